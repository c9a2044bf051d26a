"""What the loop's pictures are worth against uniform sampling in the same time, from a benchmark's results.csv.

    fechner bench SCENES --suite quick --reference-factor 4 \\
        --arms uniform,as-asked,uniform-equal-time,to-threshold -o FOLDER
    python benches/equal_time.py FOLDER

prints the table of `benches/README.md`. In an arm's time uniform sampling takes the arm's samples over one less the arm's
`overhead`, the share of time outside of the tracer. Its FLIP there is that of the arm `uniform-equal-time` by FLIP_POWER, its
JOD by the line through that arm and `uniform` over the logarithm of samples, or by JOD_SLOPE where the two are too close. Bounds are
of the seeds' scatter, one-sided, 95 %; an arm's overhead is the mean over its seeds.
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
# One-sided 95 % of Student's t by degrees of freedom.
T_95 = {1: 6.314, 2: 2.920, 3: 2.353, 4: 2.132, 5: 2.015, 6: 1.943, 7: 1.895, 8: 1.860, 9: 1.833}


def read(folder):
    """What is needed of each seed's render, by scene, arm and seed."""
    rows = collections.defaultdict(dict)
    with open(folder / "results.csv", newline="") as file:
        for row in csv.DictReader(file):
            if row["coverage"] == "0.99" and row["seed"] != "all":
                # What was rendered, not what v* would have taken.
                values = {key: float(row[key]) for key in ("overhead", "flip_mean", "jod")}
                values["spp"] = float(row["samples"]) / float(row["reached"]) ** 2
                rows[row["scene"], row["arm"]][row["seed"]] = values
    return rows


def compare(ours, uniform, near, overhead):
    """JOD less uniform's in the same time, FLIP over it, and FLIP over uniform's at as many samples."""
    apart = math.log(near["spp"] / uniform["spp"])
    slope = (near["jod"] - uniform["jod"]) / apart if abs(apart) > LEAST_APART else JOD_SLOPE
    in_time = ours["spp"] / (1.0 - overhead)
    jod = near["jod"] + slope * math.log(in_time / near["spp"])
    flip = {samples: near["flip_mean"] * (samples / near["spp"]) ** FLIP_POWER for samples in (in_time, ours["spp"])}
    return ours["jod"] - jod, ours["flip_mean"] / flip[in_time], ours["flip_mean"] / flip[ours["spp"]]


def mean_and_margin(values):
    """The mean, and what a one-sided 95 % interval adds to it or takes away."""
    count = len(values)
    mean = sum(values) / count
    if count < 2:
        return mean, math.inf
    deviation = math.sqrt(sum((value - mean) ** 2 for value in values) / (count - 1) / count)
    return mean, T_95.get(count - 1, 1.645) * deviation


def main():
    rows = read(pathlib.Path(sys.argv[1]))
    of_time = "JOD (95 %: at least) | FLIP in the same time (95 %: at most)"
    print(f"| scene | arm | spp | overhead | {of_time} | FLIP at equal samples |")
    print("| --- | --- | --- | --- | --- | --- | --- |")
    found = collections.defaultdict(list)
    for scene in dict.fromkeys(scene for scene, _ in rows):
        for arm in OF_OURS:
            ours, uniform, near = (rows[scene, name] for name in (arm, "uniform", "uniform-equal-time"))
            # One for all seeds: its scatter is the machine's.
            overhead = sum(values["overhead"] for values in ours.values()) / len(ours)
            compared = [compare(ours[seed], uniform[seed], near[seed], overhead) for seed in ours]
            (jod, jod_margin), (flip, flip_margin), (at_samples, _) = map(mean_and_margin, zip(*compared))
            found[arm].append((jod, flip, at_samples))
            spp = sum(values["spp"] for values in ours.values()) / len(ours)
            cells = f"{spp:.0f} | {100 * overhead:.1f} % | {jod:+.3f} ({jod - jod_margin:+.3f})"
            print(f"| {scene} | {arm} | {cells} | {flip:.3f} ({flip + flip_margin:.3f}) | {at_samples:.3f} |")
    for arm, of_scenes in found.items():
        jod, in_time, at_samples = zip(*of_scenes)
        mean = sum(jod) / len(jod)
        flips = (math.exp(sum(map(math.log, ratios)) / len(ratios)) for ratios in (in_time, at_samples))
        print(f"| mean | {arm} | | | {mean:+.3f} |", " | ".join(f"{flip:.3f}" for flip in flips), "|")


if __name__ == "__main__":
    main()
