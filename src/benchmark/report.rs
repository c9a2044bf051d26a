//! `report.html`: one file that needs nothing else.

use super::curve::Curve;
use super::plot::plots;
use super::record::{Record, Results};
use base64::Engine as _;
use base64::engine::general_purpose::STANDARD as BASE64;
use std::fmt::Write as _;

const STYLE: &str = "body{font:15px/1.5 system-ui,sans-serif;max-width:68rem;margin:2rem auto;padding:0 1rem;color:#1c1c22}\
h1,h2{font-weight:600}table{border-collapse:collapse;margin:1rem 0}th,td{padding:.25rem .7rem;text-align:right;\
border-bottom:1px solid #ddd}th:first-child,td:first-child{text-align:left}figure{display:inline-block;margin:.4rem}\
figcaption{font-size:12px;color:#555}img{image-rendering:pixelated;width:18rem;height:auto}.note{color:#555}\
.loss{color:#b3261e;font-weight:600}svg text{font:12px system-ui,sans-serif}";

/// The whole report.
pub(crate) fn html(results: &Results) -> String {
    let mut page = String::new();
    let _ = write!(
        page,
        "<!doctype html><html lang=\"en\"><meta charset=\"utf-8\"><title>fechner bench</title><style>{STYLE}</style>\
         <h1>Samples to equal visible quality</h1><p>{}×{} pixels, display {}, v* = {}, {} seeds, fechner {}. Samples are what \
         each arm needs to bring 99 % of the picture to v*; truth is measured against a long reference, not predicted. \
         v ∝ n<sup>−½</sup> scales each render to v*.</p>",
        results.size.0, results.size.1, results.display, results.visibility, results.seeds, results.fechner_version
    );
    page.push_str(&summary_table(results));
    for scene in scenes(results) {
        let _ = write!(page, "<h2>{scene}</h2>");
        page.push_str(&bars(results, &scene));
        page.push_str(&scene_table(results, &scene));
        let curves: Vec<&Curve> = results.curves.iter().filter(|curve| curve.scene == scene).collect();
        page.push_str(&plots(&curves));
        page.push_str(&pictures(results, &scene));
    }
    page.push_str("</html>\n");
    page
}

fn scenes(results: &Results) -> Vec<String> {
    let mut scenes: Vec<String> = Vec::new();
    for record in &results.records {
        if !scenes.contains(&record.scene) {
            scenes.push(record.scene.clone());
        }
    }
    scenes
}

/// Pooled records of a scene at 99 %.
fn pooled<'a>(results: &'a Results, scene: &'a str) -> impl Iterator<Item = &'a Record> {
    results.records.iter().filter(move |r| r.scene == scene && r.seed.is_none() && r.coverage == 0.99)
}

fn summary_table(results: &Results) -> String {
    let mut text = String::from(
        "<h2>Geometric means over scenes</h2><table><tr><th>arm</th><th>coverage</th><th>samples, uniform / arm</th>\
         <th>worst scene</th><th>time, uniform / arm</th><th>oracle / arm</th></tr>",
    );
    for s in &results.summary {
        let efficiency = s.efficiency.map_or_else(String::new, |e| e.in_words());
        let (samples, seconds) = (s.speedup_samples, s.speedup_seconds);
        let loss = if samples.value < 1.0 { " class=\"loss\"" } else { "" };
        let _ = write!(
            text,
            "<tr><td>{}</td><td>{} %</td><td{loss}>{}</td><td>{:.2}</td><td>{:.2}</td><td>{efficiency}</td></tr>",
            s.arm,
            100.0 * s.coverage,
            samples.in_words(),
            samples.least,
            seconds.value
        );
    }
    text.push_str("</table>");
    text
}

/// Samples of each arm as bars.
fn bars(results: &Results, scene: &str) -> String {
    const WIDTH: f64 = 560.0;
    let records: Vec<&Record> = pooled(results, scene).collect();
    let most = records.iter().map(|r| r.samples).fold(1e-9, f64::max);
    let height = 24 * records.len();
    let mut text = format!("<svg width=\"860\" height=\"{height}\" role=\"img\" aria-label=\"samples by arm\">");
    for (row, record) in records.iter().enumerate() {
        let (y, length) = (24 * row, WIDTH * record.samples / most);
        let colour = match record.arm {
            "default" | "as-asked" => "#c2410c",
            "oracle" => "#0f766e",
            _ => "#94a3b8",
        };
        let _ = write!(
            text,
            "<text x=\"140\" y=\"{}\" text-anchor=\"end\">{}</text><rect x=\"150\" y=\"{}\" width=\"{length:.1}\" height=\"16\" \
             fill=\"{colour}\"/><text x=\"{:.1}\" y=\"{}\">{:.0} spp</text>",
            y + 16,
            record.arm,
            y + 4,
            156.0 + length,
            y + 16,
            record.samples
        );
    }
    text.push_str("</svg>");
    text
}

fn scene_table(results: &Results, scene: &str) -> String {
    let mut text = String::from(
        "<table><tr><th>arm</th><th>spp at 99 %</th><th>uniform / arm</th><th>oracle / arm</th><th>rendered at v / v*</th>\
         <th>above 1.25 v*</th><th>FLIP</th><th>JOD</th><th>relMSE</th><th>energy bias</th><th>not tracing</th></tr>",
    );
    for r in pooled(results, scene) {
        let efficiency = r.efficiency.map_or_else(String::new, |e| format!("{e:.2}"));
        let loss = if r.speedup_samples < 1.0 { " class=\"loss\"" } else { "" };
        let _ = write!(
            text,
            "<tr><td>{}</td><td>{:.0}</td><td{loss}>{:.2}</td><td>{efficiency}</td><td>{:.2}</td><td>{:.2} %</td><td>{:.4}</td>\
             <td>{:.3}</td><td>{:.2e}</td><td>{:+.2} ± {:.2} %</td><td>{:.1} %</td></tr>",
            r.arm,
            r.samples,
            r.speedup_samples,
            r.reached,
            100.0 * r.overshoot_fraction,
            r.flip_mean,
            r.jod,
            r.relmse,
            100.0 * r.energy_bias,
            100.0 * r.energy_bias_ci,
            100.0 * r.overhead
        );
    }
    text.push_str("</table><p class=\"note\">FLIP, JOD and relMSE are of the renders as made, not scaled.</p>");
    text
}

fn pictures(results: &Results, scene: &str) -> String {
    let mut text = String::new();
    for shown in results.pictures.iter().filter(|p| p.scene == scene) {
        for (title, png) in &shown.pictures {
            let _ = write!(
                text,
                "<figure><img alt=\"{title}\" src=\"data:image/png;base64,{}\"><figcaption>{}: {title}</figcaption></figure>",
                BASE64.encode(png),
                shown.arm
            );
        }
        text.push_str("<br>");
    }
    text
}
