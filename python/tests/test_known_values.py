"""Figures that the crate's own tests and documentation state, seen from Python."""

import numpy as np
import pytest

import fechner


def viewing(pixels_per_degree):
    return fechner.Viewing(fechner.Display(pixels_per_degree=pixels_per_degree))


def test_grey_at_60_pixels_a_degree_allows_1_73_per_cent():
    allowed = fechner.threshold_map(np.full((64, 64), 100, np.float32)).allowed_standard_error()
    assert allowed.shape == (64, 64) and allowed.dtype == np.float32
    assert allowed[32, 32] == pytest.approx(1.73, abs=0.02)
    doubled = fechner.threshold_map(np.full((64, 64), 100, np.float32)).allowed_standard_error(visibility=2)
    np.testing.assert_allclose(doubled, 2 * allowed, rtol=1e-6)


@pytest.mark.parametrize(
    ("cpd", "cd_m2", "expected"),
    [(1, 100, 0.51467259), (4, 100, 1.3427774), (8, 100, 0.98562824), (4, 10, 8.0372413), (4, 1, 27.840307)],
)
def test_a_grating_has_its_contrast_over_threshold(cpd, cd_m2, expected):
    thresholds = fechner.threshold_map(np.full((256, 256), cd_m2, np.float32), viewing=viewing(32))
    grating = np.cos(2 * np.pi * cpd * (np.arange(256) + 0.5) / 32) * np.ones((256, 1))
    visibility = thresholds.measured_visibility(grating)
    assert visibility[128, 128] == pytest.approx(expected, rel=2e-3)


def test_contrast_sensitivity_of_barten():
    assert fechner.contrast_sensitivity(8, 100, csf="barten99") == pytest.approx(235.0, abs=0.1)
    assert "castle" in fechner.contrast_sensitivity_functions()


def test_prediction_agrees_with_measurement():
    thresholds = fechner.threshold_map(np.full((256, 256), 100, np.float32))
    sigma = 2.0
    predicted = thresholds.predicted_visibility(np.full((256, 256), sigma**2, np.float32))
    noise = np.random.default_rng(7).normal(0, sigma, (4, 256, 256)).astype(np.float32)
    squares = np.mean([np.mean(thresholds.measured_visibility(one) ** 2) for one in noise])
    # The crate's own bound for four fields of this size.
    assert np.sqrt(squares / np.mean(predicted**2)) == pytest.approx(1, abs=0.05)


def test_luminance_weighs_by_rec_709():
    rgb = np.array([[[1, 0, 0], [0, 1, 0], [0, 0, 1], [100, 100, 100]]], np.float32)
    np.testing.assert_allclose(fechner.luminance(rgb), [[0.2126, 0.7152, 0.0722, 100]], rtol=1e-6)


def test_allocation_gives_noisy_pixels_more_and_proves_it():
    thresholds = fechner.threshold_map(np.full((64, 64), 50, np.float32))
    variance = np.where(np.arange(64) < 32, 400, 25) * np.ones((64, 1))
    found = thresholds.allocate(variance)
    assert found.samples[30, 5] > 3 * found.samples[30, 60]
    assert 0 <= found.gap < 0.02 and found.unreachable_pixels == 0
    assert found.cost == pytest.approx(float(found.samples.sum()), rel=1e-5)
    assert found.cost == pytest.approx(found.lower_bound * (1 + found.gap), rel=1e-9)
    # What was asked for holds: visibility predicted from the counts given.
    left = thresholds.predicted_visibility(variance / found.samples)
    assert left.max() < 1.02
    paid = thresholds.allocate(variance, budget=found.cost / 4)
    assert paid.cost <= found.cost / 4 and paid.visibility == pytest.approx(2, rel=0.02)


def test_displays_and_observers():
    desktop = fechner.Display()
    assert desktop.name == "desktop" and desktop.pixels_per_degree == 60 and desktop.white_cd_m2 == 200
    assert set(fechner.Display.presets()) >= {"desktop", "laptop", "phone", "cinema", "strict"}
    assert fechner.Viewing("strict").observer.csf_area_deg2 == 7
    assert fechner.Viewing(fechner.Display("laptop", white_cd_m2=500)).display.luminance_cd_m2(1) == 500
    grey = np.full((32, 32), 100, np.float32)
    keen = fechner.threshold_map(grey, viewing=fechner.Viewing(observer=fechner.Observer.keen()))
    ratio = fechner.threshold_map(grey).allowed_standard_error() / keen.allowed_standard_error()
    np.testing.assert_allclose(ratio, 1.75, rtol=1e-4)


def test_difference_of_gratings():
    grating = np.cos(0.42 * np.arange(96)) * np.ones((96, 1))
    grey = np.full((96, 96), 80, np.float32)
    seen = fechner.difference(grey, 80 * (1 + 0.05 * grating))
    assert seen.is_visible and seen.worst_visibility > 1 and seen.visible_fraction > 0.5
    assert seen.visibility().max() == pytest.approx(seen.worst_visibility)
    assert seen.detection().shape == (96, 96) and seen.detection().max() <= 1
    assert not fechner.difference(grey, 80 * (1 + 0.002 * grating)).is_visible


def test_difference_in_colour_sees_what_luminance_does_not():
    grey = np.full((64, 64, 3), 100, np.float32)
    tinted = grey.copy()
    tinted[..., 0] = 120
    tinted[..., 1] = 100 - 20 * 0.2126 / 0.7152
    assert fechner.difference(grey, tinted).is_visible
    assert not fechner.difference(fechner.luminance(grey), fechner.luminance(tinted)).is_visible


@pytest.mark.parametrize("name", fechner.tone_operators())
def test_every_tone_operator_maps_into_the_display(name):
    ramp = np.geomspace(0.01, 1e4, 64, dtype=np.float32)
    scene = np.broadcast_to(ramp[None, :, None], (16, 64, 3))
    shown = fechner.tone_map(scene, name)
    assert shown.shape == (16, 64, 3) and shown.dtype == np.float32
    assert shown.min() >= 0 and shown.max() <= 1 and np.isfinite(shown).all()
    assert shown[0, -1, 1] > shown[0, 0, 1]


def test_error_through_a_linear_operator_scales():
    mean = np.full((32, 32), 100, np.float32)
    tone = fechner.fit_tone(mean, "absolute")
    assert tone.display_luminance(mean)[0, 0] == pytest.approx(100.2, abs=0.3)
    assert tone.display_half_difference(mean, np.full_like(mean, 3))[0, 0] == pytest.approx(3, rel=2e-3)
    assert tone.display_variance(mean, np.full_like(mean, 4))[0, 0] == pytest.approx(4, rel=4e-3)
    assert "absolute" in repr(tone) or tone.describe()


@pytest.mark.parametrize("name", ["agx", "pbr-neutral", "srgb", "linear"])
def test_coloured_operators_tell_what_is_shown(name):
    blue = np.broadcast_to(np.array([2, 5, 300], np.float32), (8, 8, 3))
    tone = fechner.fit_tone(blue, name)
    display = fechner.Viewing().display
    black, white = display.black_cd_m2, display.white_cd_m2
    shown = black + (white - black) * fechner.luminance(tone.map(blue))[0, 0]
    of_colours = tone.coloured(blue).display_luminance(fechner.luminance(blue))[0, 0]
    assert of_colours == pytest.approx(shown, rel=1e-3)
    assert tone.display_luminance(fechner.luminance(blue))[0, 0] != pytest.approx(shown, rel=0.05)
    with pytest.raises(ValueError, match=r"rgb has the shape \(4, 8, 3\)"):
        tone.coloured(blue[:4])


def test_fine_detail_is_lost_in_dim_light_unless_told_otherwise():
    checks = np.indices((32, 32)).sum(axis=0) % 2 * 0.02
    rgb = checks.astype(np.float32)[..., None].repeat(3, axis=2)
    contrast = [fechner.fit_tone(rgb, "ferwerda96", acuity=acuity).map(rgb).std() for acuity in (None, True, False)]
    assert contrast[0] == contrast[1] < 0.1 * contrast[2]


def test_a_guide_loses_its_noise():
    rng = np.random.default_rng(3)
    rgb = np.maximum(rng.normal(50, 10, (64, 64, 1)), 0).astype(np.float32).repeat(3, axis=2)
    flat = np.ones((64, 64, 3), np.float32)
    guide = fechner.denoise_guide(rgb, np.full((64, 64), 100.0), 0.5 * flat, flat / np.sqrt(3), np.ones((64, 64)))
    assert guide.std() < 0.3 * rgb.std() and guide.mean() == pytest.approx(rgb.mean(), rel=0.02)
