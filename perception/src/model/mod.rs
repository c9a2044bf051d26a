//! Threshold models: rules for how much noise a pixel may have, from the first idea to the default.
//!
//! All answer the same question, in the same unit: the standard error of a pixel's mean, in cd/m² on the display, at
//! which its noise is just at threshold. They differ in what they take into account.
//!
//! What they allow is noise. Not for bias, which all samples share and no standard error holds, as a denoiser leaves it
//! ([`crate::denoised`]).

mod ablation;
mod bolin_meyer;
mod csf_bands;
mod pyramid;
mod ramasubramanian;
mod tvi;
mod yee;

pub use ablation::{MaskedTvi, Unmasked};
pub use bolin_meyer::BolinMeyer;
pub use csf_bands::CsfBands;
pub use ramasubramanian::Ramasubramanian;
pub use tvi::Tvi;
pub use yee::Yee;

use crate::csf::ContrastSensitivity;
use crate::display::Viewing;
use crate::error::Error;
use crate::filter::gaussian_blur_xy;
use crate::names::{NamedTable, find, names_of};
use crate::plane::Plane;
use crate::table::UniformTable;
use crate::threshold::{GuideNoise, POOLING_SIGMA_DEG};

/// What a model may look at. All planes have one size.
#[derive(Clone, Copy)]
pub struct ModelInputs<'a> {
    /// Luminance of the denoised guide as the display shows it, cd/m².
    pub display_luminance_cd_m2: &'a Plane,
    /// What is known of the noise in the guide, variances in (cd/m²)².
    pub guide_noise: GuideNoise<&'a Plane>,
    /// Speed over the picture, deg/s, of what each pixel shows (see [`crate::motion::image_velocity_deg_s`]); `None`
    /// for a still. Only for error that travels with the object.
    pub image_velocity_deg_s: Option<&'a Plane>,
    /// How much each pixel attracts the gaze, 0..1 (see [`crate::saliency`]); `None` is 1: everything is followed.
    pub attention: Option<&'a Plane>,
    /// The eye, the display and its distance.
    pub viewing: &'a Viewing,
    /// Contrast sensitivity function of the eye; not every model asks it ([`ThresholdModel::knows_csf`]).
    pub csf: &'a dyn ContrastSensitivity,
}

impl ModelInputs<'_> {
    fn check(&self) -> Result<(), Error> {
        self.viewing.check()?;
        let guide = self.display_luminance_cd_m2;
        guide.check_luminance("display luminance")?;
        for (what, plane) in [
            ("guide variance", self.guide_noise.variance()),
            ("image velocity", self.image_velocity_deg_s),
            ("attention", self.attention),
        ] {
            if let Some(plane) = plane {
                plane.check_size(what, guide.width(), guide.height())?;
                plane.check_non_negative(what)?;
            }
        }
        Ok(())
    }

    /// Velocity over the retina, deg/s, at each pixel; `None` for a still.
    fn retinal_velocity_deg_s(&self) -> Option<Plane> {
        let velocity = self.image_velocity_deg_s?;
        Some(Plane::from_fn(velocity.width(), velocity.height(), |x, y| {
            let attention = self.attention.map_or(1.0, |attention| f64::from(attention.get(x, y)));
            crate::motion::retinal_velocity_deg_s(f64::from(velocity.get(x, y)), attention) as f32
        }))
    }
}

/// A rule for how much noise may remain.
pub trait ThresholdModel: Send + Sync {
    /// The model's name on the command line.
    fn name(&self) -> &'static str;

    /// Standard error of the pixel's mean, cd/m² on the display, at which noise is at threshold. Finite and positive.
    ///
    /// # Errors
    /// [`Error`] for planes of different sizes, values that are not finite or negative, and impossible viewings.
    fn allowed_standard_error_cd_m2(&self, inputs: &ModelInputs<'_>) -> Result<Plane, Error>;

    /// Whether [`ModelInputs::csf`] changes what it allows: not of models of intensity alone, nor of those with a
    /// function of their own.
    fn knows_csf(&self) -> bool {
        true
    }

    /// Whether [`ModelInputs::image_velocity_deg_s`] changes what it allows.
    fn knows_motion(&self) -> bool {
        false
    }

    /// Visibility of the noise in half of the difference of two independent pictures, cd/m² on the display: 1 where
    /// noise of what the model allows is expected to be.
    ///
    /// A model that knows only pixels gets the noise's energy pooled over a Gaussian of σ 0.25°, as the default's is;
    /// one that knows bands measures in them.
    ///
    /// # Errors
    /// As for [`ThresholdModel::allowed_standard_error_cd_m2`], and [`Error::SizeMismatch`] for a difference of
    /// another size.
    fn measured_visibility(&self, inputs: &ModelInputs<'_>, half_difference: &Plane) -> Result<Plane, Error> {
        let allowed = self.allowed_standard_error_cd_m2(inputs)?;
        half_difference.check_size("half difference", allowed.width(), allowed.height())?;
        let energy = half_difference.combined(&allowed, |difference, allowed| {
            let difference = finite_error(difference);
            let relative = difference / allowed;
            relative * relative
        });
        Ok(pooled(&energy, inputs.viewing).map(f32::sqrt))
    }
}

/// An error, 0 where it is no number, and no greater than that its energy, in threshold units, stays within `f32`.
pub(crate) fn finite_error(error_cd_m2: f32) -> f32 {
    const HOPELESS_CD_M2: f32 = 1e9;
    if error_cd_m2.is_finite() { error_cd_m2.clamp(-HOPELESS_CD_M2, HOPELESS_CD_M2) } else { 0.0 }
}

/// Energy over a Gaussian of σ 0.25°.
fn pooled(energy: &Plane, viewing: &Viewing) -> Plane {
    gaussian_blur_xy(energy, viewing.display.pixel_density().pixels(POOLING_SIGMA_DEG))
}

/// Two-sided 95 % of a normal distribution, its quantile of 0.975 (1.959 96) as tables round it: models that stop on
/// a confidence interval ask z σ ≤ T.
const Z_95: f64 = 1.96;

/// Name of the model that is meant where none is named, and the only one that knows denoised pictures and where one
/// looks.
pub const DEFAULT: &str = "csf-bands";

/// Makes a model with its defaults.
type Constructor = fn() -> Box<dyn ThresholdModel>;

/// All models, in the order in which they are listed.
const MODELS: NamedTable<Constructor, 7> = [
    (DEFAULT, || Box::new(CsfBands)),
    ("ramasubramanian", || Box::new(Ramasubramanian::default())),
    ("yee", || Box::new(Yee::default())),
    ("bolin-meyer", || Box::new(BolinMeyer)),
    ("tvi", || Box::new(Tvi::default())),
    ("csf-unmasked", || Box::new(Unmasked)),
    ("tvi-masked", || Box::new(MaskedTvi)),
];

const NAMES: [&str; MODELS.len()] = names_of(&MODELS);

/// The names that [`by_name`] knows; the first is [`DEFAULT`].
#[must_use]
pub fn names() -> &'static [&'static str] {
    &NAMES
}

/// The threshold model of that name, with its defaults; `None` where there is none.
///
/// ```
/// use fechner_perception::model;
/// assert_eq!(model::by_name("yee").unwrap().name(), "yee");
/// assert!(model::by_name("guess").is_none());
/// ```
#[must_use]
pub fn by_name(name: &str) -> Option<Box<dyn ThresholdModel>> {
    find(&MODELS, name).map(|constructor| constructor())
}

/// The threshold model of a name that somebody has given: [`by_name`], with an error instead of `None`.
///
/// # Errors
/// [`Error::UnknownName`], which lists those that there are.
pub fn named(name: &str) -> Result<Box<dyn ThresholdModel>, Error> {
    by_name(name).ok_or_else(|| Error::unknown_name("threshold model", name, names()))
}

/// A function of adaptation luminance, asked once on a fine grid instead of once a pixel.
struct PerLuminance(UniformTable);

impl PerLuminance {
    const LOWEST_DECADE: f32 = -4.0;
    const DECADES: f32 = 12.0;
    const ENTRIES_PER_DECADE: f32 = 16.0;

    /// `value_at(luminance in cd/m²)` must be positive.
    fn new(value_at: impl Fn(f64) -> f64) -> Self {
        let last = (Self::DECADES * Self::ENTRIES_PER_DECADE) as usize;
        Self(UniformTable::new((0..=last).map(|index| {
            let decade = Self::LOWEST_DECADE + index as f32 / Self::ENTRIES_PER_DECADE;
            value_at(10.0_f64.powf(f64::from(decade))).max(1e-30).ln() as f32
        })))
    }

    fn at(&self, luminance_cd_m2: f32) -> f32 {
        self.0.at((luminance_cd_m2.max(1e-4).log10() - Self::LOWEST_DECADE) * Self::ENTRIES_PER_DECADE).exp()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::csf::CastleCsf;
    use crate::test_noise::normal;

    fn picture() -> Plane {
        Plane::from_fn(160, 96, |x, y| {
            let texture = if x > 80 { 0.5 * (x as f32 * 0.42).cos() * (y as f32 * 0.42).cos() } else { 0.0 };
            50.0 * (1.0 + texture)
        })
    }

    fn ask(name: &str, guide: &Plane, velocity: Option<&Plane>) -> Plane {
        let viewing = Viewing::default();
        let inputs = ModelInputs {
            display_luminance_cd_m2: guide,
            guide_noise: GuideNoise::Clean,
            image_velocity_deg_s: velocity,
            attention: None,
            viewing: &viewing,
            csf: &CastleCsf::default(),
        };
        by_name(name).unwrap().allowed_standard_error_cd_m2(&inputs).unwrap()
    }

    /// What a model says it knows is what changes its thresholds.
    #[test]
    fn models_know_whether_they_ask_the_contrast_sensitivity_function() {
        let (guide, viewing) = (picture(), Viewing::default());
        for model in names().iter().filter_map(|name| by_name(name)) {
            let by = |csf: &dyn ContrastSensitivity| {
                let inputs = ModelInputs {
                    display_luminance_cd_m2: &guide,
                    guide_noise: GuideNoise::Clean,
                    image_velocity_deg_s: None,
                    attention: None,
                    viewing: &viewing,
                    csf,
                };
                model.allowed_standard_error_cd_m2(&inputs).unwrap()
            };
            let differs = by(&CastleCsf::default()) != by(&crate::csf::MannosSakrison::default());
            assert_eq!(model.knows_csf(), differs, "{}", model.name());
        }
    }

    #[test]
    fn every_model_answers_every_picture() {
        let mut spike = Plane::filled(20, 10, 0.0);
        spike.values_mut()[30] = 1e8;
        for name in names() {
            for guide in [Plane::filled(1, 1, 0.0), Plane::filled(3, 2, 1e8), spike.clone(), picture()] {
                let fast = Plane::filled(guide.width(), guide.height(), 1e6);
                for velocity in [None, Some(&fast)] {
                    let allowed = ask(name, &guide, velocity);
                    assert!(
                        allowed.values().iter().all(|value| value.is_finite() && *value > 0.0),
                        "{name} on {}×{}",
                        guide.width(),
                        guide.height()
                    );
                }
            }
        }
    }

    #[test]
    fn texture_and_motion_raise_thresholds_in_the_models_that_know_them() {
        let guide = picture();
        let moving = Plane::filled(160, 96, 20.0);
        for (name, knows_texture, knows_motion) in [
            ("csf-bands", true, true),
            ("ramasubramanian", true, false),
            ("yee", true, true),
            ("bolin-meyer", true, false),
            ("tvi", false, false),
            ("csf-unmasked", false, false),
            ("tvi-masked", true, true),
        ] {
            let textured = ask(name, &guide, None).get(120, 48);
            let flat = ask(name, &Plane::filled(160, 96, 50.0), None).get(120, 48);
            assert_eq!(textured > 1.05 * flat, knows_texture, "{name}: flat {flat}, textured {textured}");
            let moved = ask(name, &guide, Some(&moving)).get(120, 48);
            assert_eq!(moved > 1.2 * textured, knows_motion, "{name}: still {textured}, moving {moved}");
            assert_eq!(by_name(name).unwrap().knows_motion(), knows_motion, "{name} says otherwise");
        }
    }

    /// What rounding leaves of a uniform picture is no contrast: the greys of codes 103 and 104 differ by 2 %.
    #[test]
    fn greys_side_by_side_have_thresholds_side_by_side() {
        for name in names() {
            let [darker, brighter] = [103, 104].map(|code: i32| {
                let light = crate::eotf::Eotf::Srgb.decode(f64::from(code) / 255.0, 200.0);
                let grey = Plane::filled(160, 120, (0.2 + 199.8 * light) as f32);
                ask(name, &grey, None).get(80, 60)
            });
            assert!((brighter / darker - 1.0).abs() < 0.03, "{name}: {darker} and {brighter} cd/m²");
        }
    }

    /// The eye sees little of fine noise: models that know bands measure it by them.
    #[test]
    fn models_of_bands_measure_noise_by_their_bands() {
        let grey = Plane::filled(160, 160, 50.0);
        let visibility = |name: &str, freq_cpd: f32| {
            let grating =
                Plane::from_fn(160, 160, |x, _| (std::f32::consts::TAU * freq_cpd * (x as f32 + 0.5) / 60.0).cos());
            let inputs = ModelInputs {
                display_luminance_cd_m2: &grey,
                guide_noise: GuideNoise::Clean,
                image_velocity_deg_s: None,
                attention: None,
                viewing: &Viewing::default(),
                csf: &CastleCsf::default(),
            };
            by_name(name).unwrap().measured_visibility(&inputs, &grating).unwrap().get(80, 80)
        };
        for freq_cpd in [4.0, 24.0] {
            let (full, unmasked) = (visibility(DEFAULT, freq_cpd), visibility("csf-unmasked", freq_cpd));
            assert!((unmasked / full - 1.0).abs() < 1e-3, "{freq_cpd} cpd: {unmasked}, not {full}");
        }
        let coarse_to_fine = |name| visibility(name, 4.0) / visibility(name, 24.0);
        assert!(coarse_to_fine("bolin-meyer") > 2.0, "{}", coarse_to_fine("bolin-meyer"));
        assert!((coarse_to_fine("tvi") - 1.0).abs() < 0.01);
    }

    /// White noise of what a model allows is at threshold by it; what moves hides noise from the models that know
    /// motion.
    #[test]
    fn noise_is_measured_by_the_models_own_thresholds() {
        let (grey, moving) = (Plane::filled(160, 96, 50.0), Plane::filled(160, 96, 20.0));
        let mut state = 3;
        let white: Vec<f32> = (0..160 * 96).map(|_| normal(&mut state)).collect();
        let white = Plane::from_values(160, 96, white).unwrap();
        for name in names() {
            let model = by_name(name).unwrap();
            let visibility = |guide: &Plane, velocity: Option<&Plane>| {
                let inputs = ModelInputs {
                    display_luminance_cd_m2: guide,
                    guide_noise: GuideNoise::Clean,
                    image_velocity_deg_s: velocity,
                    attention: None,
                    viewing: &Viewing::default(),
                    csf: &CastleCsf::default(),
                };
                let noise = white.combined(&ask(name, guide, None), |white, allowed| white * allowed);
                assert!(model.measured_visibility(&inputs, &Plane::filled(2, 2, 0.0)).is_err(), "{name}");
                model.measured_visibility(&inputs, &noise).unwrap().map(|v| v * v).mean().sqrt()
            };
            let still = visibility(&grey, None);
            assert!((still - 1.0).abs() < 0.1, "{name}: {still}");
            let [still, moved] = [None, Some(&moving)].map(|velocity| visibility(&picture(), velocity));
            assert_eq!(moved < 0.9 * still, model.knows_motion(), "{name}: still {still}, moving {moved}");
        }
    }

    #[test]
    fn a_uniform_picture_has_the_published_thresholds() {
        let grey = Plane::filled(64, 64, 50.0);
        let at = |name| ask(name, &grey, None).get(32, 32) * Z_95 as f32;
        assert!((at("ramasubramanian") - 0.409_201).abs() < 1e-3, "{}", at("ramasubramanian"));
        assert!((at("tvi") - 3.087_946).abs() < 1e-2, "{}", at("tvi"));
    }

    /// The largest errors that a pixel can hold are seen, beside it too.
    #[test]
    fn no_error_is_beyond_the_models() {
        let (grey, viewing) = (Plane::filled(64, 64, 0.0), Viewing::default());
        let mut error = Plane::filled(64, 64, 1.0);
        error.values_mut()[..2].copy_from_slice(&[f32::MAX, f32::MIN]);
        for name in names() {
            let inputs = ModelInputs {
                display_luminance_cd_m2: &grey,
                guide_noise: GuideNoise::Clean,
                image_velocity_deg_s: None,
                attention: None,
                viewing: &viewing,
                csf: &CastleCsf::default(),
            };
            let seen = by_name(name).unwrap().measured_visibility(&inputs, &error).unwrap();
            assert!(seen.values().iter().all(|v| v.is_finite() && *v > 1.0), "{name}: {:?}", &seen.values()[..9]);
        }
    }

    #[test]
    fn bad_inputs_are_errors() {
        let (guide, small) = (Plane::filled(4, 4, 1.0), Plane::filled(2, 2, 1.0));
        let viewing = Viewing::default();
        for name in names() {
            let inputs = ModelInputs {
                display_luminance_cd_m2: &guide,
                guide_noise: GuideNoise::Clean,
                image_velocity_deg_s: Some(&small),
                attention: None,
                viewing: &viewing,
                csf: &CastleCsf::default(),
            };
            assert!(by_name(name).unwrap().allowed_standard_error_cd_m2(&inputs).is_err());
        }
    }
}
