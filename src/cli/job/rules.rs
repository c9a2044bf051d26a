//! How samples are spread and when they end: command line before scene before default, and what does not go together.

use super::JobArguments;
use super::choices::{AllocationChoice, Quality, SamplingChoice, SequenceChoice};
use crate::cli::seeing::{self, AskedPresentation, Presentation};
use anyhow::bail;
use fechner::adaptive::settings::{AllocationRule, Limits, LoopSettings, RivalRule, Sampling, THRESHOLD};
use fechner::checkpoint::SettingsRecord;
use fechner::sampler::PixelFilter;
use fechner::scene::Scene;
use fechner_perception::model;

/// How to sample and for whom: command line before scene before default.
pub(super) fn settings_record(arguments: &JobArguments, scene: &Scene) -> anyhow::Result<SettingsRecord> {
    let asked = AskedPresentation {
        display: arguments.display.as_deref(),
        operator: arguments.operator.as_deref(),
        exposure_stops: arguments.exposure,
    };
    let Presentation { display, operator, exposure_stops } = asked.of_scene(scene);
    let viewing = seeing::viewing_of_render(display, arguments.csf_area)?;
    if arguments.denoise.kind().is_some() && arguments.model != model::DEFAULT {
        bail!(
            "--denoise is for --model {}: {} cannot say what is seen of a denoised picture",
            model::DEFAULT,
            arguments.model
        );
    }
    let threshold = arguments.noise_threshold.unwrap_or(RivalRule::USUAL_THRESHOLD);
    let sampling = match arguments.sampling {
        SamplingChoice::Adaptive => Sampling::Adaptive,
        SamplingChoice::Uniform => Sampling::Uniform,
        SamplingChoice::Relative => Sampling::Rival(RivalRule::Relative { threshold }),
        SamplingChoice::Variance => Sampling::Rival(RivalRule::Variance { threshold }),
        SamplingChoice::Budget if !arguments.has_other_limit() => {
            bail!("--sampling budget has no stop of its own: add --spp, --time or --plans")
        }
        SamplingChoice::Budget => Sampling::Rival(RivalRule::Budget),
    };
    Ok(SettingsRecord {
        sampling,
        allocation: match arguments.allocation {
            None | Some(AllocationChoice::Convex) => AllocationRule::Convex,
            Some(AllocationChoice::Local) => AllocationRule::Local,
        },
        model: arguments.model.clone(),
        exposure_stops,
        denoiser: arguments.denoise.kind(),
        ..SettingsRecord::new(viewing, scene.nits_per_unit, operator)
    })
}

/// When to stop.
pub(super) fn limits(arguments: &JobArguments, scene: &Scene, sampling: Sampling) -> Limits {
    let asked = arguments.visibility.or(arguments.quality.map(Quality::visibility));
    Limits {
        visibility: visibility_limit(asked, scene, sampling, arguments.has_other_limit()),
        confidence: arguments.confidence.map(|per_cent| per_cent / 100.0),
        time: arguments.time,
        mean_samples: arguments.spp,
        max_samples: arguments.max_spp,
        plans: arguments.plans,
        pilot_samples: arguments.denoise.pilot_samples(),
    }
}

/// The visibility to stop at: command line before scene before threshold. `None` where only other limits or rules end
/// it.
pub(in crate::cli) fn visibility_limit(
    asked: Option<f64>,
    scene: &Scene,
    sampling: Sampling,
    has_other_limit: bool,
) -> Option<f64> {
    match sampling {
        // A uniform render of so many samples, seconds or plans is what was asked for, not an early end.
        Sampling::Uniform if has_other_limit => asked,
        // They do not look at what is seen.
        Sampling::Rival(_) => None,
        Sampling::Uniform | Sampling::Adaptive => asked.or(scene.viewing.visibility).or(Some(THRESHOLD)),
    }
}

/// Refuses what the rule of sampling would not look at.
pub(super) fn check_rule(arguments: &JobArguments) -> anyhow::Result<()> {
    if arguments.allocation.is_some() && !matches!(arguments.sampling, SamplingChoice::Adaptive) {
        bail!("--allocation is how --sampling adaptive finds counts, and this --sampling does not ask: leave it out");
    }
    let (stops_by_noise, stops_by_sight) = match arguments.sampling {
        SamplingChoice::Adaptive | SamplingChoice::Uniform => (false, true),
        SamplingChoice::Relative | SamplingChoice::Variance => (true, false),
        SamplingChoice::Budget => (false, false),
    };
    if arguments.noise_threshold.is_some() && !stops_by_noise {
        bail!(
            "--noise-threshold is where --sampling relative and variance stop, and this --sampling does not: leave it out"
        );
    }
    if (arguments.visibility.is_some() || arguments.quality.is_some()) && !stops_by_sight {
        bail!(
            "--visibility and --quality are looked at by --sampling adaptive and uniform, not by this one: leave them out"
        );
    }
    check_confidence(arguments, stops_by_sight)
}

/// Refuses a bound on what has none: it is of noise that the eye's window pools.
fn check_confidence(arguments: &JobArguments, stops_by_sight: bool) -> anyhow::Result<()> {
    if arguments.confidence.is_none() {
        return Ok(());
    }
    if !stops_by_sight {
        bail!("--confidence is about what is seen, which this --sampling does not ask: use adaptive or uniform");
    }
    if arguments.model != model::DEFAULT {
        bail!("--confidence is for --model {}: {} pools no pixels", model::DEFAULT, arguments.model);
    }
    if arguments.denoise.kind().is_some() {
        bail!(
            "--confidence is for raw pictures: what a denoiser changes has no scatter that halves would show; leave out \
             one of the two"
        );
    }
    if arguments.transparent {
        bail!("--confidence is for pictures that hide what is behind them: leave out --transparent or it");
    }
    if matches!(arguments.sequence, SequenceChoice::ZOrder) {
        bail!(
            "--confidence needs pixels whose errors do not depend on each other, as those of --sequence z-order do: use \
             per-pixel"
        );
    }
    Ok(())
}

/// Refuses what a filter with negative lobes cannot go with.
pub(super) fn check_filter(filter: PixelFilter, settings: &LoopSettings) -> anyhow::Result<()> {
    if !filter.is_signed() {
        return Ok(());
    }
    if settings.sampling != Sampling::Uniform {
        bail!(
            "--filter mitchell has negative lobes, whose scatter is not the picture's noise: adaptive sampling cannot \
             judge it; use --sampling uniform, or the filter blackman-harris"
        );
    }
    if settings.is_transparent {
        bail!(
            "--filter mitchell has negative lobes, which alpha knows nothing of: a transparent picture would have fringes; use the \
             filter blackman-harris"
        );
    }
    if settings.limits.visibility.is_some() {
        bail!(
            "--filter mitchell has negative lobes, whose scatter is not the picture's noise: no visibility can end it, asked \
             for or the scene's; say --spp, --time or --plans instead, or use the filter blackman-harris"
        );
    }
    say!(
        "note: --filter mitchell: its negative lobes scatter samples, and what is told of visible noise counts that too"
    );
    Ok(())
}
