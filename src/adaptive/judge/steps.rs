//! The steps of a look, each of what was found before it: guide and tone, scatter, thresholds, and what chromatic noise
//! shows. Their order, and what becomes of the results, is left to `judge`.

use super::super::denoised::TimedDenoising;
use super::super::missed::{Darkness, EdgeProfile, FoundLight, LampEdges};
use super::super::settings::LoopSettings;
use super::super::small_things::unmet_noise;
use super::super::statistics::{SampleStatistics, by_channel, scene_units};
use super::noise_on_display::{NoiseOnDisplay, difference_on_display, variance_shares};
use super::{JudgeError, check_cancelled, guide_rgb};
use crate::film::{CHANNELS, Estimate, Film};
use crate::sampler::Half;
use fechner_perception::Plane;
use fechner_perception::colour::ChromaticGains;
use fechner_perception::csf::{CastleCsf, ContrastSensitivity, FrameTiming, FreshNoise};
use fechner_perception::model::{ModelInputs, ThresholdModel};
use fechner_perception::seen::{self, SceneColours};
use fechner_perception::threshold::{GuideNoise, ThresholdInputs, ThresholdMap, threshold_map};
use fechner_perception::tone::acuity::BehindAcuity;
use fechner_perception::tone::{FittedTone, Pixel, SceneLight, coloured};
use std::borrow::Cow;

/// The picture without its noise, from which the rest of a look is made: denoised for output where it is, else for
/// this.
pub(super) struct Guide<'a> {
    rgb_cd_m2: Cow<'a, [[f32; 3]]>,
    light: SceneLight,
}

impl<'a> Guide<'a> {
    pub(super) fn of(
        film: &Film,
        estimate: &Estimate,
        denoised: Option<&'a TimedDenoising>,
        settings: &LoopSettings,
    ) -> Self {
        let rgb_cd_m2 = match denoised {
            Some(found) => Cow::Borrowed(&found.film.rgb_cd_m2[..]),
            None => Cow::Owned(guide_rgb(film, estimate)),
        };
        let light = SceneLight::of(settings.operator.as_ref(), film.width() as usize, &rgb_cd_m2);
        Self { rgb_cd_m2, light }
    }

    pub(super) fn luminance_cd_m2(&self) -> &Plane {
        self.light.luminance_cd_m2()
    }

    /// Luminance of the guide on the display, cd/m².
    pub(super) fn displayed(&self, tone: &dyn FittedTone, settings: &LoopSettings) -> Plane {
        seen::display_luminance(tone, &settings.viewing.display, self.luminance_cd_m2())
    }

    /// The operator's fit, one that was made elsewhere, or to this; for luminance of this picture's colours, unless it
    /// is denoised.
    pub(super) fn tone(&self, settings: &LoopSettings) -> Box<dyn FittedTone> {
        let fitted = match &settings.fitted {
            Some(fitted) => fitted.clone().restore(),
            None => settings.operator.fit(&self.light.guide(), &settings.viewing, None),
        };
        match &self.rgb_cd_m2 {
            // What is judged of a denoised picture are planes of luminance and of tints on greys.
            Cow::Borrowed(_) => fitted,
            Cow::Owned(rgb) => coloured(fitted, self.luminance_cd_m2().width(), rgb),
        }
    }
}

/// How the samples scatter on the display, (cd/m²)².
pub(super) struct Scatter {
    /// [`variance_shares`].
    shares: Plane,
    /// [`seen::display_chromatic_slope`] of the guide.
    chromatic_slope: Plane,
    /// Displayed over scene variance by channel, at the size that variances have now:
    /// [`super::display_scale`], with inflation.
    scales: [Plane; CHANNELS],
    statistics: SampleStatistics,
}

impl Scatter {
    pub(super) fn of(
        film: &Film,
        guide: &Guide<'_>,
        tone: &dyn FittedTone,
        settings: &LoopSettings,
        inflation: f64,
    ) -> Self {
        let shares = variance_shares(film);
        let luminance = guide.luminance_cd_m2();
        let chromatic_slope = seen::display_chromatic_slope(tone, &settings.viewing.display, luminance);
        let colours = SceneColours { rgb: &guide.rgb_cd_m2, chromatic_slope: &chromatic_slope };
        let noise = NoiseOnDisplay { shares: &shares, colours, tone, settings, inflation };
        let (scales, difference) = rayon::join(
            || noise.scales(luminance, |pixel| film.halves(pixel).sample_variances()),
            || difference_on_display(film, luminance, colours, tone, settings),
        );
        let statistics = SampleStatistics::of_displayed(film, &scales, &difference);
        Self { shares, chromatic_slope, scales, statistics }
    }

    /// Scatter of a film that holds what is displayed.
    pub(super) fn of_display_light(film: &Film) -> Self {
        let scales = scene_units(film);
        let statistics = SampleStatistics::of(film, &scales);
        let chromatic_slope = Plane::filled(film.width() as usize, film.height() as usize, 1.0);
        Self { shares: variance_shares(film), chromatic_slope, scales, statistics }
    }

    /// Displayed over scene variance by channel.
    pub(super) fn scales(&self) -> &[Plane; CHANNELS] {
        &self.scales
    }

    /// Displayed over scene variance of luminance, per pixel.
    pub(super) fn luminance_scale(&self) -> &Plane {
        &self.scales[0]
    }

    /// Variance of each pixel's mean of which this is one sample's.
    pub(super) fn of_mean(&self, per_sample: &Plane) -> Plane {
        per_sample.combined(&self.shares, |sample, share| sample * share)
    }

    /// Displayed over scene variance by channel for what each half decides by: of the other half's light and noise. By
    /// both halves', pixels that were lucky go beyond white, show no noise and stop, and the others go on until they
    /// are lucky, too. Measured by both: a thin tube of light makes a picture 2.75 % too bright
    /// (`benches/results/energy.md`). Of both are still which pixels shine, how many samples there are, the guide's
    /// hues and what the operator leaves of tints on it, and what is seen over white. `lights`: of the halves.
    pub(super) fn scales_of_halves(
        &self,
        film: &Film,
        guide: &Guide<'_>,
        lights: &[FoundLight; 2],
        tone: &dyn FittedTone,
        settings: &LoopSettings,
        inflation: f64,
    ) -> [[Plane; CHANNELS]; 2] {
        let colours = SceneColours { rgb: &guide.rgb_cd_m2, chromatic_slope: &self.chromatic_slope };
        let noise = NoiseOnDisplay { shares: &self.shares, colours, tone, settings, inflation };
        Half::BOTH.map(|half| {
            let other = half.other();
            let variances = |pixel: usize| std::array::from_fn(|c| film.half(other)[pixel].sample_variance(c));
            noise.scales(&lights[other.index()].mean_cd_m2, variances)
        })
    }

    /// What lamps' rims, and known lamps that few samples met, may hide where so much light was found; `None` where no
    /// lamps are known, and the pixel filter tells of no neighbour.
    pub(super) fn missed_noise(
        &self,
        film: &Film,
        found: &FoundLight,
        tone: &dyn FittedTone,
        settings: &LoopSettings,
    ) -> Option<MissedNoise> {
        // A lamp's light has not the colour of what is beside it.
        let tone = tone.without_colours().unwrap_or(tone);
        let shown =
            |pixel: Pixel, light: f32| seen::display_luminance_at(tone, &settings.viewing.display, pixel, light);
        let at_rims = EdgeProfile::of(settings.filter).map(|profile| {
            let edges = LampEdges { profile, film, found, lamps_from_cd_m2: 0.0 };
            let whole = |pixel: Pixel, light: f32| shown(pixel, found.mean_cd_m2.get(pixel.x, pixel.y) + light);
            Darkness::of(&edges.expected(), whole).mean_square
        });
        let of_known = unmet_noise(film, found, settings.nits_per_unit, shown);
        let mean_square = match (at_rims, of_known) {
            (Some(at_rims), Some(of_known)) => at_rims.combined(&of_known, f32::max),
            (one, other) => one.or(other)?,
        };
        Some(MissedNoise(mean_square.combined(&self.shares, |square, share| square / share)))
    }

    pub(super) fn luminance_variance_of_mean(&self) -> Plane {
        self.of_mean(&self.statistics.luminance().stratified_variance())
    }

    /// [`super::Judgement::pooled_variance_per_sample`].
    pub(super) fn pooled_per_sample(&self, thresholds: &ThresholdMap, gains: Option<&ChromaticGains>) -> Plane {
        most_visible(thresholds, gains, |c| self.statistics.channels[c].stratified_variance())
    }

    /// [`super::Judgement::variance_per_sample`]. `scales`: [`Self::scales_of_halves`].
    pub(super) fn per_sample_of_halves(
        &self,
        film: &Film,
        scales: [&[Plane; CHANNELS]; 2],
        thresholds: &ThresholdMap,
        gains: Option<&ChromaticGains>,
    ) -> [Plane; 2] {
        Half::BOTH.map(|half| {
            let of_channel =
                |c: usize| self.statistics.stratified_variance_for_half(film, &scales[half.index()][c], half, c);
            most_visible(thresholds, gains, of_channel)
        })
    }
}

/// Variances of one sample that show as much as light of lamps that is expected beside them, (cd/m²)² on the display.
/// Samples alone tell no variance of pixels that lamps cover by a hundredth, among neighbours that are unlike them, and
/// no audit raises them, since no variance is found to be wrong. Measured without: globes on black are taken to be done
/// at 5 times the visibility that is asked for.
pub(super) struct MissedNoise(Plane);

impl MissedNoise {
    /// The mean of both.
    pub(super) fn mean(&self, other: &Self) -> Self {
        Self(self.0.combined(&other.0, |a, b| 0.5 * (a + b)))
    }

    /// The larger of a scatter and this.
    pub(super) fn or_scatter(&self, per_sample: &Plane) -> Plane {
        per_sample.combined(&self.0, f32::max)
    }
}

/// Luminance variance that shows as much as the most visible channel's: luminance's own where the others have no gains.
fn most_visible(
    thresholds: &ThresholdMap,
    gains: Option<&ChromaticGains>,
    variance_of_channel: impl Fn(usize) -> Plane + Sync,
) -> Plane {
    match gains {
        None => variance_of_channel(0),
        Some(gains) => thresholds.luminance_equivalent_variance(gains, by_channel(variance_of_channel).each_ref()),
    }
}

/// What a picture hides, cd/m² on the display, without importance.
#[derive(Debug)]
pub struct Thresholds {
    /// Thresholds from the guide, by contrast sensitivity in bands.
    pub in_bands: ThresholdMap,
    /// Standard error that a pixel may have at visibility 1 by the model that drives the loop, where that is another
    /// one: a rule of its own for each pixel.
    pub per_pixel: Option<Plane>,
}

impl Thresholds {
    /// Visibility of a picture whose displayed luminance has this variance, (cd/m²)².
    pub(super) fn visibility(&self, display_variance: &Plane) -> Plane {
        match &self.per_pixel {
            None => self.in_bands.predicted_visibility(display_variance),
            Some(allowed) => display_variance.combined(allowed, |variance, allowed| variance.sqrt() / allowed),
        }
    }

    /// Standard error that a pixel may have at visibility 1, cd/m².
    pub(super) fn limits(&self) -> Plane {
        match &self.per_pixel {
            None => self.in_bands.allowed_standard_error_cd_m2(1.0),
            Some(allowed) => allowed.clone(),
        }
    }
}

/// [`super::Judgement::thresholds`]. `displayed_guide`: the guide's luminance on the display. `noise`: variance of the
/// mean's, before denoising.
pub(super) fn found_thresholds(
    guide: &Guide<'_>,
    displayed_guide: &Plane,
    tone: &dyn FittedTone,
    noise: &Plane,
    settings: &LoopSettings,
) -> Result<Thresholds, JudgeError> {
    let csf = contrast_sensitivity(settings.frames, tone, settings)?;
    let in_bands = in_pursuit(of_resting_eye(&csf, displayed_guide, noise, settings)?, guide, tone, settings)?;
    check_cancelled(settings)?;
    let of_model = |model: &dyn ThresholdModel| {
        model.allowed_standard_error_cd_m2(&ModelInputs {
            display_luminance_cd_m2: displayed_guide,
            guide_noise: GuideNoise::BeforeDenoising(noise),
            image_velocity_deg_s: None,
            attention: None,
            viewing: &settings.viewing,
            csf: &csf,
        })
    };
    let per_pixel = settings.model.as_deref().map(of_model).transpose()?;
    Ok(Thresholds { in_bands, per_pixel })
}

/// The thresholds of what stands still, where [`found_thresholds`] are of noise that is new in every frame: `None` of a
/// still. Arguments as there.
pub(super) fn thresholds_of_still(
    displayed_guide: &Plane,
    tone: &dyn FittedTone,
    noise: &Plane,
    settings: &LoopSettings,
) -> Result<Option<ThresholdMap>, JudgeError> {
    if settings.frames.is_none() {
        return Ok(None);
    }
    let csf = contrast_sensitivity(None, tone, settings)?;
    of_resting_eye(&csf, displayed_guide, noise, settings).map(Some)
}

/// Thresholds where one looks, and away from there.
fn of_resting_eye(
    csf: &dyn ContrastSensitivity,
    displayed_guide: &Plane,
    noise: &Plane,
    settings: &LoopSettings,
) -> Result<ThresholdMap, JudgeError> {
    let guide_noise = GuideNoise::BeforeDenoising(noise);
    let inputs = ThresholdInputs { display_luminance_cd_m2: displayed_guide, guide_noise };
    let thresholds = threshold_map(&inputs, &settings.viewing, csf)?;
    Ok(if settings.gazes.is_empty() { thresholds } else { thresholds.with_gazes(&settings.gazes) })
}

/// Thresholds on what the eye does not follow.
fn in_pursuit(
    thresholds: ThresholdMap,
    guide: &Guide<'_>,
    tone: &dyn FittedTone,
    settings: &LoopSettings,
) -> Result<ThresholdMap, JudgeError> {
    let (Some(pursuit), Some(timing)) = (&settings.pursuit, settings.frames) else { return Ok(thresholds) };
    let size = (guide.luminance_cd_m2().width(), guide.luminance_cd_m2().height());
    let eye = pursuit.eye_velocity_deg_s(&guide.rgb_cd_m2, size, tone, &settings.viewing.display)?;
    Ok(thresholds.with_pursuit(&eye, timing)?)
}

/// What noise in the chromatic channels shows; `None` by a model of luminance alone, which judges luminance alone.
pub(super) fn chromatic_gains(
    thresholds: &ThresholdMap,
    settings: &LoopSettings,
) -> Result<Option<ChromaticGains>, JudgeError> {
    Ok(match (&settings.model, settings.frames) {
        (Some(_), _) => None,
        (None, None) => Some(thresholds.chromatic_gains()?),
        (None, Some(timing)) => Some(thresholds.chromatic_gains_of_fresh_noise(timing)?),
    })
}

/// Sensitivity of the eye for noise that stands still, or that is new in every frame of such a timing. Noise goes
/// through the loss of acuity that the operator shows, as the picture does.
fn contrast_sensitivity(
    frames: Option<FrameTiming>,
    tone: &dyn FittedTone,
    settings: &LoopSettings,
) -> Result<BehindAcuity<Box<dyn ContrastSensitivity>>, JudgeError> {
    let area_deg2 = settings.viewing.observer.csf_area_deg2;
    let csf: Box<dyn ContrastSensitivity> = match frames {
        None => Box::new(CastleCsf::new(area_deg2)?),
        Some(timing) => Box::new(FreshNoise::new(area_deg2, timing)?),
    };
    Ok(BehindAcuity { csf, acuity: tone.acuity() })
}
