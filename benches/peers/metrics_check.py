#!/usr/bin/env python3
"""Do the crates `flip-rs` and `colorvideovdp` say what their authors' own programs say of our pictures?

Renders scenes of this repository with few and with many samples, and prints FLIP and JOD by both, and the largest difference.

    python3 -m venv venv && venv/bin/pip install flip-evaluator cvvdp pypng
    cargo build --release
    venv/bin/python benches/peers/metrics_check.py
"""

import pathlib
import subprocess
import tempfile

import flip_evaluator
import numpy as np
import png
import pycvvdp
import torch

ROOT = pathlib.Path(__file__).resolve().parents[2]
SCENES = ["cornell-box", "complementary-lamps", "dark-window"]
PIXELS_PER_DEGREE = 60.0


def render(scene, spp, folder):
    target = folder / f"{scene}-{spp}.png"
    command = [ROOT / "target/release/fechner", "render", ROOT / f"scenes/{scene}.toml", "-o", target]
    command += ["--size", "160x120", "--sampling", "uniform", "--spp", str(spp), "--seed", str(spp)]
    subprocess.run([str(part) for part in command], check=True, capture_output=True)
    return target


def read(path):
    width, height, rows, info = png.Reader(filename=str(path)).asRGB()
    values = np.vstack([np.asarray(row, dtype=np.float32) for row in rows]).reshape(height, width, 3)
    return values / np.float32(2 ** info["bitdepth"] - 1)


def by_the_crates(reference, test):
    command = ["cargo", "bench", "--quiet", "--bench", "metrics", "--", str(reference), str(test)]
    words = subprocess.run(command, cwd=ROOT, check=True, capture_output=True, text=True).stdout.split()
    return float(words[1]), float(words[3])


def by_the_authors(metric, reference, test):
    _, flip, _ = flip_evaluator.evaluate(reference, test, "LDR", parameters={"ppd": PIXELS_PER_DEGREE})
    jod, _ = metric.predict(test, reference, dim_order="HWC")
    return float(flip), float(jod)


def main():
    metric = pycvvdp.cvvdp(display_name="standard_4k", device=torch.device("cpu"))
    print("| scene | spp | FLIP, crate | FLIP, flip-evaluator | JOD, crate | JOD, cvvdp |")
    print("| --- | --- | --- | --- | --- | --- |")
    worst = [0.0, 0.0]
    with tempfile.TemporaryDirectory() as folder:
        folder = pathlib.Path(folder)
        for scene in SCENES:
            reference = render(scene, 1024, folder)
            for spp in [4, 64]:
                test = render(scene, spp, folder)
                ours = by_the_crates(reference, test)
                theirs = by_the_authors(metric, read(reference), read(test))
                worst = [max(w, abs(a - b)) for w, a, b in zip(worst, ours, theirs)]
                print(f"| {scene} | {spp} | {ours[0]:.6f} | {theirs[0]:.6f} | {ours[1]:.4f} | {theirs[1]:.4f} |")
    print(f"\nlargest difference: FLIP {worst[0]:.1e}, JOD {worst[1]:.1e}")


if __name__ == "__main__":
    main()
