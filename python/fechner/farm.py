"""Run a farm's units on a Dask cluster.

``fechner farm plan`` makes a folder; this module hands its units and merges to workers, each of which runs the program
``fechner`` on that folder. Files are the only result: a worker that dies costs the unit that it was at, less its checkpoint,
and whatever the cluster does, the pictures have the bytes of one process. Workers must see the folder, the scene and the
program under the same names.

    python -m fechner.farm out/shot --workers 4
    python -m fechner.farm out/shot --scheduler tcp://head:8786

Needs ``pip install "dask[distributed]"``.
"""

from __future__ import annotations

import argparse
import json
import subprocess
import time
from pathlib import Path

CALL_AGAIN = 75
"""Exit status of a program that was stopped or has to wait: nothing is wrong, and it goes on from its checkpoint."""


def status(folder: str, program: str = "fechner") -> dict:
    """How far the farm is: ``{"done": bool, "frames": [{"frame", "state", "missing", ...}]}``, as ``farm status --json``."""
    said = subprocess.run([program, "farm", "status", folder, "--json"], check=True, capture_output=True, text=True)
    return json.loads(said.stdout)


def _run(program: str, folder: str, words: list[str]) -> None:
    """Runs one command on a worker. What it says on failure becomes the task's exception."""
    for _ in range(3):
        done = subprocess.run([program, "farm", words[0], folder, *words[1:]], capture_output=True, text=True)
        if done.returncode == CALL_AGAIN and words[0] == "merge":
            # Somebody else is at it: who looks at once how far it is would ask for it again, over and over.
            time.sleep(1)
            return
        if done.returncode == 0:
            return
        if done.returncode != CALL_AGAIN:
            break
    raise RuntimeError(f"{' '.join(done.args)}: status {done.returncode}: {done.stderr.strip()}")


def run(folder, client, program: str = "fechner", threads: int = 1, say=print) -> None:
    """Works on ``folder`` with ``client`` (a ``distributed.Client``) until all frames are done.

    Frames go through their rounds independently of each other: a frame is merged as soon as its own units are there, and its next
    round's units are handed out at once. ``threads`` is what each program takes; give workers one task at a time.
    Raises ``RuntimeError`` with the program's words where a unit or merge fails, and where the last merge leaves something to do.
    """
    from distributed import as_completed

    folder = str(Path(folder).resolve())
    waiting = {}  # frame: units that are not back
    frame_of = {}  # future's key: (frame, unit or None for a merge)
    pending = as_completed(with_results=False)

    def submit(frame, words, unit):
        # Not pure: a unit that is refused is rendered again by the same words.
        future = client.submit(_run, program, folder, [*words, "--threads", str(threads)], pure=False)
        frame_of[future.key] = (frame, unit)
        pending.add(future)

    def hand_out(frames):
        for found in frames:
            frame = found["frame"]
            waiting[frame] = set(found["missing"])
            for unit in found["missing"]:
                submit(frame, ["unit", str(unit)], unit)
            if found["state"] == "merge":
                submit(frame, ["merge", "--frame", str(frame)], None)

    hand_out(status(folder, program)["frames"])
    for future in pending:
        frame, unit = frame_of.pop(future.key)
        future.result()
        if unit is None:
            now = [found for found in status(folder, program)["frames"] if found["frame"] == frame]
            if now[0]["state"] == "done":
                say(f"frame {frame}: done")
            hand_out(now)
        else:
            waiting[frame].discard(unit)
            if not waiting[frame]:
                submit(frame, ["merge", "--frame", str(frame)], None)
    if status(folder, program)["done"]:
        return
    # What needs all frames, such as a video.
    client.submit(_run, program, folder, ["merge", "--threads", str(threads)], pure=False).result()
    if not status(folder, program)["done"]:
        raise RuntimeError(f"{folder}: the last merge was ended, or another is at it: call again")


def main() -> None:
    """``python -m fechner.farm``."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("folder", help="what fechner farm plan made")
    parser.add_argument("--scheduler", help="address of a running scheduler; without it, workers are started here")
    parser.add_argument("--workers", type=int, default=2, help="how many to start here")
    parser.add_argument("--threads", type=int, default=1, help="threads of each unit")
    parser.add_argument("--program", default="fechner", help="the program, if it is not in PATH")
    words = parser.parse_args()
    try:
        from distributed import Client, LocalCluster
    except ImportError as error:
        parser.exit(2, f'fechner.farm: {error}; it needs: pip install "dask[distributed]"\n')

    if words.scheduler:
        with Client(words.scheduler) as client:
            run(words.folder, client, words.program, words.threads)
        return
    cluster = LocalCluster(
        n_workers=words.workers, threads_per_worker=1, processes=True, host="127.0.0.1", dashboard_address=None
    )
    with cluster, Client(cluster) as client:
        run(words.folder, client, words.program, words.threads)


if __name__ == "__main__":
    main()
