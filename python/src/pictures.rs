//! Questions about whole pictures: luminance, difference, a denoised guide.

use fechner_perception::guide::{self, GuideInputs};
use fechner_perception::{Plane, csf, difference as perception, photometry};
use numpy::{PyArray2, PyArray3};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

use crate::arrays::{Pixels, Shape, plane, plane_to_array, rgb_to_array};
use crate::errors::{check_size, try_work, value_error, work};
use crate::viewing::{Viewing, or_default};

/// Photopic luminance, (height, width), of linear Rec. 709 RGB, (height, width, 3), in the unit of `rgb`. NaN stays
/// NaN.
#[pyfunction]
pub(crate) fn luminance<'py>(py: Python<'py>, rgb: &Bound<'py, PyAny>) -> PyResult<Bound<'py, PyArray2<f32>>> {
    let pixels = Pixels::borrow("rgb", rgb)?;
    let (shape, rgb) = pixels.rgb()?;
    let of_pixel = |x: usize, y: usize| photometry::luminance(rgb[y * shape.width + x]);
    plane_to_array(py, work(py, || Plane::from_fn(shape.width, shape.height, of_pixel))?)
}

/// What an observer sees of the difference of two pictures.
#[pyclass(frozen, module = "fechner")]
pub(crate) struct Difference(perception::Difference);

/// Predicts what can be seen of the difference between two pictures as displayed.
///
/// reference, test: both linear Rec. 709 RGB, (height, width, 3), or both luminance, (height, width); display cd/m².
/// ValueError for pictures that cannot be compared.
#[pyfunction]
#[pyo3(signature = (reference, test, viewing = None, csf = "castle"))]
pub(crate) fn difference(
    py: Python<'_>,
    reference: &Bound<'_, PyAny>,
    test: &Bound<'_, PyAny>,
    viewing: Option<&Viewing>,
    csf: &str,
) -> PyResult<Difference> {
    let viewing = or_default(viewing);
    let csf = csf::by_name(csf, &viewing).map_err(value_error)?;
    let (reference, test) = (Pixels::borrow("reference", reference)?, Pixels::borrow("test", test)?);
    if !reference.has_channels() {
        let (reference, test) = (reference.plane()?, test.plane()?);
        return Ok(Difference(try_work(py, || perception::difference(&reference, &test, &viewing, &*csf))?));
    }
    let ((Shape { height, width }, reference), (found, test)) = (reference.rgb()?, test.rgb()?);
    if found != (Shape { height, width }) {
        let message = format!("test is {}×{} pixels, but {width}×{height} are needed", found.width, found.height);
        return Err(PyValueError::new_err(message));
    }
    let seen = try_work(py, || perception::colour_difference(reference, test, width, height, &viewing, &*csf))?;
    Ok(Difference(seen))
}

#[pymethods]
impl Difference {
    /// Visibility of the difference in threshold units, (height, width).
    fn visibility<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f32>>> {
        plane_to_array(py, self.0.visibility.clone())
    }

    /// Probability of seeing the difference in the 1° patch around each pixel, (height, width).
    fn detection<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f32>>> {
        plane_to_array(py, work(py, || self.0.detection())?)
    }

    /// Greatest visibility: above 1 the pictures are told apart somewhere.
    #[getter]
    fn worst_visibility(&self) -> f64 {
        self.0.worst_visibility
    }

    /// Share of the pixels with visibility above 1.
    #[getter]
    fn visible_fraction(&self) -> f64 {
        self.0.visible_fraction
    }

    /// Whether the difference reaches threshold anywhere.
    #[getter]
    fn is_visible(&self) -> bool {
        self.0.is_visible()
    }

    fn __repr__(&self) -> String {
        let Self(seen) = self;
        format!("<Difference: worst {:.3}, {:.2} % visible>", seen.worst_visibility, 100.0 * seen.visible_fraction)
    }
}

/// A denoised guide, (height, width, 3), for thresholds and tone; never to be shown.
///
/// rgb: mean of the samples, linear, in a unit in which light lies between 1e-5 and 1e9, (height, width, 3).
/// variance: of the mean's luminance in that unit squared, (height, width). albedo and normal: of the first surface,
/// (height, width, 3), 0 where there is none. depth: (height, width), not finite where there is none; a mean over
/// samples of which some met nothing, counted as 0, is fine as well.
#[pyfunction]
pub(crate) fn denoise_guide<'py>(
    py: Python<'py>,
    rgb: &Bound<'py, PyAny>,
    variance: &Bound<'py, PyAny>,
    albedo: &Bound<'py, PyAny>,
    normal: &Bound<'py, PyAny>,
    depth: &Bound<'py, PyAny>,
) -> PyResult<Bound<'py, PyArray3<f32>>> {
    let pixels =
        [("rgb", rgb), ("albedo", albedo), ("normal", normal)].map(|(what, given)| Pixels::borrow(what, given));
    let [rgb, albedo, normal] = pixels;
    let (rgb, albedo, normal) = (rgb?, albedo?, normal?);
    let ((shape, rgb), (of_albedo, albedo), (of_normal, normal)) = (rgb.rgb()?, albedo.rgb()?, normal.rgb()?);
    if of_albedo != shape || of_normal != shape {
        return Err(PyValueError::new_err("albedo and normal must have the shape of rgb"));
    }
    let (variance, depth) = (plane("variance", variance)?, plane("depth", depth)?);
    check_size("variance", &variance, shape.width, shape.height)?;
    check_size("depth", &depth, shape.width, shape.height)?;
    let (width, height) = (shape.width, shape.height);
    let inputs = GuideInputs { rgb, variance: &variance, albedo, normal, depth: depth.values(), width, height };
    let guide = work(py, || guide::denoise(&inputs))?;
    rgb_to_array(py, shape, guide)
}
