"""What the loop's pictures are worth against uniform sampling in the same time, from a benchmark's results.csv.

    fechner bench SCENES --suite quick --reference-factor 4 \\
        --arms uniform,as-asked,uniform-equal-time,to-threshold -o FOLDER
    python benches/equal_time.py FOLDER

prints the table of `benches/README.md`. In an arm's time uniform sampling takes the arm's samples over one less the arm's
`overhead`, the share of time outside of the tracer. Its FLIP there is that of the arm `uniform-equal-time` by FLIP_POWER, its
JOD by the line through that arm and `uniform` over the logarithm of samples, or by JOD_SLOPE where the two are too close.
"""

import collections
import csv
import math
import pathlib
import sys

FLIP_POWER = -0.41
JOD_SLOPE = 0.35
LEAST_APART = 0.1
OF_OURS = ("as-asked", "to-threshold")


def read(folder):
    """Means over seeds of what is needed, by scene and arm."""
    rows = collections.defaultdict(list)
    with open(folder / "results.csv", newline="") as file:
        for row in csv.DictReader(file):
            if row["coverage"] == "0.99" and row["seed"]:
                # What was rendered, not what v* would have taken.
                values = {key: float(row[key]) for key in ("overhead", "flip_mean", "jod")}
                values["spp"] = float(row["samples"]) / float(row["reached"]) ** 2
                rows[row["scene"], row["arm"]].append(values)
    return {key: {name: sum(v[name] for v in values) / len(values) for name in values[0]} for key, values in rows.items()}


def compare(ours, uniform, near):
    """JOD less uniform's in the same time, FLIP over it, and FLIP over uniform's at as many samples."""
    apart = math.log(near["spp"] / uniform["spp"])
    slope = (near["jod"] - uniform["jod"]) / apart if abs(apart) > LEAST_APART else JOD_SLOPE
    in_time = ours["spp"] / (1.0 - ours["overhead"])
    jod = near["jod"] + slope * math.log(in_time / near["spp"])
    flip = {samples: near["flip_mean"] * (samples / near["spp"]) ** FLIP_POWER for samples in (in_time, ours["spp"])}
    return ours["jod"] - jod, ours["flip_mean"] / flip[in_time], ours["flip_mean"] / flip[ours["spp"]]


def main():
    means = read(pathlib.Path(sys.argv[1]))
    print("| scene | arm | spp | overhead | JOD | FLIP in the same time | FLIP at equal samples |")
    print("| --- | --- | --- | --- | --- | --- | --- |")
    found = collections.defaultdict(list)
    for scene in dict.fromkeys(scene for scene, _ in means):
        for arm in OF_OURS:
            ours = means[scene, arm]
            compared = compare(ours, means[scene, "uniform"], means[scene, "uniform-equal-time"])
            found[arm].append(compared)
            jod, in_time, at_samples = compared
            cells = f"{ours['spp']:.0f} | {100 * ours['overhead']:.1f} % | {jod:+.3f} | {in_time:.3f} | {at_samples:.3f}"
            print(f"| {scene} | {arm} | {cells} |")
    for arm, of_scenes in found.items():
        jod, in_time, at_samples = zip(*of_scenes)
        mean = sum(jod) / len(jod)
        flips = (math.exp(sum(map(math.log, ratios)) / len(ratios)) for ratios in (in_time, at_samples))
        print(f"| mean | {arm} | | | {mean:+.3f} |", " | ".join(f"{flip:.3f}" for flip in flips), "|")


if __name__ == "__main__":
    main()
