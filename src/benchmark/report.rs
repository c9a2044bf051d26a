//! Writes `report.html`: one file that needs nothing else.

use super::arm::Arm;
use super::curve::Curve;
use super::pictures::{ShownPicture, heat_codes};
use super::plot::plots;
use super::quote::html_text;
use super::record::{ArmSummary, CLEARLY_ABOVE, Record, Results, ScenePictures};
use super::summary::intervals_in_words;
use base64::Engine as _;
use base64::engine::general_purpose::STANDARD as BASE64;
use std::fmt::Write as _;

const STYLE: &str = include_str!("report.css");

/// The whole report.
pub(crate) fn html(results: &Results) -> String {
    let sections: String = scenes(results).into_iter().map(|scene| section(results, scene)).collect();
    format!(
        "<!doctype html>\n<html lang=\"en\">\n<meta charset=\"utf-8\">\n\
         <meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n<title>fechner bench</title>\n\
         <style>\n{STYLE}</style>\n{}{}{sections}</html>\n",
        introduction(results),
        summary_table(&results.summary)
    )
}

fn introduction(results: &Results) -> String {
    let seeds = if results.seeds == 1 { "1 seed".to_owned() } else { format!("{} seeds", results.seeds) };
    format!(
        "<h1>Samples to equal visible quality</h1>\n<p>{}×{} pixels, display {}, v* = {}, {seeds}, fechner {}. Samples are what \
         each arm needs to bring 99 % of the picture to v*; truth is measured against a long reference, not predicted. \
         v ∝ n<sup>−½</sup> scales each render to v*.</p>\n",
        results.size.0,
        results.size.1,
        html_text(&results.display),
        results.visibility,
        results.fechner_version
    )
}

fn section(results: &Results, scene: &str) -> String {
    let records: Vec<&Record> = results.pooled(scene).collect();
    let curves: Vec<&Curve> = results.curves.iter().filter(|curve| curve.scene == scene).collect();
    let pictures: String = results.pictures.iter().filter(|shown| shown.scene == scene).map(pictures).collect();
    let title = html_text(scene);
    let (bars, table, plots) = (bars(&records), scene_table(&records), plots(&curves, results.visibility));
    format!("<h2>{title}</h2>\n{bars}{table}{plots}{pictures}")
}

fn scenes(results: &Results) -> Vec<&str> {
    let mut scenes: Vec<&str> = Vec::new();
    for record in &results.records {
        if !scenes.contains(&record.scene.as_str()) {
            scenes.push(&record.scene);
        }
    }
    scenes
}

/// What a cell says of a figure that is not known.
const UNKNOWN: &str = "–";

fn if_known<T>(value: Option<T>, in_words: impl Fn(T) -> String) -> String {
    value.map_or_else(|| UNKNOWN.to_owned(), in_words)
}

/// Marks arms that need more than uniform sampling.
fn loss(speedup: Option<f64>) -> &'static str {
    if speedup.is_some_and(|speedup| speedup < 1.0) { " class=\"loss\"" } else { "" }
}

fn summary_table(summary: &[ArmSummary]) -> String {
    let mut text = String::from(
        "<h2>Geometric means over scenes</h2>\n<div class=\"wide\"><table>\n<tr><th>arm</th><th>coverage</th>\
         <th>samples, uniform / arm</th><th>worst scene</th><th>time, uniform / arm</th><th>oracle / arm</th></tr>\n",
    );
    let mut coverage = None;
    for s in summary {
        let group = if coverage.replace(s.coverage) == Some(s.coverage) { "" } else { " class=\"first-of-group\"" };
        let (samples, seconds) = (s.speedup_samples, s.speedup_seconds);
        let _ = writeln!(
            text,
            "<tr{group}><td>{}</td><td>{} %</td><td{}>{}</td><td>{}</td><td>{}</td><td>{}</td></tr>",
            s.arm.name(),
            100.0 * s.coverage,
            loss(samples.map(|mean| mean.value)),
            if_known(samples, |mean| mean.in_words()),
            if_known(samples, |mean| format!("{:.2}", mean.least)),
            if_known(seconds, |mean| format!("{:.2}", mean.value)),
            if_known(s.efficiency, |mean| mean.in_words())
        );
    }
    let _ = writeln!(text, "</table></div>\n<p class=\"note\">{}</p>", intervals_in_words());
    text
}

/// Samples of each arm as bars.
fn bars(records: &[&Record]) -> String {
    let most = records.iter().map(|r| r.samples).fold(1e-9, f64::max);
    let mut text = String::from("<dl class=\"bars\" aria-label=\"samples a pixel by arm\">\n");
    for record in records {
        let class = match record.arm {
            Arm::Default | Arm::AsAsked => "ours",
            Arm::Oracle => "oracle",
            _ => "other",
        };
        let _ = writeln!(
            text,
            "<dt>{}</dt><dd><i class=\"{class}\" style=\"--share:{:.4}\"></i>{:.0} spp</dd>",
            record.arm.name(),
            record.samples / most,
            record.samples
        );
    }
    text.push_str("</dl>\n");
    text
}

fn scene_table(records: &[&Record]) -> String {
    let mut text = format!(
        "<div class=\"wide\"><table>\n<tr><th>arm</th><th>spp at 99&nbsp;%</th><th>uniform /&nbsp;arm</th><th>oracle /&nbsp;arm</th>\
         <th>rendered at v&nbsp;/&nbsp;v*</th><th>above {CLEARLY_ABOVE}&nbsp;v*</th><th>FLIP</th><th>JOD</th><th>relMSE</th><th>energy bias</th>\
         <th>not tracing</th></tr>\n",
    );
    let ratio = |value: Option<f64>| if_known(value, |value| format!("{value:.2}"));
    for r in records {
        let _ = writeln!(
            text,
            "<tr><td>{}</td><td>{:.0}</td><td{}>{}</td><td>{}</td><td>{:.2}</td><td>{:.2} %</td><td>{:.4}</td>\
             <td>{:.3}</td><td>{:.2e}</td><td>{}</td><td>{:.1} %</td></tr>",
            r.arm.name(),
            r.samples,
            loss(r.speedup_samples),
            ratio(r.speedup_samples),
            ratio(r.efficiency),
            r.reached,
            100.0 * r.overshoot_fraction,
            r.flip_mean,
            r.jod,
            r.relmse,
            r.energy_bias_in_words(),
            100.0 * r.overhead
        );
    }
    text.push_str(
        "</table></div>\n<p class=\"note\">FLIP, JOD and relMSE are of the renders as made, not scaled.</p>\n",
    );
    text
}

fn pictures(shown: &ScenePictures) -> String {
    let figures: String = shown.pictures.iter().map(|picture| figure(shown, picture)).collect();
    if figures.is_empty() { figures } else { format!("<div class=\"pictures\">\n{figures}</div>\n") }
}

/// A picture with what its colours mean.
fn figure(shown: &ScenePictures, picture: &ShownPicture) -> String {
    let (arm, title) = (shown.arm.name(), picture.kind.title);
    format!(
        "<figure><div class=\"map\"><img alt=\"{}, arm {arm}: {title}\" src=\"data:image/png;base64,{}\">{}</div>\
         <figcaption>{arm}: {title}</figcaption></figure>\n",
        html_text(&shown.scene),
        BASE64.encode(&picture.png),
        scale(picture.kind.scale)
    )
}

/// The colours of a map beside what they mean, the least below; nothing of pictures without meanings.
fn scale(meanings: &[&str]) -> String {
    if meanings.is_empty() {
        return String::new();
    }
    let code = |rgb: [f32; 3]| {
        let [r, g, b] = rgb.map(|value| (255.0 * value).round() as u8);
        format!("#{r:02x}{g:02x}{b:02x}")
    };
    let colours: Vec<String> = heat_codes(16).map(code).collect();
    let labels: String = meanings.iter().map(|meaning| format!("<li>{meaning}</li>")).collect();
    format!(
        "<div class=\"scale\"><i style=\"background:linear-gradient(to top,{})\"></i><ol>{labels}</ol></div>",
        colours.join(",")
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn maps_say_what_their_colours_mean() {
        let text = scale(&["0", "≥ 2"]);
        // Magma from black-violet to cream, as in the maps.
        assert!(text.contains("to top,#000004,") && text.contains(",#fcfdbf)"), "{text}");
        assert!(text.contains("<ol><li>0</li><li>≥ 2</li></ol>"), "{text}");
        assert_eq!(scale(&[]), "");
    }
}
