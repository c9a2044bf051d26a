//! Velocity maps against rendered frames: what a frame shows is, within noise, where its map says that the next one
//! has it.

use crate::support::{add_material, add_rectangle, diffuse, empty_scene, trace_settings};
use fechner::animate::velocity::VelocityMap;
use fechner::film::{Estimate, Film};
use fechner::integrator::{BlockWork, PathTracer, SamplePlan, TraceSettings};
use fechner::sampler::{Half, PixelFilter};
use fechner::scene::{Camera, Environment, Scene};
use glam::{Vec2, Vec3};
use std::sync::Arc;

const WIDTH: u32 = 60;
const HEIGHT: u32 = 40;
const ROWS: u32 = 6;
const PATCHES_PER_ROW: u32 = 17;

/// A wall of patches of as many greys. Its rows slide past each other, and the camera goes by and turns. Nothing is
/// in the way of the light of the surroundings, so that no patch changes as it moves.
fn wall(frame: f32) -> Scene {
    let mut scene = empty_scene();
    // Brighter to one side, so that its light has noise.
    scene.environment = Some(Environment::from_directions(32, 16, |d| Vec3::splat(0.6 + 0.5 * d.x)));
    let eye = Vec3::new(0.2 * frame, 0.1 * frame, 5.0 - 0.1 * frame);
    scene.camera = Camera::pinhole(eye, Vec3::new(0.01 * frame, 0.0, -1.0).normalize(), Vec3::Y, 40.0);
    for row in 0..ROWS {
        let slid = 0.18 * (row as f32 - 2.5) * frame;
        for patch in 0..PATCHES_PER_ROW {
            let grey = 0.1 + 0.8 * (0.618_034 * (row * PATCHES_PER_ROW + patch) as f32).fract();
            let material = add_material(&mut scene, diffuse(grey), Vec3::ZERO);
            let corner = Vec3::new(0.9 * (patch as f32 - 8.5) + slid, 0.6 * (row as f32 - 3.0), 0.0);
            add_rectangle(&mut scene, corner, Vec3::X * 0.9, Vec3::Y * 0.6, material);
        }
    }
    scene
}

fn tracer(scene: &Scene, seed: u64) -> PathTracer {
    // No wider than a pixel, so that most patches have pixels that see nothing else.
    let settings = TraceSettings { filter: PixelFilter::Box, ..trace_settings(WIDTH, HEIGHT, seed) };
    PathTracer::new(Arc::new(scene.clone()), settings)
}

/// The same number of samples everywhere.
fn film_of(tracer: &PathTracer) -> Film {
    let blocks = (0..WIDTH * HEIGHT)
        .flat_map(|pixel| Half::BOTH.map(|half| (0..3).map(move |level| BlockWork::whole(pixel, half, level))))
        .flatten()
        .collect();
    let mut film = Film::new(WIDTH, HEIGHT);
    tracer.trace(&SamplePlan { blocks }, &mut film, &|_| {});
    film
}

/// Whether all of a pixel's neighbours show the same patch, so that what is beside it in the next frame is that patch
/// too.
fn is_inside(film: &Film, x: u32, y: u32) -> bool {
    let albedo = |x: u32, y: u32| film.features()[(y * WIDTH + x) as usize].albedo[0];
    let own = albedo(x, y);
    (y - 2..=y + 2).all(|row| (x - 2..=x + 2).all(|column| (albedo(column, row) - own).abs() < 1e-4))
}

/// Luminance and its variance between four pixels; `None` where not all are in the picture.
fn between_pixels(picture: &Estimate, place: Vec2) -> Option<[f32; 2]> {
    let corner = (place - 0.5).floor();
    let is_in = corner.cmpge(Vec2::ZERO).all() && corner.x + 1.0 < WIDTH as f32 && corner.y + 1.0 < HEIGHT as f32;
    let share = place - 0.5 - corner;
    let mut sum = [0.0; 2];
    for (dx, dy) in [(0, 0), (1, 0), (0, 1), (1, 1)].into_iter().filter(|_| is_in) {
        let weight = (if dx == 1 { share.x } else { 1.0 - share.x }) * (if dy == 1 { share.y } else { 1.0 - share.y });
        let (x, y) = (corner.x as usize + dx, corner.y as usize + dy);
        sum[0] += weight * picture.luminance_cd_m2.get(x, y);
        sum[1] += weight * weight * picture.variance_of_mean.get(x, y);
    }
    is_in.then_some(sum)
}

/// Squared differences from what a motion leads to in the next frame, in units of their variance: all that can be made.
fn squared_scores(film: &Film, next: &Estimate, motion: &[Vec2]) -> Vec<f64> {
    let now = film.estimate(1.0);
    let inside =
        (2..HEIGHT - 2).flat_map(|y| (2..WIDTH - 2).map(move |x| (x, y))).filter(|&(x, y)| is_inside(film, x, y));
    let score = |(x, y): (u32, u32)| {
        let place = Vec2::new(x as f32, y as f32) + 0.5 + motion[(y * WIDTH + x) as usize];
        let [there, variance_there] = between_pixels(next, place)?;
        let (x, y) = (x as usize, y as usize);
        let variance = f64::from(now.variance_of_mean.get(x, y) + variance_there);
        Some(f64::from(now.luminance_cd_m2.get(x, y) - there).powi(2) / variance)
    };
    inside.filter_map(score).collect()
}

/// Where both frames see a point they agree within their own variance; without the map, or with the one to the frame
/// before, they do not.
#[test]
fn a_frame_is_where_its_velocity_says_in_the_next_one() {
    let [before, now, next] = [-1.0, 0.0, 1.0].map(wall);
    let tracer_now = tracer(&now, 1);
    let map = VelocityMap::new(&tracer_now, &before, &next);
    let (film, next) = (film_of(&tracer_now), film_of(&tracer(&next, 2)).estimate(1.0));
    let mean = |scores: &[f64]| scores.iter().sum::<f64>() / scores.len() as f64;
    let warped = squared_scores(&film, &next, &map.to_next);
    assert!(warped.len() > 200 && warped.iter().all(|score| score.is_finite()), "{} pixels", warped.len());
    // Stratified samples vary less than their variance says; four standard errors of a mean square of 1 are added to
    // it.
    let most = 1.0 + 4.0 * (2.0 / warped.len() as f64).sqrt();
    let worst = warped.iter().copied().fold(0.0, f64::max);
    assert!(mean(&warped) < most && worst < 36.0, "{} in the mean, {worst} at most", mean(&warped));
    for (name, motion) in [("none", vec![Vec2::ZERO; map.to_next.len()]), ("backwards", map.to_previous.clone())] {
        let scores = squared_scores(&film, &next, &motion);
        assert!(mean(&scores) > 10.0 * most, "{name}: {} in the mean", mean(&scores));
    }
}
