"""Plots a Campbell–Robson chart and the boundary where it vanishes, predicted two ways.

The chart is a grating whose frequency rises to the right and whose contrast falls towards the top. White line: 1/S of the contrast
sensitivity function. Black line: where `ThresholdMap.measured_visibility` of the chart's own pixels falls below 1. They agree within
a few per cent: the second is found from the picture alone.

    pip install ./python matplotlib
    python python/examples/campbell_robson.py -o campbell_robson.png

Without matplotlib the figures are still printed.
"""

import argparse

import numpy as np

import fechner

MEAN_CD_M2 = 80.0
MIN_CONTRAST, GREATEST_CONTRAST = 1e-3, 0.5


def chart(viewing, frequencies_cpd, height):
    """Signed contrast of the chart, (height, width), and the contrast of each row."""
    pixels_per_degree = viewing.display.pixels_per_degree
    # Phase is the integral of frequency over the place.
    phase = 2 * np.pi * np.cumsum(frequencies_cpd) / pixels_per_degree
    contrasts = np.geomspace(MIN_CONTRAST, GREATEST_CONTRAST, height)
    return contrasts[:, None] * np.cos(phase), contrasts


def boundary(visibility, contrasts):
    """Least contrast of each column whose visibility is 1, by interpolation in the logarithm; NaN where there is none."""
    found = np.full(visibility.shape[1], np.nan)
    for column, values in enumerate(visibility.T):
        above = np.flatnonzero(values >= 1)
        if above.size and above[0] > 0:
            row = above[0]
            share = np.log(1 / values[row - 1]) / np.log(values[row] / values[row - 1])
            found[column] = contrasts[row - 1] * (contrasts[row] / contrasts[row - 1]) ** share
    return found


def main():
    arguments = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    arguments.add_argument("-o", "--output", help="PNG of the chart (needs matplotlib)")
    arguments.add_argument("--width", type=int, default=1800)
    arguments.add_argument("--height", type=int, default=1200)
    options = arguments.parse_args()

    viewing = fechner.Viewing("desktop")
    frequencies = np.geomspace(0.7, 24, options.width)
    signed, contrasts = chart(viewing, frequencies, options.height)
    grey = np.full(signed.shape, MEAN_CD_M2, np.float32)
    visibility = fechner.threshold_map(grey, viewing=viewing).measured_visibility(MEAN_CD_M2 * signed)
    measured = boundary(visibility, contrasts)
    predicted = np.array([1 / fechner.contrast_sensitivity(cpd, MEAN_CD_M2, viewing) for cpd in frequencies])

    print("frequency, cpd   threshold of the chart's pixels   1/S")
    for cpd in (1, 2, 4, 8, 16):
        column = int(np.argmin(abs(frequencies - cpd)))
        print(f"{cpd:14}   {measured[column]:31.4f}   {predicted[column]:.4f}")

    if options.output:
        plot(options.output, signed, frequencies, contrasts, measured, predicted)


def plot(output, signed, frequencies, contrasts, measured, predicted):
    try:
        from matplotlib import pyplot
    except ImportError:
        raise SystemExit("a picture needs matplotlib: pip install matplotlib") from None
    figure, axes = pyplot.subplots(figsize=(9, 6))
    code = np.clip(0.5 * (1 + signed), 0, 1) ** (1 / 2.2)
    axes.pcolormesh(frequencies, contrasts, code, cmap="gray", vmin=0, vmax=1, rasterized=True)
    axes.plot(frequencies, predicted, color="white", linewidth=2.5, label="1/S, castleCSF")
    axes.plot(frequencies, measured, color="black", linewidth=1, label="visibility 1 of these pixels")
    axes.set(xscale="log", yscale="log", xlabel="frequency, cycles per degree", ylabel="contrast")
    axes.invert_yaxis()
    axes.set_title(f"Campbell–Robson chart at {MEAN_CD_M2:.0f} cd/m²")
    axes.legend(loc="lower left", facecolor="0.7")
    figure.savefig(output, dpi=120)


if __name__ == "__main__":
    main()
