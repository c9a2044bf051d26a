//! Vase, bowl, jug and candle.

use crate::lathe::{tube, turn, turn_bent};
use crate::mesh::Part;
use std::f64::consts::TAU;

/// A painted vase 0.34 m tall: outside, lip, inside.
pub(super) fn vase() -> Vec<Part> {
    let mut parts = turn("vase-foot", "glaze", (56, 1), "0,0 50,0");
    parts.extend(turn(
        "vase-outside",
        "vase",
        (56, 44),
        "50,0 52,12 58,30 88,100 105,165 98,215 68,258 45,285 40,305 46,325 60,340",
    ));
    parts.extend(turn(
        "vase-inside",
        "glaze",
        (56, 22),
        "60,340 60.5,343 58,343 42,325 36,305 41,285 62,258 90,215 90,165 50,30 0,22",
    ));
    parts
}

/// A stoneware bowl 0.25 m wide, glazed light inside.
pub(super) fn bowl() -> Vec<Part> {
    let mut parts = turn(
        "bowl-outside",
        "stoneware",
        (56, 28),
        "0,4 40,4 / 40,4 40,0 46,0 47,10 / 47,10 75,20 104,45 120,78 125,90 123.5,92",
    );
    parts.extend(turn("bowl-inside", "glaze", (56, 18), "123.5,92 121,90 115,78 99,48 70,24 35,14 0,12"));
    parts
}

/// A copper jug 0.2 m tall with a bent handle and a pulled lip.
pub(super) fn jug() -> Vec<Part> {
    let profile =
        "0,0 48,0 56,4 70,35 74,65 64,110 46,145 43,165 50,190 51.5,192 49,190 41,165 43,145 60,110 70,65 60,12 0,6";
    // The lip is pulled out on one side, +x.
    let body = turn_bent("jug-body", "copper", (52, 54), profile, |[x, y, z], u| {
        let side = (0.5 + 0.5 * (u * TAU).cos()).powi(6);
        let pull = side * ((y - 0.150) / 0.042).clamp(0.0, 1.0).powi(2);
        [x * (1.0 + 0.55 * pull), y + 0.010 * pull, z * (1.0 - 0.15 * pull)]
    });
    let path = |t: f64| {
        // Leaves the neck, swings out and comes back at the belly; both ends are inside the wall.
        let angle = TAU * (0.29 - 0.56 * t);
        [-0.068 - 0.044 * angle.cos().max(-0.55), 0.118 + 0.052 * angle.sin() - 0.010 * t, 0.0]
    };
    vec![body, tube("jug-handle", "copper", path, |t| 0.0055 + 0.0015 * (2.0 * t - 1.0).powi(2), (30, 10))]
}

/// A brass candlestick with a candle, 0.36 m in all.
pub(super) fn candle() -> Vec<Part> {
    let mut parts = turn(
        "candlestick",
        "brass",
        (36, 62),
        "0,0 55,0 / 55,0 57,3 52,9 34,16 16,26 10,45 13,56 18,64 13,72 9,85 8,110 10,135 17,148 24,156 26,158 / 26,158 26.5,160 18,161 13.5,163 13,178 11.2,179 0,179",
    );
    parts.extend(turn("candle", "wax", (24, 14), "11,178 10.8,230 10.4,310 9.8,336 8.8,340 6,338 0,335"));
    let wick = |t: f64| [0.003 * t * t, 0.334 + 0.014 * t, 0.0];
    parts.push(tube("wick", "stem", wick, |t| 0.0008 * (1.05 - t), (6, 6)));
    parts
}
