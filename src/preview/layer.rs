//! What a viewer can look at. How they are encoded is left to `frame`.

use super::coarse::stand_in;
use crate::film::{Film, PixelFeatures};
use crate::output::encode_srgb8;
use crate::output::false_colour::{Colours, Range, figure, range, share_of};
use fechner_perception::Plane;
use glam::Vec2;
use serde::{Deserialize, Serialize};

/// Layers, in the order of the page's buttons.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub(super) enum Layer {
    /// The picture as the display shows it.
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

impl Layer {
    /// The layers in the order of their declaration.
    pub(super) const ALL: [Self; 10] = [
        Self::Picture,
        Self::Samples,
        Self::Threshold,
        Self::Visibility,
        Self::Variance,
        Self::HalfDifference,
        Self::Albedo,
        Self::Normal,
        Self::Depth,
        Self::Velocity,
    ];

    /// Place in [`Self::ALL`], in arrays of what layers have, and in the first byte of a frame.
    pub(super) fn index(self) -> usize {
        self as usize
    }
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
    let Some(Range { low, high, .. }) = range(&plane) else { return unknown(film, "there is no surface here") };
    let grey = |&d: &f32| {
        let share = if d > 0.0 { 1.0 - share_of(d.into(), low, high) } else { 0.0 };
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

/// A plain picture in place of a layer that is not known now, with why as its legend.
pub(super) fn unknown(film: &Film, why: &str) -> Colours {
    let bytes = 3 * film.width() as usize * film.height() as usize;
    Colours { rgb8: vec![24; bytes], legend: why.to_owned() }
}

/// First surfaces; where a pixel has no samples yet, another's.
fn surfaces(film: &Film) -> impl Iterator<Item = &PixelFeatures> {
    (0..film.features().len()).map(|pixel| &film.features()[stand_in(film, pixel).unwrap_or(pixel)])
}

/// A plain picture in place of a layer that needs a look at the film which has not been taken.
pub(super) fn nothing_yet(film: &Film) -> Colours {
    unknown(film, "known after the first look")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn layers_stand_in_their_places() {
        assert!(Layer::ALL.into_iter().enumerate().all(|(place, layer)| layer.index() == place));
        assert_eq!(serde_json::from_str::<Layer>("\"velocity\"").expect("the last one").index(), Layer::ALL.len() - 1);
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
}
