"""What an eye can see in a picture.

Pictures are numpy arrays, row 0 at the top: ``(height, width)`` for one value a pixel, ``(height, width, 3)`` for linear
Rec. 709 RGB. C-contiguous ``float32`` is read where it lies; other arrays of numbers are converted. Luminance is in cd/m²,
variance in (cd/m²)², resolution in pixels per degree, frequency in cycles per degree; visibility is in threshold units, 1 is
just seen. What cannot be answered raises ``ValueError`` with what would be right.

Other Python threads run while a call works. Do not write to an array while a call reads it.
"""

from importlib.metadata import version

from ._fechner import (
    Allocation,
    Difference,
    Display,
    Observer,
    ThresholdMap,
    Tone,
    Viewing,
    contrast_sensitivity,
    contrast_sensitivity_functions,
    denoise_guide,
    difference,
    fit_tone,
    luminance,
    threshold_map,
    tone_map,
    tone_operators,
)

__version__ = version("fechner")

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
