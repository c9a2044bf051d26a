//! Scheel, Stamminger and Seidel's operator for walkthroughs, 2000.
//!
//! For frames of a walk, whose centre decides. Not for pictures that are looked at all over, and not as a reference of
//! the paper: its text could not be had.

use super::scale::Scale;
use super::statistics::{as_eyes_see, log_average_to_eyes};
use super::time::{AdaptationState, Goal};
use super::ward94::scale_factor;
use super::{FittedTone, Pixel, SceneGuide, ToneOperator};
use crate::display::{PixelDensity, Viewing};

/// [`Ward94`](super::Ward94) with the world adaptation from some hundred points of the view, most of them at its
/// centre (or where the eye looks), as rays into the scene would give it: cheap enough for each frame, whatever the
/// picture's size.
///
/// "Tone reproduction for interactive walkthroughs", Computer Graphics Forum 19(3), 2000. The paper's text could not be
/// had: that the sample is centre-weighted is stated by others, the Gaussian and its width are ours.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Scheel00 {
    /// Multiplies the result: 2^stops.
    pub exposure: f64,
}

const POINTS: usize = 512;
/// Standard deviation of the points' places, over the picture's shorter side.
const SPREAD: f64 = 0.25;

impl ToneOperator for Scheel00 {
    fn name(&self) -> &'static str {
        "scheel00"
    }

    fn sees_adaptation(&self) -> bool {
        true
    }

    /// The goal of the centre-weighted points, over time too.
    fn goal(&self, guide: &SceneGuide<'_>, density: PixelDensity) -> Goal {
        let view = Goal::of(guide, density);
        let of_points =
            |plane, of_view: f64| sampled(&SceneGuide { luminance_cd_m2: plane, ..*guide }).unwrap_or(of_view);
        Goal {
            cones_cd_m2: of_points(guide.luminance_cd_m2, view.cones_cd_m2),
            rods_cd_m2: of_points(guide.rods(), view.rods_cd_m2),
        }
    }

    fn fit(&self, guide: &SceneGuide<'_>, viewing: &Viewing, state: Option<&AdaptationState>) -> Box<dyn FittedTone> {
        let display_adaptation = viewing.display.white_cd_m2 / 2.0;
        let adaptation =
            state.map(|state| state.cones.neural_cd_m2).or_else(|| seen(guide)).unwrap_or(display_adaptation);
        Box::new(Scale {
            operator: self.name().to_owned(),
            relative_per_cd_m2: self.exposure * scale_factor(adaptation, display_adaptation)
                / viewing.display.white_cd_m2.max(f64::MIN_POSITIVE),
        })
    }
}

/// Geometric mean of what eyes see at the points, or where nothing is at any of them, of all, cd/m².
fn seen(guide: &SceneGuide<'_>) -> Option<f64> {
    sampled(guide).or_else(|| log_average_to_eyes(guide.luminance_cd_m2))
}

/// Geometric mean of what eyes see at the points, cd/m².
fn sampled(guide: &SceneGuide<'_>) -> Option<f64> {
    let plane = guide.luminance_cd_m2;
    let (mut sum, mut count) = (0.0, 0.0);
    for Pixel { x, y } in points(plane.width(), plane.height(), guide.gaze) {
        if let Some(value) = as_eyes_see(plane.get(x, y)) {
            sum += f64::from(value).ln();
            count += 1.0;
        }
    }
    (count > 0.0).then(|| (sum / count).exp())
}

/// Points of a Gaussian around the gaze or the centre that fall into the picture, always the same ones.
fn points(width: usize, height: usize, gaze: Option<Pixel>) -> impl Iterator<Item = Pixel> {
    let sigma = SPREAD * width.min(height) as f64;
    let (x, y) =
        gaze.map_or((width as f64 / 2.0, height as f64 / 2.0), |gaze| (gaze.x as f64 + 0.5, gaze.y as f64 + 0.5));
    (0..POINTS).filter_map(move |index| {
        // The R2 sequence (Roberts 2018), which fills the square evenly, bent to a Gaussian (Box and Muller).
        let [u, v] = [0.754_877_666_246_692_8, 0.569_840_290_998_053_3].map(|step| (0.5 + step * index as f64).fract());
        let radius = sigma * (-2.0 * (1.0 - u).ln()).sqrt();
        let (sine, cosine) = (std::f64::consts::TAU * v).sin_cos();
        let (x, y) = ((x + radius * cosine).floor(), (y + radius * sine).floor());
        (x >= 0.0 && y >= 0.0 && x < width as f64 && y < height as f64)
            .then_some(Pixel { x: x as usize, y: y as usize })
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::plane::Plane;

    #[test]
    fn the_centre_counts_most_and_the_gaze_moves_it() {
        let scene =
            Plane::from_fn(400, 200, |x, y| if x.abs_diff(200) < 60 && y.abs_diff(100) < 60 { 100.0 } else { 1.0 });
        let guide = SceneGuide::of(&scene);
        assert!(sampled(&guide).unwrap() > 10.0);
        assert!(sampled(&guide.with_gaze(Some(Pixel { x: 20, y: 20 }))).unwrap() < 1.5);
        assert!((sampled(&SceneGuide::of(&Plane::filled(4, 4, 0.0))).unwrap() / 1e-4 - 1.0).abs() < 1e-6);
        assert!(sampled(&SceneGuide::of(&Plane::filled(0, 0, 0.0))).is_none());
        assert!((sampled(&SceneGuide::of(&Plane::filled(1, 1, 7.0))).unwrap() - 7.0).abs() < 1e-6);
    }

    /// An eye that has long looked at a view is adapted to what the still of it is fitted to.
    #[test]
    fn an_adapted_eye_sees_the_centre_too() {
        let lamp = Plane::from_fn(200, 100, |x, y| if x.abs_diff(100).max(y.abs_diff(50)) < 25 { 100.0 } else { 1.0 });
        let guide = SceneGuide::of(&lamp);
        let (operator, viewing) = (Scheel00 { exposure: 1.0 }, Viewing::default());
        let goal = operator.goal(&guide, viewing.display.pixel_density());
        let eye = AdaptationState::adapted_to(goal, &operator.kinetics());
        let [still, moving] =
            [None, Some(&eye)].map(|state| operator.fit(&guide, &viewing, state).relative_luminance(5.0));
        assert!((moving / still - 1.0).abs() < 1e-6, "{still} and {moving}");
        assert!(goal.cones_cd_m2 > 2.0 * Goal::of(&guide, viewing.display.pixel_density()).cones_cd_m2);
    }

    #[test]
    fn it_agrees_with_the_mean_of_an_even_spread() {
        let noise = Plane::from_fn(640, 360, |x, y| 10.0 * 1.5_f32.powi(((x * 31 + y * 17) % 5) as i32 - 2));
        assert!((sampled(&SceneGuide::of(&noise)).unwrap() / 10.0 - 1.0).abs() < 0.1);
    }
}
