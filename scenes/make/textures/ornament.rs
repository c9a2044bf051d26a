//! Painted and grown surfaces of the still life: a vase's glaze, an apple's skin, an orange's peel. u goes around.

use crate::noise::{cells, fractal, mix, random, step};
use crate::raster::{Color, Raster, mix_colors, scale_color};
use std::f32::consts::TAU;
use std::path::Path;

/// Coverage of a stroke `width` wide around a line `distance` away.
fn stroke(distance: f32, width: f32) -> f32 {
    1.0 - step(width * 0.75, width, distance.abs())
}

/// Blue brush on white glaze; v runs from the lip (0) to the foot (1).
fn vase(u: f32, v: f32) -> Color {
    let hand = |seed| 0.004 * fractal(u * 10.0, v * 10.0, (10, 10), 3, seed);
    let (u, v) = (u + hand(1), v + hand(2));
    let mut ink: f32 = 0.0;
    for (at, width) in
        [(0.09, 0.010), (0.115, 0.004), (0.285, 0.005), (0.305, 0.010), (0.70, 0.010), (0.72, 0.005), (0.93, 0.012)]
    {
        ink = ink.max(stroke(v - at, width));
    }
    // Two waves that cross between the upper bands.
    let wave = 0.055 * (u * TAU * 9.0).sin();
    ink = ink.max(stroke(v - 0.2 - wave, 0.009)).max(stroke(v - 0.2 + wave, 0.009));
    // Flowers on the belly: petals around centres set in a ring, with a tendril between.
    let count = 5.0;
    let cell = (u * count).rem_euclid(1.0) - 0.5;
    let (x, y) = (cell * 1.35, (v - 0.5) * 4.9);
    let (radius, angle) = (x.hypot(y), y.atan2(x));
    let petals = 0.44 + 0.13 * (angle * 6.0).cos();
    let inside = 1.0 - step(petals * 0.95, petals, radius);
    let outline = stroke(radius - petals, 0.045);
    let vein = inside * (0.35 + 0.4 * (0.5 + 0.5 * (angle * 36.0).cos()) * step(0.15, 0.4, radius));
    ink = ink.max(outline).max(vein * 0.8).max(1.0 - step(0.10, 0.13, radius));
    let tendril = (u * count * TAU).cos();
    if radius > petals + 0.06 {
        ink = ink.max(stroke(v - 0.5 - 0.115 * tendril, 0.008)).max(stroke(v - 0.5 + 0.115 * tendril, 0.008));
    }
    // Leaves that stand up from the foot.
    let leaf = (u * 14.0).rem_euclid(1.0) - 0.5;
    let tip = 0.78 + 1.1 * leaf * leaf;
    ink = ink
        .max(if v > tip && v < 0.915 { 0.55 } else { 0.0 })
        .max(stroke(v - tip, 0.007) * step(0.73, 0.74, v) * (1.0 - step(0.91, 0.92, v)));
    let wash = 0.82 + 0.25 * fractal(u * 24.0, v * 24.0, (24, 24), 3, 5);
    let glaze = scale_color([0.93, 0.93, 0.90], 1.0 + 0.02 * fractal(u * 6.0, v * 6.0, (6, 6), 3, 6));
    mix_colors(glaze, [0.10, 0.18, 0.46], (ink * wash).clamp(0.0, 1.0))
}

/// Red over yellow, streaked from the stem (v = 0) down.
fn apple(u: f32, v: f32) -> Color {
    let streak = fractal(u * 40.0, v * 3.0, (40, 3), 3, 11);
    let blush = fractal(u * 3.0, v * 2.0, (3, 2), 3, 12) + 0.35 * (u * TAU).sin();
    let red =
        (0.78 + 0.55 * blush + 0.45 * streak - 0.9 * step(0.12, 0.0, v) - 0.45 * step(0.75, 1.0, v)).clamp(0.0, 1.0);
    let color = mix_colors([0.86, 0.72, 0.30], [0.66, 0.10, 0.10], red);
    let dot = cells(u * 30.0, v * 20.0, (30, 20), 13);
    let speck = (1.0 - step(0.06, 0.10, dot.distance)) * if random(dot.id.0, dot.id.1, 14) < 0.5 { 0.5 } else { 0.0 };
    mix_colors(color, [0.93, 0.82, 0.55], speck)
}

/// Pits of citrus peel as heights.
fn peel(u: f32, v: f32) -> f32 {
    let pit = |scale: i32, seed| {
        let s = scale as f32;
        step(0.0, 0.42, cells(u * s, v * s, (scale, scale), seed).distance)
    };
    mix(pit(40, 3), pit(22, 4), 0.45)
}

/// Writes `vase.png`, `apple.png` and `peel-normal.png`.
pub(super) fn write(folder: &Path) -> anyhow::Result<()> {
    Raster::new(512, vase).write(&folder.join("vase.png"))?;
    Raster::new(256, apple).write(&folder.join("apple.png"))?;
    Raster::new(256, peel).normals(0.006).write(&folder.join("peel-normal.png"))
}
