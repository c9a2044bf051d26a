//! What a viewer can look at, and how values become colours.

use super::coarse::stand_in;
use crate::film::{Film, PixelGuide};
use crate::output::encode_srgb8;
use fechner_perception::Plane;
use glam::Vec2;
use serde::{Deserialize, Serialize};

/// Layers, in the order of the page's buttons.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub(super) enum Layer {
    /// As the display shows it.
    Picture,
    /// Samples of each pixel.
    Samples,
    /// Standard error that is at visibility 1, cd/m² on the display.
    Threshold,
    /// How visible the remaining noise is.
    Visibility,
    /// Variance of the picture's luminance.
    Variance,
    /// Half the difference of the two halves.
    HalfDifference,
    /// Albedo of the first surfaces.
    Albedo,
    /// Their normals.
    Normal,
    /// Their distance.
    Depth,
    /// Their motion in the picture, to the next frame.
    Velocity,
}

/// How many layers there are.
pub(super) const LAYERS: usize = 10;

/// A layer in colours: 8 bits, RGB after RGB, and what the colours mean.
pub(super) struct Colours {
    pub(super) rgb8: Vec<u8>,
    pub(super) legend: String,
}

impl Layer {
    /// Place in arrays and in the first byte of a frame.
    pub(super) fn index(self) -> usize {
        self as usize
    }
}

/// Positive values by their logarithm, dark to bright, between the 0.5th and the 99.5th percentile.
pub(super) fn logarithmic(values: &Plane, unit: &str) -> Colours {
    let (low, high) = range(values);
    let scale = 1.0 / (high / low).ln().max(1e-3);
    let rgb8 = values.values().iter().flat_map(|&v| heat((f64::from(v).max(low) / low).ln() * scale)).collect();
    Colours { rgb8, legend: format!("dark {} to bright {} {unit}, logarithmic", figure(low), figure(high)) }
}

/// Visibility against a target: blue to black below it, black through red to pale yellow at four times it.
pub(super) fn visibility(values: &Plane, target: f64) -> Colours {
    let rgb8 = values
        .values()
        .iter()
        .flat_map(|&v| {
            let ratio = f64::from(v) / target;
            if ratio <= 1.0 {
                [0, (40.0 * ratio) as u8, (40.0 + 60.0 * ratio) as u8]
            } else {
                heat(0.3 + 0.35 * ratio.log2())
            }
        })
        .collect();
    Colours {
        rgb8,
        legend: format!(
            "blue: at most the target, {}; red to yellow: up to {} and above",
            figure(target),
            figure(4.0 * target)
        ),
    }
}

/// Signed values: grey is 0, white and black are four times the root mean square.
pub(super) fn signed(values: &Plane, unit: &str) -> Colours {
    let square = |v: &f32| f64::from(*v) * f64::from(*v);
    let rms = (values.values().iter().map(square).sum::<f64>() / values.values().len().max(1) as f64).sqrt();
    let most = (4.0 * rms).max(f64::MIN_POSITIVE);
    let grey = |v: &f32| [(127.5 + 127.5 * (f64::from(*v) / most).clamp(-1.0, 1.0)) as u8; 3];
    let rgb8 = values.values().iter().flat_map(grey).collect();
    Colours { rgb8, legend: format!("black −{0} to white +{0} {unit}", figure(most)) }
}

/// Colours between 0 and 1.
pub(super) fn albedo(film: &Film) -> Colours {
    let albedo: Vec<[f32; 3]> = surfaces(film).map(|surface| surface.albedo).collect();
    Colours { rgb8: encode_srgb8(film.width(), &albedo), legend: "share of light that is reflected".to_owned() }
}

/// x, y, z from −1 to 1 as red, green, blue.
pub(super) fn normal(film: &Film) -> Colours {
    let byte = |n: f32| (127.5 + 127.5 * n.clamp(-1.0, 1.0)) as u8;
    let rgb8 = surfaces(film).flat_map(|surface| surface.normal.map(byte)).collect();
    Colours { rgb8, legend: "x, y, z of the world as red, green, blue; −1 dark, 1 bright".to_owned() }
}

/// Near is bright.
pub(super) fn depth(film: &Film) -> Colours {
    let depths: Vec<f32> = surfaces(film).map(|surface| surface.depth).collect();
    let plane = Plane::from_values(film.width() as usize, film.height() as usize, depths);
    let Ok(plane) = plane else { return nothing_yet(film) };
    let (low, high) = range(&plane);
    let scale = 1.0 / (high / low).ln().max(1e-3);
    let grey = |&d: &f32| {
        let share = if d > 0.0 { 1.0 - (f64::from(d) / low).ln() * scale } else { 0.0 };
        [(255.0 * share.clamp(0.0, 1.0)) as u8; 3]
    };
    let rgb8 = plane.values().iter().flat_map(grey).collect();
    Colours { rgb8, legend: format!("bright {} to dark {} scene units, logarithmic", figure(low), figure(high)) }
}

/// Motion to the next frame: to the right orange, left blue, down green, up magenta, still grey.
pub(super) fn velocity(to_next_px: &[Vec2], frames_per_second: f64) -> Colours {
    /// Motion that nobody sees, pixels a frame: what rounding leaves of stillness.
    const STILL_PX: f32 = 1e-3;
    let mut speeds: Vec<f32> = to_next_px.iter().map(|motion| motion.abs().max_element()).collect();
    speeds.sort_unstable_by(f32::total_cmp);
    let most = speeds.get((0.995 * speeds.len().saturating_sub(1) as f64) as usize).copied().unwrap_or(0.0);
    let most = if most > STILL_PX { most } else { speeds.last().copied().unwrap_or(0.0) };
    let (scale, legend) = if most > STILL_PX {
        let most_px = figure(f64::from(most));
        let legend = format!(
            "right orange, left blue, down green, up magenta; full at {most_px} pixels in 1/{frames_per_second} s"
        );
        (127.5 / most, legend)
    } else {
        (0.0, "nothing moves here".to_owned())
    };
    let byte = |value: f32| (127.5 + (scale * value).clamp(-127.5, 127.5)) as u8;
    let rgb8 = to_next_px.iter().flat_map(|motion| [byte(motion.x), byte(motion.y), byte(-motion.x)]).collect();
    Colours { rgb8, legend }
}

/// For layers that are not known now, and why.
pub(super) fn unknown(film: &Film, why: &str) -> Colours {
    let bytes = 3 * film.width() as usize * film.height() as usize;
    Colours { rgb8: vec![24; bytes], legend: why.to_owned() }
}

/// First surfaces; where a pixel has no samples yet, another's.
fn surfaces(film: &Film) -> impl Iterator<Item = &PixelGuide> {
    (0..film.guides().len()).map(|pixel| &film.guides()[stand_in(film, pixel).unwrap_or(pixel)])
}

/// For layers that need a look at the film which has not been taken.
pub(super) fn nothing_yet(film: &Film) -> Colours {
    unknown(film, "known after the first look")
}

/// The 0.5th and 99.5th percentile of what is above 0.
fn range(values: &Plane) -> (f64, f64) {
    let mut above: Vec<f32> = values.values().iter().copied().filter(|v| *v > 0.0 && v.is_finite()).collect();
    if above.is_empty() {
        return (1.0, 2.0);
    }
    above.sort_unstable_by(f32::total_cmp);
    let at = |share: f64| f64::from(above[(share * (above.len() - 1) as f64) as usize]);
    (at(0.005), at(0.995))
}

/// Black, purple, red, orange, pale yellow for 0 to 1.
fn heat(share: f64) -> [u8; 3] {
    const STOPS: [[f64; 3]; 5] =
        [[4.0, 3.0, 18.0], [86.0, 18.0, 110.0], [190.0, 54.0, 84.0], [248.0, 142.0, 20.0], [252.0, 252.0, 170.0]];
    let at = if share.is_nan() { 0.0 } else { share.clamp(0.0, 1.0) } * (STOPS.len() - 1) as f64;
    let below = (at as usize).min(STOPS.len() - 2);
    let rest = at - below as f64;
    std::array::from_fn(|c| (STOPS[below][c] + rest * (STOPS[below + 1][c] - STOPS[below][c])) as u8)
}

/// Three significant digits.
fn figure(value: f64) -> String {
    match value.abs() {
        v if (100.0..1e6).contains(&v) => format!("{value:.0}"),
        v if (1.0..100.0).contains(&v) => format!("{}", (value * 100.0).round() / 100.0),
        v if (0.001..1.0).contains(&v) => format!("{}", (value * 1e4).round() / 1e4),
        _ => format!("{value:.2e}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_of_any_kind_become_colours() {
        let plane = Plane::from_values(5, 1, vec![f32::NAN, 0.0, -1.0, f32::INFINITY, 3.0]).expect("a plane");
        for colours in [logarithmic(&plane, "x"), visibility(&plane, 1.0), signed(&plane, "x")] {
            assert_eq!(colours.rgb8.len(), 15, "{}", colours.legend);
        }
        assert_eq!((heat(0.0), heat(2.0)), ([4, 3, 18], [252, 252, 170]));
    }

    /// Directions are told apart, and a still picture is one grey with a word about it.
    #[test]
    fn motion_has_a_colour_for_each_direction() {
        let [right, left, down, up] = [Vec2::X, -Vec2::X, Vec2::Y, -Vec2::Y].map(|motion| 2.0 * motion);
        let colours = velocity(&[right, left, down, up, Vec2::ZERO], 24.0);
        let rgb = |i: usize| <[u8; 3]>::try_from(&colours.rgb8[3 * i..3 * i + 3]).expect("three");
        let found = [rgb(0), rgb(1), rgb(2), rgb(3), rgb(4)];
        assert_eq!(found, [[255, 127, 0], [0, 127, 255], [127, 255, 127], [127, 0, 127], [127; 3]]);
        let still = velocity(&[Vec2::splat(1e-5); 3], 24.0);
        assert_eq!((still.rgb8, still.legend.as_str()), (vec![127; 9], "nothing moves here"));
        // One small thing moves in a picture that is else still.
        let mut mostly = vec![Vec2::ZERO; 1000];
        mostly[500] = Vec2::X;
        assert_eq!(velocity(&mostly, 24.0).rgb8[1500], 255);
    }

    /// What is above the target never looks like what is below it.
    #[test]
    fn the_target_is_a_border_of_colours() {
        let plane = Plane::from_values(4, 1, vec![0.0, 1.99, 2.01, 8.0]).expect("a plane");
        let colours = visibility(&plane, 2.0).rgb8;
        let is_blue = |i: usize| colours[3 * i] == 0;
        assert!(is_blue(0) && is_blue(1) && !is_blue(2) && !is_blue(3), "{colours:?}");
    }
}
