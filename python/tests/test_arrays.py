"""What goes in and out: memory, kinds of array, errors, threads."""

import copy
import multiprocessing
import pickle
import threading
import time

import numpy as np
import pytest

import fechner

GREY = np.full((24, 32), 50, np.float32)


def misaligned(picture):
    memory = np.empty(picture.nbytes + 1, np.uint8)
    array = memory[1:].view(np.float32).reshape(picture.shape)
    array[:] = picture
    return array


def visibility_of(picture):
    return fechner.threshold_map(picture).allowed_standard_error()


@pytest.mark.parametrize(
    "same",
    [
        GREY.astype(np.float64),
        GREY.astype(np.uint8),
        np.asfortranarray(GREY),
        np.repeat(GREY, 2, axis=1)[:, ::2],
        GREY[::-1],
        GREY.astype(">f4"),
        GREY.tolist(),
        misaligned(GREY),
        np.ma.masked_array(GREY),
    ],
    ids=["float64", "uint8", "fortran", "strided", "negative stride", "big endian", "list", "misaligned", "nothing masked"],
)
def test_other_arrays_are_converted(same):
    np.testing.assert_array_equal(visibility_of(same), visibility_of(GREY))


def test_inputs_are_left_alone_and_may_be_read_only():
    picture = np.random.default_rng(1).uniform(1, 100, (20, 30, 3)).astype(np.float32)
    before = picture.copy()
    picture.setflags(write=False)
    fechner.luminance(picture)
    fechner.tone_map(picture, "ferwerda96")
    fechner.difference(picture, picture)
    np.testing.assert_array_equal(picture, before)


def test_rows_and_columns_are_not_swapped():
    rgb = np.zeros((5, 9, 3), np.float32)
    rgb[1, 7] = 10
    assert np.argwhere(fechner.luminance(rgb)).tolist() == [[1, 7]]
    assert fechner.threshold_map(np.full((5, 9), 10.0)).shape == (5, 9)


def colour(shape):
    return np.ones(shape, np.float32)


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: fechner.threshold_map(np.where(np.eye(24, 32), np.nan, GREY)), r"holds NaN at \[0, 0\]"),
        (lambda: fechner.threshold_map(np.full((4, 4), np.inf)), "holds inf"),
        (lambda: fechner.threshold_map(-GREY), "must be finite and not negative"),
        (lambda: fechner.threshold_map(np.zeros((0, 4))), "display_luminance has no pixels"),
        (lambda: fechner.threshold_map(np.zeros(4)), r"shape \[4\]; it must have \(height, width\)"),
        (lambda: fechner.threshold_map(colour((4, 4, 3))), r"must have \(height, width\)"),
        (lambda: fechner.threshold_map(None), "must have"),
        (lambda: fechner.threshold_map(np.ma.masked_equal(GREY, 50)), "display_luminance is a masked array"),
        (lambda: fechner.threshold_map(GREY).allowed_standard_error(-1), "visibility is -1; it must be finite and above 0"),
        (lambda: fechner.threshold_map(GREY).allowed_standard_error(float("nan")), "visibility is NaN"),
        (lambda: fechner.contrast_sensitivity(float("nan"), 100), "frequency_cpd is NaN; it must be finite and not"),
        (lambda: fechner.contrast_sensitivity(1, -1), "luminance_cd_m2 is -1"),
        (lambda: fechner.fit_tone(GREY, "agx", gaze=(-1, 0)), r"gaze \(-1, 0\) lies outside the picture"),
        (lambda: fechner.fit_tone(-GREY, "agx"), "scene holds the luminance -50; light must not be negative"),
        (lambda: fechner.tone_map(-colour((4, 4, 3)), "agx"), "scene holds the luminance -"),
        (lambda: fechner.threshold_map("picture"), "display_luminance is no array of numbers"),
        (lambda: fechner.threshold_map([[1.0, 2.0], [3.0]]), "display_luminance is no array of numbers"),
        (lambda: fechner.threshold_map(GREY, GREY[1:]), r"guide variance has the shape \(23, 32\), but \(24, 32\) is needed"),
        (lambda: fechner.threshold_map(GREY, csf="eagle"), "no contrast sensitivity function is called `eagle`"),
        (lambda: fechner.threshold_map(GREY).predicted_visibility(GREY.T), r"shape \(32, 24\), but \(24, 32\) is needed"),
        (lambda: fechner.threshold_map(GREY).measured_visibility(GREY[:, 1:]), r"shape \(24, 31\), but \(24, 32\)"),
        (lambda: fechner.threshold_map(GREY).allocate(GREY[1:]), r"but \(24, 32\) is needed"),
        (lambda: fechner.threshold_map(GREY).allocate(np.full_like(GREY, np.nan)), "NaN"),
        (lambda: fechner.threshold_map(GREY).allocate(GREY, visibility=0), "visibility is 0"),
        (lambda: fechner.threshold_map(GREY).allocate(GREY, visibility=float("nan")), "visibility is NaN"),
        (lambda: fechner.threshold_map(GREY).allocate(GREY, budget=-1), "budget is -1"),
        (lambda: fechner.threshold_map(GREY).allocate(GREY, min_samples=9, max_samples=2), "samples"),
        (lambda: fechner.luminance(GREY), r"must have \(height, width, 3\)"),
        (lambda: fechner.luminance(colour((4, 4, 4))), r"must have \(height, width, 3\)"),
        (lambda: fechner.luminance(colour((4, 0, 3))), "rgb has no pixels"),
        (lambda: fechner.difference(GREY, GREY[1:]), r"test picture has the shape \(23, 32\)"),
        (lambda: fechner.difference(colour((4, 4, 3)), colour((4, 5, 3))), "test is 5×4 pixels, but 4×4 are needed"),
        (lambda: fechner.difference(colour((4, 4, 3)), GREY), r"must have \(height, width, 3\)"),
        (lambda: fechner.difference(GREY * np.nan, GREY), "NaN"),
        (lambda: fechner.threshold_map(GREY * (1 + 1j)), "complex64 holds none that are real"),
        (lambda: fechner.threshold_map(GREY.astype(str)), "is no array of numbers"),
        (lambda: fechner.threshold_map(GREY.astype("datetime64[s]")), "is no array of numbers"),
        (lambda: fechner.Display().luminance_cd_m2(float("nan")), "relative is NaN"),
        (lambda: fechner.tone_map(colour((4, 4, 3)) * np.nan, "ward94"), "NaN; light must be finite"),
        (lambda: fechner.tone_map(colour((4, 4, 3)), "darkroom"), "no tone operator is called `darkroom`; there are:"),
        (lambda: fechner.tone_map(colour((4, 4, 3)), "agx", exposure_stops=float("inf")), "exposure_stops is inf"),
        (lambda: fechner.fit_tone(GREY, "agx", exposure_stops=1e6), "exposure_stops is 1000000"),
        (lambda: fechner.tone_map(GREY, "agx"), r"must have \(height, width, 3\)"),
        (lambda: fechner.fit_tone(GREY, "agx").map(colour((4, 4, 3))), r"shape \(4, 4, 3\), but \(24, 32, 3\)"),
        (lambda: fechner.fit_tone(GREY, "agx", gaze=(32, 0)), "lies outside the picture"),
        (lambda: fechner.fit_tone(GREY, "agx").display_variance(GREY, GREY[1:]), r"variance has the shape \(23, 32\)"),
        (lambda: fechner.Display("television of 1936"), "no display preset is called `television of 1936`; there are:"),
        (lambda: fechner.Viewing("television of 1936"), "no display preset"),
        (lambda: fechner.Display(pixels_per_degree=0), "pixels_per_degree is 0; it must be between 1 and 1000"),
        (lambda: fechner.Display(white_cd_m2=float("nan")), "white_cd_m2 is NaN"),
        (lambda: fechner.Display("laptop", distance_m=0.4), "distance_m alone does not say"),
        (lambda: fechner.Observer(sensitivity=-1), "sensitivity is -1"),
        (lambda: fechner.Observer(glare_age_years=900), "age_years is 900"),
        (lambda: fechner.contrast_sensitivity(4, 100, csf=""), "no contrast sensitivity function"),
        (
            lambda: fechner.denoise_guide(colour((4, 4, 3)), GREY, colour((4, 4, 3)), colour((4, 4, 3)), GREY),
            r"variance has the shape \(24, 32\), but \(4, 4\) is needed",
        ),
    ],
)
def test_what_cannot_be_answered_is_a_value_error(call, message):
    with pytest.raises(ValueError, match=message):
        call()


@pytest.mark.parametrize("shape", [(1, 1), (1, 7), (3, 1), (2, 2)])
def test_the_smallest_pictures_have_answers(shape):
    picture = np.full(shape, 20, np.float32)
    thresholds = fechner.threshold_map(picture)
    assert np.isfinite(thresholds.allowed_standard_error()).all()
    assert np.isfinite(thresholds.measured_visibility(picture)).all()
    assert np.isfinite(thresholds.allocate(picture).samples).all()
    assert np.isfinite(fechner.difference(picture, picture + 1).worst_visibility)
    for name in fechner.tone_operators():
        rgb = np.full((*shape, 3), 20, np.float32)
        for local in (False, True):
            assert np.isfinite(fechner.tone_map(rgb, name, local=local)).all()


def test_a_forked_process_has_threads_of_its_own():
    picture = np.full((200, 200), 50.0)
    expected = fechner.threshold_map(picture).allowed_standard_error()
    with multiprocessing.get_context("fork").Pool(2) as pool:
        found = pool.map_async(fork_worker, [picture] * 4).get(timeout=120)
    assert all(np.array_equal(each, expected) for each in found)


def fork_worker(picture):
    return fechner.threshold_map(picture).allowed_standard_error()


@pytest.mark.parametrize("error", [KeyboardInterrupt, MemoryError, RuntimeError, TypeError])
def test_what_happens_while_an_array_is_made_is_told(error):
    class Broken:
        def __array__(self, dtype=None, copy=None):
            raise error("while it was made")

    with pytest.raises(ValueError if error is TypeError else error, match="while it was made"):
        fechner.threshold_map(Broken())


def test_an_observer_and_a_display_both_have_their_say():
    strict = fechner.Viewing("strict").observer.csf_area_deg2
    assert strict == 7 and fechner.Viewing("strict", fechner.Observer.keen()).observer.csf_area_deg2 == strict
    assert fechner.Viewing("strict", fechner.Observer(csf_area_deg2=2)).observer.csf_area_deg2 == 2
    keen = fechner.contrast_sensitivity(4, 100, fechner.Viewing(None, fechner.Observer.keen()))
    assert keen == pytest.approx(1.75 * fechner.contrast_sensitivity(4, 100))
    with pytest.raises(TypeError, match="display is 5; it must be a Display or a preset's name"):
        fechner.Viewing(5)


@pytest.mark.parametrize(
    "settings",
    [
        fechner.Display("phone"),
        fechner.Display("strict", pixels_per_degree=41.7, distance_m=0.7, black_cd_m2=0),
        fechner.Observer.keen(),
        fechner.Observer(0.5, csf_area_deg2=3, glare_age_years=60),
        fechner.Viewing("strict"),
        fechner.Viewing(fechner.Display("laptop", white_cd_m2=500), fechner.Observer.keen()),
    ],
    ids=repr,
)
def test_settings_go_to_other_processes(settings):
    for protocol in range(2, pickle.HIGHEST_PROTOCOL + 1):
        again = pickle.loads(pickle.dumps(settings, protocol))
        assert repr(again) == repr(settings) and again == settings and hash(again) == hash(settings)
    assert repr(copy.copy(settings)) == repr(copy.deepcopy(settings)) == repr(settings)


def test_settings_are_equal_by_what_they_say():
    assert fechner.Display() == fechner.Display("desktop") != fechner.Display("laptop")
    assert fechner.Observer() == fechner.Observer(1.0) != fechner.Observer.keen()
    assert fechner.Viewing("laptop") == fechner.Viewing(fechner.Display("laptop")) != fechner.Viewing()
    assert fechner.Display() != "desktop"
    assert len({fechner.Viewing("laptop"), fechner.Viewing("laptop"), fechner.Viewing()}) == 2


def test_the_package_says_its_version():
    assert fechner.__version__.count(".") == 2


def test_broken_error_is_counted_as_the_crate_says():
    thresholds = fechner.threshold_map(GREY)
    broken = np.ones_like(GREY)
    broken[3, 4] = np.nan
    for visibility in (thresholds.predicted_visibility(broken), thresholds.measured_visibility(broken)):
        assert np.array_equal(np.isinf(visibility), np.isnan(broken))


def test_threads_run_while_the_crate_works():
    picture = np.random.default_rng(2).uniform(1, 200, (1080, 1920)).astype(np.float32)
    state = {"counted": 0, "stop": False}

    def count():
        while not state["stop"]:
            state["counted"] += 1
            time.sleep(0)

    counter = threading.Thread(target=count)
    counter.start()
    try:
        while state["counted"] == 0:
            time.sleep(0.001)
        # Between these two lines Python's lock is either let go or held: nothing is timed.
        before = state["counted"]
        fechner.threshold_map(picture)
        during = state["counted"] - before
    finally:
        state["stop"] = True
        counter.join()
    # Held, the lock changes hands at most at the call's two ends.
    assert during > 100
