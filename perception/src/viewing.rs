//! The eye, and the display that it looks at.

use serde::{Deserialize, Serialize};

use crate::csf::check_area_deg2;
use crate::display::Display;
use crate::error::{Error, check_range};

/// The eye that looks: how keen it is, what it is asked about and what it scatters.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Observer {
    /// Multiplies contrast sensitivity: 1 is the median observer of the model's data, 1.75 a keen one.
    pub sensitivity: f64,
    /// Area of the grating whose threshold is meant, deg². 1 is a foveal patch.
    pub csf_area_deg2: f64,
    /// Light scattered in the eye; [`Glare::None`] unless asked for.
    #[serde(default)]
    pub glare: Glare,
}

/// What the eye's own media do to bright light (see [`crate::glare`]).
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Glare {
    /// Nothing: thresholds beside lamps come out lower than they are, never higher.
    #[default]
    None,
    /// A veil by the CIE's general disability glare equation for an eye of this age.
    Cie {
        /// Age of the eye, years.
        age_years: f64,
    },
}

impl Observer {
    /// A keen observer: 1.75 times the median sensitivity.
    #[must_use]
    pub fn keen() -> Self {
        Self { sensitivity: 1.75, ..Self::default() }
    }
}

impl Default for Observer {
    /// The median observer, 1 deg².
    fn default() -> Self {
        Self { sensitivity: 1.0, csf_area_deg2: 1.0, glare: Glare::None }
    }
}

/// An eye in front of a display, for which every judgement of a picture is made.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Viewing {
    /// The display at its distance.
    pub display: Display,
    /// The eye in front of it.
    pub observer: Observer,
}

impl Viewing {
    /// A display with the observer it asks for (the preset `strict` asks for 7 deg²).
    #[must_use]
    pub fn of(display: Display) -> Self {
        let mut observer = Observer::default();
        observer.csf_area_deg2 = display.csf_area_deg2.unwrap_or(observer.csf_area_deg2);
        Self { display, observer }
    }

    /// Rejects a viewing with a field outside its range.
    ///
    /// # Errors
    /// [`Error::OutOfRange`], naming the field.
    pub fn check(&self) -> Result<(), Error> {
        self.display.check()?;
        if let Glare::Cie { age_years } = self.observer.glare {
            check_range("observer.glare.age_years", age_years, 1.0, 120.0, "between 1 and 120 years")?;
        }
        check_range("observer.sensitivity", self.observer.sensitivity, 1e-3, 1e3, "between 0.001 and 1000")?;
        check_area_deg2("observer.csf_area_deg2", self.observer.csf_area_deg2)
    }
}
