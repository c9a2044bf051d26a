//! `fechner-perception` for Python.
//!
//! Arrays in, arrays out: no formula stands here. Every function reads its arguments, lets go of Python's lock, asks
//! the crate and hands the answer's memory to numpy. What the crate rejects becomes a `ValueError` with its message.

use pyo3::prelude::*;

mod arrays;
mod errors;
mod pictures;
mod threads;
mod thresholds;
mod tone;
mod viewing;

#[pymodule]
mod _fechner {
    #[pymodule_export]
    use crate::pictures::{Difference, denoise_guide, difference, luminance};
    #[pymodule_export]
    use crate::thresholds::{
        Allocation, ThresholdMap, contrast_sensitivity, contrast_sensitivity_functions, threshold_map,
    };
    #[pymodule_export]
    use crate::tone::{Tone, fit_tone, tone_map, tone_operators};
    #[pymodule_export]
    use crate::viewing::{Display, Observer, Viewing};
}
