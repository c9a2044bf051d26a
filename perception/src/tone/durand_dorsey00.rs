//! Durand and Dorsey's interactive operator, 2000: rods and cones that adapt over time.
//!
//! For walks through dim scenes. Not as a reference of the paper: its text could not be had, and its chromatic
//! adaptation and flare are left out.

use super::duplex::{DuplexLaw, FittedDuplex, RodWeight, adapted};
use super::field::{AdaptationScope, LocalAdaptation};
use super::time::{AdaptationState, Kinetics};
use super::{FittedTone, SceneGuide, ToneOperator};
use crate::display::Viewing;
use crate::photometry::luminance;

/// [`Ferwerda96`](super::Ferwerda96) for walkthroughs: rods that fade by Walraven and Valeton's law, see blue, and
/// adapt over time.
///
/// Durand and Dorsey, "Interactive tone mapping", Eurographics Workshop on Rendering 2000. The paper's text could not
/// be had. The weight and the tint are those that independent implementations agree on; for the time constants (0.1 s
/// for cones, 0.4 s for rods) there is no source at hand; its chromatic adaptation and flare are left out.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DurandDorsey00 {
    /// Multiplies the result: 2^stops.
    pub exposure: f64,
    /// Whether the eye is adapted to the view as a whole or to each place.
    pub scope: AdaptationScope,
}

/// What rods see, as the display shows it; brought to luminance 1 before use.
const BLUE: [f32; 3] = [1.05, 0.97, 1.27];

impl ToneOperator for DurandDorsey00 {
    fn name(&self) -> &'static str {
        "durand-dorsey00"
    }

    fn kinetics(&self) -> Kinetics {
        Kinetics::DURAND_DORSEY_2000
    }

    fn sees_adaptation(&self) -> bool {
        true
    }

    fn always_loses_colour(&self) -> bool {
        true
    }

    fn sees_rods(&self) -> bool {
        true
    }

    fn knows_places(&self) -> bool {
        true
    }

    fn fit(&self, guide: &SceneGuide<'_>, viewing: &Viewing, state: Option<&AdaptationState>) -> Box<dyn FittedTone> {
        let density = viewing.display.pixel_density();
        let white_cd_m2 = viewing.display.white_cd_m2.max(f64::MIN_POSITIVE);
        let world = adapted(guide, density, state);
        let weight = RodWeight::WalravenValeton;
        Box::new(FittedDuplex {
            operator: self.name().to_owned(),
            exposure: self.exposure,
            white_cd_m2,
            weight,
            rod_tint: BLUE.map(|channel| channel / luminance(BLUE)),
            world,
            law: DuplexLaw::between(world, white_cd_m2 / 2.0, weight),
            local: LocalAdaptation::of(guide, self.scope, &viewing.display),
            acuity: None,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::plane::Plane;

    #[test]
    fn golden_rod_weights() {
        let weights =
            [(0.1, 0.998_751), (1.0, 0.987_624), (5.0, 0.940_476), (10.0, 0.886_364), (100.0, 0.375), (400.0, 0.0)];
        for (adaptation, expected) in weights {
            let found = RodWeight::WalravenValeton.at(adaptation);
            assert!((found - expected).abs() < 1e-6, "{adaptation}: {found}");
        }
        assert!(RodWeight::WalravenValeton.at(1e6).abs() < 1e-12);
    }

    #[test]
    fn moonlight_is_blue() {
        let guide = Plane::filled(8, 8, 0.01);
        let operator = DurandDorsey00 { exposure: 1.0, scope: AdaptationScope::World };
        let fit = operator.fit(&SceneGuide::of(&guide), &Viewing::default(), None);
        let shown = fit.map_rgb([0.002; 3]);
        assert!(shown[2] > 1.15 * shown[0], "{shown:?}");
        assert!((luminance(shown) - fit.relative_luminance(0.002)).abs() < 1e-4);
    }
}
