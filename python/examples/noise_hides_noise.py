"""How much of itself noise hides: grey with white noise, judged with and without the noise's own variance.

    python python/examples/noise_hides_noise.py

Prints the median v of noise on 40 cd/m² as `laptop` shows it, means of eight seeds with their standard errors: under thresholds of the
noisy mean alone, of the mean and its variance, and of the grey without noise, which is what is right.
"""

import numpy as np

import fechner

SIDE = 128
SEEDS = 8
GREY_CD_M2 = 40.0


def visibilities(relative, seed, viewing):
    """v without the variance, with it, and by the grey, of noise of this share of the grey in the mean of two halves."""
    random = np.random.default_rng(seed)
    halves = [GREY_CD_M2 * (1 + np.sqrt(2) * relative * random.standard_normal((SIDE, SIDE))) for _ in range(2)]
    a, b = np.maximum(halves, 0)
    mean, half_difference = (a + b) / 2, (a - b) / 2
    tone = fechner.fit_tone(mean, "ward94", viewing)
    error = tone.display_half_difference(mean, half_difference)
    shown = tone.display_luminance(mean)
    grey = tone.display_luminance(np.full((SIDE, SIDE), GREY_CD_M2))
    maps = [
        fechner.threshold_map(shown, viewing=viewing),
        fechner.threshold_map(shown, error**2, viewing),
        fechner.threshold_map(grey, viewing=viewing),
    ]
    return [float(np.median(thresholds.measured_visibility(error))) for thresholds in maps]


def main():
    viewing = fechner.Viewing("laptop")
    print("| noise | without its variance | with it | by the grey |\n| --- | --- | --- | --- |")
    for relative in (0.05, 0.2, 1.0):
        found = np.array([visibilities(relative, seed, viewing) for seed in range(SEEDS)])
        means, errors = found.mean(axis=0), found.std(axis=0, ddof=1) / np.sqrt(SEEDS)
        cells = " | ".join(f"{mean:.2f} ± {error:.2f}" for mean, error in zip(means, errors))
        print(f"| {100 * relative:.0f} % | {cells} |")


if __name__ == "__main__":
    main()
