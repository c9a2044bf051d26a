//! Displays, observers, and who looks at what.

use fechner_perception::display::Glare;
use fechner_perception::{Eotf, Error, display};
use pyo3::prelude::*;

use crate::errors::value_error;

/// A display at its viewing distance: a preset, with fields of its own where they are given.
///
/// Fields: pixels_per_degree (of visual angle, along a row), pixel_aspect_ratio (width over height of a pixel), white_cd_m2,
/// black_cd_m2, ambient_cd_m2 (room light off the screen), eotf ("srgb", "bt1886", "pq", "linear"), distance_m,
/// csf_area_deg2, frames_per_second, persistence. ValueError for an unknown preset and for values that no display has.
#[pyclass(frozen, module = "fechner")]
pub(crate) struct Display(pub(crate) display::Display);

#[pymethods]
impl Display {
    #[new]
    #[pyo3(signature = (
        preset = "desktop", *, pixels_per_degree = None, pixel_aspect_ratio = None, white_cd_m2 = None, black_cd_m2 = None,
        ambient_cd_m2 = None, eotf = None, distance_m = None, csf_area_deg2 = None, frames_per_second = None, persistence = None
    ))]
    #[expect(clippy::too_many_arguments, reason = "keyword arguments of Python")]
    fn new(
        preset: &str,
        pixels_per_degree: Option<f64>,
        pixel_aspect_ratio: Option<f64>,
        white_cd_m2: Option<f64>,
        black_cd_m2: Option<f64>,
        ambient_cd_m2: Option<f64>,
        eotf: Option<&str>,
        distance_m: Option<f64>,
        csf_area_deg2: Option<f64>,
        frames_per_second: Option<f64>,
        persistence: Option<f64>,
    ) -> PyResult<Self> {
        let base = named_display(preset)?;
        let display = display::Display {
            pixels_per_degree: pixels_per_degree.unwrap_or(base.pixels_per_degree),
            pixel_aspect_ratio: pixel_aspect_ratio.unwrap_or(base.pixel_aspect_ratio),
            white_cd_m2: white_cd_m2.unwrap_or(base.white_cd_m2),
            black_cd_m2: black_cd_m2.unwrap_or(base.black_cd_m2),
            ambient_cd_m2: ambient_cd_m2.unwrap_or(base.ambient_cd_m2),
            eotf: eotf.map_or(Ok(base.eotf), named_eotf)?,
            distance_m: distance_m.or(base.distance_m),
            csf_area_deg2: csf_area_deg2.or(base.csf_area_deg2),
            frames_per_second: frames_per_second.unwrap_or(base.frames_per_second),
            persistence: persistence.unwrap_or(base.persistence),
            name: base.name,
        };
        display.check().map_err(value_error)?;
        Ok(Self(display))
    }

    /// The names of the presets.
    #[staticmethod]
    fn presets() -> Vec<&'static str> {
        display::Display::preset_names().to_vec()
    }

    /// Luminance, cd/m², that the display shows for linear light 0..1 (clamped).
    fn luminance_cd_m2(&self, relative: f64) -> f64 {
        self.0.luminance_cd_m2(relative)
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

    fn __repr__(&self) -> String {
        let display = &self.0;
        format!(
            "Display({:?}, pixels_per_degree={}, white_cd_m2={}, black_cd_m2={}, ambient_cd_m2={})",
            display.name, display.pixels_per_degree, display.white_cd_m2, display.black_cd_m2, display.ambient_cd_m2
        )
    }
}

fn named_display(name: &str) -> PyResult<display::Display> {
    display::Display::preset(name).ok_or_else(|| unknown("display preset", name, display::Display::preset_names()))
}

fn named_eotf(name: &str) -> PyResult<Eotf> {
    const NAMES: [(&str, Eotf); 4] =
        [("srgb", Eotf::Srgb), ("bt1886", Eotf::Bt1886), ("pq", Eotf::Pq), ("linear", Eotf::Linear)];
    let found = NAMES.iter().find(|(known, _)| *known == name);
    found.map(|(_, eotf)| *eotf).ok_or_else(|| unknown("transfer function", name, &NAMES.map(|(name, _)| name)))
}

/// That `name` is nothing, and what there is.
pub(crate) fn unknown(kind: &'static str, name: &str, known: &[&str]) -> PyErr {
    value_error(Error::UnknownName { kind, name: name.to_owned(), known: known.join(", ") })
}

/// The eye: sensitivity (1 is the median observer, 1.75 a keen one), csf_area_deg2 (area of the grating whose threshold is
/// meant, deg²), glare_age_years (light scattered in an eye of this age; None scatters none).
#[pyclass(frozen, module = "fechner")]
pub(crate) struct Observer(display::Observer);

#[pymethods]
impl Observer {
    #[new]
    #[pyo3(signature = (sensitivity = 1.0, csf_area_deg2 = 1.0, glare_age_years = None))]
    fn new(sensitivity: f64, csf_area_deg2: f64, glare_age_years: Option<f64>) -> PyResult<Self> {
        let glare = glare_age_years.map_or(Glare::None, |age_years| Glare::Cie { age_years });
        let observer = display::Observer { sensitivity, csf_area_deg2, glare };
        display::Viewing { observer: observer.clone(), ..display::Viewing::default() }.check().map_err(value_error)?;
        Ok(Self(observer))
    }

    /// 1.75 times the median sensitivity.
    #[staticmethod]
    fn keen() -> Self {
        Self(display::Observer::keen())
    }

    /// Multiplies contrast sensitivity.
    #[getter]
    fn sensitivity(&self) -> f64 {
        self.0.sensitivity
    }

    /// Area of the grating whose threshold is meant, deg².
    #[getter]
    fn csf_area_deg2(&self) -> f64 {
        self.0.csf_area_deg2
    }

    fn __repr__(&self) -> String {
        format!("Observer(sensitivity={}, csf_area_deg2={})", self.0.sensitivity, self.0.csf_area_deg2)
    }
}

/// Who looks at what. `display` is a Display or a preset's name; without an observer it is the one the display asks for.
#[pyclass(frozen, module = "fechner")]
pub(crate) struct Viewing(pub(crate) display::Viewing);

#[derive(FromPyObject)]
enum DisplayOrName<'py> {
    Display(Bound<'py, Display>),
    Name(String),
}

#[pymethods]
impl Viewing {
    #[new]
    #[pyo3(signature = (display = None, observer = None))]
    fn new(display: Option<DisplayOrName<'_>>, observer: Option<&Observer>) -> PyResult<Self> {
        let display = match display {
            None => display::Display::default(),
            Some(DisplayOrName::Display(display)) => display.get().0.clone(),
            Some(DisplayOrName::Name(name)) => named_display(&name)?,
        };
        let mut viewing = display::Viewing::of(display);
        if let Some(observer) = observer {
            viewing.observer = observer.0.clone();
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
        Observer(self.0.observer.clone())
    }

    fn __repr__(&self) -> String {
        format!("Viewing({}, {})", self.display().__repr__(), self.observer().__repr__())
    }
}

/// The viewing given, or the median observer at a desktop display.
pub(crate) fn or_default(viewing: Option<&Viewing>) -> display::Viewing {
    viewing.map_or_else(display::Viewing::default, |viewing| viewing.0.clone())
}
