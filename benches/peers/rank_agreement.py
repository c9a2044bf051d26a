#!/usr/bin/env python3
"""Does `fechner compare` order pictures as FLIP and ColorVideoVDP do?

Renders scenes of this repository, makes from each picture a set of versions (noise of several kinds, blur, tint, brightness,
banding, renders with few samples) and asks all three metrics how far each version is from its reference. Prints the rank
correlations (Spearman's rho, Kendall's tau) over each scene's set and their mean. No metric is trusted as the truth.

    python3 -m venv venv && venv/bin/pip install flip-evaluator cvvdp pypng scipy
    cargo build --release
    venv/bin/python benches/peers/rank_agreement.py [--scenes cornell-box still-life] [--table versions.csv] [PICTURE.png ...]

Without pictures it renders its own (a minute on two cores). All three metrics look at the same 16-bit sRGB pictures on the same
display: 38 pixels a degree, white 200, black 0.2 cd/m² (`--display fullhd`).
"""

import argparse
import csv
import json
import pathlib
import subprocess
import sys
import tempfile

import flip_evaluator
import numpy as np
import png
import pycvvdp
import torch
from pycvvdp.display_model import vvdp_display_geometry, vvdp_display_photo_eotf
from scipy.ndimage import gaussian_filter
from scipy.stats import kendalltau, spearmanr

ROOT = pathlib.Path(__file__).resolve().parents[2]
FECHNER = ROOT / "target" / "release" / "fechner"
SCENES = ["cornell-box", "still-life", "textured-room", "dark-window"]
SIZE = "160x120"
REFERENCE_SAMPLES = 256
PIXELS_PER_DEGREE = 38.0
WHITE_CD_M2 = 200.0
LUMINANCE = np.array([0.2126, 0.7152, 0.0722])


def render(scene, spp, seed, folder):
    """A picture of `scene` with `spp` samples a pixel, as sRGB code values."""
    target = folder / f"{scene}-{spp}-{seed}.png"
    command = [FECHNER, "render", ROOT / "scenes" / f"{scene}.toml", "-o", target, "--size", SIZE]
    command += ["--sampling", "uniform", "--spp", str(spp), "--seed", str(seed)]
    subprocess.run([str(part) for part in command], check=True, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    return read(target)


def read(path):
    width, height, rows, info = png.Reader(filename=str(path)).asRGB()
    values = np.vstack([np.asarray(row, dtype=np.float64) for row in rows]).reshape(height, width, 3)
    return values / (2 ** info["bitdepth"] - 1)


def write(path, codes):
    values = np.round(np.clip(codes, 0, 1) * 65535).astype(np.uint16)
    writer = png.Writer(values.shape[1], values.shape[0], greyscale=False, bitdepth=16)
    with open(path, "wb") as file:
        writer.write(file, values.reshape(values.shape[0], -1).tolist())


def decoded(codes):
    return np.where(codes <= 0.04045, codes / 12.92, ((codes + 0.055) / 1.055) ** 2.4)


def encoded(light):
    light = np.clip(light, 0, 1)
    return np.where(light <= 0.0031308, 12.92 * light, 1.055 * light ** (1 / 2.4) - 0.055)


def versions(reference):
    """Names and sRGB code values of changed versions of a picture."""
    light = decoded(reference)
    generator = np.random.default_rng(7)
    shape = light.shape[:2]
    white = generator.standard_normal(shape)[..., None]
    coloured = generator.standard_normal(light.shape)
    isoluminant = white * np.array([1.0, -LUMINANCE[0] / LUMINANCE[1], 0.0])
    blotches = gaussian_filter(generator.standard_normal(shape), 3)[..., None]
    blotches /= blotches.std()
    fine = white - gaussian_filter(white, (1, 1, 0))
    fine /= fine.std()
    changed = {}
    for amount in (0.005, 0.02, 0.08):
        changed[f"white noise {amount}"] = light * (1 + amount * white)
        changed[f"coloured noise {amount}"] = light * (1 + amount * coloured)
        changed[f"fine noise {amount}"] = light * (1 + amount * fine)
        changed[f"blotches {amount}"] = light * (1 + amount * blotches)
    for amount in (0.02, 0.1):
        changed[f"red-green noise {amount}"] = light + amount * light.mean(axis=2, keepdims=True) * isoluminant
    for amount in (0.01, 0.04, 0.15):
        changed[f"warm tint {amount}"] = light * np.array([1 + amount, 1, 1 - amount])
        changed[f"brighter {amount}"] = light * (1 + amount)
    for sigma in (0.4, 0.8, 1.6):
        changed[f"blur {sigma} px"] = gaussian_filter(light, (sigma, sigma, 0))
    for levels in (64, 24):
        changed[f"{levels} levels"] = decoded(np.round(reference * levels) / levels)
    return {name: encoded(value) for name, value in changed.items()}


def ours(reference, test, folder):
    paths = [folder / "reference.png", folder / "test.png", folder / "figures.json"]
    write(paths[0], reference)
    write(paths[1], test)
    command = [str(FECHNER), "compare", str(paths[0]), str(paths[1]), "--display", "fullhd", "--json", str(paths[2])]
    status = subprocess.run(command, stdout=subprocess.DEVNULL, check=False).returncode
    if status not in (0, 1):
        sys.exit(f"{' '.join(command)} failed with {status}")
    figures = json.loads(paths[2].read_text())
    return figures["worst_visibility"], figures["mean_visibility"]


def flip(reference, test):
    error, mean, _ = flip_evaluator.evaluate(
        reference.astype(np.float32), test.astype(np.float32), "LDR", applyMagma=False, parameters={"ppd": PIXELS_PER_DEGREE}
    )
    return mean, float(np.quantile(error, 0.99))


def video_difference_predictor(shape):
    photometry = vvdp_display_photo_eotf(WHITE_CD_M2, contrast=1000, source_colorspace="sRGB", E_ambient=0)
    geometry = vvdp_display_geometry([shape[1], shape[0]], ppd=PIXELS_PER_DEGREE)
    return pycvvdp.cvvdp(display_photometry=photometry, display_geometry=geometry, quiet=True, device=torch.device("cpu"))


def main():
    arguments = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    arguments.add_argument("pictures", nargs="*", type=pathlib.Path)
    arguments.add_argument("--scenes", nargs="+", default=SCENES, help="those to render, without their .toml")
    arguments.add_argument("--table", type=pathlib.Path, help="write every figure here")
    arguments = arguments.parse_args()
    columns = ["scene", "version", "worst v", "mean v", "FLIP mean", "FLIP 99 %", "JOD lost"]
    rows = []
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        if arguments.pictures:
            sets = {path.stem: (read(path), {}) for path in arguments.pictures}
        else:
            sets = {}
            for scene in arguments.scenes:
                few = {f"{spp} spp": render(scene, spp, 2, folder) for spp in (4, 16, 64)}
                sets[scene] = (render(scene, REFERENCE_SAMPLES, 1, folder), few)
        for scene, (reference, few) in sets.items():
            predictor = video_difference_predictor(reference.shape)
            for version, test in {**versions(reference), **few}.items():
                quality, _ = predictor.predict(test.astype(np.float32), reference.astype(np.float32), dim_order="HWC")
                figures = (*ours(reference, test, folder), *flip(reference, test), 10 - float(quality))
                rows.append((scene, version, *figures))
    if arguments.table:
        with open(arguments.table, "w", newline="", encoding="utf-8") as file:
            csv.writer(file).writerows([columns, *rows])
    report(columns[2:], rows)


def report(metrics, rows):
    pairs = [(0, 2), (0, 3), (0, 4), (1, 2), (1, 4), (2, 4)]
    scenes = sorted({row[0] for row in rows})
    print(f"{len(rows)} versions of {len(scenes)} pictures; Spearman / Kendall, per picture and on average")
    for a, b in pairs:
        found = []
        for scene in scenes:
            of_scene = [row for row in rows if row[0] == scene]
            first, second = ([row[2 + metric] for row in of_scene] for metric in (a, b))
            found.append((spearmanr(first, second)[0], kendalltau(first, second)[0]))
        each = "  ".join(f"{scene} {rho:.2f}/{tau:.2f}" for scene, (rho, tau) in zip(scenes, found))
        mean = np.mean(found, axis=0)
        print(f"{metrics[a]:>9} – {metrics[b]:<9} {mean[0]:.2f} / {mean[1]:.2f}    {each}")


if __name__ == "__main__":
    main()
