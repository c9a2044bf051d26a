#!/usr/bin/env python3
"""Denoised pictures at equal time: ours, Mitsuba 3 with Open Image Denoise, Cycles adaptive with its denoiser, as it comes (it
clamps indirect light and blurs what glossy surfaces show) and without that.

Each is judged by ColorVideoVDP against its own converged picture, as a display of 200 cd/m² shows both; Cycles as it comes also
against the one without clamp and blur, since against its own what they take away is not missed. Two threads each, one after the
other; loading, trees and compiling are not counted, denoising is.

    cargo build --release
    python3 -m venv venv && venv/bin/pip install cvvdp OpenEXR numpy
    OIDN_DIR=... MITSUBA_PYTHON=... CYCLES_PYTHON=... venv/bin/python benches/peers/denoised/equal_time.py [SIZE SPP SECONDS...]

MITSUBA_PYTHON has mitsuba and pyoidn, CYCLES_PYTHON has bpy (their numpy versions do not go together). Mitsuba 3.9 needs an
LLVM newer than 16: `apt install libllvm19`, and DRJIT_LIBLLVM_PATH where an older one is found first.
"""

import json
import os
import pathlib
import subprocess
import sys
import tempfile

import numpy as np
import OpenEXR
import pycvvdp
import torch

import described

HERE = pathlib.Path(__file__).resolve().parent
ROOT = HERE.parents[2]
SCENES = ["cornell-box", "cornell-glass"]
SEEDS = [1, 2, 3]
WHITE_CD_M2 = 200.0


def fechner(scene, size, folder, *options):
    target = folder / "fechner.exr"
    command = [ROOT / "target/release/fechner", "render", scene, "-o", target, "--size", f"{size}x{size}", "--threads", "2"]
    # Else even counts would end at visibility 1.
    command += ["--visibility", "0.1", "--json", folder / "fechner.json", *options]
    subprocess.run([str(part) for part in command], check=True, capture_output=True)
    with OpenEXR.File(str(target)) as file:
        channels = file.channels()
        picture = channels["RGB"].pixels if "RGB" in channels else np.dstack([channels[c].pixels for c in "RGB"])
        picture = np.array(picture, dtype=np.float32)[:, :, :3]
    return picture, json.loads((folder / "fechner.json").read_text())


def ours(scene, size, reference_spp, times, folder):
    reference, _ = fechner(scene, size, folder, "--sampling", "uniform", "--spp", str(reference_spp), "--seed", "9")
    made = {}
    for time in times:
        for seed in SEEDS:
            picture, said = fechner(scene, size, folder, "--denoise", "oidn", "--time", time, "--seed", str(seed))
            made.setdefault(time, []).append((picture, said["seconds_total"], said["spp_mean"]))
    return reference, made


def peer(script, python, scene, size, reference_spp, times, folder, *options):
    command = [python, HERE / script, scene, str(size), str(reference_spp), folder, *times, *options]
    finished = subprocess.run([str(part) for part in command], check=True, capture_output=True, text=True, cwd=HERE)
    lines = [json.loads(line[line.index("{") :]) for line in finished.stdout.splitlines() if '"asked"' in line]
    made = {}
    for said in lines:
        picture = np.load(folder / f"{said['asked']}-{said['seed']}.npy")
        made.setdefault(said["asked"], []).append((picture, said["seconds"], said["spp"]))
    return np.load(folder / "reference.npy"), made


def shown(picture, nits_per_unit):
    """sRGB values of a display that clips at its white."""
    light = np.clip(picture * nits_per_unit / WHITE_CD_M2, 0.0, 1.0)
    return np.where(light <= 0.0031308, 12.92 * light, 1.055 * light ** (1 / 2.4) - 0.055).astype(np.float32)


def rows(metric, nits_per_unit, head, reference, made):
    for time, pictures in made.items():
        jods = []
        for picture, _, _ in pictures:
            jod, _ = metric.predict(shown(picture, nits_per_unit), shown(reference, nits_per_unit), dim_order="HWC")
            jods.append(float(jod))
        seconds = np.mean([took for _, took, _ in pictures])
        spp = [samples for _, _, samples in pictures if samples]
        spp = f"{np.mean(spp):.0f}" if spp else "by its rule"
        print(f"{head} {time} | {seconds:.2f} | {spp} | {np.mean(jods):.3f} ± {np.std(jods):.3f} |", flush=True)


def main():
    size, reference_spp = (int(word) for word in (sys.argv[1:3] or ["256", "2048"]))
    times = sys.argv[3:] or ["2", "5", "15"]
    metric = pycvvdp.cvvdp(display_name="standard_4k", device=torch.device("cpu"))
    print("| scene | renderer | asked, s | took, s | samples a pixel | JOD |")
    print("| --- | --- | --- | --- | --- | --- |")
    for name in SCENES:
        scene = ROOT / f"scenes/{name}.toml"
        nits_per_unit = described.read(scene)["nits_per_unit"]
        with tempfile.TemporaryDirectory() as folder:
            folder = pathlib.Path(folder)
            arguments = (scene, size, reference_spp, times, folder)
            arms = {
                "fechner + OIDN": lambda: ours(*arguments),
                "Mitsuba 3 + OIDN": lambda: peer("mitsuba_oidn.py", os.environ["MITSUBA_PYTHON"], *arguments),
                "Cycles": lambda: peer("blender.py", os.environ["CYCLES_PYTHON"], *arguments),
                "Cycles, unbiased": lambda: peer("blender.py", os.environ["CYCLES_PYTHON"], *arguments, "--unbiased"),
            }
            references = {}
            for arm, run in arms.items():
                reference, made = run()
                references[arm] = reference
                print(f"{name}, {arm}: mean of the reference {reference.mean():.4f}", file=sys.stderr)
                rows(metric, nits_per_unit, f"| {name} | {arm} |", reference, made)
                if arm == "Cycles":
                    as_it_comes = made
            rows(metric, nits_per_unit, f"| {name} | Cycles, against unbiased |", references["Cycles, unbiased"], as_it_comes)


if __name__ == "__main__":
    main()
