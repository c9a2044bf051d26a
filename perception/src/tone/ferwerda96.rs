//! Ferwerda, Pattanaik, Shirley and Greenberg's operator of rods and cones, 1996.
//!
//! For dim scenes and what is just visible in them. Not for scenes of more range than the display's: light is scaled,
//! and what is too bright is clipped. Acuity is that of the whole view.

use super::acuity::AcuityFilter;
use super::duplex::{DuplexLaw, FittedDuplex, RodWeight, adapted};
use super::field::{AdaptationScope, LocalAdaptation};
use super::time::AdaptationState;
use super::{Effects, FittedTone, SceneGuide, ToneOperator};
use crate::display::Viewing;

/// Keeps thresholds of rods and of cones, each by its own law; what rods see has no colour, and what the eye does not
/// resolve in dim light is blurred.
///
/// "A model of visual adaptation for realistic image synthesis", SIGGRAPH 1996. `L_d` = `m_p` L + k `m_s` V with
/// `m_p` = `T_p`(`L_da`) / `T_p`(`L_wa`) and `m_s` = `T_p`(`L_da`) / `T_s`(`L_wa`), `L_da` half the display's white:
/// the display is looked at with cones. (Some implementations have `T_s`(`L_da`) there, which is 6.5 times brighter.)
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ferwerda96 {
    /// Multiplies the result: 2^stops.
    pub exposure: f64,
    /// Whether the eye is adapted to the view as a whole or to each place.
    pub scope: AdaptationScope,
    /// Whether fine detail is lost in dim light.
    pub acuity: bool,
}

impl ToneOperator for Ferwerda96 {
    fn name(&self) -> &'static str {
        "ferwerda96"
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

    fn optional_effects(&self) -> Effects {
        Effects { acuity: true, ..Effects::default() }
    }

    fn fit(&self, guide: &SceneGuide<'_>, viewing: &Viewing, state: Option<&AdaptationState>) -> Box<dyn FittedTone> {
        Box::new(self.fit_duplex(guide, viewing, state))
    }
}

impl Ferwerda96 {
    fn fit_duplex(&self, guide: &SceneGuide<'_>, viewing: &Viewing, state: Option<&AdaptationState>) -> FittedDuplex {
        let density = viewing.display.pixel_density();
        let white_cd_m2 = viewing.display.white_cd_m2.max(f64::MIN_POSITIVE);
        let world = adapted(guide, density, state);
        let weight = RodWeight::LogRamp;
        FittedDuplex {
            operator: self.name().to_owned(),
            exposure: self.exposure,
            white_cd_m2,
            weight,
            rod_tint: [1.0; 3],
            world,
            law: DuplexLaw::between(world, white_cd_m2 / 2.0, weight),
            local: LocalAdaptation::of(guide, self.scope, &viewing.display),
            acuity: self.acuity.then(|| AcuityFilter::for_adaptation(world.cones_cd_m2, viewing)).flatten(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::field::Adapted;
    use super::*;
    use crate::display::Display;
    use crate::plane::Plane;
    use crate::test_golden::check;
    use crate::tvi;

    fn law(adaptation: f64) -> DuplexLaw {
        let scene = Adapted { cones_cd_m2: adaptation, rods_cd_m2: adaptation };
        DuplexLaw::between(scene, 50.0, RodWeight::LogRamp)
    }

    #[test]
    fn golden_scales_and_weights() {
        check("fpsg_mp_Lda50", 1e-6, |row| law(row[0]).cone_scale);
        check("fpsg_ms_TpLda50_over_Ts", 1e-6, |row| law(row[0]).rod_scale);
        for (adaptation, expected) in [(0.01, 0.848_485), (0.1, 0.545_455), (1.0, 0.242_424), (5.0, 0.030_615)] {
            assert!((law(adaptation).rod_weight - expected).abs() < 1e-6, "{adaptation}");
        }
        assert!(law(10.0).rod_weight.abs() < 1e-12 && law(1e-6).rod_weight <= 1.0);
    }

    /// A step of one threshold in the scene is a step of one threshold on the display, for each kind of receptor by
    /// its law.
    #[test]
    fn thresholds_are_kept() {
        let viewing = Viewing::of(Display { white_cd_m2: 100.0, black_cd_m2: 0.0, ..Display::default() });
        for adaptation in [0.001_f64, 0.1, 1.0, 10.0, 1000.0] {
            let guide = Plane::filled(8, 8, adaptation as f32);
            let operator = Ferwerda96 { exposure: 1.0, scope: AdaptationScope::World, acuity: true };
            let fit = operator.fit_duplex(&SceneGuide::of(&guide), &viewing, None);
            let shown = |law: DuplexLaw, light: f64| {
                let fit = FittedDuplex { law, ..fit.clone() };
                100.0 * f64::from(fit.relative_luminance(light as f32))
            };
            let cones = DuplexLaw { rod_weight: 0.0, ..fit.law };
            let step = shown(cones, adaptation + tvi::photopic(adaptation)) - shown(cones, adaptation);
            assert!((step / tvi::photopic(50.0) - 1.0).abs() < 0.01, "cones at {adaptation}: {step}");
            let rods = DuplexLaw { cone_scale: 0.0, rod_weight: 1.0, ..fit.law };
            let step = shown(rods, adaptation + tvi::scotopic(adaptation)) - shown(rods, adaptation);
            assert!((step / tvi::photopic(50.0) - 1.0).abs() < 0.01, "rods at {adaptation}: {step}");
        }
    }

    #[test]
    fn night_has_no_colour_and_day_keeps_it() {
        let viewing = Viewing::default();
        let saturation = |adaptation: f32| {
            let guide = Plane::filled(8, 8, adaptation);
            let fit = Ferwerda96 { exposure: 1.0, scope: AdaptationScope::World, acuity: true }.fit(
                &SceneGuide::of(&guide),
                &viewing,
                None,
            );
            let shown = fit.map_rgb([2.0 * adaptation, adaptation, 0.5 * adaptation].map(|c| 0.2 * c));
            (shown[0] - shown[2]) / shown[0]
        };
        assert!(saturation(1e-3) < 0.05 && saturation(100.0) > 0.7, "{} {}", saturation(1e-3), saturation(100.0));
    }

    #[test]
    fn a_black_night_is_blurred_and_day_is_not() {
        let fit = |adaptation: f32| {
            let guide = Plane::filled(8, 8, adaptation);
            Ferwerda96 { exposure: 1.0, scope: AdaptationScope::World, acuity: true }.fit(
                &SceneGuide::of(&guide),
                &Viewing::default(),
                None,
            )
        };
        assert!(fit(0.01).acuity().is_some() && fit(100.0).acuity().is_none());
    }
}
