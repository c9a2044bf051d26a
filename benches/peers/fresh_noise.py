#!/usr/bin/env python3
"""What of noise that is new in every frame an eye receives, by fine sums over time: the figures that the tests of
perception/src/csf/fresh_noise.rs and pursued_noise.rs are held to.

    python3 -m venv venv && venv/bin/pip install numpy
    venv/bin/python benches/peers/fresh_noise.py

Temporal responses are castleCSF's (Ashraf et al. 2024), frames are held for their whole time. At rest the energy is
the integral of 2T sinc^2(f T) r(f)^2; for an eye of velocity v it is that of 2T sinc^2((f - s) T) r(f)^2 over all f, of either
sign, averaged over the angles of s = rho v cos(theta), over the same with s = 0.
"""

import numpy as np

STEP_HZ, HIGHEST_HZ = 0.01, 400.0
HZ = (np.arange(int(HIGHEST_HZ / STEP_HZ)) + 0.5) * STEP_HZ
DIRECTIONS = (np.arange(200) + 0.5) / 200 * np.pi / 2

# Exponents and divisors of exp(-f^exponent / divisor).
RESPONSES = {
    "sustained": (1.3314, 10.5795),
    "red-green": (1.15591, 16.4325),
    "yellow-violet": (0.969123, 7.15012),
}


def squared(response):
    exponent, divisor = RESPONSES[response]
    return np.exp(-2 * HZ**exponent / divisor)


def energy(frames_per_second, response, shift_hz=0.0):
    held = lambda hz: np.sinc(hz / frames_per_second) ** 2
    density = (held(HZ - shift_hz) + held(HZ + shift_hz)) / frames_per_second
    return (density * squared(response)).sum() * STEP_HZ


print("frames a second: energy of still noise over that of fresh noise")
for fps in (24, 30, 60):
    print(f"{fps:4}", *(f"{name} {1 / energy(fps, name):.4f}" for name in RESPONSES))

print("frames a second, cycles a degree, degrees a second: energy left of the sustained channel's by an eye that moves")
for fps, freq_cpd, velocity_deg_s in [(24, 16, 1), (24, 16, 4), (24, 24, 2), (60, 16, 1), (60, 16, 4), (60, 24, 2)]:
    moved = [energy(fps, "sustained", freq_cpd * velocity_deg_s * np.cos(angle)) for angle in DIRECTIONS]
    print(f"{fps:4} {freq_cpd:4} {velocity_deg_s:4} {np.mean(moved) / energy(fps, 'sustained'):.4f}")
