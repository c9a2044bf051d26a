"""Drives Mitsuba 3 by our stop rule, and counts what its own uniform render needs to look as good.

Mitsuba's integrator is asked for the light of any list of pixels, so each pixel gets its own number of samples and nothing of Mitsuba
is changed. A pilot goes everywhere; then, in rounds, thresholds of the picture so far and the allocation that brings the noise's
visibility to the target, with every pixel's count growing at most threefold a round. Two independent halves are kept: where they
show more noise than its variance predicts, they are believed. It ends when the noise of 99 % of the picture is at most as visible as
asked.

The comparison is nobody's own opinion: visibility of (render − reference) under the reference's thresholds, for both, the
reference's own noise taken off. The figure is the number of samples at which `mi.render`, the same for every pixel, has 99 % of the
picture at the visibility that the adaptive render reached there, over the adaptive render's mean number.

    pip install ./python mitsuba
    python python/examples/drive_mitsuba.py
    python python/examples/drive_mitsuba.py scene.xml --width 160 --height 90 --reference 4096

Mitsuba's LLVM mode needs libLLVM (Debian: libllvm15 or later).
"""

import argparse
import time
import xml.etree.ElementTree as ElementTree
from pathlib import Path

import mitsuba as mi
import numpy as np

import fechner

mi.set_variant("llvm_ad_rgb")

PATHS_AT_ONCE = 1 << 20
# Of one pass of the reference, a pixel.
PASS_SAMPLES = 256
COVERAGE = 0.99
LUMINANCE = np.array([0.2126, 0.7152, 0.0722])


def load(path, width, height):
    """A scene of this size with a box filter, so that pixels are independent."""
    if path is None:
        scene = mi.cornell_box()
        scene["sensor"]["film"].update(width=width, height=height, rfilter={"type": "box"})
        scene["sensor"]["sampler"] = {"type": "independent"}
        return mi.load_dict(scene)
    tree = ElementTree.parse(path)
    film = tree.getroot().find("sensor/film")
    if film is None:
        raise ValueError("no sensor with a film, whose size could be set")
    for name, value in (("width", width), ("height", height)):
        for old in film.findall(f"integer[@name='{name}']"):
            film.remove(old)
        ElementTree.SubElement(film, "integer", name=name, value=str(value))
    # `high_quality_edges` is Mitsuba 0.6's; Mitsuba 3 refuses it.
    for old in film.findall("rfilter") + film.findall("boolean[@name='high_quality_edges']"):
        film.remove(old)
    ElementTree.SubElement(film, "rfilter", type="box")
    sampler = tree.getroot().find("sensor/sampler")
    if sampler is not None:
        sampler.clear()
        sampler.set("type", "independent")
    for old in tree.iter("lookAt"):
        old.tag = "lookat"  # Mitsuba 3 translates 0.4's names, but not this one
    mi.file_resolver().append(str(path.parent.resolve()))
    return mi.load_string(ElementTree.tostring(tree.getroot(), encoding="unicode"))


class Tracer:
    """Light of chosen pixels, one path for each mention."""

    def __init__(self, scene, width, height, seed):
        self.scene, self.width, self.height = scene, width, height
        self.sampler = mi.load_dict({"type": "independent"})
        self.seed = seed

    def rays(self, pixels):
        self.seed += 1
        self.sampler.seed(self.seed, len(pixels))
        pixels = mi.UInt32(pixels.astype(np.uint32))
        corner = mi.Vector2f(pixels % self.width, pixels // self.width)
        place = (corner + self.sampler.next_2d()) / mi.Vector2f(self.width, self.height)
        return self.scene.sensors()[0].sample_ray_differential(0.0, self.sampler.next_1d(), place, self.sampler.next_2d())

    def light(self, pixels):
        """Linear RGB, (paths, 3)."""
        ray, weight = self.rays(pixels)
        radiance, _, _ = self.scene.integrator().sample(self.scene, self.sampler, ray)
        return np.array(mi.Color3f(weight * radiance)).T

    def surfaces(self, samples=4):
        """Mean albedo, normal and depth of the first surface, (height, width[, 3])."""
        count = self.width * self.height
        pixels = np.repeat(np.arange(count), samples)
        ray, _ = self.rays(pixels)
        hit = self.scene.ray_intersect(ray)
        albedo = np.array(mi.Color3f(hit.bsdf(ray).eval_diffuse_reflectance(hit, hit.is_valid()))).T
        normal = np.array(mi.Vector3f(hit.sh_frame.n)).T
        valid = np.array(hit.is_valid())[:, None]
        mean = lambda values: np.nan_to_num(np.where(valid, values, 0)).reshape(self.height, self.width, samples, -1).mean(axis=2)
        depth = np.array(hit.t).reshape(self.height, self.width, samples).mean(axis=2)
        return mean(albedo), mean(normal), depth


class Film:
    """Sums of the samples of every pixel, flat."""

    def __init__(self, count):
        self.samples = np.zeros(count)
        self.rgb = np.zeros((count, 3))
        self.squares = np.zeros(count)

    def trace(self, tracer, counts):
        """Adds `counts` samples to each pixel."""
        pixels = np.repeat(np.arange(len(counts)), counts)
        for start in range(0, len(pixels), PATHS_AT_ONCE):
            some = pixels[start : start + PATHS_AT_ONCE]
            light = tracer.light(some)
            luminance = light @ LUMINANCE
            add = lambda values: np.bincount(some, values, minlength=len(counts))
            self.rgb += np.stack([add(light[:, channel]) for channel in range(3)], axis=1)
            self.squares += add(luminance**2)
            self.samples += add(np.ones(len(some)))

    def mean(self):
        return self.rgb / self.samples[:, None]

    def variance(self):
        """Of one sample's luminance."""
        luminance = self.mean() @ LUMINANCE
        return np.maximum(self.squares - self.samples * luminance**2, 0) / (self.samples - 1)


def box_mean(values, side):
    padded = np.pad(values, side // 2, mode="edge")
    for axis in (0, 1):
        padded = np.lib.stride_tricks.sliding_window_view(padded, side, axis=axis).mean(axis=-1)
    return padded


def steadied(of_one, samples):
    """Variance of one sample, leaning on the neighbours' as if they were 64 samples more: few samples know little of their own, and
    a pixel that has not met its firefly yet believes that it is done."""
    around = box_mean(samples * of_one, 5) / box_mean(samples, 5)
    return (samples * of_one + 64 * around) / (samples + 64)


def adaptive(tracer, options, exposure):
    """Renders until the rule says so; mean RGB (scene cd/m²) and the samples of each pixel."""
    shape = (tracer.height, tracer.width)
    halves = [Film(tracer.width * tracer.height) for _ in range(2)]
    albedo, normal, depth = tracer.surfaces()
    more = np.full(shape, options.pilot)
    for round_number in range(1, 21):
        first = (more + 1) // 2
        for film, counts in zip(halves, (first, more - first)):
            film.trace(tracer, counts.ravel().astype(np.int64))
        samples = sum(film.samples for film in halves).reshape(shape)
        rgb = exposure * sum(film.rgb for film in halves).reshape(*shape, 3) / samples[..., None]
        of_one = [film.variance().reshape(shape) for film in halves]
        variance = exposure**2 * 0.5 * (of_one[0] + of_one[1])

        guide = fechner.denoise_guide(rgb, variance / samples, albedo, normal, depth)
        dim = fechner.luminance(guide)
        tone = fechner.fit_tone(dim, options.tone)
        # As displayed, where a lamp's edge is bounded by white, before pixels lean on each other.
        shown = steadied(samples * tone.display_variance(dim, variance / samples), samples) / samples
        thresholds = fechner.threshold_map(tone.display_luminance(dim), shown, denoised=True)
        predicted = thresholds.predicted_visibility(shown)
        a, b = (exposure * film.mean().reshape(*shape, 3) @ LUMINANCE for film in halves)
        measured = thresholds.measured_visibility(tone.display_half_difference(0.5 * (a + b), 0.5 * (a - b)))
        # What the halves show around a pixel, over a thousand others, corrects what variances promise, and only upward: counts were
        # decided by the same samples, so where the halves agree by chance they would be left to it.
        correction = np.clip(box_mean(measured**2, 33) / np.maximum(box_mean(predicted**2, 33), 1e-12), 1, 16)
        reached = np.quantile(np.sqrt(correction) * predicted, COVERAGE)
        print(
            f"  round {round_number}: {samples.mean():7.1f} samples a pixel, 99 % below {reached:5.2f}; "
            f"{np.quantile(predicted, COVERAGE):5.2f} by variances, {np.quantile(measured, COVERAGE):5.2f} by halves"
        )
        if reached <= options.visibility:
            break
        of_one = correction * shown * samples
        # The hardest 1 % are left as uniform sampling would leave them.
        need = thresholds.predicted_visibility(of_one)
        tolerance = np.maximum(1, need / np.quantile(need, COVERAGE))
        goal = dict(visibility=options.visibility, min_samples=options.pilot)
        wanted = thresholds.allocate(of_one, tolerance=tolerance, **goal).samples
        # Two halves: even counts.
        more = 2 * np.ceil(np.clip(wanted - samples, 0, 2 * samples) / 2)
        if not more.any():
            break
    return rgb, samples


class Judge:
    """What can be seen of a picture's error, by a reference of several passes, (passes, height, width, 3) in cd/m²."""

    def __init__(self, passes, tone):
        luminances = np.stack([fechner.luminance(one) for one in passes])
        mean = luminances.mean(axis=0)
        self.tone = fechner.fit_tone(mean, tone)
        self.shown = self.tone.display_luminance(mean)
        variance = self.tone.display_variance(mean, luminances.var(axis=0, ddof=1) / len(passes))
        # Without its variance the reference's noise would count as a texture that hides noise.
        self.thresholds = fechner.threshold_map(self.shown, variance)
        self.own = self.thresholds.predicted_visibility(variance)

    def visibility(self, rgb):
        error = self.tone.display_luminance(fechner.luminance(rgb)) - self.shown
        return np.sqrt(np.maximum(self.thresholds.measured_visibility(error) ** 2 - self.own**2, 0))


def uniform_need(scene, visibility, judge, exposure, step):
    """Samples a pixel at which `mi.render` has 99 % of the picture at `visibility`, and the last measurement before and after."""
    total, samples, before = 0, 0, None
    while samples < 200 * step:
        total = total + np.array(mi.render(scene, spp=step, seed=90_000 + samples)).astype(float)[..., :3] * step
        samples += step
        found = np.quantile(judge.visibility(exposure * total / samples), COVERAGE)
        if found <= visibility:
            if before is None:
                return float(samples)
            # Visibility falls as a power of the samples between two measurements.
            share = np.log(before[1] / visibility) / np.log(before[1] / found)
            return before[0] * (samples / before[0]) ** share
        before = (samples, found)
    return float("nan")


def main():
    arguments = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    arguments.add_argument("scene", nargs="?", type=Path, help="Mitsuba XML; without it mi.cornell_box()")
    arguments.add_argument("--width", type=int, default=128)
    arguments.add_argument("--height", type=int, default=128)
    arguments.add_argument("--visibility", type=float, default=2.0, help="that may remain, in threshold units")
    arguments.add_argument("--pilot", type=int, default=8, help="samples everywhere, even, at least 4")
    arguments.add_argument("--reference", type=int, default=4096, help=f"samples a pixel, at least {4 * PASS_SAMPLES}")
    arguments.add_argument("--tone", default="ward94", choices=fechner.tone_operators())
    arguments.add_argument("--seeds", type=int, default=1)
    options = arguments.parse_args()
    # Each half of the pilot needs two samples, and the reference passes, to know their variance.
    at_least = {"width": 1, "height": 1, "pilot": 4, "reference": 4 * PASS_SAMPLES, "seeds": 1}
    for name, least in at_least.items():
        if getattr(options, name) < least:
            arguments.error(f"--{name} is {getattr(options, name)}; it must be at least {least}")
    if not 0 < options.visibility < np.inf:
        arguments.error(f"--visibility is {options.visibility}; it must be finite and above 0")

    start = time.time()
    try:
        scene = load(options.scene, options.width, options.height)
    except (OSError, ValueError, ElementTree.ParseError, RuntimeError) as error:
        arguments.error(f"{options.scene}: {error}")
    count = options.reference // PASS_SAMPLES
    renders = (mi.render(scene, spp=PASS_SAMPLES, seed=10_000 + i) for i in range(count))
    passes = np.stack([np.array(render)[..., :3] for render in renders]).astype(float)
    # Arbitrary units become cd/m²: the middle of the picture, in logarithms, is 30.
    exposure = 30 / np.exp(np.mean(np.log(np.maximum(fechner.luminance(passes.mean(axis=0)), 1e-4))))
    judge = Judge(exposure * passes, options.tone)
    print(
        f"reference: {PASS_SAMPLES * count} samples a pixel, {time.time() - start:.0f} s, "
        f"its own noise on 99 % below {np.quantile(judge.own, COVERAGE):.2f}"
    )
    rows = []
    for seed in range(options.seeds):
        tracer = Tracer(scene, options.width, options.height, 1000 * (seed + 1))
        rgb, samples = adaptive(tracer, options, exposure)
        reached = float(np.quantile(judge.visibility(rgb), COVERAGE))
        step = max(8, int(samples.mean() / 8))
        rows.append((seed, samples.mean(), reached, uniform_need(scene, reached, judge, exposure, step)))
    print("| seed | adaptive, samples a pixel | 99 % below v | uniform for the same | ratio |\n| --- | --- | --- | --- | --- |")
    for seed, mean, reached, need in rows:
        print(f"| {seed} | {mean:.1f} | {reached:.2f} | {need:.1f} | {need / mean:.2f} |")


if __name__ == "__main__":
    main()
