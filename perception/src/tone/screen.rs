//! Display luminances as the display's own linear light.

use serde::{Deserialize, Serialize};

use crate::display::Display;

/// What a display shows for 0 and for 1.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct Screen {
    /// Black and ambient light, cd/m²: what it cannot help showing.
    pub(super) black_cd_m2: f64,
    /// What it shows more for white, cd/m².
    pub(super) span_cd_m2: f64,
}

impl Screen {
    pub(super) fn of(display: &Display) -> Self {
        let black_cd_m2 = display.luminance_cd_m2(0.0);
        Self { black_cd_m2, span_cd_m2: (display.luminance_cd_m2(1.0) - black_cd_m2).max(f64::MIN_POSITIVE) }
    }

    /// A display's own light, without what it reflects of the room.
    pub(super) fn emitting(display: &Display) -> Self {
        let black_cd_m2 = display.emitted_cd_m2(0.0);
        Self { black_cd_m2, span_cd_m2: (display.emitted_cd_m2(1.0) - black_cd_m2).max(f64::MIN_POSITIVE) }
    }

    pub(super) fn white_cd_m2(self) -> f64 {
        self.black_cd_m2 + self.span_cd_m2
    }

    /// The light that shows this luminance; 0 below black and for NaN.
    pub(super) fn relative(self, shown_cd_m2: f64) -> f32 {
        finite((shown_cd_m2 - self.black_cd_m2) / self.span_cd_m2)
    }

    /// The light of one channel of a colour that shows this: less than 0 below black, NaN for NaN.
    pub(super) fn channel(self, shown_cd_m2: f64) -> f32 {
        ((shown_cd_m2 - self.black_cd_m2) / self.span_cd_m2) as f32
    }
}

/// At least 0, at most the largest `f32`; NaN becomes 0.
pub(super) fn finite(relative: f64) -> f32 {
    relative.max(0.0).min(f64::from(f32::MAX)) as f32
}
