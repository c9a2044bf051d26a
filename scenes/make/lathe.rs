//! Surfaces of revolution around the y axis, from profiles drawn as smooth curves with corners where wanted.

use crate::mesh::{Part, Vec3, add, cross, normalize, scale};
use std::f64::consts::TAU;

/// A smooth curve through points (radius, height).
struct Curve {
    points: Vec<(f64, f64)>,
    /// Length of the curve up to each point.
    lengths: Vec<f64>,
}

impl Curve {
    fn new(points: &[(f64, f64)]) -> Self {
        let mut lengths = vec![0.0];
        for pair in points.windows(2) {
            let chord = (pair[1].0 - pair[0].0).hypot(pair[1].1 - pair[0].1);
            lengths.push(lengths[lengths.len() - 1] + chord);
        }
        Self { points: points.to_vec(), lengths }
    }

    fn length(&self) -> f64 {
        self.lengths[self.lengths.len() - 1]
    }

    /// The point at share `t` of the length: a cubic through the points with slopes from their neighbours.
    fn at(&self, t: f64) -> (f64, f64) {
        let last = self.points.len() - 1;
        let s = t * self.length();
        let i = (1..last).take_while(|&i| self.lengths[i] <= s).count();
        let span = self.lengths[i + 1] - self.lengths[i];
        let x = (s - self.lengths[i]) / span;
        let slope = |k: usize| {
            let (a, b) = (k.saturating_sub(1), (k + 1).min(last));
            let run = self.lengths[b] - self.lengths[a];
            ((self.points[b].0 - self.points[a].0) / run * span, (self.points[b].1 - self.points[a].1) / run * span)
        };
        let (p, q, m, n) = (self.points[i], self.points[i + 1], slope(i), slope(i + 1));
        let (x2, x3) = (x * x, x * x * x);
        let blend = |p: f64, q: f64, m: f64, n: f64| {
            p * (2.0 * x3 - 3.0 * x2 + 1.0) + m * (x3 - 2.0 * x2 + x) + q * (3.0 * x2 - 2.0 * x3) + n * (x3 - x2)
        };
        (blend(p.0, q.0, m.0, n.0), blend(p.1, q.1, m.1, n.1))
    }
}

/// Reads a profile: "radius,height radius,height ..." in millimetres.
fn profile(text: &str) -> Curve {
    let number = |text: &str| text.parse::<f64>().expect("profiles are written in this program") / 1000.0;
    let point = |text: &str| {
        let (radius, height) = text.split_once(',').expect("profiles are written in this program");
        (number(radius), number(height))
    };
    Curve::new(&text.split_whitespace().map(point).collect::<Vec<_>>())
}

/// Turns profiles, parted by "/", into surfaces of `columns` faces around. Each profile is smooth, the next begins at
/// a corner; they run from the middle of the bottom outwards and up, so that the front is outside. Rows are spread by
/// length, `rows` in all; v runs from 0 to 1 over each profile on its own.
pub(crate) fn turn(name: &str, material: &str, (columns, rows): (usize, usize), profiles: &str) -> Vec<Part> {
    let curves: Vec<Curve> = profiles.split('/').map(profile).collect();
    let total: f64 = curves.iter().map(Curve::length).sum();
    curves
        .iter()
        .enumerate()
        .map(|(i, curve)| {
            let rows = ((rows as f64 * curve.length() / total).round() as usize).max(1);
            let name = if i == 0 { name.to_owned() } else { format!("{name}-{i}") };
            Part::surface(&name, material, (columns, rows), [1.0, 1.0], |u, v| around(curve.at(v), u))
        })
        .collect()
}

/// A point of a profile turned by `u` whole turns.
pub(crate) fn around((radius, height): (f64, f64), u: f64) -> Vec3 {
    let (sin, cos) = (u * TAU).sin_cos();
    [radius.max(0.0) * cos, height, -radius.max(0.0) * sin]
}

/// Turns one smooth profile and then moves each point by `bend`.
pub(crate) fn turn_bent(
    name: &str,
    material: &str,
    (columns, rows): (usize, usize),
    points: &str,
    bend: impl Fn(Vec3, f64) -> Vec3,
) -> Part {
    let curve = profile(points);
    Part::surface(name, material, (columns, rows), [1.0, 1.0], |u, v| bend(around(curve.at(v), u), u))
}

/// A tube around a path in the plane z = 0, closed at neither end.
pub(crate) fn tube(
    name: &str,
    material: &str,
    path: impl Fn(f64) -> Vec3,
    radius: impl Fn(f64) -> f64,
    (along, round): (usize, usize),
) -> Part {
    Part::surface(name, material, (round, along), [1.0, 4.0], move |u, v| {
        let step = 1e-3;
        let (a, b) = (path(v - step), path(v + step));
        let forward = normalize(add(b, scale(a, -1.0)));
        let side = [0.0, 0.0, 1.0];
        let up = cross(side, forward);
        let (sin, cos) = (u * TAU).sin_cos();
        add(path(v), scale(add(scale(side, cos), scale(up, -sin)), radius(v)))
    })
}
