//! Light from all around, as lat-long Radiance pictures: row 0 is up, the middle column is −z.

use crate::noise::{fractal, step};
use image::Rgb;
use image::codecs::hdr::HdrEncoder;
use std::f32::consts::{PI, TAU};
use std::path::Path;

const WIDTH: usize = 256;
const HEIGHT: usize = 128;

/// A place in the picture: azimuth in turns from −z towards +x, elevation in degrees.
fn write(path: &Path, radiance: impl Fn(f32, f32) -> [f32; 3]) -> anyhow::Result<()> {
    let pixels: Vec<Rgb<f32>> = (0..WIDTH * HEIGHT)
        .map(|i| {
            let azimuth = ((i % WIDTH) as f32 + 0.5) / WIDTH as f32 - 0.5;
            let elevation = 90.0 - 180.0 * ((i / WIDTH) as f32 + 0.5) / HEIGHT as f32;
            Rgb(radiance(azimuth, elevation))
        })
        .collect();
    let file = std::io::BufWriter::new(std::fs::File::create(path)?);
    HdrEncoder::new(file).encode(&pixels, WIDTH, HEIGHT)?;
    Ok(())
}

fn sum(a: [f32; 3], b: [f32; 3], weight: f32) -> [f32; 3] {
    std::array::from_fn(|i| a[i] + b[i] * weight)
}

/// 1 inside a box of azimuths (turns) and elevations (degrees), with edges `soft` degrees wide.
fn window(azimuth: f32, elevation: f32, (left, right): (f32, f32), (low, high): (f32, f32), soft: f32) -> f32 {
    let rise = |edge: f32, x: f32| step(edge - soft, edge + soft, x);
    rise(low, elevation)
        * (1.0 - rise(high, elevation))
        * rise(left * 360.0, azimuth * 360.0)
        * (1.0 - rise(right * 360.0, azimuth * 360.0))
}

/// A late afternoon: low warm sun behind thin cloud, blue above, ground below.
fn evening(azimuth: f32, elevation: f32) -> [f32; 3] {
    let up = (elevation / 90.0).clamp(0.0, 1.0);
    let (sun_azimuth, sun_elevation) = (-0.19_f32, 24.0_f32);
    let rad = |degrees: f32| degrees * PI / 180.0;
    let cos = rad(elevation).sin() * rad(sun_elevation).sin()
        + rad(elevation).cos() * rad(sun_elevation).cos() * ((azimuth - sun_azimuth) * TAU).cos();
    let away = cos.clamp(-1.0, 1.0).acos() * 180.0 / PI;
    if elevation < 0.0 {
        let ground = 0.10 + 0.08 * step(-40.0, 0.0, elevation);
        return [ground * 1.1, ground, ground * 0.85];
    }
    let mut color = sum([0.85, 0.78, 0.72], [-0.62, -0.42, -0.10], up.powf(0.55));
    let x = azimuth + 0.5;
    let cloud =
        fractal(x * 8.0, elevation / 14.0, (8, 997), 5, 3) + 0.35 * fractal(x * 3.0, elevation / 25.0, (3, 997), 2, 4);
    let cover = step(0.02, 0.5, cloud) * step(0.0, 14.0, elevation);
    color = sum(color.map(|c| c * (1.0 - 0.6 * cover)), [1.15, 1.08, 1.02], 0.75 * cover);
    color = sum(color, [1.9, 1.25, 0.65], (-away / 14.0).exp());
    sum(color, [560.0, 430.0, 260.0], (-(away / 3.2).powi(2)).exp())
}

/// A dim room: a tall window on the left, a smaller one behind on the right, warm walls.
fn room(azimuth: f32, elevation: f32) -> [f32; 3] {
    let shade = 0.5 + 0.5 * (elevation / 90.0);
    let mut color = [0.30, 0.26, 0.21].map(|c| c * (0.35 + 0.65 * shade));
    let big = window(azimuth, elevation, (-0.33, -0.17), (2.0, 52.0), 1.2);
    let bars = |at: f32, wide: f32, x: f32| step(wide, wide + 0.8, (x - at).abs());
    let big = big * bars(-0.25 * 360.0, 0.8, azimuth * 360.0) * bars(27.0, 0.8, elevation);
    let small = window(azimuth, elevation, (0.34, 0.42), (5.0, 42.0), 1.2);
    color = sum(color, [15.0, 17.0, 20.5], big);
    sum(color, [9.0, 8.0, 6.6], small)
}

/// A photographer's studio: two soft boxes and a strip light in the dark.
fn studio(azimuth: f32, elevation: f32) -> [f32; 3] {
    let mut color = [0.045, 0.046, 0.05];
    // Each box fades towards one end, as soft boxes do, which draws gradients on gloss.
    let left = window(azimuth, elevation, (-0.33, -0.22), (8.0, 62.0), 2.0) * step(-10.0, 80.0, elevation);
    let right = window(azimuth, elevation, (0.20, 0.25), (-2.0, 75.0), 1.5);
    let top = step(66.0, 74.0, elevation);
    color = sum(color, [70.0, 68.0, 66.0], left);
    color = sum(color, [34.0, 36.0, 39.0], right);
    sum(color, [3.0, 3.0, 3.0], top)
}

/// Writes `evening.hdr`, `room.hdr` and `studio.hdr`.
pub(crate) fn write_all(folder: &Path) -> anyhow::Result<()> {
    write(&folder.join("evening.hdr"), evening)?;
    write(&folder.join("room.hdr"), room)?;
    write(&folder.join("studio.hdr"), studio)
}
