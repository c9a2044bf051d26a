#!/usr/bin/env python3
"""Denoised pictures of even counts: what a change to a denoiser, or to what guides it, is worth at equal samples.

Mean and standard deviation of ColorVideoVDP's JOD over three seeds, against a raw reference by another seed.

    cargo build --release
    OIDN_DIR=... venv/bin/python benches/peers/denoised/equal_samples.py SIZE REFERENCE_SPP SCENE,... SPP,... [oidn|builtin]

The virtual environment is that of `equal_time.py`.
"""

import pathlib
import sys
import tempfile
import tomllib

import numpy as np
import pycvvdp
import torch

from equal_time import ROOT, SEEDS, fechner, shown


def main():
    size, reference_spp = int(sys.argv[1]), sys.argv[2]
    scenes, counts = sys.argv[3].split(","), sys.argv[4].split(",")
    denoiser = sys.argv[5] if len(sys.argv) > 5 else "oidn"
    metric = pycvvdp.cvvdp(display_name="standard_4k", device=torch.device("cpu"))
    print("| scene | spp | JOD |")
    print("| --- | --- | --- |")
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        for scene_name in scenes:
            scene = ROOT / f"scenes/{scene_name}.toml"
            nits_per_unit = tomllib.loads(scene.read_text())["nits_per_unit"]

            def displayed(*options):
                picture, _ = fechner(scene, size, folder, "--sampling", "uniform", *options)
                return shown(picture, nits_per_unit)

            reference = displayed("--spp", reference_spp, "--seed", "9")
            for spp in counts:
                pictures = [displayed("--spp", spp, "--seed", str(seed), "--denoise", denoiser) for seed in SEEDS]
                jods = [float(metric.predict(picture, reference, dim_order="HWC")[0]) for picture in pictures]
                print(f"| {scene_name} | {spp} | {np.mean(jods):.3f} ± {np.std(jods):.3f} |", flush=True)


if __name__ == "__main__":
    main()
