//! What `bench` prints: tables in Markdown, for documents. Files of results are written elsewhere.

use fechner::benchmark::{
    AnimationRow, ArmSummary, Bound, Calibration, DenoisingResults, Need, Quality, RaceMean, Reached,
    intervals_in_words, mean_ratio,
};

/// What each arm saves, over scenes.
pub(super) fn print_summary(summary: &[ArmSummary]) {
    answer!("| arm | coverage | samples, uniform / arm | worst scene | oracle / arm |");
    answer!("| --- | --- | --- | --- | --- |");
    for s in summary {
        let unknown = || "–".to_owned();
        let speedup = s.speedup_samples.map_or_else(unknown, |mean| mean.in_words());
        let least = s.speedup_samples.map_or_else(unknown, |mean| format!("{:.2}", mean.least));
        let efficiency = s.efficiency.map_or_else(String::new, |e| format!("{:.2} (least {:.2})", e.value, e.least));
        answer!("| {} | {} % | {speedup} | {least} | {efficiency} |", s.arm.name(), 100.0 * s.coverage);
    }
    if summary.iter().any(|s| s.speedup_samples.is_some_and(|mean| mean.low.is_some())) {
        answer!("\n{}", intervals_in_words());
    }
}

/// What uniform sampling and the optimum need.
pub(super) fn print_bounds(bounds: &[Bound]) {
    answer!("| scene | coverage | uniform, spp | optimum, spp | ratio |");
    answer!("| --- | --- | --- | --- | --- |");
    for b in bounds {
        let (share, ratio) = (100.0 * b.coverage, b.uniform / b.optimum);
        answer!("| {} | {share} % | {:.1} | {:.1} | {ratio:.2} |", b.scene, b.uniform, b.optimum);
    }
}

/// The law against the truth.
pub(super) fn print_calibrations(calibrations: &[Calibration]) {
    answer!(
        "| scene | denoiser | spp | seed | rank corr. | predicted / true v | by variance alone | called fine | of it unproven | fine, \
         proven, wrong | fine, unproven, wrong | truly wrong | JOD raw, denoised | FLIP raw, denoised | overhead |"
    );
    answer!("| --- | --- | --- | --- | --- | --- | --- | --- | --- | --- | --- | --- | --- | --- | --- |");
    for c in calibrations {
        let percent = |share: f64| format!("{:.1} %", 100.0 * share);
        let ratio = |value: Option<f64>| value.map_or_else(|| "–".to_owned(), |value| format!("{value:.2}"));
        answer!(
            "| {} | {} | {} | {} | {} | {} | {} | {} | {} | {} | {} | {} | {:.2}, {:.2} | {:.3}, {:.3} | {:.2} |",
            c.scene,
            c.denoiser,
            c.spp,
            c.seed,
            ratio(c.rank_correlation),
            ratio(c.predicted_over_true),
            ratio(c.variance_over_true),
            percent(c.fine_share),
            percent(c.unproven_share),
            percent(c.wrong_share),
            percent(c.wrong_unproven_share),
            percent(c.truly_wrong_share),
            c.jod_raw,
            c.jod,
            c.flip_raw,
            c.flip,
            c.overhead
        );
    }
}

/// Samples to each quality by each rule, in brackets uniform sampling's over the rule's, and the means of those.
pub(super) fn print_races(results: &DenoisingResults) {
    if results.races.is_empty() {
        return;
    }
    answer!("\n| scene | denoiser | rule | spp to {} |", Quality::ALL.map(Quality::name).join(" | to "));
    answer!("| --- | --- | --- |{}", " --- |".repeat(Quality::ALL.len()));
    for race in &results.races {
        let cells: Vec<String> = race.needs.iter().map(need_in_words).collect();
        answer!("| {} | {} | {} | {} |", race.scene, race.denoiser, race.rule.name(), cells.join(" | "));
    }
    answer!(
        "\nUniform sampling's samples over the rule's, geometric means of the pairs in which neither is a bound (≤, >):\n"
    );
    for mean in &results.race_means {
        answer!("- {}", race_mean_in_words(mean));
    }
}

/// "41.0 (1.12)", or a bound alone.
fn need_in_words(need: &Need) -> String {
    need.uniform_over
        .map_or_else(|| format!("{:.1}", need.samples), |ratio| format!("{:.1} ({ratio:.2})", need.samples))
}

fn race_mean_in_words(mean: &RaceMean) -> String {
    let ratio = mean.uniform_over.map_or_else(|| "–".to_owned(), |ratio| format!("{ratio:.2}"));
    let RaceMean { rule, quality, pairs, pairs_left_out, .. } = mean;
    let (rule, quality) = (rule.name(), quality.name());
    format!("{rule}, to {quality}: {ratio}, pairs {pairs}, left out {pairs_left_out}")
}

/// Shots of one denoiser, and means of each rate.
pub(super) fn print_animation(denoiser: Option<&str>, rows: &[AnimationRow]) {
    if let Some(denoiser) = denoiser {
        answer!("All but the references denoised by {denoiser}:\n");
    }
    answer!(
        "| shot | frames a second | motion: spp, JOD | still: spp, JOD | still / motion | even, as good: spp | even / motion | \
         as a budget: spp, JOD | even, as good: spp | even / budget | flicker | of even, at equal visibility |"
    );
    answer!("| --- | --- | --- | --- | --- | --- | --- | --- | --- | --- | --- | --- |");
    for row in rows {
        let ratio = row.still_spp / row.motion_spp;
        let even_over = |even: Reached, spp: f64| {
            let ratio = even.known().map_or_else(|| "–".to_owned(), |even| format!("{:.2}", even / spp));
            format!("{even:.0} | {ratio}")
        };
        let even = even_over(row.uniform_spp, row.motion_spp);
        let budget = format!(
            "{:.0}, {:.2} | {}",
            row.budget_spp,
            row.budget_jod,
            even_over(row.uniform_spp_of_budget, row.budget_spp)
        );
        let AnimationRow { scene, frames_per_second, motion_spp, motion_jod, still_spp, still_jod, flicker, .. } = row;
        let even_flicker = row.uniform_flicker.map_or_else(|| "not tried".to_owned(), |even| format!("{even:.2}"));
        answer!(
            "| {scene} | {frames_per_second} | {motion_spp:.0}, {motion_jod:.2} | {still_spp:.0}, {still_jod:.2} | \
             {ratio:.2} | {even} | {budget} | {flicker:.2} | {even_flicker} |"
        );
    }
    let mut rates: Vec<f64> = rows.iter().map(|row| row.frames_per_second).collect();
    rates.sort_by(f64::total_cmp);
    rates.dedup();
    for rate in rates {
        let of_rate = || rows.iter().filter(|row| row.frames_per_second == rate);
        let still = geometric_mean(of_rate().map(|row| Some(row.still_spp / row.motion_spp)));
        let even = geometric_mean(of_rate().map(|row| Some(row.uniform_spp.known()? / row.motion_spp)));
        let budget = geometric_mean(of_rate().map(|row| Some(row.uniform_spp_of_budget.known()? / row.budget_spp)));
        let flicker = geometric_mean(of_rate().map(|row| Some(row.flicker / row.uniform_flicker?)));
        answer!(
            "at {rate}: still / motion {still}, even / motion {even}, even / budget {budget}, flicker over that of even {flicker}"
        );
    }
}

/// A geometric mean of what is known, in words, with how many are left out: "1.02 (of 3; 2 without a figure left out)".
fn geometric_mean(values: impl Iterator<Item = Option<f64>>) -> String {
    let values: Vec<Option<f64>> = values.collect();
    let known = values.iter().flatten().count();
    let unknown = values.len() - known;
    let left_out =
        if unknown == 0 { String::new() } else { format!(" (of {known}; {unknown} without a figure left out)") };
    let mean = mean_ratio(values.into_iter().flatten()).map_or_else(|| "–".to_owned(), |mean| format!("{mean:.2}"));
    format!("{mean}{left_out}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn means_say_what_they_leave_out() {
        assert_eq!(geometric_mean([Some(2.0), Some(8.0)].into_iter()), "4.00");
        assert_eq!(geometric_mean([Some(2.0), None].into_iter()), "2.00 (of 1; 1 without a figure left out)");
        assert_eq!(geometric_mean([None].into_iter()), "– (of 0; 1 without a figure left out)");
    }

    #[test]
    fn bounds_are_not_printed_as_measurements() {
        let need = |samples, uniform_over| need_in_words(&Need { quality: Quality::ALL[0], samples, uniform_over });
        assert_eq!(need(Reached::AtMost(32.0), None), "≤ 32.0");
        assert_eq!(need(Reached::MoreThan(256.0), None), "> 256.0");
        assert_eq!(need(Reached::About(41.0), Some(1.12)), "41.0 (1.12)");
    }
}
