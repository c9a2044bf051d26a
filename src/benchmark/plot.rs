//! Curves of the report, as SVG.

use super::curve::{Curve, CurvePoint};
use std::fmt::Write as _;

const WIDTH: f64 = 400.0;
const HEIGHT: f64 = 230.0;
const LEFT: f64 = 58.0;
const RIGHT: f64 = 22.0;
const TOP: f64 = 26.0;
const BOTTOM: f64 = 40.0;

/// A quantity of the points.
#[derive(Clone, Copy)]
pub(super) struct Axis {
    title: &'static str,
    of: fn(&CurvePoint) -> f64,
    is_logarithmic: bool,
}

const SAMPLES: Axis = Axis { title: "samples a pixel", of: |p| p.samples, is_logarithmic: true };
const SECONDS: Axis = Axis { title: "seconds", of: |p| p.seconds, is_logarithmic: true };
const VISIBILITY: Axis = Axis { title: "true visibility, 99 %", of: |p| p.visibility, is_logarithmic: true };
const FLIP: Axis = Axis { title: "FLIP, mean", of: |p| p.flip_mean, is_logarithmic: true };
const JOD: Axis = Axis { title: "ColorVideoVDP, JOD", of: |p| p.jod, is_logarithmic: false };
const RELMSE: Axis = Axis { title: "relMSE", of: |p| p.relmse, is_logarithmic: true };

/// What an axis shows, from its least to its greatest value.
struct Scale {
    axis: Axis,
    least: f64,
    greatest: f64,
}

impl Scale {
    fn of(axis: Axis, curves: &[&Curve]) -> Option<Self> {
        let values = curves.iter().flat_map(|curve| &curve.points).map(axis.of);
        let is_shown = |v: &f64| v.is_finite() && (!axis.is_logarithmic || *v > 0.0);
        let (least, greatest) =
            values.filter(is_shown).fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), v| (a.min(v), b.max(v)));
        (least <= greatest).then_some(Self { axis, least, greatest })
    }

    /// 0 at the least and 1 at the greatest.
    fn place(&self, value: f64) -> f64 {
        let by = |v: f64| if self.axis.is_logarithmic { v.ln() } else { v };
        let span = by(self.greatest) - by(self.least);
        if span > 0.0 { ((by(value) - by(self.least)) / span).clamp(0.0, 1.0) } else { 0.5 }
    }

    /// Both ends and the middle.
    fn ticks(&self) -> [f64; 3] {
        let middle = if self.axis.is_logarithmic {
            (self.least * self.greatest).sqrt()
        } else {
            0.5 * (self.least + self.greatest)
        };
        [self.least, middle, self.greatest]
    }
}

fn colour(arm: &str) -> &'static str {
    match arm {
        "as-asked" => "#c2410c",
        "relative" => "#0369a1",
        _ => "#64748b",
    }
}

fn in_short(value: f64) -> String {
    if value >= 100.0 || value == 0.0 {
        format!("{value:.0}")
    } else if value >= 1.0 {
        format!("{value:.2}")
    } else if value >= 0.01 {
        format!("{value:.3}")
    } else {
        format!("{value:.1e}")
    }
}

/// Every metric over samples and over time.
pub(super) fn plots(curves: &[&Curve]) -> String {
    let mut text = String::new();
    for x in [SAMPLES, SECONDS] {
        for y in [VISIBILITY, FLIP, JOD, RELMSE] {
            text.push_str(&plot(curves, x, y).unwrap_or_default());
        }
        text.push_str("<br>");
    }
    text
}

fn plot(curves: &[&Curve], x: Axis, y: Axis) -> Option<String> {
    let (x, y) = (Scale::of(x, curves)?, Scale::of(y, curves)?);
    let at_x = |value: f64| LEFT + (WIDTH - LEFT - RIGHT) * x.place(value);
    let at_y = |value: f64| HEIGHT - BOTTOM - (HEIGHT - TOP - BOTTOM) * y.place(value);
    let label = format!("{} over {}", y.axis.title, x.axis.title);
    let mut text = format!("<svg width=\"{WIDTH}\" height=\"{HEIGHT}\" role=\"img\" aria-label=\"{label}\">");
    let _ = write!(text, "<text x=\"{LEFT}\" y=\"14\">{label}</text>");
    for tick in x.ticks() {
        let (x, bottom) = (at_x(tick), HEIGHT - BOTTOM);
        let _ = write!(
            text,
            "<line x1=\"{x:.1}\" x2=\"{x:.1}\" y1=\"{TOP}\" y2=\"{bottom}\" stroke=\"#e2e2e6\"/><text x=\"{x:.1}\" y=\"{}\" \
             text-anchor=\"middle\">{}</text>",
            bottom + 16.0,
            in_short(tick)
        );
    }
    for tick in y.ticks() {
        let (y, right) = (at_y(tick), WIDTH - RIGHT);
        let _ = write!(
            text,
            "<line x1=\"{LEFT}\" x2=\"{right}\" y1=\"{y:.1}\" y2=\"{y:.1}\" stroke=\"#e2e2e6\"/><text x=\"{}\" y=\"{:.1}\" \
             text-anchor=\"end\">{}</text>",
            LEFT - 6.0,
            y + 4.0,
            in_short(tick)
        );
    }
    for (place, curve) in curves.iter().enumerate() {
        let colour = colour(curve.arm);
        let line: Vec<String> = curve
            .points
            .iter()
            .map(|point| format!("{:.1},{:.1}", at_x((x.axis.of)(point)), at_y((y.axis.of)(point))))
            .collect();
        let _ = write!(
            text,
            "<polyline points=\"{}\" fill=\"none\" stroke=\"{colour}\" stroke-width=\"2\"/>",
            line.join(" ")
        );
        for at in &line {
            if let Some((x, y)) = at.split_once(',') {
                let _ = write!(text, "<circle cx=\"{x}\" cy=\"{y}\" r=\"3\" fill=\"{colour}\"/>");
            }
        }
        let left = LEFT + 110.0 * place as f64;
        let _ = write!(text, "<text x=\"{left}\" y=\"{}\" fill=\"{colour}\">{}</text>", HEIGHT - 6.0, curve.arm);
    }
    text.push_str("</svg>");
    Some(text)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn curves_lie_within_their_frame_and_nothing_is_no_plot() {
        let point = |samples: f64, jod: f64| CurvePoint {
            samples,
            seconds: 0.1 * samples,
            visibility: 1.0 / samples,
            flip_mean: 0.0,
            jod,
            relmse: f64::NAN,
        };
        let curve = Curve { scene: "s".into(), arm: "uniform", points: vec![point(16.0, 8.0), point(64.0, 9.0)] };
        let text = plot(&[&curve], SAMPLES, JOD).expect("a plot");
        assert!(text.contains("points=\"58.0,190.0 378.0,26.0\""), "{text}");
        assert!(plot(&[&curve], SAMPLES, RELMSE).is_none());
        assert!(plot(&[], SAMPLES, JOD).is_none());
        assert!(!plots(&[&curve]).contains("NaN"));
    }
}
