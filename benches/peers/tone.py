#!/usr/bin/env python3
"""Tone operators beside pfstools' (Debian package `pfstools`).

    cargo build --release
    python3 -m venv /tmp/venv && /tmp/venv/bin/pip install numpy OpenEXR
    /tmp/venv/bin/python benches/peers/tone.py

Speed: processor time, all threads together. "files": an EXR made into a picture, `fechner tonemap` with its packed PNG over
`pfsinexr | operator | pfsoutppm`, which does not pack (Debian's pfstools has no PNG writer of its own). "operator": less the
time of the cheapest way through either with the same files (`absolute`, and `pfsinexr | pfsoutppm`). Runs alternate and the
best of several counts.
Agreement: displayed linear light of a ramp of greys through both, for the operators that are meant to be the same.
"""

import os
import resource
import subprocess
import tempfile

import numpy as np
import OpenEXR

ROOT = os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "..")
FECHNER = os.environ.get("FECHNER", os.path.join(ROOT, "target", "release", "fechner"))
RUNS = 3
# Ours, and pfstools' command nearest to it.
PAIRS = [
    ("pattanaik00", ["pfstmo_pattanaik00"]),
    ("reinhard02", ["pfstmo_reinhard02"]),
    ("reinhard02 --adaptation local", ["pfstmo_reinhard02", "--scales"]),
    ("ward-larson97", ["pfstmo_mantiuk08", "--display-function", "l=200:b=0.2:g=2.2"]),
    ("tumblin-rushmeier", ["pfstmo_drago03"]),
    ("ferwerda96", ["pfstmo_drago03"]),
    ("durand-dorsey00", ["pfstmo_drago03"]),
    ("ward94 --adaptation local", ["pfstmo_durand02"]),
]


def write_exr(path, rgb):
    header = {"compression": OpenEXR.ZIP_COMPRESSION, "type": OpenEXR.scanlineimage}
    OpenEXR.File(header, {"RGB": np.ascontiguousarray(rgb, np.float32)}).write(path)


def read_pfm(path):
    with open(path, "rb") as file:
        assert file.readline().strip() == b"PF"
        width, height = map(int, file.readline().split())
        kind = "<f4" if float(file.readline()) < 0 else ">f4"
        return np.frombuffer(file.read(), kind).reshape(height, width, 3)


def picture(width, height):
    """Five decades of luminance with texture and colour."""
    x, y = np.meshgrid(np.linspace(0, 1, width), np.linspace(0, 1, height))
    light = 10 ** (5 * x - 1) * (1 + 0.3 * np.sin(60 * x) * np.sin(45 * y))
    return light[..., None] * np.stack([1 + 0.3 * y, np.ones_like(y), 1.3 - 0.6 * y], -1)


def seconds(command, **streams):
    """Processor seconds of all threads: other sessions on the machine do not count."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    subprocess.run(command, check=True, stderr=subprocess.DEVNULL, **streams)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


def tonemap(source, target, *arguments):
    return [FECHNER, "tonemap", source, "-o", target, "--nits-per-unit", "1", *arguments]


def speed(folder):
    source = os.path.join(folder, "large.exr")
    write_exr(source, picture(1920, 1080))

    def ours(*arguments):
        command = tonemap(source, os.path.join(folder, "a.png"), "--operator", *arguments)
        return seconds(command, stdout=subprocess.DEVNULL)

    def theirs(command):
        pipe = ["pfsinexr", source, "|", *command, "|"] if command else ["pfsinexr", source, "|"]
        return seconds(["sh", "-c", " ".join([*pipe, "pfsoutppm", os.path.join(folder, "a.ppm")])], stdout=subprocess.DEVNULL)

    print("| fechner | pfstools | files, s | ratio | operator, s | ratio |\n| --- | --- | --- | --- | --- | --- |")
    for name, command in PAIRS:
        best = [float("inf")] * 4
        for _ in range(RUNS):
            times = [ours(*name.split()), theirs(command), ours("absolute"), theirs([])]
            best = [min(pair) for pair in zip(best, times)]
        own, peer = best[0] - best[2], best[1] - best[3]
        files = f"{best[0]:.2f} / {best[1]:.2f} | {best[0] / best[1]:.2f}"
        print(f"| `{name}` | `{' '.join(command)}` | {files} | {own:.2f} / {peer:.2f} | {own / peer:.2f} |", flush=True)


def through_pfs(source, folder, command):
    """Green of a row of the picture after a command of pfstools."""
    target = os.path.join(folder, "out.pfm")
    line = f"pfsinexr {source} | {' '.join(command)} | pfsoutpfm {target}"
    subprocess.run(line, shell=True, check=True, stderr=subprocess.DEVNULL)
    picture = read_pfm(target)
    return picture[len(picture) // 2, :, 1]


def agreement(folder):
    display = os.path.join(folder, "peer.toml")
    with open(display, "w") as file:
        file.write("white_cd_m2 = 125\nblack_cd_m2 = 0\n")
    source, target = os.path.join(folder, "ramp.exr"), os.path.join(folder, "ours.exr")
    print("\npattanaik00 on greys from A/100 to 5 A: largest difference of display light (white is 1)")
    for adaptation in [1e-4, 0.01, 1, 25, 100, 1000, 1e4]:
        ramp = adaptation * np.logspace(-2, np.log10(5), 512)
        write_exr(source, np.repeat(np.tile(ramp, (16, 1))[..., None], 3, -1))
        extra = ["--operator", "pattanaik00", "--display", display, "--adapted-to", str(adaptation)]
        subprocess.run(tonemap(source, target, *extra), check=True, stdout=subprocess.DEVNULL)
        # pfsinexr multiplies by whiteLuminance.
        ours = through_pfs(target, folder, ["cat"]) / 125
        theirs = through_pfs(source, folder, ["pfstmo_pattanaik00", "--cone", str(adaptation), "--rod", str(adaptation)])
        print(f"  A = {adaptation:8} cd/m2: {np.abs(ours - theirs).max():.6f}")


if __name__ == "__main__":
    with tempfile.TemporaryDirectory() as folder:
        agreement(folder)
        speed(folder)
