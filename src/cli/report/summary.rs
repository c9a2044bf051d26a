//! The end of a render in plain words.

use super::{Report, TOO_FEW, patch_count};
use crate::cli::console::duration_in_words;
use crate::cli::finished::Finished;
use crate::cli::words::{OF_THE_MODEL, count, rounded};
use fechner::adaptive::audit::MAX_INFLATION;
use fechner::adaptive::settings::Sampling;
use fechner::adaptive::{Rendered, StopReason};
use fechner_perception::Plane;
use fechner_perception::display::Display;
use fechner_perception::psychometric::detection_probability;

/// Who ends a render before it is done.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(in crate::cli) enum Interrupter {
    /// The system or a terminal.
    Signal,
    /// Somebody at the page of `--view`.
    Viewer,
}

/// The end of a render in plain words; `interrupter` has ended it if anybody has.
pub(in crate::cli) fn summary(finished: Finished, interrupter: Option<Interrupter>) -> String {
    let Finished { rendered, settings, report } = finished;
    let mut lines = vec![spent(report), stopped(finished, interrupter)];
    lines.extend(noticed(report, &settings.viewing.display, &rendered.judgement.predicted));
    lines.extend(confidence(report));
    lines.extend(importance(report));
    lines.extend(denoised(report));
    lines.extend(audited(report, rendered));
    lines.extend(fireflies(report, settings.sampling));
    lines.extend(nonfinite(report));
    lines.join("\n")
}

fn spent(report: &Report) -> String {
    format!(
        "{} ({:.1} a pixel on average, {} at most) in {}, of which {:.1} % in the perception model ({:.1} % in \
         finding counts).",
        count(report.samples_total as usize, "sample"),
        report.spp_mean,
        report.spp_max,
        duration_in_words(report.seconds_total),
        100.0 * report.seconds_perception / report.seconds_total,
        100.0 * report.seconds_allocation / report.seconds_total
    )
}

fn stopped(finished: Finished, interrupter: Option<Interrupter>) -> String {
    let Finished { rendered, settings, report } = finished;
    let why = match rendered.stop_reason {
        StopReason::Visibility => "Stopped because the target is reached",
        StopReason::Time if settings.limits.time.is_some_and(|limit| rendered.seconds.total < limit.as_secs_f64()) => {
            "Stopped because the next plan would not fit into the time"
        }
        StopReason::Time => "Stopped because the time was up",
        StopReason::Samples => "Stopped because the samples were spent",
        StopReason::MaxSamples if report.visibility_target.is_none() => {
            "Stopped because all pixels that would get more have the most samples allowed"
        }
        StopReason::MaxSamples => {
            "Stopped although some pixels are above the target: they have the most samples allowed"
        }
        StopReason::Plans => "Stopped after the plans asked for",
        StopReason::Rule => "Stopped because the rule asked for is satisfied",
        StopReason::Interrupted => match interrupter {
            Some(Interrupter::Signal) => "Stopped by a signal",
            Some(Interrupter::Viewer) => "Stopped from the page of --view",
            None => "Stopped before it was done",
        },
        StopReason::Merged => "Merged",
    };
    let target = match (report.fraction_visible, report.visibility_target) {
        (None, _) => TOO_FEW.to_owned(),
        (Some(share), None) => format!("{:.2} % of the picture is above visibility 1", 100.0 * share),
        (Some(share), Some(t)) => {
            format!("{:.2} % of the picture is above the target visibility {}", 100.0 * share, rounded(t))
        }
    };
    // That many --plans make the same picture.
    let plans = match rendered.stop_reason {
        StopReason::Plans | StopReason::Merged => String::new(),
        _ => format!(", after {}", count(rendered.plans as usize, "plan")),
    };
    format!("{why}{plans}; {target}.")
}

fn noticed(report: &Report, display: &Display, predicted: &Plane) -> Option<String> {
    let (p99, noticed) = (report.visibility_p99?, report.patches_noticed?);
    let distance = display.distance_m.map_or_else(String::new, |d| format!(" at {d:.2} m"));
    Some(format!(
        "On the display \"{}\" ({} pixels a degree{distance}, white {} cd/m²): predicted chance that remaining {} \
         is detected in a 1° patch is {:.1} % at the 99th percentile (visibility {p99:.2}); about {noticed:.1} of {:.1} patches.\n\
         Light paths never sampled are not covered ({OF_THE_MODEL}).",
        display.name,
        rounded(display.pixels_per_degree),
        rounded(display.white_cd_m2),
        if report.denoised.is_some() { "error" } else { "noise" },
        100.0 * detection_probability(p99),
        patch_count(predicted, display),
    ))
}

fn confidence(report: &Report) -> Option<String> {
    // Where too few samples tell there is nothing to be bounded.
    report.visibility_p99?;
    report.confidence.map(|confidence| {
        format!(
            "Visibilities and chances are upper bounds: each place's holds with {} % confidence, over all looks of \
             which plans came.",
            rounded(100.0 * confidence)
        )
    })
}

fn importance(report: &Report) -> Option<String> {
    report.importance_range.map(|[least, greatest]| {
        format!(
            "Thresholds are multiplied by the importance map, {least} to {greatest}, and visibilities and chances are under it."
        )
    })
}

/// Change of a picture's light by its denoiser that is worth a line.
const NOTABLE_ENERGY_CHANGE: f64 = 0.005;

/// Less of the picture is 0.0 % in words.
const MIN_TOLD_SHARE: f64 = 0.0005;

fn denoised(report: &Report) -> Vec<String> {
    let Some(denoised) = &report.denoised else { return Vec::new() };
    let by = format!(
        "Denoised by {} in {} ({:.1} % of the time)",
        denoised.denoiser,
        duration_in_words(report.seconds_denoising),
        100.0 * report.seconds_denoising / report.seconds_total,
    );
    let left = match (denoised.variance_visibility_p99, denoised.bias_visibility_p99) {
        (Some(variance), Some(bias)) => format!(
            "{by}; at the 99th percentile the noise that is left has visibility {variance:.2}, what the denoiser changed \
             {bias:.2}."
        ),
        _ => format!("{by}."),
    };
    let unproven = denoised.unproven_fraction.filter(|&share| share >= MIN_TOLD_SHARE).map(|share| {
        format!(
            "Unproven: in {:.1} % of the picture, which is called fine, raw noise is too strong to show that the \
             denoiser changed nothing visible; there its error is inferred from the rest of the picture.",
            100.0 * share
        )
    });
    let change = denoised.energy_change;
    let energy = (change.abs() >= NOTABLE_ENERGY_CHANGE).then(|| {
        format!(
            "The denoised picture holds {:.1} % {} light than the raw mean, which is unbiased and is kept in an .exr.",
            100.0 * change.abs(),
            if change < 0.0 { "less" } else { "more" }
        )
    });
    [Some(left), unproven, energy].into_iter().flatten().collect()
}

fn audited(report: &Report, rendered: &Rendered) -> Option<String> {
    let audit = rendered.audit?;
    let tile = if report.denoised.is_some() { "unproven tile" } else { "tile" };
    if audit.had_nothing_to_find() {
        return Some(format!("Audit: nothing is predicted to show in {}.", count(audit.tiles, tile)));
    }
    let times = rendered.inflation;
    let since = if times >= MAX_INFLATION {
        format!("; {times:.1} times as much is predicted since, the most that is believed: it may still be too little")
    } else if audit.disagrees() {
        format!("; {times:.1} times as much is predicted since")
    } else {
        String::new()
    };
    Some(format!(
        "Audit: fresh samples in {} differ from the picture by {:.2} ± {:.2} times the predicted visible energy{since}.",
        count(audit.tiles, tile),
        audit.ratio,
        audit.standard_error
    ))
}

fn fireflies(report: &Report, sampling: Sampling) -> Option<String> {
    // By 2 % in a block of `cornell-glass` (`benches/local_energy.py`).
    let darker =
        if sampling == Sampling::Adaptive { "; around it the picture may be a few per cent too dark" } else { "" };
    let kept = if report.denoised.is_some() { "kept in the raw mean" } else { "kept" };
    (report.outlier_pixels > 0).then(|| {
        format!(
            "Light that few samples find (fireflies) is in {}: {:.2} % of the picture's energy. It is {kept}{darker}.",
            count(report.outlier_pixels, "pixel"),
            100.0 * report.outlier_energy_share,
        )
    })
}

fn nonfinite(report: &Report) -> Option<String> {
    let samples = report.nonfinite_samples;
    (samples > 0).then(|| format!("Left out since not finite: {}.", count(samples as usize, "sample")))
}
