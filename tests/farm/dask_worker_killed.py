"""A farm on a Dask cluster of three processes, one of which is killed in the middle: the bytes of one process.

    python tests/farm/dask_worker_killed.py FECHNER

Needs dask[distributed] and this repository's python/fechner/farm.py, which is read from where it stands.
"""

import os
import signal
import subprocess
import sys
import tempfile
import threading
import time
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
DRIVER = str(ROOT / "python/fechner")
OPTIONS = ["--size", "96x96", "--visibility", "3", "--seed", "5"]


def kill_a_busy_worker(client, killed):
    """SIGKILL to the first worker that has been at a task for a moment."""
    for _ in range(600):
        busy = [address for address, tasks in client.processing().items() if tasks]
        if busy:
            process = client.run(os.getpid, workers=[busy[0]], nanny=False)[busy[0]]
            os.kill(process, signal.SIGKILL)
            killed.append(process)
            return
        time.sleep(0.02)


def main():
    from distributed import Client, LocalCluster

    # The driver alone, without the compiled module beside it; workers find it by the same path.
    sys.path.insert(0, DRIVER)
    os.environ["PYTHONPATH"] = DRIVER
    import farm as driver

    program = str(Path(sys.argv[1]).resolve())
    scene = str(ROOT / "scenes/cornell-box.toml")
    with tempfile.TemporaryDirectory() as folder:
        farm = f"{folder}/farm"
        plan = ["farm", "plan", scene, "--passes", "6", "--unit-samples", "10000", "-o", farm, "--", *OPTIONS]
        subprocess.run([program, *plan], check=True)
        cluster = LocalCluster(
            n_workers=3, threads_per_worker=1, processes=True, host="127.0.0.1", dashboard_address=None
        )
        killed = []
        with cluster, Client(cluster) as client:
            before = {worker["pid"] for worker in client.run(lambda: {"pid": os.getpid()}).values()}
            killer = threading.Thread(target=kill_a_busy_worker, args=(client, killed))
            killer.start()
            driver.run(farm, client, program)
            killer.join()
        assert killed and killed[0] in before, "no worker was killed"
        subprocess.run([program, "render", scene, "-o", f"{folder}/one.exr", *OPTIONS], check=True, capture_output=True)
        one, farmed = (Path(path).read_bytes() for path in [f"{folder}/one.exr", f"{farm}/pictures/picture.exr"])
        assert one == farmed, "the picture is not that of one process"
        print(f"Dask: worker {killed[0]} of 3 killed with SIGKILL; the bytes of one process")


if __name__ == "__main__":
    main()
