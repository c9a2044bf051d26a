from typing import Literal, final

import numpy as np
from numpy.typing import ArrayLike, NDArray

__all__ = [
    "Allocation",
    "Difference",
    "Display",
    "Observer",
    "ThresholdMap",
    "Tone",
    "Viewing",
    "contrast_sensitivity",
    "contrast_sensitivity_functions",
    "denoise_guide",
    "difference",
    "fit_tone",
    "luminance",
    "threshold_map",
    "tone_map",
    "tone_operators",
]

_Array = NDArray[np.float32]
_Csf = Literal[
    "castle", "stela", "barten99", "barten89", "daly93", "daly98", "laird06", "hdrvdp2", "mannos-sakrison"
]

@final
class Display:
    def __new__(
        cls,
        preset: str = "desktop",
        *,
        pixels_per_degree: float | None = None,
        pixel_aspect_ratio: float | None = None,
        white_cd_m2: float | None = None,
        black_cd_m2: float | None = None,
        ambient_cd_m2: float | None = None,
        distance_m: float | None = None,
        csf_area_deg2: float | None = None,
    ) -> Display: ...
    @staticmethod
    def presets() -> list[str]: ...
    def luminance_cd_m2(self, relative: float) -> float: ...
    @property
    def name(self) -> str: ...
    @property
    def pixels_per_degree(self) -> float: ...
    @property
    def pixel_aspect_ratio(self) -> float: ...
    @property
    def white_cd_m2(self) -> float: ...
    @property
    def black_cd_m2(self) -> float: ...
    @property
    def ambient_cd_m2(self) -> float: ...
    @property
    def distance_m(self) -> float | None: ...
    @property
    def csf_area_deg2(self) -> float | None: ...

@final
class Observer:
    def __new__(
        cls, sensitivity: float = 1.0, csf_area_deg2: float | None = None, glare_age_years: float | None = None
    ) -> Observer: ...
    @staticmethod
    def keen() -> Observer: ...
    @property
    def sensitivity(self) -> float: ...
    @property
    def csf_area_deg2(self) -> float | None: ...
    @property
    def glare_age_years(self) -> float | None: ...

@final
class Viewing:
    def __new__(cls, display: Display | str | None = None, observer: Observer | None = None) -> Viewing: ...
    @property
    def display(self) -> Display: ...
    @property
    def observer(self) -> Observer: ...

@final
class ThresholdMap:
    @property
    def shape(self) -> tuple[int, int]: ...
    def adaptation(self) -> _Array: ...
    def allowed_standard_error(self, visibility: float = 1.0) -> _Array: ...
    def masking_elevation(self) -> _Array: ...
    def predicted_visibility(self, variance_of_mean: ArrayLike) -> _Array: ...
    def measured_visibility(self, half_difference: ArrayLike) -> _Array: ...
    def allocate(
        self,
        variance_per_sample: ArrayLike,
        *,
        cost: ArrayLike | None = None,
        tolerance: ArrayLike | None = None,
        visibility: float = 1.0,
        min_samples: float = 1.0,
        max_samples: float = 1e6,
        budget: float | None = None,
    ) -> Allocation: ...

@final
class Allocation:
    @property
    def samples(self) -> _Array: ...
    @property
    def cost(self) -> float: ...
    @property
    def lower_bound(self) -> float: ...
    @property
    def gap(self) -> float: ...
    @property
    def visibility(self) -> float: ...
    @property
    def unreachable_pixels(self) -> int: ...
    @property
    def iterations(self) -> int: ...

@final
class Tone:
    def map(self, rgb: ArrayLike) -> _Array: ...
    def display_luminance(self, scene_luminance: ArrayLike) -> _Array: ...
    def display_variance(self, mean: ArrayLike, variance: ArrayLike) -> _Array: ...
    def display_half_difference(self, mean: ArrayLike, half_difference: ArrayLike) -> _Array: ...
    def describe(self) -> str: ...

@final
class Difference:
    def visibility(self) -> _Array: ...
    def detection(self) -> _Array: ...
    @property
    def worst_visibility(self) -> float: ...
    @property
    def visible_fraction(self) -> float: ...
    @property
    def is_visible(self) -> bool: ...

def luminance(rgb: ArrayLike) -> _Array: ...
def threshold_map(
    display_luminance: ArrayLike,
    guide_variance: ArrayLike | None = None,
    viewing: Viewing | None = None,
    csf: _Csf = "castle",
) -> ThresholdMap: ...
def contrast_sensitivity_functions() -> list[_Csf]: ...
def contrast_sensitivity(
    frequency_cpd: float, luminance_cd_m2: float, viewing: Viewing | None = None, csf: _Csf = "castle"
) -> float: ...
def tone_operators() -> list[str]: ...
def fit_tone(
    scene: ArrayLike,
    name: str,
    viewing: Viewing | None = None,
    *,
    exposure_stops: float = 0.0,
    local: bool = False,
    gaze: tuple[int, int] | None = None,
) -> Tone: ...
def tone_map(
    rgb: ArrayLike,
    name: str,
    viewing: Viewing | None = None,
    *,
    exposure_stops: float = 0.0,
    local: bool = False,
) -> _Array: ...
def difference(
    reference: ArrayLike, test: ArrayLike, viewing: Viewing | None = None, csf: _Csf = "castle"
) -> Difference: ...
def denoise_guide(
    rgb: ArrayLike, variance: ArrayLike, albedo: ArrayLike, normal: ArrayLike, depth: ArrayLike
) -> _Array: ...
