//! How fine a display is to the eye.

use serde::{Deserialize, Serialize};

/// Pixels a degree of visual angle along both axes.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct PixelDensity {
    /// Pixels a degree along a row.
    pub horizontal: f64,
    /// Pixels a degree along a column.
    pub vertical: f64,
}

impl PixelDensity {
    /// Density of square pixels, `pixels_per_degree` along both axes.
    #[must_use]
    pub fn square(pixels_per_degree: f64) -> Self {
        Self { horizontal: pixels_per_degree, vertical: pixels_per_degree }
    }

    /// Density of a picture with `scale` times the pixels along both axes.
    #[must_use]
    pub fn times(self, scale: f64) -> Self {
        Self { horizontal: scale * self.horizontal, vertical: scale * self.vertical }
    }

    /// Pixels along a row and along a column that `degrees` of visual angle take.
    ///
    /// ```
    /// use fechner_perception::display::PixelDensity;
    /// assert_eq!(PixelDensity { horizontal: 60.0, vertical: 30.0 }.pixels(0.5), [30.0, 15.0]);
    /// ```
    #[must_use]
    pub fn pixels(self, degrees: f64) -> [f64; 2] {
        [degrees * self.horizontal, degrees * self.vertical]
    }

    /// Pixels a degree along the finer axis.
    #[must_use]
    pub fn finest(self) -> f64 {
        self.horizontal.max(self.vertical)
    }

    /// Pixels a degree along the coarser axis.
    #[must_use]
    pub fn coarsest(self) -> f64 {
        self.horizontal.min(self.vertical)
    }

    /// The geometric mean, pixels a degree: that of square pixels of the same area.
    #[must_use]
    pub fn mean(self) -> f64 {
        (self.horizontal * self.vertical).sqrt()
    }
}
