//! Marble and terrazzo.

use crate::noise::{cells, fractal, gradient, mix, random, step};
use crate::raster::{Color, Raster, mix_colors, scale_color};
use std::path::Path;

fn marble(u: f32, v: f32) -> Color {
    let warp = |seed| 0.55 * fractal(u * 2.0, v * 2.0, (2, 2), 5, seed);
    let (x, y) = (u * 3.0 + warp(1), v * 3.0 + warp(2));
    // A vein runs where a smooth field changes sign; its width follows another field.
    let vein = |x: f32, y: f32, period: i32, width: f32, seed: u32| {
        let distance = gradient(x, y, (period, period), seed).abs();
        let width = width * (0.35 + 0.65 * (0.5 + 0.5 * gradient(x * 0.5 + 0.3, y * 0.5, (period, period), seed + 1)));
        (-(distance / width).powi(2)).exp()
    };
    let cloud = 0.5 + 0.5 * fractal(u * 3.0 + warp(3), v * 3.0, (3, 3), 5, 9);
    let body = mix_colors([0.93, 0.92, 0.90], [0.76, 0.77, 0.79], step(0.25, 0.9, cloud));
    // Veins fade in and out, else they close to rings.
    let fade = |seed| step(-0.15, 0.45, fractal(u * 3.0 + warp(5), v * 3.0, (3, 3), 3, seed));
    let veins = (0.8 * fade(40) * vein(x, y, 3, 0.05, 20)).max(0.6 * fade(41) * vein(x * 2.0, y * 2.0, 6, 0.05, 30));
    mix_colors(body, [0.36, 0.38, 0.42], veins)
}

const CHIPS: [Color; 6] = [
    [0.75, 0.42, 0.33],
    [0.28, 0.37, 0.40],
    [0.93, 0.89, 0.80],
    [0.62, 0.58, 0.52],
    [0.83, 0.66, 0.42],
    [0.42, 0.48, 0.38],
];

fn terrazzo(u: f32, v: f32) -> Color {
    let grain = fractal(u * 64.0, v * 64.0, (64, 64), 2, 77);
    let mut color = scale_color([0.84, 0.82, 0.78], 1.0 + 0.04 * grain);
    for (scale, share, seed) in [(30, 0.55, 5_u32), (11, 0.75, 6)] {
        let s = scale as f32;
        let bend = |seed| 0.12 * gradient(u * s * 2.0, v * s * 2.0, (2 * scale, 2 * scale), seed);
        let cell = cells(u * s + bend(50), v * s + bend(51), (scale, scale), seed);
        let pick = |k: u32| random(cell.id.0, cell.id.1, seed * 31 + k);
        if pick(0) < share {
            // Chips are what is left of the cells when their borders are cut away, some more, some less.
            let cut = mix(0.10, 0.32, pick(1));
            let inside = step(cut, cut + 0.04, cell.margin);
            let chip = CHIPS[(pick(2) * CHIPS.len() as f32) as usize % CHIPS.len()];
            let shade = mix(0.88, 1.06, pick(3)) * (1.0 + 0.05 * grain);
            color = mix_colors(color, scale_color(chip, shade), inside);
        }
    }
    color
}

/// Writes `marble.png` and `terrazzo.png`.
pub(super) fn write(folder: &Path) -> anyhow::Result<()> {
    Raster::new(512, marble).write(&folder.join("marble.png"))?;
    Raster::new(512, terrazzo).write(&folder.join("terrazzo.png"))
}
