"""What the loop's pictures are worth against uniform sampling in the same time, from a benchmark's results.csv.

    fechner bench SCENES --suite quick --reference-factor 4 \\
        --arms uniform,as-asked,uniform-equal-time,to-threshold -o FOLDER
    python benches/equal_time.py FOLDER

prints the table of `benches/results/equal-time.md`. In an arm's time uniform sampling takes the arm's samples over one less the arm's
`overhead`, the share of time outside of the tracer; where it ends with a look, as the arm does and as its report needs,
times one less the share of the arm's last look. Its FLIP there is that of the arm `uniform-equal-time` by FLIP_POWER, its
JOD by the line through that arm and `uniform` over the logarithm of samples, or by JOD_SLOPE where the two are too close.
Where the arm's picture is that of `uniform`, both go from there: other counts of samples may lie less evenly.
Bounds are of the seeds' scatter, one-sided, 95 %; an arm's overhead and last look are means over its seeds.
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
# What an arm is compared with: uniform sampling that takes as long and never looks; that ends with a look; that takes as many samples.
AGAINST = ("in the same time", "with a last look too", "at equal samples")
# One-sided 95 % of Student's t by degrees of freedom.
T_95 = {1: 6.314, 2: 2.920, 3: 2.353, 4: 2.132, 5: 2.015, 6: 1.943, 7: 1.895, 8: 1.860, 9: 1.833}
# The same of the normal distribution.
Z_95 = 1.644854


def read(folder):
    """What is needed of each seed's render, by scene, arm and seed."""
    rows = collections.defaultdict(dict)
    with open(folder / "results.csv", newline="") as file:
        for row in csv.DictReader(file):
            if row["coverage"] == "0.99" and row["seed"] != "all":
                # What was rendered, not what v* would have taken.
                values = {key: float(row[key]) for key in ("overhead", "last_look", "flip_mean", "jod")}
                values["spp"] = float(row["samples"]) / float(row["reached"]) ** 2
                rows[row["scene"], row["arm"]][row["seed"]] = values
    return rows


def compare(ours, uniform, near, samples):
    """JOD less that of uniform sampling with so many samples, and FLIP over it."""
    base = uniform if is_same_picture(ours, uniform) else near
    apart = math.log(near["spp"] / uniform["spp"])
    slope = (near["jod"] - uniform["jod"]) / apart if abs(apart) > LEAST_APART else JOD_SLOPE
    jod = base["jod"] + slope * math.log(samples / base["spp"])
    flip = base["flip_mean"] * (samples / base["spp"]) ** FLIP_POWER
    return ours["jod"] - jod, ours["flip_mean"] / flip


def is_same_picture(one, other):
    """Whether two renders have the same samples, by what pictures are measured by."""
    return all(one[key] == other[key] for key in ("spp", "flip_mean", "jod"))


def mean(values):
    return sum(values) / len(values)


def t_95(freedom):
    """One-sided 95 % of Student's t: beyond the table by its series over degrees of freedom, right to 1e-4 from 10 on."""
    near, z = 1.0 / (4.0 * freedom), Z_95
    terms = (z, z**3 + z, (5 * z**5 + 16 * z**3 + 3 * z) / 6, (3 * z**7 + 19 * z**5 + 17 * z**3 - 15 * z) / 6)
    return T_95.get(freedom, sum(term * near**power for power, term in enumerate(terms)))


def mean_and_margin(values):
    """The mean, and what a one-sided 95 % interval adds to it or takes away."""
    count, middle = len(values), mean(values)
    if count < 2:
        return middle, math.inf
    deviation = math.sqrt(sum((value - middle) ** 2 for value in values) / (count - 1) / count)
    return middle, t_95(count - 1) * deviation


def main():
    rows = read(pathlib.Path(sys.argv[1]))
    print("| scene | arm | spp | overhead, last look |", " | ".join(f"JOD, FLIP {name}" for name in AGAINST), "|")
    print("| --- | --- | --- | --- |" + " --- |" * len(AGAINST))
    found = collections.defaultdict(list)
    for scene in dict.fromkeys(scene for scene, _ in rows):
        for arm in OF_OURS:
            ours, uniform, near = (rows[scene, name] for name in (arm, "uniform", "uniform-equal-time"))
            # One for all seeds: its scatter is the machine's.
            spp, overhead, last = (mean([values[key] for values in ours.values()]) for key in ("spp", "overhead", "last_look"))
            cells = []
            for more in (1.0 / (1.0 - overhead), (1.0 - last) / (1.0 - overhead), 1.0):
                compared = [compare(ours[seed], uniform[seed], near[seed], more * ours[seed]["spp"]) for seed in ours]
                (jod, jod_margin), (flip, flip_margin) = map(mean_and_margin, zip(*compared))
                found[arm].append((jod, flip))
                cells.append(f"{jod:+.3f} ({jod - jod_margin:+.3f}), {flip:.3f} ({flip + flip_margin:.3f})")
            print(f"| {scene} | {arm} | {spp:.0f} | {100 * overhead:.1f}, {100 * last:.1f} % |", " | ".join(cells), "|")
    for arm, pairs in found.items():
        means = []
        for against in range(len(AGAINST)):
            jods, flips = zip(*pairs[against :: len(AGAINST)])
            means.append(f"{mean(jods):+.3f}, {math.exp(mean(list(map(math.log, flips)))):.3f}")
        print(f"| mean | {arm} | | |", " | ".join(means), "|")


if __name__ == "__main__":
    main()
