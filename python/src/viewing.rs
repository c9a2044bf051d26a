//! Displays, observers, and who looks at what.

use fechner_perception::display::{self, Glare};
use pyo3::exceptions::{PyTypeError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::errors::value_error;

/// A display at its viewing distance: a preset, with fields of its own where they are given.
///
/// Fields: pixels_per_degree (of visual angle, along a row), pixel_aspect_ratio (width over height of a pixel),
/// white_cd_m2, black_cd_m2, ambient_cd_m2 (room light off the screen), distance_m (what the eye focuses on, for the
/// function "daly93"; changes pixels_per_degree, so it must be given beside it), csf_area_deg2 (area of the grating
/// whose threshold is meant, for observers that do not say it). ValueError for an unknown preset and for values that
/// no display has.
#[pyclass(frozen, eq, module = "fechner")]
#[derive(PartialEq)]
pub(crate) struct Display(pub(crate) display::Display);

#[pymethods]
impl Display {
    #[new]
    #[pyo3(signature = (
        preset = "desktop", *, pixels_per_degree = None, pixel_aspect_ratio = None, white_cd_m2 = None, black_cd_m2 = None,
        ambient_cd_m2 = None, distance_m = None, csf_area_deg2 = None
    ))]
    #[expect(clippy::too_many_arguments, reason = "keyword arguments of Python")]
    fn new(
        preset: &str,
        pixels_per_degree: Option<f64>,
        pixel_aspect_ratio: Option<f64>,
        white_cd_m2: Option<f64>,
        black_cd_m2: Option<f64>,
        ambient_cd_m2: Option<f64>,
        distance_m: Option<f64>,
        csf_area_deg2: Option<f64>,
    ) -> PyResult<Self> {
        let base = named_display(preset)?;
        if distance_m.is_some() && pixels_per_degree.is_none() {
            const MISSING: &str =
                "distance_m alone does not say how many pixels a degree has: give pixels_per_degree beside it";
            return Err(PyValueError::new_err(MISSING));
        }
        let display = display::Display {
            pixels_per_degree: pixels_per_degree.unwrap_or(base.pixels_per_degree),
            pixel_aspect_ratio: pixel_aspect_ratio.unwrap_or(base.pixel_aspect_ratio),
            white_cd_m2: white_cd_m2.unwrap_or(base.white_cd_m2),
            black_cd_m2: black_cd_m2.unwrap_or(base.black_cd_m2),
            ambient_cd_m2: ambient_cd_m2.unwrap_or(base.ambient_cd_m2),
            distance_m: distance_m.or(base.distance_m),
            csf_area_deg2: csf_area_deg2.or(base.csf_area_deg2),
            ..base
        };
        display.check().map_err(value_error)?;
        Ok(Self(display))
    }

    /// The names of the presets.
    #[staticmethod]
    fn presets() -> Vec<&'static str> {
        display::Display::preset_names().to_vec()
    }

    /// Luminance, cd/m², that the display shows for linear light 0..1 (clamped). ValueError for NaN.
    fn luminance_cd_m2(&self, relative: f64) -> PyResult<f64> {
        if relative.is_nan() {
            return Err(PyValueError::new_err("relative is NaN; it must be a number"));
        }
        Ok(self.0.luminance_cd_m2(relative))
    }

    /// The preset's name.
    #[getter]
    fn name(&self) -> &str {
        &self.0.name
    }

    /// Pixels a degree of visual angle, along a row.
    #[getter]
    fn pixels_per_degree(&self) -> f64 {
        self.0.pixels_per_degree
    }

    /// Width of a pixel over its height.
    #[getter]
    fn pixel_aspect_ratio(&self) -> f64 {
        self.0.pixel_aspect_ratio
    }

    /// Luminance of full white, cd/m².
    #[getter]
    fn white_cd_m2(&self) -> f64 {
        self.0.white_cd_m2
    }

    /// Luminance of full black, cd/m².
    #[getter]
    fn black_cd_m2(&self) -> f64 {
        self.0.black_cd_m2
    }

    /// Room light off the screen, cd/m².
    #[getter]
    fn ambient_cd_m2(&self) -> f64 {
        self.0.ambient_cd_m2
    }

    /// How far away it is, m, where that is known.
    #[getter]
    fn distance_m(&self) -> Option<f64> {
        self.0.distance_m
    }

    /// Area of the grating whose threshold is meant for observers that do not say it, deg².
    #[getter]
    fn csf_area_deg2(&self) -> Option<f64> {
        self.0.csf_area_deg2
    }

    /// Equal for equal displays.
    fn __hash__(&self) -> u64 {
        self.0.pixels_per_degree.to_bits()
    }

    /// What `pickle` and `copy` make it again from: the preset, and every field by its name.
    fn __getnewargs_ex__<'py>(&self, py: Python<'py>) -> PyResult<((&str,), Bound<'py, PyDict>)> {
        let display = &self.0;
        let fields = PyDict::new(py);
        for (name, value) in [
            ("pixels_per_degree", Some(display.pixels_per_degree)),
            ("pixel_aspect_ratio", Some(display.pixel_aspect_ratio)),
            ("white_cd_m2", Some(display.white_cd_m2)),
            ("black_cd_m2", Some(display.black_cd_m2)),
            ("ambient_cd_m2", Some(display.ambient_cd_m2)),
            ("distance_m", display.distance_m),
            ("csf_area_deg2", display.csf_area_deg2),
        ] {
            fields.set_item(name, value)?;
        }
        Ok(((&display.name,), fields))
    }

    fn __repr__(&self) -> String {
        let display = &self.0;
        let mut text = format!(
            "Display({:?}, pixels_per_degree={}, pixel_aspect_ratio={}, white_cd_m2={}, black_cd_m2={}, ambient_cd_m2={}",
            display.name,
            display.pixels_per_degree,
            display.pixel_aspect_ratio,
            display.white_cd_m2,
            display.black_cd_m2,
            display.ambient_cd_m2
        );
        for (name, value) in [("distance_m", display.distance_m), ("csf_area_deg2", display.csf_area_deg2)] {
            if let Some(value) = value {
                text += &format!(", {name}={value}");
            }
        }
        text + ")"
    }
}

fn display_or_preset(given: &Bound<'_, PyAny>) -> PyResult<display::Display> {
    if let Ok(display) = given.cast::<Display>() {
        return Ok(display.get().0.clone());
    }
    let Ok(name) = given.extract::<String>() else {
        let message = format!("display is {}; it must be a Display or a preset's name", given.repr()?);
        return Err(PyTypeError::new_err(message));
    };
    named_display(&name)
}

fn named_display(name: &str) -> PyResult<display::Display> {
    display::Display::named(name).map_err(value_error)
}

/// The eye: sensitivity (1 is the median observer, 1.75 a keen one), csf_area_deg2 (area of the grating whose
/// threshold is meant, deg²; None takes the display's, or 1), glare_age_years (light scattered in an eye of this age;
/// None scatters none).
#[pyclass(frozen, eq, module = "fechner")]
#[derive(PartialEq)]
pub(crate) struct Observer {
    observer: display::Observer,
    /// What was asked for, before a display has its say.
    csf_area_deg2: Option<f64>,
}

#[pymethods]
impl Observer {
    #[new]
    #[pyo3(signature = (sensitivity = 1.0, csf_area_deg2 = None, glare_age_years = None))]
    fn new(sensitivity: f64, csf_area_deg2: Option<f64>, glare_age_years: Option<f64>) -> PyResult<Self> {
        let glare = glare_age_years.map_or(Glare::None, |age_years| Glare::Cie { age_years });
        let area = csf_area_deg2.unwrap_or(display::Observer::default().csf_area_deg2);
        let observer = display::Observer { sensitivity, csf_area_deg2: area, glare };
        display::Viewing { observer: observer.clone(), ..display::Viewing::default() }.check().map_err(value_error)?;
        Ok(Self { observer, csf_area_deg2 })
    }

    /// 1.75 times the median sensitivity.
    #[staticmethod]
    fn keen() -> Self {
        Self { observer: display::Observer::keen(), csf_area_deg2: None }
    }

    /// Multiplies contrast sensitivity.
    #[getter]
    fn sensitivity(&self) -> f64 {
        self.observer.sensitivity
    }

    /// Area of the grating whose threshold is meant, deg²; None where the display says it.
    #[getter]
    fn csf_area_deg2(&self) -> Option<f64> {
        self.csf_area_deg2
    }

    /// Age of the eye that scatters light, years; None scatters none.
    #[getter]
    fn glare_age_years(&self) -> Option<f64> {
        match self.observer.glare {
            Glare::None => None,
            Glare::Cie { age_years } => Some(age_years),
        }
    }

    /// Equal for equal observers.
    fn __hash__(&self) -> u64 {
        self.observer.sensitivity.to_bits()
    }

    /// What `pickle` and `copy` make it again from.
    fn __getnewargs__(&self) -> (f64, Option<f64>, Option<f64>) {
        (self.observer.sensitivity, self.csf_area_deg2, self.glare_age_years())
    }

    fn __repr__(&self) -> String {
        let or_none = |value: Option<f64>| value.map_or_else(|| "None".to_owned(), |value| value.to_string());
        format!(
            "Observer(sensitivity={}, csf_area_deg2={}, glare_age_years={})",
            self.observer.sensitivity,
            or_none(self.csf_area_deg2),
            or_none(self.glare_age_years())
        )
    }
}

/// Who looks at what. `display` is a Display or a preset's name; without an observer it is the one the display asks
/// for.
#[pyclass(frozen, eq, module = "fechner")]
#[derive(PartialEq)]
pub(crate) struct Viewing(pub(crate) display::Viewing);

#[pymethods]
impl Viewing {
    #[new]
    #[pyo3(signature = (display = None, observer = None))]
    fn new(display: Option<&Bound<'_, PyAny>>, observer: Option<&Observer>) -> PyResult<Self> {
        let display = display.map_or_else(|| Ok(display::Display::default()), display_or_preset)?;
        let mut viewing = display::Viewing::of(display);
        if let Some(observer) = observer {
            let area = observer.csf_area_deg2.unwrap_or(viewing.observer.csf_area_deg2);
            viewing.observer = display::Observer { csf_area_deg2: area, ..observer.observer.clone() };
        }
        Ok(Self(viewing))
    }

    /// The display.
    #[getter]
    fn display(&self) -> Display {
        Display(self.0.display.clone())
    }

    /// The eye in front of it.
    #[getter]
    fn observer(&self) -> Observer {
        Observer { observer: self.0.observer.clone(), csf_area_deg2: Some(self.0.observer.csf_area_deg2) }
    }

    /// Equal for equal viewings.
    fn __hash__(&self) -> u64 {
        self.display().__hash__() ^ self.observer().__hash__()
    }

    /// What `pickle` and `copy` make it again from.
    fn __getnewargs__(&self) -> (Display, Observer) {
        (self.display(), self.observer())
    }

    fn __repr__(&self) -> String {
        format!("Viewing({}, {})", self.display().__repr__(), self.observer().__repr__())
    }
}

/// The viewing given, or the median observer at a desktop display.
pub(crate) fn or_default(viewing: Option<&Viewing>) -> display::Viewing {
    viewing.map_or_else(display::Viewing::default, |viewing| viewing.0.clone())
}
