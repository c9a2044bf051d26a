"""How much light the loop's counts lose, in all and place by place.

    cargo build --release
    python3 -m venv venv && venv/bin/pip install numpy OpenEXR
    venv/bin/python benches/local_energy.py scenes/cornell-glass.toml [--seeds 50] [--visibility 4] [--spp 30]

renders a scene by many seeds, adaptively to a visibility or a budget and evenly by --even samples a pixel, and a reference of --reference even
samples of a seed of its own. Printed are, of both, the energy of the mean over that of the reference in per cent with its standard
error, the block of 8x8 pixels that is off by most standard errors, and the mean of t^2 over the blocks, 1 where nothing is
biased. The scatter of a block is that of its seeds and of the reference, whose own is that of one even render scaled by its samples.
"""

import argparse
import pathlib
import subprocess
import tempfile

import numpy as np
import OpenEXR

BLOCK = 8


def percent(part, whole):
    """0 where there is nothing."""
    return 100 * np.divide(part, whole, out=np.zeros_like(part), where=whole != 0)


def luminance(path):
    pixels = OpenEXR.File(str(path), separate_channels=True).channels()
    red, green, blue = (pixels[name].pixels.astype(np.float64) for name in "RGB")
    return 0.2126 * red + 0.7152 * green + 0.0722 * blue


def blocks(picture):
    rows, columns = picture.shape[0] // BLOCK, picture.shape[1] // BLOCK
    cut = picture[: rows * BLOCK, : columns * BLOCK]
    return cut.reshape(rows, BLOCK, columns, BLOCK).mean(axis=(1, 3))


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("scene")
    parser.add_argument("--seeds", type=int, default=50)
    parser.add_argument("--size", default="48x48")
    parser.add_argument("--visibility", default="4")
    parser.add_argument("--spp")
    parser.add_argument("--even", type=int, default=160)
    parser.add_argument("--reference", type=int, default=16384)
    parser.add_argument("--program", default="target/release/fechner")
    arguments = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        picture = pathlib.Path(folder) / "a.exr"

        def render(seed, *how):
            command = [arguments.program, "render", arguments.scene, "--size", arguments.size, "--seed", str(seed), *how]
            subprocess.run([*command, "-o", str(picture)], check=True, stderr=subprocess.DEVNULL)
            return luminance(picture)

        def even(seed, samples):
            return render(seed, "--sampling", "uniform", "--spp", str(samples))

        reference = even(10_000_019, arguments.reference)
        seeds = range(1, arguments.seeds + 1)
        evenly = np.array([even(seed, arguments.even) for seed in seeds])
        limits = ["--visibility", arguments.visibility, *(["--spp", arguments.spp] if arguments.spp else [])]
        adaptively = np.array([render(seed, *limits) for seed in seeds])

    def spread(of):
        values = np.array([of(one) for one in evenly])
        return values.var(axis=0, ddof=1) * arguments.even / arguments.reference

    for name, renders in (("adaptive", adaptively), ("even", evenly)):
        def offset(of):
            values, true = np.array([of(one) for one in renders]), of(reference)
            error = np.sqrt(values.var(axis=0, ddof=1) / len(values) + spread(of))
            return percent(values.mean(axis=0) - true, true), percent(error, true)

        whole, whole_error = offset(np.mean)
        local, local_error = offset(blocks)
        # A block that nothing lights, or that all samples see alike, is not off.
        t = np.divide(local, local_error, out=np.zeros_like(local), where=local_error > 0)
        worst = row, column = np.unravel_index(np.abs(t).argmax(), t.shape)
        print(
            f"{name}: {whole:+.2f} ± {whole_error:.2f} % in all; block {column}, {row}: {local[worst]:+.1f} ± {local_error[worst]:.1f} % "
            f"(t = {t[worst]:+.1f}); mean t² {np.mean(t * t):.1f}"
        )


if __name__ == "__main__":
    main()
