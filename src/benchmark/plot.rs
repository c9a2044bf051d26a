//! Curves of the report, as SVG. Their points are taken as they are given.

use super::arm::Arm;
use super::curve::{Curve, CurvePoint};
use crate::digits::significant;
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
    /// An axis on which all curves and a mark can be seen.
    fn of(axis: Axis, curves: &[&Curve], mark: Option<f64>) -> Option<Self> {
        let values = curves.iter().flat_map(|curve| &curve.points).map(axis.of);
        let values = values.chain(mark.filter(|_| !curves.is_empty()));
        let is_shown = |v: &f64| v.is_finite() && (!axis.is_logarithmic || *v > 0.0);
        let (least, greatest) =
            values.filter(is_shown).fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), v| (a.min(v), b.max(v)));
        (least <= greatest).then_some(Self { axis, least, greatest })
    }

    /// 0 at the least and 1 at the greatest; 0 for nothing on a logarithmic axis, which has no place for it.
    fn place(&self, value: f64) -> f64 {
        if self.axis.is_logarithmic && value <= 0.0 {
            return 0.0;
        }
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

/// The style's name for an arm's colour.
fn class(arm: Arm) -> &'static str {
    match arm {
        Arm::AsAsked => "ours",
        Arm::Relative => "relative",
        _ => "other",
    }
}

/// Plots of every metric over samples and over time, with a line at v\*, `target`.
pub(super) fn plots(curves: &[&Curve], target: f64) -> String {
    let metrics = [(VISIBILITY, Some(target)), (FLIP, None), (JOD, None), (RELMSE, None)];
    let row = |x: Axis| metrics.iter().filter_map(|&(y, mark)| plot(curves, x, y, mark)).collect::<String>();
    let rows = [SAMPLES, SECONDS].map(row).into_iter().filter(|row| !row.is_empty());
    rows.map(|row| format!("<div class=\"plots\">\n{row}</div>\n")).collect()
}

/// Two axes in the picture's units.
struct Frame {
    x: Scale,
    y: Scale,
}

impl Frame {
    fn left_of(&self, value: f64) -> f64 {
        LEFT + (WIDTH - LEFT - RIGHT) * self.x.place(value)
    }

    fn top_of(&self, value: f64) -> f64 {
        HEIGHT - BOTTOM - (HEIGHT - TOP - BOTTOM) * self.y.place(value)
    }

    fn place(&self, point: &CurvePoint) -> (f64, f64) {
        (self.left_of((self.x.axis.of)(point)), self.top_of((self.y.axis.of)(point)))
    }

    fn grid(&self) -> String {
        let (right, bottom) = (WIDTH - RIGHT, HEIGHT - BOTTOM);
        let mut text = String::new();
        for tick in self.x.ticks() {
            let (x, label) = (self.left_of(tick), significant(tick, 3));
            let _ = write!(
                text,
                "<line class=\"grid\" x1=\"{x:.1}\" x2=\"{x:.1}\" y1=\"{TOP}\" y2=\"{bottom}\"/>\
                 <text x=\"{x:.1}\" y=\"{}\" text-anchor=\"middle\">{label}</text>",
                bottom + 16.0
            );
        }
        for tick in self.y.ticks() {
            let (y, label) = (self.top_of(tick), significant(tick, 3));
            let _ = write!(
                text,
                "<line class=\"grid\" x1=\"{LEFT}\" x2=\"{right}\" y1=\"{y:.1}\" y2=\"{y:.1}\"/>\
                 <text x=\"{}\" y=\"{:.1}\" text-anchor=\"end\">{label}</text>",
                LEFT - 6.0,
                y + 4.0
            );
        }
        text
    }

    /// The line at v\*.
    fn target_line(&self, target: f64) -> String {
        let (y, right) = (self.top_of(target), WIDTH - RIGHT);
        format!(
            "<line class=\"target\" x1=\"{LEFT}\" x2=\"{right}\" y1=\"{y:.1}\" y2=\"{y:.1}\"/>\
             <text class=\"target\" x=\"{:.1}\" y=\"{:.1}\">v*</text>",
            right + 4.0,
            y + 4.0
        )
    }

    fn curve(&self, curve: &Curve) -> String {
        let line: Vec<String> =
            curve.points.iter().map(|point| self.place(point)).map(|(x, y)| format!("{x:.1},{y:.1}")).collect();
        let circles: String = curve
            .points
            .iter()
            .map(|point| self.place(point))
            .map(|(x, y)| format!("<circle cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"3\"/>"))
            .collect();
        format!("<polyline points=\"{}\"/>{circles}", line.join(" "))
    }
}

fn plot(curves: &[&Curve], x: Axis, y: Axis, mark: Option<f64>) -> Option<String> {
    let frame = Frame { x: Scale::of(x, curves, None)?, y: Scale::of(y, curves, mark)? };
    let label = format!("{} over {}", y.title, x.title);
    let mut text = format!(
        "<svg viewBox=\"0 0 {WIDTH} {HEIGHT}\" role=\"img\" aria-label=\"{label}\"><text class=\"title\" x=\"{LEFT}\" \
         y=\"14\">{label}</text>{}{}",
        frame.grid(),
        mark.map_or_else(String::new, |target| frame.target_line(target))
    );
    for (place, curve) in curves.iter().enumerate() {
        let (class, left) = (class(curve.arm), LEFT + 110.0 * place as f64);
        let (line, name) = (frame.curve(curve), curve.arm.name());
        let _ = write!(text, "<g class=\"{class}\">{line}<text x=\"{left}\" y=\"{}\">{name}</text></g>", HEIGHT - 6.0);
    }
    text.push_str("</svg>\n");
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
        let curve = Curve { scene: "s".into(), arm: Arm::Uniform, points: vec![point(16.0, 8.0), point(64.0, 9.0)] };
        let text = plot(&[&curve], SAMPLES, JOD, None).expect("a plot");
        assert!(text.contains("points=\"58.0,190.0 378.0,26.0\""), "{text}");
        assert!(plot(&[&curve], SAMPLES, RELMSE, None).is_none());
        assert!(plot(&[], SAMPLES, JOD, None).is_none() && plot(&[], SAMPLES, VISIBILITY, Some(1.0)).is_none());
        assert!(!plots(&[&curve], 1.0).contains("NaN"));
    }

    /// Visibilities of 1/16 and 1/64: a target above them all lies at the top, one between them between.
    #[test]
    fn the_target_is_a_line_within_the_frame() {
        let point = |samples: f64| CurvePoint {
            samples,
            seconds: 1.0,
            visibility: 1.0 / samples,
            flip_mean: 0.1,
            jod: 9.0,
            relmse: 0.1,
        };
        let curve = Curve { scene: "s".into(), arm: Arm::Uniform, points: vec![point(16.0), point(64.0)] };
        for (target, y) in [(1.0, "26.0"), (1.0 / 32.0, "108.0")] {
            let text = plot(&[&curve], SAMPLES, VISIBILITY, Some(target)).expect("a plot");
            let line = format!("<line class=\"target\" x1=\"58\" x2=\"378\" y1=\"{y}\" y2=\"{y}\"/>");
            assert!(text.contains(&line), "{text}");
        }
        assert_eq!(plots(&[&curve], 1.0).matches("v*</text>").count(), 2);
        let nothing = CurvePoint { visibility: 0.0, ..point(16.0) };
        let flat = Curve { scene: "s".into(), arm: Arm::Uniform, points: vec![nothing] };
        let text = plot(&[&flat], SAMPLES, VISIBILITY, Some(4.0)).expect("a plot");
        assert!(text.contains("cy=\"190.0\""), "nothing lies below v*: {text}");
    }
}
