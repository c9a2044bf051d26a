//! Linen in plain weave: each thread goes over one and under the next.

use crate::noise::{fractal, mix, random};
use crate::raster::{Color, Raster, mix_colors, scale_color};
use std::f32::consts::PI;
use std::path::Path;

const THREADS: i32 = 16;
const WARP: Color = [0.86, 0.81, 0.71];
const WEFT: Color = [0.70, 0.28, 0.22];

/// Height in [0, 1], whether the warp (along v) is on top, and the number of the thread on top.
fn weave(u: f32, v: f32) -> (f32, bool, i32) {
    let n = THREADS as f32;
    let wobble = |seed| 0.16 * fractal(u * 4.0, v * 4.0, (4, 4), 3, seed);
    let (x, y) = (u * n + wobble(1), v * n + wobble(2));
    let (i, j) = (x.floor() as i32, y.floor() as i32);
    let (fx, fy) = (x - x.floor() - 0.5, y - y.floor() - 0.5);
    // Both threads bend in turn; the higher one is seen.
    let over = if (i + j).rem_euclid(2) == 0 { 1.0 } else { -1.0 };
    let round = |t: f32| (1.0 - (2.1 * t).powi(2)).max(0.0).sqrt();
    let warp = 0.5 * round(fx) * mix(0.75, 1.0, random(i.rem_euclid(THREADS), 0, 3)) + 0.28 * over * (fy * PI).cos();
    let weft = 0.5 * round(fy) * mix(0.75, 1.0, random(j.rem_euclid(THREADS), 1, 3)) - 0.28 * over * (fx * PI).cos();
    let top = warp > weft;
    let thread = if top { i } else { j }.rem_euclid(THREADS);
    ((warp.max(weft).max(0.0) / 0.78).min(1.0), top, thread)
}

fn fibre(u: f32, v: f32, warp: bool) -> f32 {
    if warp { fractal(u * 128.0, v * 16.0, (128, 16), 2, 60) } else { fractal(u * 16.0, v * 128.0, (16, 128), 2, 61) }
}

/// Writes `linen.png` and `linen-normal.png`.
pub(super) fn write(folder: &Path) -> anyhow::Result<()> {
    Raster::new(512, |u, v| {
        let (height, warp, thread) = weave(u, v);
        // A stripe of the second colour runs along the warp.
        let base = if warp && !(2..=3).contains(&thread) {
            WARP
        } else if warp {
            WEFT
        } else {
            mix_colors(WARP, WEFT, 0.12)
        };
        let shade = mix(0.45, 1.0, height) * (1.0 + 0.10 * fibre(u, v, warp)) * mix(0.94, 1.04, random(thread, 9, 4));
        scale_color(base, shade)
    })
    .write(&folder.join("linen.png"))?;
    Raster::new(256, |u, v| {
        let (height, warp, _) = weave(u, v);
        height + 0.06 * fibre(u, v, warp)
    })
    .normals(0.016)
    .write(&folder.join("linen-normal.png"))
}
