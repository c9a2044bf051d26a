//! Glazed wall tiles and bricks, both in running bond.

use crate::noise::{fractal, gradient, mix, random, step};
use crate::raster::{Color, Raster, mix_colors, scale_color};
use std::path::Path;

/// A place in a running bond.
struct Place {
    /// Column and row, wrapped.
    id: (i32, i32),
    /// Place in the stone, [-0.5, 0.5] each.
    local: (f32, f32),
    /// Distance to its edge, in heights of a stone.
    edge: f32,
}

/// Running bond of `columns` × `rows` (even) stones.
fn bond(u: f32, v: f32, columns: i32, rows: i32, aspect: f32) -> Place {
    let y = v * rows as f32;
    let row = y.floor() as i32;
    let x = u * columns as f32 + if row.rem_euclid(2) == 1 { 0.5 } else { 0.0 };
    let local = (x - x.floor() - 0.5, y - y.floor() - 0.5);
    let edge = ((0.5 - local.0.abs()) * aspect).min(0.5 - local.1.abs());
    Place { id: ((x.floor() as i32).rem_euclid(columns), row.rem_euclid(rows)), local, edge }
}

/// A tile's share of the place (0 is grout) and how its face leans and bulges.
fn tile(u: f32, v: f32) -> (Place, f32, f32) {
    let place = bond(u, v, 4, 8, 2.0);
    let share = step(0.035, 0.055, place.edge);
    let lean = |k| random(place.id.0, place.id.1, k) - 0.5;
    let face = 0.10 * (lean(1) * place.local.0 + lean(2) * place.local.1)
        + 0.06 * fractal(u * 8.0, v * 8.0, (8, 8), 2, 3)
        + 0.9 * step(0.03, 0.13, place.edge);
    (place, share, face)
}

fn tile_color(u: f32, v: f32) -> Color {
    let (place, share, _) = tile(u, v);
    let pick = |k| random(place.id.0, place.id.1, k);
    let glaze = mix_colors([0.16, 0.36, 0.36], [0.24, 0.47, 0.44], pick(5));
    // Glaze runs thin, and so lighter, at the edges.
    let thin = 1.0 - step(0.05, 0.17, place.edge);
    let cloud = 1.0 + 0.10 * fractal(u * 12.0, v * 12.0, (12, 12), 3, 8);
    let glaze = mix_colors(scale_color(glaze, cloud), [0.45, 0.60, 0.55], 0.55 * thin);
    let grout = scale_color([0.72, 0.69, 0.63], 1.0 + 0.10 * fractal(u * 64.0, v * 64.0, (64, 64), 2, 4));
    mix_colors(grout, glaze, share)
}

fn brick(u: f32, v: f32) -> (Place, f32, f32) {
    let wobble = |seed| 0.004 * fractal(u * 12.0, v * 12.0, (12, 12), 3, seed);
    let place = bond(u + wobble(21), v + wobble(22), 4, 12, 3.0);
    let ragged = 0.05 * gradient(u * 48.0, v * 48.0, (48, 48), 25);
    let share = step(0.06, 0.10, place.edge + ragged);
    let pits = fractal(u * 40.0, v * 40.0, (40, 40), 4, 26);
    let height = 0.75 * step(0.04, 0.16, place.edge + ragged) + 0.16 * pits;
    (place, share, height)
}

fn brick_color(u: f32, v: f32) -> Color {
    let (place, share, _) = brick(u, v);
    let pick = |k| random(place.id.0, place.id.1, k);
    let clay = mix_colors([0.62, 0.30, 0.21], [0.47, 0.21, 0.17], pick(31));
    let clay = if pick(32) < 0.14 { mix_colors(clay, [0.30, 0.19, 0.19], 0.7) } else { clay };
    let clay = if pick(33) < 0.12 { mix_colors(clay, [0.76, 0.50, 0.34], 0.6) } else { clay };
    let grain = 1.0 + 0.22 * fractal(u * 32.0, v * 32.0, (32, 32), 4, 34);
    let bloom = step(0.15, 0.6, fractal(u * 5.0, v * 5.0, (5, 5), 4, 35));
    let clay = mix_colors(scale_color(clay, grain), [0.74, 0.66, 0.60], 0.28 * bloom);
    let mortar = scale_color([0.70, 0.66, 0.60], 1.0 + 0.16 * fractal(u * 64.0, v * 64.0, (64, 64), 3, 36));
    mix_colors(mortar, clay, share)
}

/// Writes colour, normals and roughness of the tiles, and colour and normals of the bricks.
pub(super) fn write(folder: &Path) -> anyhow::Result<()> {
    Raster::new(512, tile_color).write(&folder.join("tiles.png"))?;
    Raster::new(512, |u, v| tile(u, v).2).normals(0.012).write(&folder.join("tiles-normal.png"))?;
    Raster::new(256, |u, v| mix(0.85, 0.16, tile(u, v).1)).write(&folder.join("tiles-roughness.png"))?;
    Raster::new(512, brick_color).write(&folder.join("bricks.png"))?;
    Raster::new(256, |u, v| brick(u, v).2).normals(0.010).write(&folder.join("bricks-normal.png"))
}
