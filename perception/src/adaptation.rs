//! What the eye is adapted to.
//!
//! The mean luminance over a Gaussian as wide as a disc of 1°, at which thresholds are taken. Not for the course of
//! adaptation over time ([`crate::tone::AdaptationState`]), and not for noisy pictures as they are: of noise only lone
//! fireflies and pairs are brought down, so give a denoised guide.

use crate::display::{Display, Viewing};
use crate::error::Error;
use crate::filter::gaussian_blur_xy;
use crate::glare;
use crate::plane::Plane;
use crate::sensitivity::MIN_ADAPTATION_CD_M2;
use crate::threshold::POOLING_SIGMA_DEG;

/// How luminances are averaged.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Mean {
    /// The arithmetic mean: what reaches the retina, and what threshold curves were measured with. A firefly moves it.
    #[default]
    Arithmetic,
    /// exp(mean(ln L)): robust, usual for the key of a whole picture.
    Geometric,
}

/// The luminance, cd/m², that the eye looking at each pixel adapts to: the mean over a Gaussian of σ 0.25° (as wide
/// as a disc of 1°), at least 1e-4. Arithmetic means first bring down pixels that outshine all their neighbours, or
/// all but one: fireflies, alone or in pairs.
///
/// # Errors
/// [`Error::Empty`] and [`Error::BadPixel`] for no picture, [`Error::OutOfRange`] for an impossible display.
///
/// ```
/// use fechner_perception::{Display, Plane};
/// use fechner_perception::adaptation::{Mean, local_adaptation_cd_m2};
/// let halves = Plane::from_fn(120, 8, |x, _| if x < 60 { 1.0 } else { 100.0 });
/// let adapted = local_adaptation_cd_m2(&halves, &Display::default(), Mean::Arithmetic)?;
/// assert!(adapted.get(5, 4) < 1.01 && adapted.get(115, 4) > 99.0);
/// # Ok::<(), fechner_perception::Error>(())
/// ```
pub fn local_adaptation_cd_m2(luminance_cd_m2: &Plane, display: &Display, mean: Mean) -> Result<Plane, Error> {
    luminance_cd_m2.check_non_negative("luminance")?;
    display.check()?;
    Ok(match mean {
        Mean::Arithmetic => local_adaptation(luminance_cd_m2, display),
        Mean::Geometric => {
            // The logarithm of the floor is the origin: the blur wants no negative numbers.
            let logs = luminance_cd_m2.map(|value| (value.max(MIN_ADAPTATION_CD_M2) / MIN_ADAPTATION_CD_M2).ln());
            blurred(&logs, display).map(|log| log.exp() * MIN_ADAPTATION_CD_M2)
        }
    })
}

/// What thresholds are taken at: [`local_adaptation`], and the observer's glare.
pub(crate) fn adapted(luminance_cd_m2: &Plane, viewing: &Viewing) -> Plane {
    let mut adaptation = local_adaptation(luminance_cd_m2, &viewing.display);
    if let Some(veil) = glare::veil_cd_m2(luminance_cd_m2, &adaptation, viewing) {
        adaptation.for_each_row_mut(|y, row| {
            veil.add_to_row(y, row);
        });
    }
    adaptation
}

/// Adaptation luminance: see [`crate::threshold_map`].
fn local_adaptation(luminance_cd_m2: &Plane, display: &Display) -> Plane {
    let mut adaptation = blurred(&without_fireflies(luminance_cd_m2), display);
    adaptation.for_each_row_mut(|_, row| row.iter_mut().for_each(|value| *value = value.max(MIN_ADAPTATION_CD_M2)));
    adaptation
}

fn blurred(plane: &Plane, display: &Display) -> Plane {
    gaussian_blur_xy(plane, display.pixel_density().pixels(POOLING_SIGMA_DEG))
}

/// Every pixel lowered to the second brightest of its eight neighbours where it exceeds that: fireflies, alone and in
/// pairs. In a picture one pixel wide, whose ends have a single neighbour, to the brightest.
fn without_fireflies(plane: &Plane) -> Plane {
    let (width, height) = (plane.width(), plane.height());
    if width * height == 1 {
        return plane.clone();
    }
    let is_line = width == 1 || height == 1;
    let mut result = Plane::filled(width, height, 0.0);
    result.for_each_row_mut(|y, row| {
        // The two brightest neighbours of each pixel; 0 is below them all.
        let (brightest, mut second) = (row, vec![0.0_f32; width]);
        let mut raise = |range: std::ops::Range<usize>, values: &[f32]| {
            let ranks = brightest[range.clone()].iter_mut().zip(&mut second[range]);
            for ((brightest, second), value) in ranks.zip(values) {
                *second = second.max(brightest.min(*value));
                *brightest = brightest.max(*value);
            }
        };
        for v in y.saturating_sub(1)..(y + 2).min(height) {
            let line = plane.row(v);
            raise(1..width, &line[..width - 1]);
            raise(0..width - 1, &line[1..]);
            if v != y {
                raise(0..width, line);
            }
        }
        for ((limit, second), own) in brightest.iter_mut().zip(&second).zip(plane.row(y)) {
            *limit = own.min(if is_line { *limit } else { *second });
        }
    });
    result
}

#[cfg(test)]
mod tests {
    use super::*;

    fn display(pixels_per_degree: f64) -> Display {
        Display { pixels_per_degree, ..Display::default() }
    }

    #[test]
    fn half_dark_half_bright() {
        let picture = Plane::from_fn(40, 40, |x, _| if x < 20 { 1.0 } else { 100.0 });
        // At the edge the window sees as much of one half as of the other.
        let at = |mean| {
            let adapted = local_adaptation_cd_m2(&picture, &display(20.0), mean).unwrap();
            (adapted.get(19, 20), adapted.get(20, 20))
        };
        let (left, right) = at(Mean::Arithmetic);
        assert!((0.5 * (left + right) - 50.5).abs() < 0.1);
        let (left, right) = at(Mean::Geometric);
        assert!(((left * right).sqrt() - 10.0).abs() < 0.1);
    }

    #[test]
    fn an_impossible_display_is_refused() {
        assert!(local_adaptation_cd_m2(&Plane::filled(2, 2, 1.0), &display(0.0), Mean::Geometric).is_err());
    }
}
