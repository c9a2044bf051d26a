//! Luminous intensity by direction, as goniophotometers measure it: a photometric web.
//!
//! In the C-planes of IES LM-63's type C (CIE 121): the vertical angle γ counts from the lamp's axis, 0° straight down
//! in the lamp's own space, 90° level, 180° straight up; the horizontal angle C counts about that axis,
//! counter-clockwise seen from above (LM-63-2002, section 3). Between the angles measured intensity is bilinear in both
//! of them. Not for near fields: the whole lamp is one point.

use glam::{Mat3, Vec3};

/// Luminous intensity by direction. Dark where it has no vertical angle.
#[derive(Clone, Debug, PartialEq)]
pub struct PhotometricWeb {
    /// Vertical angles γ in degrees within [0, 180], rising.
    vertical_deg: Vec<f32>,
    /// Horizontal angles C in degrees, rising over one whole turn, so that the last plane is the first again; one alone
    /// where intensity does not depend on them.
    horizontal_deg: Vec<f32>,
    /// Luminous intensity in cd: plane after plane, each with a value for every vertical angle.
    intensity_cd: Vec<f32>,
}

impl Default for PhotometricWeb {
    /// Dark all around.
    fn default() -> Self {
        Self { vertical_deg: vec![0.0, 180.0], horizontal_deg: vec![0.0], intensity_cd: vec![0.0; 2] }
    }
}

impl PhotometricWeb {
    /// A web of planes at the horizontal angles, each with an intensity for every vertical angle, at least 0; of two
    /// planes and more the last is the first again, which is not checked.
    ///
    /// # Panics
    /// Unless all angles rise, horizontal ones by 360° in all, and there is an intensity for each pair: who reads files
    /// has told their authors before.
    pub fn new(vertical_deg: Vec<f32>, horizontal_deg: Vec<f32>, intensity_cd: Vec<f32>) -> Self {
        let rises = |angles: &[f32]| angles.windows(2).all(|pair| pair[0] < pair[1]);
        assert!(rises(&vertical_deg) && rises(&horizontal_deg), "angles must rise");
        assert!(vertical_deg.len() >= 2 && !horizontal_deg.is_empty(), "too few angles");
        let turn = horizontal_deg[horizontal_deg.len() - 1] - horizontal_deg[0];
        assert!(horizontal_deg.len() == 1 || turn == 360.0, "the planes fill {turn} degrees");
        assert_eq!(intensity_cd.len(), vertical_deg.len() * horizontal_deg.len(), "intensities");
        Self { vertical_deg, horizontal_deg, intensity_cd }
    }

    /// A web that samples a function of the unit direction in the lamp's space every `step_deg` degrees, of which 180
    /// is a whole multiple.
    pub fn from_directions(step_deg: f32, intensity_cd: impl Fn(Vec3) -> f32) -> Self {
        let steps = (180.0 / step_deg).round() as u32;
        let angles = |count: u32| (0..=count).map(|i| 180.0 * i as f32 / steps as f32).collect::<Vec<_>>();
        let (vertical_deg, horizontal_deg) = (angles(steps), angles(2 * steps));
        let directions =
            horizontal_deg.iter().flat_map(|&c| vertical_deg.iter().map(move |&gamma| direction(gamma, c)));
        let intensity_cd = directions.map(intensity_cd).collect();
        Self::new(vertical_deg, horizontal_deg, intensity_cd)
    }

    /// Luminous intensity in cd in a unit direction of the lamp's own space: γ = 0 along −z, C = 0 along +x and 90°
    /// along +y.
    pub fn intensity_cd(&self, direction: Vec3) -> f32 {
        let Vec3 { x, y, z } = direction;
        let vertical = Between::of(&self.vertical_deg, x.hypot(y).atan2(-z).to_degrees());
        let first = self.horizontal_deg[0];
        let turned = (y.atan2(x).to_degrees() - first).rem_euclid(360.0);
        let horizontal = match self.horizontal_deg.len() {
            1 => Some(Between::ONLY),
            _ => Between::of(&self.horizontal_deg, first + turned),
        };
        let (Some(vertical), Some(horizontal)) = (vertical, horizontal) else { return 0.0 };
        let in_plane = |plane: usize| vertical.mix(&self.intensity_cd[plane * self.vertical_deg.len()..]);
        let before = in_plane(horizontal.index);
        if horizontal.share == 0.0 {
            return before;
        }
        before + horizontal.share * (in_plane(horizontal.index + 1) - before)
    }

    /// The largest intensity in cd.
    pub fn max_cd(&self) -> f32 {
        self.intensity_cd.iter().fold(0.0, |most, &intensity| most.max(intensity))
    }

    /// Luminous flux in lm: the integral of the interpolated intensity over all directions, without quadrature error.
    pub fn flux_lm(&self) -> f64 {
        let vertical = integrals_of_hats(&self.vertical_deg, sine_hat_integrals);
        let horizontal = match self.horizontal_deg.len() {
            1 => vec![std::f64::consts::TAU],
            _ => integrals_of_hats(&self.horizontal_deg, |low, high| [0.5 * (high - low); 2]),
        };
        let planes = self.intensity_cd.chunks_exact(self.vertical_deg.len()).zip(horizontal);
        planes.map(|(plane, weight)| weight * dot(plane, &vertical)).sum()
    }

    /// Vertical angles in radians, each with the largest intensity in cd that any plane has there.
    pub fn profile(&self) -> impl DoubleEndedIterator<Item = (f32, f32)> {
        self.vertical_deg.iter().enumerate().map(|(row, gamma)| {
            let at_gamma = self.intensity_cd.iter().skip(row).step_by(self.vertical_deg.len());
            (gamma.to_radians(), at_gamma.fold(0.0, |most: f32, &intensity| most.max(intensity)))
        })
    }

    /// The rotation from the world's space into that of a lamp whose axis (γ = 0) points along a unit vector, and which
    /// is then turned about it by an angle in radians, in the sense in which C counts.
    ///
    /// As if it were first turned about the vertical and then tilted towards C = 0 (IES LM-72, "orient" and "tilt"):
    /// C = 0 lies in the axis's vertical plane, on its upper side. Of a lamp that looks straight down it is +x, and
    /// straight up −x, with +y as the vertical.
    pub fn from_world(axis: Vec3, spin: f32) -> Mat3 {
        let level = Vec3::new(axis.x, 0.0, axis.z);
        let sine = level.length();
        let ahead = if sine > 1e-6 { level / sine } else { Vec3::X };
        let c_0 = -axis.y * ahead + sine * Vec3::Y;
        let c_90 = c_0.cross(axis);
        let (sin, cos) = spin.sin_cos();
        Mat3::from_cols(cos * c_0 + sin * c_90, cos * c_90 - sin * c_0, -axis).transpose()
    }

    /// Angles and intensities, for who hashes them.
    pub(super) fn arrays(&self) -> [&[f32]; 3] {
        [&self.vertical_deg, &self.horizontal_deg, &self.intensity_cd]
    }
}

/// The unit direction of angles in degrees, in the lamp's space.
fn direction(gamma_deg: f32, c_deg: f32) -> Vec3 {
    let ((sin_gamma, cos_gamma), (sin_c, cos_c)) = (gamma_deg.to_radians().sin_cos(), c_deg.to_radians().sin_cos());
    Vec3::new(sin_gamma * cos_c, sin_gamma * sin_c, -cos_gamma)
}

/// A place between two neighbours of a row of values.
struct Between {
    /// Of the one before.
    index: usize,
    /// Of the way to the next, in [0, 1].
    share: f32,
}

impl Between {
    /// In a row of one.
    const ONLY: Self = Self { index: 0, share: 0.0 };

    /// Where an angle stands among rising ones; `None` outside of them.
    fn of(angles: &[f32], angle: f32) -> Option<Self> {
        let behind = angles.partition_point(|&known| known <= angle);
        if behind == 0 || angle > angles[angles.len() - 1] {
            return None;
        }
        let index = behind.min(angles.len() - 1) - 1;
        Some(Self { index, share: (angle - angles[index]) / (angles[index + 1] - angles[index]) })
    }

    fn mix(&self, values: &[f32]) -> f32 {
        values[self.index] + self.share * (values[self.index + 1] - values[self.index])
    }
}

/// For each of some rising angles in degrees: the integral of a weight times the hat that is 1 there and 0 at the
/// neighbours. `of_part` has, for two ends in radians, the integrals times the falling and the rising side.
fn integrals_of_hats(angles_deg: &[f32], of_part: impl Fn(f64, f64) -> [f64; 2]) -> Vec<f64> {
    let mut integrals = vec![0.0; angles_deg.len()];
    for (index, ends) in angles_deg.windows(2).enumerate() {
        let [falling, rising] = of_part(f64::from(ends[0]).to_radians(), f64::from(ends[1]).to_radians());
        integrals[index] += falling;
        integrals[index + 1] += rising;
    }
    integrals
}

/// ∫ (b − θ)/(b − a) sin θ dθ and ∫ (θ − a)/(b − a) sin θ dθ from a to b, by parts.
fn sine_hat_integrals(low: f64, high: f64) -> [f64; 2] {
    let mean_cosine = (high.sin() - low.sin()) / (high - low);
    [low.cos() - mean_cosine, mean_cosine - high.cos()]
}

fn dot(values: &[f32], weights: &[f64]) -> f64 {
    values.iter().zip(weights).map(|(&value, weight)| f64::from(value) * weight).sum()
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::{PI, TAU};

    /// Steps of 15°, unevenly in C, from 90° on as of street lamps.
    fn uneven() -> PhotometricWeb {
        let vertical: Vec<f32> = (0..=10).map(|i| 15.0 * i as f32).collect();
        let horizontal = vec![90.0, 110.0, 200.0, 330.0, 450.0];
        let value = |plane: usize, row: usize| 100.0 + 37.0 * ((plane % 4) * 7 + row * row % 5) as f32;
        let intensity = (0..5).flat_map(|plane| (0..11).map(move |row| value(plane, row))).collect();
        PhotometricWeb::new(vertical, horizontal, intensity)
    }

    /// At the angles themselves, half way between them, across the seam of C and where there is nothing.
    #[test]
    fn intensity_is_bilinear_in_the_angles() {
        let web = uneven();
        let at = |gamma, c| web.intensity_cd(direction(gamma, c));
        let near = |value: f32, expected: f32| assert!((value - expected).abs() < 0.02, "{value} {expected}");
        near(at(30.0, 110.0), 100.0 + 37.0 * 11.0);
        near(at(37.5, 110.0), 100.0 + 37.0 * 11.0);
        near(at(22.5, 110.0), 100.0 + 37.0 * 9.5);
        near(at(30.0, 155.0), 100.0 + 37.0 * 14.5);
        // From 330° on to 450°, which is 90°: 0° is a quarter of the way.
        near(at(30.0, 0.0), 100.0 + 37.0 * (0.75 * 25.0 + 0.25 * 4.0));
        near(at(30.0, 89.999), 100.0 + 37.0 * 4.0);
        near(at(30.0, 360.0), at(30.0, 0.0));
        assert_eq!(at(150.5, 110.0), 0.0);
        assert_eq!(web.intensity_cd(Vec3::NAN), 0.0);
        assert_eq!(web.max_cd(), 100.0 + 37.0 * 25.0);
    }

    /// The closed form of a Lambertian disk, of which a web in steps of 1° has all but 4e-5, and sums over directions.
    #[test]
    fn flux_is_the_integral_of_intensity() {
        let disk = PhotometricWeb::new(
            (0..=90).map(|i| i as f32).collect(),
            vec![0.0],
            (0..=90).map(|i| 100.0 * (i as f32).to_radians().cos()).collect(),
        );
        assert!((disk.flux_lm() / (100.0 * PI) - 1.0).abs() < 1e-4, "{}", disk.flux_lm());
        let ball = PhotometricWeb::new(vec![0.0, 180.0], vec![0.0, 360.0], vec![7.0; 4]);
        assert!((ball.flux_lm() / (7.0 * 2.0 * TAU) - 1.0).abs() < 1e-12, "{}", ball.flux_lm());
        for web in [disk, uneven()] {
            // A golden-angle spiral, equal areas.
            let count = 400_000;
            let sum: f64 = (0..count)
                .map(|i| {
                    let z = 1.0 - (2.0 * f64::from(i) + 1.0) / f64::from(count);
                    let (sin, cos) = (f64::from(i) * PI * (3.0 - 5f64.sqrt())).sin_cos();
                    let radius = (1.0 - z * z).sqrt();
                    f64::from(web.intensity_cd(Vec3::new((radius * cos) as f32, (radius * sin) as f32, z as f32)))
                })
                .sum();
            let sampled = sum * 2.0 * TAU / f64::from(count);
            assert!((sampled / web.flux_lm() - 1.0).abs() < 1e-4, "{sampled} {}", web.flux_lm());
        }
    }

    /// A function that is sampled every 2° comes back within what bilinear interpolation of that step can be off.
    #[test]
    fn directions_are_sampled_where_they_are() {
        let lobe = |d: Vec3| 1.0 + 0.5 * d.x + 0.25 * d.y - 0.25 * d.z;
        let web = PhotometricWeb::from_directions(2.0, lobe);
        for (gamma, c) in [(3.0, 7.0), (61.0, 121.0), (90.0, 359.0), (135.0, 200.5), (180.0, 0.0)] {
            let (found, expected) = (web.intensity_cd(direction(gamma, c)), lobe(direction(gamma, c)));
            assert!((found - expected).abs() < 2e-4, "{gamma} {c}: {found} {expected}");
        }
    }

    /// What of a lamp points where, for lamps that look down, ahead, sideways and up, and turned about their axes.
    #[test]
    fn lamps_are_turned_and_tilted_as_by_lm_72() {
        let down = Vec3::NEG_Y;
        for (axis, spin_deg, c_0, c_90) in [
            (down, 0.0, Vec3::X, Vec3::NEG_Z),
            (down, 90.0, Vec3::NEG_Z, Vec3::NEG_X),
            (Vec3::NEG_Z, 0.0, Vec3::Y, Vec3::NEG_X),
            (Vec3::X, 0.0, Vec3::Y, Vec3::NEG_Z),
            (Vec3::X, 90.0, Vec3::NEG_Z, Vec3::NEG_Y),
            (Vec3::Y, 0.0, Vec3::NEG_X, Vec3::NEG_Z),
            (Vec3::new(1e-3, -1.0, 0.0).normalize(), 0.0, Vec3::X, Vec3::NEG_Z),
        ] {
            let from_world = PhotometricWeb::from_world(axis, f32::to_radians(spin_deg));
            for (world, own) in [(axis, Vec3::NEG_Z), (c_0, Vec3::X), (c_90, Vec3::Y)] {
                assert!((from_world * world).distance(own) < 2e-3, "{axis} {spin_deg}: {world} {}", from_world * world);
            }
            assert!((from_world.determinant() - 1.0).abs() < 1e-5, "{axis}");
        }
    }
}
