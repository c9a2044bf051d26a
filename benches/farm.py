"""What a farm costs over one process, and merging over copying.

    python benches/farm.py [overhead|merge]        # target/release/fechner must be built

Overhead is in processor seconds of all programs, which others' work on the machine does not count in; each unit and each merge is
a process of its own, as schedulers start them. Merging is beside `cp` of the same files, both from the page cache and without
waiting for the disk, which is unkind to merging: any disk is slower than that.
"""

import resource
import shutil
import subprocess
import sys
import tempfile
import time
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
PROGRAM = str(ROOT / "target/release/fechner")
SCENE = str(ROOT / "scenes/cornell-box.toml")
SIZE = ["--size", "480x270"]
ROUNDS = 2


def run(*words, cwd):
    """Runs a program; processor seconds, wall seconds, and what it said."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    start = time.perf_counter()
    done = subprocess.run(words, cwd=cwd, check=True, capture_output=True, text=True)
    wall = time.perf_counter() - start
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime, wall, done.stdout


def overhead():
    """One process against units of about seven processor seconds, shorter than they should be."""
    options = [*SIZE, "--sampling", "uniform", "--spp", "128"]
    with tempfile.TemporaryDirectory() as folder:
        pilot, _, _ = run(PROGRAM, "render", SCENE, "-o", "x.exr", *SIZE, "--sampling", "uniform", "--spp", "16", cwd=folder)
        unit_samples = int(6.5 * 480 * 270 * 16 / pilot)
        rows = []
        for number in range(ROUNDS):
            one, _, _ = run(PROGRAM, "render", SCENE, "-o", "one.exr", *options, cwd=folder)
            farm = f"farm-{number}"
            plan = ["farm", "plan", SCENE, "--passes", "1000", "--unit-samples", str(unit_samples), "-o", farm, "--"]
            planning, _, _ = run(PROGRAM, *plan, *options, cwd=folder)
            units, merges = [], []
            while not Path(folder, farm, "frame-0000/result.json").exists():
                for unit in run(PROGRAM, "farm", "status", farm, "--list", "units", cwd=folder)[2].split():
                    units.append(run(PROGRAM, "farm", "unit", farm, unit, cwd=folder)[0])
                merges.append(run(PROGRAM, "farm", "merge", farm, cwd=folder)[0])
            assert Path(folder, "one.exr").read_bytes() == Path(folder, farm, "pictures/picture.exr").read_bytes()
            rows.append((planning + sum(units) + sum(merges)) / one)
            print(
                f"one process {one:.1f} s; farm: plan {planning:.1f} s, {len(units)} units of {sum(units) / len(units):.1f} s, "
                f"{len(merges)} merges {sum(merges):.1f} s (looks and small rounds too); farm / one {rows[-1]:.3f}"
            )
        print(f"farm over one process: best {min(rows):.3f}, worst {max(rows):.3f}")


def merge():
    """A hundred films of one size and a hundred units of one frame, beside cp."""
    with tempfile.TemporaryDirectory() as folder:
        films = []
        for seed in range(100):
            films.append(f"{seed}.film")
            one = ["--sampling", "uniform", "--spp", "2", "--seed", str(seed), "--checkpoint", films[-1]]
            run(PROGRAM, "render", SCENE, "-o", "x.png", *SIZE, *one, cwd=folder)
        for count in [2, 100]:
            merge_all = [PROGRAM, "merge", *films[:count], "-o", "sum.film"]
            compare(folder, f"{count} films", films[:count], merge_all, lambda: None)

    for count in [1, 100]:
        merge_units(count)


def merge_units(count):
    """One round of a frame in so many units: the merge's look at the picture and its files are in it as well."""
    with tempfile.TemporaryDirectory() as folder:
        options = [*SIZE, "--sampling", "uniform", "--spp", "16"]
        plan = ["farm", "plan", SCENE, "--passes", str(count), "--unit-samples", "1", "-o", "farm", "--"]
        run(PROGRAM, *plan, *options, cwd=folder)
        run(PROGRAM, "farm", "unit", "farm", *map(str, range(count)), cwd=folder)
        sums = sorted(str(path.relative_to(folder)) for path in Path(folder).glob("farm/frame-0000/round-000/*.sums"))
        shutil.copytree(f"{folder}/farm", f"{folder}/kept")

        def again():
            shutil.rmtree(f"{folder}/farm")
            shutil.copytree(f"{folder}/kept", f"{folder}/farm")

        compare(folder, f"a frame in {count} units", sums, [PROGRAM, "farm", "merge", "farm"], again)


def compare(folder, what, files, command, before):
    """Prints wall and processor seconds of a command that reads files, over those of cp."""
    size = sum(Path(folder, name).stat().st_size for name in files) / 1e6
    copies, merges = [], []
    for _ in range(ROUNDS):
        before()
        Path(folder, "copy").mkdir()
        copies.append(run("cp", *files, "copy", cwd=folder)[:2])
        shutil.rmtree(Path(folder, "copy"))
        merges.append(run(*command, cwd=folder)[:2])
    (cp_cpu, cp_wall), (cpu, wall) = (map(min, zip(*runs)) for runs in (copies, merges))
    print(
        f"{what}, {size:.0f} MB: merge {wall:.2f} s ({size / wall:.0f} MB/s; processor {cpu:.2f} s), cp {cp_wall:.2f} s "
        f"({size / cp_wall:.0f} MB/s; {cp_cpu:.2f} s), ratio {wall / cp_wall:.1f} (processor {cpu / cp_cpu:.1f})"
    )


if __name__ == "__main__":
    for name in sys.argv[1:] or ["overhead", "merge"]:
        {"overhead": overhead, "merge": merge}[name]()
