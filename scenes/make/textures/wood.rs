//! Oiled planks: grain along u, five planks across v.

use crate::noise::{fractal, gradient, mix, random, step};
use crate::raster::{Color, Raster, mix_colors, scale_color};
use std::path::Path;

const PLANKS: i32 = 5;
const LIGHT: Color = [0.74, 0.53, 0.34];
const DARK: Color = [0.50, 0.31, 0.17];

struct Sample {
    /// 0 early wood, 1 late wood.
    ring: f32,
    /// Fine fibres along the grain, about [-1, 1].
    fibre: f32,
    /// 0 in a joint, 1 on a plank.
    plank: f32,
    /// A number in [0, 1) for the plank.
    tone: f32,
}

fn sample(u: f32, v: f32) -> Sample {
    let across = v * PLANKS as f32;
    let index = across.floor() as i32;
    let seed = 40 + index as u32;
    let shift = random(index, 3, 7);
    let u = u + shift;
    let y = across - across.floor() - 0.5;
    // A plank is a cut through rings around a core that wanders along the plank, some way off it.
    let core = 0.25 * gradient(u * 2.0, 0.5, (2, 1), seed) + mix(-0.5, 0.5, random(index, 0, 11));
    let depth = mix(0.25, 0.7, random(index, 1, 11)) + 0.12 * gradient(u * 3.0, 3.5, (3, 8), seed);
    let warp = 0.035 * fractal(u * 4.0, across, (4, PLANKS), 4, seed + 9);
    let radius = ((y - core) * 0.8).hypot(depth) + warp;
    let phase = (radius * 17.0).rem_euclid(1.0);
    // Late wood grows dark slowly and ends at once.
    let ring = step(0.15, 0.85, phase) * (1.0 - step(0.90, 1.0, phase));
    let fibre = fractal(u * 8.0, across * 42.0, (8, PLANKS * 42), 3, seed + 20);
    let plank = step(0.012, 0.024, 0.5 - y.abs());
    Sample { ring, fibre, plank, tone: random(index, 2, 5) }
}

/// Writes `wood.png` and `wood-roughness.png`.
pub(super) fn write(folder: &Path) -> anyhow::Result<()> {
    Raster::new(512, |u, v| {
        let s = sample(u, v);
        let color = mix_colors(LIGHT, DARK, (0.75 * s.ring + 0.45 * s.fibre).clamp(0.0, 1.0));
        let color = scale_color(color, mix(0.86, 1.08, s.tone) * mix(0.25, 1.0, s.plank));
        [color[0], color[1] * mix(0.97, 1.02, s.tone), color[2]]
    })
    .write(&folder.join("wood.png"))?;
    Raster::new(256, |u, v| {
        let s = sample(u, v);
        mix(0.9, 0.38 + 0.12 * s.ring + 0.10 * s.fibre, s.plank)
    })
    .write(&folder.join("wood-roughness.png"))
}
