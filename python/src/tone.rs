//! Tone operators by name, and error as it is seen through them.

use fechner_perception::photometry::{luminance, scotopic_luminance};
use fechner_perception::tone::{
    AdaptationScope, Effects, FittedTone, Pixel, SceneGuide, ToneSettings, coloured, map_picture, operator_named,
    operator_names,
};
use fechner_perception::{Plane, display, seen};
use numpy::{PyArray2, PyArray3};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

use crate::arrays::{Pixels, Shape, plane, plane_to_array, rgb_to_array};
use crate::errors::{check_size, value_error, work};
use crate::viewing::{Viewing, or_default};

/// The names of the tone operators.
#[pyfunction]
pub(crate) fn tone_operators() -> Vec<&'static str> {
    operator_names().to_vec()
}

/// A tone operator frozen for one picture and one viewing; made by `fit_tone`.
#[pyclass(frozen, module = "fechner")]
pub(crate) struct Tone {
    fitted: Box<dyn FittedTone>,
    display: display::Display,
    shape: Shape,
}

/// Freezes the operator `name` for a picture, so that the same scene light always becomes the same display light.
///
/// scene: linear Rec. 709 RGB (height, width, 3) or luminance (height, width), scene cd/m². exposure_stops multiplies
/// light by 2^stops (between -100 and 100). local: adapted at each pixel, for the operators that know it (others take
/// no notice). gaze: (column, row) the eye rests on, for operators whose eye adapts to what it looks at. acuity:
/// whether `map` takes out the fine detail that an eye loses in dim light, for ferwerda96, which does unless told
/// otherwise, and ward-larson97, which does not. ValueError for a name that there is not and for luminance below 0
/// and light that is not finite.
#[pyfunction]
#[pyo3(signature = (scene, name, viewing = None, *, exposure_stops = 0.0, local = false, gaze = None, acuity = None))]
#[expect(clippy::too_many_arguments, reason = "Python names them")]
pub(crate) fn fit_tone(
    py: Python<'_>,
    scene: &Bound<'_, PyAny>,
    name: &str,
    viewing: Option<&Viewing>,
    exposure_stops: f64,
    local: bool,
    gaze: Option<(i64, i64)>,
    acuity: Option<bool>,
) -> PyResult<Tone> {
    let scope = if local { AdaptationScope::Local } else { AdaptationScope::World };
    let effects = acuity.map(|acuity| Effects { acuity, ..Effects::default() });
    let settings = ToneSettings { exposure_stops, scope, effects };
    let operator = operator_named(name, &settings).map_err(value_error)?;
    if !(-100.0..=100.0).contains(&exposure_stops) {
        return Err(PyValueError::new_err(format!(
            "exposure_stops is {exposure_stops}; it must be between -100 and 100"
        )));
    }
    let scene = Scene::read(py, &Pixels::borrow("scene", scene)?)?;
    let shape = Shape { height: scene.photopic.height(), width: scene.photopic.width() };
    let gaze = gaze.map(|gaze| pixel_of(gaze, shape)).transpose()?;
    let viewing = or_default(viewing);
    let fitted = work(py, || {
        let guide = SceneGuide { scotopic_cd_m2: scene.scotopic.as_ref(), ..SceneGuide::of(&scene.photopic) };
        operator.fit(&guide.with_gaze(gaze), &viewing, None)
    })?;
    Ok(Tone { fitted, display: viewing.display, shape })
}

fn pixel_of((x, y): (i64, i64), Shape { height, width }: Shape) -> PyResult<Pixel> {
    let within = |place: i64, size: usize| usize::try_from(place).ok().filter(|&place| place < size);
    within(x, width).zip(within(y, height)).map(|(x, y)| Pixel { x, y }).ok_or_else(|| {
        PyValueError::new_err(format!("gaze ({x}, {y}) lies outside the picture of {width} columns and {height} rows"))
    })
}

/// What cones and rods see of a picture, cd/m².
struct Scene {
    photopic: Plane,
    scotopic: Option<Plane>,
}

impl Scene {
    fn read(py: Python<'_>, pixels: &Pixels<'_>) -> PyResult<Self> {
        let scene = if pixels.has_channels() {
            let (shape, rgb) = pixels.rgb()?;
            let seen_by = |weigh: fn([f32; 3]) -> f32| {
                Plane::from_fn(shape.width, shape.height, |x, y| weigh(rgb[y * shape.width + x]).max(0.0))
            };
            check_finite(rgb.as_flattened())?;
            check_luminance(rgb.iter().map(|&rgb| luminance(rgb)))?;
            work(py, || Self { photopic: seen_by(luminance), scotopic: Some(seen_by(scotopic_luminance)) })?
        } else {
            let photopic = pixels.plane()?;
            check_finite(photopic.values())?;
            check_luminance(photopic.values().iter().copied())?;
            Self { photopic, scotopic: None }
        };
        Ok(scene)
    }
}

fn check_finite(values: &[f32]) -> PyResult<()> {
    match values.iter().find(|value| !value.is_finite()) {
        None => Ok(()),
        Some(value) => Err(PyValueError::new_err(format!("scene holds {value}; light must be finite"))),
    }
}

/// Single channels below 0 are colours that Rec. 709 does not hold; luminance below 0 is no light.
fn check_luminance(mut values: impl Iterator<Item = f32>) -> PyResult<()> {
    match values.find(|&value| value < 0.0) {
        None => Ok(()),
        Some(value) => {
            Err(PyValueError::new_err(format!("scene holds the luminance {value}; light must not be negative")))
        }
    }
}

impl Tone {
    fn plane_of_its_size(&self, what: &'static str, given: &Bound<'_, PyAny>) -> PyResult<Plane> {
        let plane = plane(what, given)?;
        check_size(what, &plane, self.shape.width, self.shape.height)?;
        Ok(plane)
    }

    fn rgb_of_its_size<'a>(&self, pixels: &'a Pixels<'_>) -> PyResult<&'a [[f32; 3]]> {
        let (found, rgb) = pixels.rgb()?;
        if found == self.shape {
            return Ok(rgb);
        }
        Err(PyValueError::new_err(format!(
            "rgb has the shape ({}, {}, 3), but ({}, {}, 3) is needed",
            found.height, found.width, self.shape.height, self.shape.width
        )))
    }
}

#[pymethods]
impl Tone {
    /// This operator, whose display_luminance, display_variance and display_half_difference are of the picture's own
    /// colours, rgb (height, width, 3), and not of greys: for srgb, linear, agx and pbr-neutral, which bend or clip
    /// each channel by itself. Others show every colour as bright as its grey, except those with rods (ferwerda96,
    /// durand-dorsey00, pattanaik00), which in dim light show blue brighter than these functions say.
    fn coloured(&self, py: Python<'_>, rgb: &Bound<'_, PyAny>) -> PyResult<Self> {
        let pixels = Pixels::borrow("rgb", rgb)?;
        let rgb = self.rgb_of_its_size(&pixels)?;
        let fitted = work(py, || coloured(self.fitted.save().restore(), self.shape.width, rgb))?;
        Ok(Self { fitted, display: self.display.clone(), shape: self.shape })
    }

    /// Linear display RGB 0..1, (height, width, 3), for linear Rec. 709 RGB in scene cd/m² of the same shape.
    /// Infinite channels are very bright, negative ones and those that are no number dark; where fine detail is lost
    /// (acuity) all of these are dark.
    fn map<'py>(&self, py: Python<'py>, rgb: &Bound<'py, PyAny>) -> PyResult<Bound<'py, PyArray3<f32>>> {
        let pixels = Pixels::borrow("rgb", rgb)?;
        let rgb = self.rgb_of_its_size(&pixels)?;
        let shown = work(py, || map_picture(&*self.fitted, self.shape.width, rgb))?;
        rgb_to_array(py, self.shape, shown)
    }

    /// Luminance that the display shows, cd/m², for scene luminance, cd/m², of greys (see coloured); both (height,
    /// width). Without the loss of fine detail that map shows with acuity.
    fn display_luminance<'py>(
        &self,
        py: Python<'py>,
        scene_luminance: &Bound<'py, PyAny>,
    ) -> PyResult<Bound<'py, PyArray2<f32>>> {
        let scene = self.plane_of_its_size("scene_luminance", scene_luminance)?;
        plane_to_array(py, work(py, || seen::display_luminance(&*self.fitted, &self.display, &scene))?)
    }

    /// Variance of the displayed luminance, (cd/m²)², for scene luminance of this mean, cd/m², and variance,
    /// (cd/m²)²; all (height, width). Pixels that are not finite get infinity.
    fn display_variance<'py>(
        &self,
        py: Python<'py>,
        mean: &Bound<'py, PyAny>,
        variance: &Bound<'py, PyAny>,
    ) -> PyResult<Bound<'py, PyArray2<f32>>> {
        let mean = self.plane_of_its_size("mean", mean)?;
        let variance = self.plane_of_its_size("variance", variance)?;
        plane_to_array(py, work(py, || seen::display_variance(&*self.fitted, &self.display, &mean, &variance))?)
    }

    /// Half the difference that two halves A and B make on the display, cd/m²: mean is (A + B)/2, half_difference (A
    /// − B)/2, scene cd/m²; all (height, width). Pixels that are not finite give 0.
    fn display_half_difference<'py>(
        &self,
        py: Python<'py>,
        mean: &Bound<'py, PyAny>,
        half_difference: &Bound<'py, PyAny>,
    ) -> PyResult<Bound<'py, PyArray2<f32>>> {
        let mean = self.plane_of_its_size("mean", mean)?;
        let error = self.plane_of_its_size("half_difference", half_difference)?;
        plane_to_array(py, work(py, || seen::display_half_difference(&*self.fitted, &self.display, &mean, &error))?)
    }

    /// The fit in one line.
    fn describe(&self) -> String {
        self.fitted.describe()
    }

    fn __repr__(&self) -> String {
        format!("<Tone: {}>", self.fitted.describe())
    }
}

/// Linear display RGB 0..1 for a picture, (height, width, 3), through the operator `name` fitted to it: `fit_tone`
/// and `map`.
#[pyfunction]
#[pyo3(signature = (rgb, name, viewing = None, *, exposure_stops = 0.0, local = false))]
pub(crate) fn tone_map<'py>(
    py: Python<'py>,
    rgb: &Bound<'py, PyAny>,
    name: &str,
    viewing: Option<&Viewing>,
    exposure_stops: f64,
    local: bool,
) -> PyResult<Bound<'py, PyArray3<f32>>> {
    fit_tone(py, rgb, name, viewing, exposure_stops, local, None, None)?.map(py, rgb)
}
