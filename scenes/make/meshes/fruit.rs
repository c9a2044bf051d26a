//! Fruit, each a little irregular.

use crate::lathe::{tube, turn_bent};
use crate::mesh::{Part, Vec3};
use crate::noise::solid;
use std::f64::consts::TAU;

/// An apple 0.08 m wide, five-sided as apples are, with its stem.
pub(super) fn apple() -> Vec<Part> {
    // From the blossom end up: v of the texture runs from there, so its image begins at the stem.
    let profile = "0,9 6,6 14,0 26,8 36,26 40.5,45 36,62 24,71.5 12,69 5,61 0,57";
    let body = turn_bent("apple", "apple", (40, 30), profile, |[x, y, z], u| {
        let lobe = 1.0 + 0.022 * (u * TAU * 5.0).cos() * (1.2 - y / 0.08) + 0.015 * (u * TAU + 0.6).cos();
        [x * lobe, y, z * lobe]
    });
    let path = |t: f64| [0.008 * t * t, 0.056 + 0.028 * t, 0.0];
    vec![body, tube("apple-stem", "stem", path, |t| 0.0012 + 0.0008 * t * t, (8, 8))]
}

pub(super) fn orange() -> Part {
    grown("orange", "orange", (36, 24), [0.041, 0.039, 0.041], 5, 0.025, -0.05)
}

/// A sphere pushed in and out along its normals by noise, resting on y = 0.
fn grown(name: &str, material: &str, size: (usize, usize), radii: Vec3, seed: u32, amount: f64, tip: f64) -> Part {
    Part::surface(name, material, size, [1.0, 1.0], move |u, v| {
        let (sin, cos) = (v * TAU / 2.0).sin_cos();
        let (s, c) = (u * TAU).sin_cos();
        let d = [sin * c, -cos, -sin * s];
        let at = d.map(|x| (x * 1.7 + 9.0) as f32);
        let bump = 1.0 + amount * f64::from(solid(at, seed));
        let nipple = tip * (-((1.0 - d[1].abs()) / 0.045)).exp();
        let p: Vec3 = std::array::from_fn(|i| d[i] * radii[i] * bump);
        [p[0], p[1] + d[1].signum() * nipple * radii[1] + radii[1], p[2]]
    })
}

/// A lemon on its side, long in x.
pub(super) fn lemon() -> Part {
    let upright = |u: f64, v: f64| {
        let (sin, cos) = (v * TAU / 2.0).sin_cos();
        let (s, c) = (u * TAU).sin_cos();
        let d = [sin * c, -cos, -sin * s];
        let bump = 1.0 + 0.035 * f64::from(solid(d.map(|x| (x * 1.9 + 5.0) as f32), 8));
        let nipple = 0.012 * (-((1.0 - d[1].abs()) / 0.07)).exp();
        [d[0] * 0.029 * bump, d[1] * (0.037 * bump + nipple), d[2] * 0.029 * bump]
    };
    Part::surface("lemon", "lemon", (32, 30), [1.0, 1.0], move |u, v| {
        let [x, y, z] = upright(u, v);
        [y, 0.029 - x, z]
    })
}

/// A pear 0.11 m tall with its stem.
pub(super) fn pear() -> Vec<Part> {
    let profile = "0,7 7,3 16,0 30,10 37,30 34,52 23,76 17,95 12,107 5,111.5 0,110";
    let lean = |[x, y, z]: Vec3, u: f64| {
        let lobe = 1.0 + 0.02 * (u * TAU * 3.0 + 1.0).cos();
        [x * lobe + 0.9 * y * y, y, z * lobe]
    };
    let body = turn_bent("pear", "pear", (36, 32), profile, lean);
    let path = |t: f64| [0.011 + 0.010 * t * t, 0.109 + 0.026 * t, 0.0];
    vec![body, tube("pear-stem", "stem", path, |t| 0.0012 + 0.0008 * t * t, (8, 8))]
}
