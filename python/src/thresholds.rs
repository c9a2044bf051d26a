//! The threshold map, what it says of noise, and where samples should go.

use fechner_perception::allocation::{self, AllocationProblem, FINE_GAP};
use fechner_perception::{GuideNoise, Plane, ThresholdInputs, csf, threshold};
use numpy::PyArray2;
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

use crate::arrays::{optional_plane, plane, plane_to_array};
use crate::errors::{check_size, try_work, value_error, work};
use crate::viewing::{Viewing, or_default};

/// What the eye in front of one display can see at each pixel of one picture; made by `threshold_map`.
#[pyclass(frozen, module = "fechner")]
pub(crate) struct ThresholdMap(threshold::ThresholdMap);

/// Finds adaptation, masking and thresholds of a picture.
///
/// display_luminance: (height, width), cd/m² as the display shows them, denoised. guide_variance: (height, width),
/// (cd/m²)², the variance of the noise in it, so that noise does not hide noise; None takes it as clean. denoised:
/// whether display_luminance is denoised, and guide_variance that of before. csf: a name of
/// contrast_sensitivity_functions(). ValueError for pictures that are none, sizes that differ, values below 0 or not
/// finite.
#[pyfunction]
#[pyo3(signature = (display_luminance, guide_variance = None, viewing = None, csf = "castle", *, denoised = false))]
pub(crate) fn threshold_map(
    py: Python<'_>,
    display_luminance: &Bound<'_, PyAny>,
    guide_variance: Option<&Bound<'_, PyAny>>,
    viewing: Option<&Viewing>,
    csf: &str,
    denoised: bool,
) -> PyResult<ThresholdMap> {
    let luminance = plane("display_luminance", display_luminance)?;
    let variance = optional_plane("guide_variance", guide_variance)?;
    let viewing = or_default(viewing);
    let csf = csf::by_name(csf, &viewing).map_err(value_error)?;
    let guide_noise = match &variance {
        None => GuideNoise::Clean,
        Some(variance) if denoised => GuideNoise::BeforeDenoising(variance),
        Some(variance) => GuideNoise::White(variance),
    };
    let inputs = ThresholdInputs { display_luminance_cd_m2: &luminance, guide_noise };
    Ok(ThresholdMap(try_work(py, || threshold::threshold_map(&inputs, &viewing, &*csf))?))
}

/// The names of the contrast sensitivity functions.
#[pyfunction]
pub(crate) fn contrast_sensitivity_functions() -> Vec<&'static str> {
    csf::names().to_vec()
}

/// Contrast sensitivity (1 over threshold contrast) of the viewing's observer by the function `csf` at a frequency,
/// cpd, and a luminance, cd/m²: ValueError where one is below 0 or not finite.
#[pyfunction]
#[pyo3(signature = (frequency_cpd, luminance_cd_m2, viewing = None, csf = "castle"))]
pub(crate) fn contrast_sensitivity(
    frequency_cpd: f64,
    luminance_cd_m2: f64,
    viewing: Option<&Viewing>,
    csf: &str,
) -> PyResult<f64> {
    check_number("frequency_cpd", frequency_cpd, frequency_cpd >= 0.0, "finite and not negative")?;
    check_number("luminance_cd_m2", luminance_cd_m2, luminance_cd_m2 >= 0.0, "finite and not negative")?;
    let viewing = or_default(viewing);
    let csf = csf::by_name(csf, &viewing).map_err(value_error)?;
    Ok(viewing.observer.sensitivity * csf.sensitivity(frequency_cpd, luminance_cd_m2))
}

fn check_number(what: &str, value: f64, is_sound: bool, must_be: &str) -> PyResult<()> {
    if is_sound && value.is_finite() {
        return Ok(());
    }
    Err(PyValueError::new_err(format!("{what} is {value}; it must be {must_be}")))
}

impl ThresholdMap {
    fn plane_of_its_size(&self, what: &'static str, given: &Bound<'_, PyAny>) -> PyResult<Plane> {
        let plane = plane(what, given)?;
        check_size(what, &plane, self.0.width(), self.0.height())?;
        Ok(plane)
    }
}

#[pymethods]
impl ThresholdMap {
    /// (height, width).
    #[getter]
    fn shape(&self) -> (usize, usize) {
        (self.0.height(), self.0.width())
    }

    /// Adaptation luminance, cd/m², (height, width).
    fn adaptation<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f32>>> {
        plane_to_array(py, self.0.adaptation_cd_m2().clone())
    }

    /// Standard error of each pixel's mean, cd/m², that leaves white noise at `visibility`, above 0; (height, width).
    #[pyo3(signature = (visibility = 1.0))]
    fn allowed_standard_error<'py>(&self, py: Python<'py>, visibility: f64) -> PyResult<Bound<'py, PyArray2<f32>>> {
        check_number("visibility", visibility, visibility > 0.0, "finite and above 0")?;
        plane_to_array(py, work(py, || self.0.allowed_standard_error_cd_m2(visibility))?)
    }

    /// How many times masking raises the allowed standard error, 1 to 3; (height, width). With glare_age_years it
    /// holds what keeps thresholds from falling under a veil, too, beside very bright lamps hundreds of times.
    fn masking_elevation<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f32>>> {
        plane_to_array(py, work(py, || self.0.masking_elevation())?)
    }

    /// Visibility, in threshold units, that independent pixel errors of this variance ((cd/m²)² on the display, of
    /// each pixel's mean; (height, width)) will have. Pixels whose variance is below 0 or not finite get infinity.
    fn predicted_visibility<'py>(
        &self,
        py: Python<'py>,
        variance_of_mean: &Bound<'py, PyAny>,
    ) -> PyResult<Bound<'py, PyArray2<f32>>> {
        let variance = self.plane_of_its_size("variance_of_mean", variance_of_mean)?;
        plane_to_array(py, work(py, || self.0.predicted_visibility(&variance))?)
    }

    /// Visibility, in threshold units, of the error that two independent halves of a picture show: half_difference is
    /// (A − B)/2 of their luminance in display cd/m², (height, width). Noise of colour alone has none, and is not
    /// seen here. Pixels that are not finite get infinity and count as 0 for the others.
    fn measured_visibility<'py>(
        &self,
        py: Python<'py>,
        half_difference: &Bound<'py, PyAny>,
    ) -> PyResult<Bound<'py, PyArray2<f32>>> {
        let error = self.plane_of_its_size("half_difference", half_difference)?;
        plane_to_array(py, work(py, || self.0.measured_visibility(&error))?)
    }

    /// The cheapest sample counts that bring visibility down to `visibility` everywhere, with a bound that proves it.
    ///
    /// variance_per_sample: (height, width), (cd/m²)² on the display. cost: of one sample, any unit, above 0; None is
    /// 1 everywhere. tolerance: multiplies the visibility allowed. With a budget (Σ cost · samples) the lowest
    /// visibility that it pays for is found instead, and `visibility` is where the search begins. min_samples
    /// everywhere are paid for even where they cost more than the budget: compare `cost`.
    #[pyo3(signature = (
        variance_per_sample, *, cost = None, tolerance = None, visibility = 1.0, min_samples = 1.0, max_samples = 1e6, budget = None
    ))]
    #[expect(clippy::too_many_arguments, reason = "keyword arguments of Python")]
    fn allocate(
        &self,
        py: Python<'_>,
        variance_per_sample: &Bound<'_, PyAny>,
        cost: Option<&Bound<'_, PyAny>>,
        tolerance: Option<&Bound<'_, PyAny>>,
        visibility: f64,
        min_samples: f64,
        max_samples: f64,
        budget: Option<f64>,
    ) -> PyResult<Allocation> {
        let variance = plane("variance_per_sample", variance_per_sample)?;
        let cost = optional_plane("cost", cost)?.unwrap_or_else(|| Plane::filled(self.0.width(), self.0.height(), 1.0));
        let tolerance = optional_plane("tolerance", tolerance)?;
        let problem = AllocationProblem {
            variance_per_sample: &variance,
            thresholds: &self.0,
            cost: &cost,
            tolerance: tolerance.as_ref(),
            visibility,
            min_samples,
            max_samples,
            enough_gap: FINE_GAP,
        };
        let found = try_work(py, || match budget {
            None => allocation::allocate(&problem),
            Some(budget) => allocation::allocate_budget(&problem, budget),
        })?;
        Allocation::new(py, found)
    }

    fn __repr__(&self) -> String {
        format!("<ThresholdMap of {}×{} pixels>", self.0.width(), self.0.height())
    }
}

/// Sample counts, and how far from the best they can at most be.
#[pyclass(frozen, get_all, module = "fechner")]
pub(crate) struct Allocation {
    /// Samples of each pixel, real-valued; (height, width).
    samples: Py<PyArray2<f32>>,
    /// Σ cost · samples.
    cost: f64,
    /// No counts within the limits that meet the constraints cost less.
    lower_bound: f64,
    /// cost / lower_bound − 1.
    gap: f64,
    /// The visibility asked for or, for a budget, the greatest that the counts leave anywhere, over what is tolerated
    /// there, be it because max_samples does not reach further.
    visibility: f64,
    /// Pixels that stay above it even with max_samples everywhere.
    unreachable_pixels: usize,
    /// Updates of the multipliers.
    iterations: usize,
}

impl Allocation {
    fn new(py: Python<'_>, found: allocation::Allocation) -> PyResult<Self> {
        Ok(Self {
            samples: plane_to_array(py, found.samples)?.unbind(),
            cost: found.cost,
            lower_bound: found.lower_bound,
            gap: found.gap,
            visibility: found.visibility,
            unreachable_pixels: found.unreachable_pixels,
            iterations: found.iterations,
        })
    }
}

#[pymethods]
impl Allocation {
    fn __repr__(&self) -> String {
        format!("Allocation(cost={}, gap={}, visibility={})", self.cost, self.gap, self.visibility)
    }
}
