"""Judges two independent renders of one view, from any renderer: where does their noise still show?

A and B are the same picture rendered with two seeds and equally many samples. Half their difference is a realisation of the error
of their mean; `ThresholdMap.measured_visibility` says how visible it is, in threshold units, on the display that you name.

    python python/examples/judge_renders.py a.npy b.npy --exposure 1000 -o map.png
    python python/examples/judge_renders.py a.pfm b.pfm --display laptop -o map.npy

Files: .npy ((height, width, 3), linear Rec. 709), .pfm, and with `pip install mitsuba` .exr (of several layers the one without a name or called
Combined, as Blender writes them) and .hdr.
Exit status 0 when at least 99 % of the picture is below threshold, 1 when it is not, 2 when that cannot be said.
"""

import argparse
import importlib.util
import sys
from pathlib import Path

import numpy as np

import fechner


def read(path):
    """Linear RGB, (height, width, 3), float32."""
    kind = path.suffix.lower()
    if kind == ".npy":
        picture = np.load(path)
    elif kind == ".pfm":
        picture = read_pfm(path)
    elif kind in (".exr", ".hdr"):
        picture = read_by_mitsuba(path)
    else:
        raise ValueError(f"{path}: {kind or 'no ending'}; a picture is .npy, .pfm, .hdr or .exr")
    if picture.ndim != 3 or picture.shape[2] < 3:
        raise ValueError(f"{path} has the shape {picture.shape}; a picture has (height, width, 3)")
    return np.ascontiguousarray(picture[..., :3], np.float32)


def read_by_mitsuba(path):
    """An OpenEXR or Radiance picture."""
    import mitsuba

    mitsuba.set_variant("scalar_rgb")
    try:
        bitmap = mitsuba.Bitmap(str(path))
        if bitmap.pixel_format() == mitsuba.Bitmap.PixelFormat.MultiChannel:
            bitmap = finished_layer(path, bitmap)
        return np.array(bitmap.convert(mitsuba.Bitmap.PixelFormat.RGB, mitsuba.Struct.Type.Float32, False))
    except RuntimeError as error:
        raise ValueError(f"{path}: {' '.join(str(error).split())}") from error


def finished_layer(path, bitmap):
    """The layer without a name, or the one called Combined. `Bitmap.split` refuses files in which two layers have an alpha, as those of the
    aov integrator over a film of rgba."""
    import mitsuba

    names = [field.name for field in bitmap.struct_()]
    layers = dict.fromkeys(name.rpartition(".")[0] for name in names)
    found = []
    for layer in layers:
        channels_of = {kind: [f"{layer}.{part}" if layer else part for part in kind] for kind in ("RGB", "XYZ", "Y")}
        kind = next((kind for kind, channels in channels_of.items() if set(channels) <= set(names)), None)
        if kind and layer.split(".")[-1] in ("", "Combined"):
            found.append((kind, channels_of[kind]))
    if len(found) != 1:
        known = ", ".join(layer or "without a name" for layer in layers)
        raise ValueError(f"{path} has the layers {known}; one picture and no more must be without a name or called Combined")
    kind, channels = found[0]
    values = np.array(bitmap)[..., [names.index(channel) for channel in channels]]
    return mitsuba.Bitmap(np.ascontiguousarray(values, np.float32), getattr(mitsuba.Bitmap.PixelFormat, kind))


def read_pfm(path):
    """A portable float map: three lines of text, then rows from the bottom."""
    with path.open("rb") as file:
        if file.readline().strip() != b"PF":
            raise ValueError(f"{path} is no PFM in colour; its first line must be PF")
        width, height = map(int, file.readline().split())
        order = "<" if float(file.readline()) < 0 else ">"
        values = np.frombuffer(file.read(12 * width * height), order + "f4")
    if values.size != 3 * width * height:
        raise ValueError(f"{path} ends after {values.size} values; {3 * width * height} are needed")
    return values.reshape(height, width, 3)[::-1]


def judge(first, second, viewing, operator):
    """Visibility, in threshold units, of the noise left in the mean of two renders (scene cd/m²)."""
    # A filter with negative lobes may leave luminance below 0, which is no light.
    mean = np.maximum(fechner.luminance(0.5 * (first + second)), 0)
    half_difference = fechner.luminance(0.5 * (first - second))
    tone = fechner.fit_tone(mean, operator, viewing)
    shown = tone.display_luminance(mean)
    # The two halves' squared half difference estimates the variance of the noise in their mean, which must not mask itself.
    seen = tone.display_half_difference(mean, half_difference)
    thresholds = fechner.threshold_map(shown, box_mean(seen**2, 7), viewing)
    return thresholds.measured_visibility(seen)


def box_mean(values, side):
    """Mean over a window of side × side pixels, held at the borders."""
    padded = np.pad(values, side // 2, mode="edge")
    for axis in (0, 1):
        padded = np.lib.stride_tricks.sliding_window_view(padded, side, axis=axis).mean(axis=-1)
    return padded


def report(visibility, columns=6, rows=4):
    """Prints the figures of the picture and the tiles where noise shows most."""
    print(f"below threshold     {100 * np.mean(visibility <= 1):.2f} % of the picture")
    print(f"99 % lie below      v = {np.quantile(visibility, 0.99):.2f}")
    # Noise falls with the square root of the samples.
    print(f"samples for 99 %    {max(np.quantile(visibility, 0.99), 1e-9) ** 2:.2f} times as many")
    height, width = visibility.shape
    tiles = []
    for row in range(rows):
        for column in range(columns):
            top, bottom = row * height // rows, (row + 1) * height // rows
            left, right = column * width // columns, (column + 1) * width // columns
            if bottom > top and right > left:
                tile = visibility[top:bottom, left:right]
                tiles.append((float(tile.mean()), float(np.mean(tile > 1)), (left, top, right, bottom)))
    print("noise shows most in (left, top, right, bottom):")
    for mean, share, corners in sorted(tiles, reverse=True)[:4]:
        print(f"  {corners}: v = {mean:.2f} on average, above threshold on {100 * share:.1f} % of it")


def check_output(path):
    """Before the work: whether the map can be written."""
    if path.suffix not in (".npy", ".png"):
        raise ValueError(f"{path}: {path.suffix or 'no ending'}; the map is .npy or .png")
    if path.suffix == ".png" and importlib.util.find_spec("matplotlib") is None:
        raise ValueError(f"{path} needs matplotlib; end the name in .npy without it")
    if not path.parent.is_dir():
        raise ValueError(f"{path}: there is no folder {path.parent}")


def write_map(path, visibility):
    if path.suffix == ".npy":
        np.save(path, visibility)
        return
    from matplotlib import pyplot

    pyplot.imsave(path, visibility, vmin=0, vmax=2, cmap="magma")


def main():
    arguments = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    arguments.add_argument("first", type=Path)
    arguments.add_argument("second", type=Path)
    arguments.add_argument("--exposure", type=float, default=1.0, help="cd/m² of a pixel value of 1")
    arguments.add_argument("--display", default="desktop", help=", ".join(fechner.Display.presets()))
    arguments.add_argument("--tone", default="ward94", help=", ".join(fechner.tone_operators()))
    arguments.add_argument("-o", "--output", type=Path, help="the map of v: .npy, or .png with matplotlib (white is 2)")
    options = arguments.parse_args()
    if not 0 < options.exposure < np.inf:
        arguments.error(f"--exposure is {options.exposure}; it must be finite and above 0")
    try:
        if options.output:
            check_output(options.output)
        first, second = (options.exposure * read(path) for path in (options.first, options.second))
        if first.shape != second.shape:
            raise ValueError(f"{options.second} has the shape {second.shape}, but {options.first} {first.shape}")
        if np.array_equal(first, second):
            raise ValueError("one picture twice, or two renders by one seed, which tell nothing of noise (mi.render has seed 0 unless told)")
        visibility = judge(first, second, fechner.Viewing(options.display), options.tone)
        report(visibility)
        if options.output:
            write_map(options.output, visibility)
    except Exception as error:  # Whatever it is: Python's own status, 1, would say that noise shows.
        print(f"judge_renders: {error or type(error).__name__}", file=sys.stderr)
        return 2
    return 0 if np.mean(visibility <= 1) >= 0.99 else 1


if __name__ == "__main__":
    sys.exit(main())
