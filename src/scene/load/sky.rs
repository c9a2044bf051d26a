//! A clear sky with its sun, in cd/m² and lx, from the sun's place and the haze.
//!
//! Sky: Preetham, Shirley and Smits, "A Practical Analytic Model for Daylight", 1999. Not for a sun below the horizon,
//! nor for turbidities outside [2, 10], for which the model was not fitted. Sun: the solar disc through the air masses
//! and optical depths of the same paper's appendix (Rayleigh and aerosol; ozone, gases and water vapour are left out:
//! below 5 % of illuminance at an air mass of 1).
//!
//! Limits of the sky. It is too bright, above all while the sun is low: on level ground at turbidity 3 it gives, at sun
//! elevations of 0°, 3°, 10° and 60°, 11, 2.5, 2.0 and 2.1 times the illuminance that handbooks give for a clear sky
//! (IES RP-21: 0.8 + 15.5 √sin h klx; `cargo test --lib brighter_than_handbooks -- --nocapture`), so that there is no
//! dusk. Near the horizon it depends on turbidity more than real skies do: at 2 the horizon opposite a sun at 10° is
//! about three times as bright as at 3. Below a sixteenth of a degree of elevation it is that of this elevation.

use super::spectrum::{observer_at, xyz_to_rgb};
use super::within_rec709;
use crate::scene::{Environment, Light};
use glam::{DVec3, Vec3};
use std::f32::consts::{FRAC_1_PI, FRAC_PI_2};
use std::ops::RangeInclusive;

/// What a clear sky depends on.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sky {
    /// Height of the sun above the horizon in degrees, within [`Sky::ELEVATION_DEG`].
    pub sun_elevation_deg: f32,
    /// Direction of the sun in degrees from −z (ahead) towards +x (right).
    pub sun_azimuth_deg: f32,
    /// Haze: 2 is very clear, 3 clear, 6 warm and moist, 10 hazy. Within [`Sky::TURBIDITY`].
    pub turbidity: f32,
    /// Reflectance of the ground below the horizon, in [0, 1].
    pub ground_albedo: f32,
    /// Whether the sun itself shines.
    pub sun: bool,
}

impl Sky {
    /// Heights of the sun, degrees, that it can have.
    pub const ELEVATION_DEG: RangeInclusive<f32> = 0.0..=90.0;
    /// Turbidities that the fit of its luminance holds for.
    pub const TURBIDITY: RangeInclusive<f32> = 2.0..=10.0;
}

impl Default for Sky {
    /// A clear afternoon.
    fn default() -> Self {
        Self { sun_elevation_deg: 45.0, sun_azimuth_deg: 40.0, turbidity: 3.0, ground_albedo: 0.2, sun: true }
    }
}

/// What a sky adds to a scene.
#[derive(Clone, Debug)]
pub struct SkyLight {
    /// The sky above and the ground below the horizon.
    pub environment: Environment,
    /// The sun's disc, unless it was left out or has no height.
    pub sun: Option<Light>,
}

/// Half angle of the solar disc in radians, at the mean distance.
const SUN_ANGULAR_RADIUS: f32 = 0.004_65;
/// Illuminance of the sun outside the atmosphere in lx (133 klx: Darula, Kittler and Gueymard, "Reference Luminous
/// Solar Constant and Solar Luminance for Illuminance Calculations", 2005).
const SOLAR_ILLUMINANCE_LX: f64 = 133_300.0;
/// Columns and rows of the sky's picture: the glow around the sun is degrees wide.
const SIZE: [u32; 2] = [512, 256];

/// The sky in scene units.
pub fn light(sky: &Sky, nits_per_unit: f64) -> SkyLight {
    let (azimuth, elevation) = (sky.sun_azimuth_deg.to_radians(), sky.sun_elevation_deg.to_radians());
    let towards_sun = Vec3::new(elevation.cos() * azimuth.sin(), elevation.sin(), -elevation.cos() * azimuth.cos());
    let per_unit = (1.0 / nits_per_unit) as f32;
    let sun_irradiance = solar_irradiance(elevation, sky.turbidity) * per_unit;
    let dome = Dome::new(FRAC_PI_2 - elevation, sky.turbidity);
    let above = |direction: Vec3| dome.luminance(direction, towards_sun) * per_unit;
    let upper_only = Environment::from_directions(SIZE[0], SIZE[1], |d| if d.y > 0.0 { above(d) } else { Vec3::ZERO });
    let mut on_ground = upper_only.irradiance(Vec3::Y);
    if sky.sun {
        on_ground += sun_irradiance * towards_sun.y.max(0.0);
    }
    let ground = on_ground * (sky.ground_albedo * FRAC_1_PI);
    let environment = Environment::from_directions(SIZE[0], SIZE[1], |d| if d.y > 0.0 { above(d) } else { ground });
    let sun = (sky.sun && elevation > 0.0).then_some(Light::Directional {
        direction: -towards_sun,
        irradiance: sun_irradiance,
        angular_radius: SUN_ANGULAR_RADIUS,
        is_of_sky: true,
    });
    SkyLight { environment, sun }
}

/// Perez's five coefficients.
type Perez = [f32; 5];

/// The distribution of luminance Y and chromaticity x, y over the sky.
struct Dome {
    /// For Y, x and y.
    perez: [Perez; 3],
    /// Zenith value over Perez's function there.
    scale: [f32; 3],
}

impl Dome {
    /// For the sun's angle from the zenith in radians.
    fn new(sun_zenith: f32, turbidity: f32) -> Self {
        let t = turbidity;
        // Appendix A.2 of the paper: distribution coefficients.
        let perez = [
            [
                0.1787 * t - 1.4630,
                -0.3554 * t + 0.4275,
                -0.0227 * t + 5.3251,
                0.1206 * t - 2.5771,
                -0.0670 * t + 0.3703,
            ],
            [
                -0.0193 * t - 0.2592,
                -0.0665 * t + 0.0008,
                -0.0004 * t + 0.2125,
                -0.0641 * t - 0.8989,
                -0.0033 * t + 0.0452,
            ],
            [
                -0.0167 * t - 0.2608,
                -0.0950 * t + 0.0092,
                -0.0079 * t + 0.2102,
                -0.0441 * t - 1.6537,
                -0.0109 * t + 0.0529,
            ],
        ];
        // Zenith values: luminance in kcd/m², then chromaticities as polynomials of turbidity and the sun's angle.
        let chi = (4.0 / 9.0 - t / 120.0) * (std::f32::consts::PI - 2.0 * sun_zenith);
        let luminance = 1000.0 * ((4.0453 * t - 4.9710) * chi.tan() - 0.2155 * t + 2.4192);
        let s = sun_zenith;
        let polynomial = |rows: [[f32; 4]; 3]| {
            let of_sun = rows.map(|[a, b, c, d]| ((a * s + b) * s + c) * s + d);
            (of_sun[0] * t + of_sun[1]) * t + of_sun[2]
        };
        let x = polynomial([
            [0.001_66, -0.003_75, 0.002_09, 0.0],
            [-0.029_03, 0.063_77, -0.032_02, 0.003_94],
            [0.116_93, -0.211_96, 0.060_52, 0.258_86],
        ]);
        let y = polynomial([
            [0.002_75, -0.006_10, 0.003_17, 0.0],
            [-0.042_14, 0.089_70, -0.041_53, 0.005_16],
            [0.153_46, -0.267_56, 0.066_70, 0.266_88],
        ]);
        let zenith = [luminance.max(0.0), x, y];
        let scale = std::array::from_fn(|i| zenith[i] / perez_value(&perez[i], 1.0, sun_zenith));
        Self { perez, scale }
    }

    /// Linear Rec.709 in cd/m².
    fn luminance(&self, direction: Vec3, towards_sun: Vec3) -> Vec3 {
        let cos_theta = direction.y.max(1e-3);
        let gamma = direction.dot(towards_sun).clamp(-1.0, 1.0).acos();
        let [luminance, x, y] = std::array::from_fn(|i| self.scale[i] * perez_value(&self.perez[i], cos_theta, gamma));
        rgb_of(x, y) * luminance.max(0.0)
    }
}

/// F(θ, γ) of Perez, Seals and Michalsky 1993.
fn perez_value([a, b, c, d, e]: &Perez, cos_theta: f32, gamma: f32) -> f32 {
    let cos_gamma = gamma.cos();
    (1.0 + a * (b / cos_theta).exp()) * (1.0 + c * (d * gamma).exp() + e * cos_gamma * cos_gamma)
}

/// Linear Rec.709 of luminance 1 and this chromaticity; what lies outside the gamut is brought in at that luminance.
fn rgb_of(x: f32, y: f32) -> Vec3 {
    let y = y.max(1e-3);
    let [x, y] = [x, y].map(f64::from);
    within_rec709(xyz_to_rgb(DVec3::new(x / y, 1.0, (1.0 - x - y) / y)).as_vec3())
}

/// Irradiance of the sun on a surface that faces it, linear Rec.709 in lx.
fn solar_irradiance(elevation: f32, turbidity: f32) -> Vec3 {
    let degrees = f64::from(elevation.to_degrees()).max(0.0);
    // Relative optical air mass (Kasten and Young 1989).
    let air_mass = 1.0 / (degrees.to_radians().sin() + 0.505_72 * (degrees + 6.079_95).powf(-1.6364));
    // Ångström's turbidity coefficient from the haze, and his exponent of 1.3.
    let beta = 0.046_08 * f64::from(turbidity) - 0.045_86;
    let (mut outside, mut arriving) = (0.0, DVec3::ZERO);
    for step in 0..=80 {
        let nm = 380.0 + 5.0 * f64::from(step);
        let um = nm / 1000.0;
        let transmitted = (-air_mass * (0.008_735 * um.powf(-4.08) + beta * um.powf(-1.3))).exp();
        let emitted = black_body(nm, 5772.0);
        let response = observer_at(nm);
        outside += emitted * response.y;
        arriving += response * (emitted * transmitted);
    }
    within_rec709(xyz_to_rgb(arriving * (SOLAR_ILLUMINANCE_LX / outside)).as_vec3())
}

/// Planck's law up to a factor.
fn black_body(nm: f64, kelvin: f64) -> f64 {
    let um = nm / 1000.0;
    um.powi(-5) / ((14_387.77 / (um * kelvin)).exp() - 1.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn luminance(rgb: Vec3) -> f32 {
        crate::scene::load::luminance(rgb)
    }

    fn sky_of(sun_elevation_deg: f32, turbidity: f32) -> SkyLight {
        light(&Sky { sun_elevation_deg, turbidity, ..Sky::default() }, 1.0)
    }

    /// The paper's zenith luminance: T = 3 and the sun at 45° give (4.0453·3 − 4.9710)·tan χ − 0.2155·3 + 2.4192 kcd/m²
    /// with χ = (4/9 − 3/120)·π/2.
    #[test]
    fn the_zenith_has_the_papers_luminance() {
        let chi = (4.0f32 / 9.0 - 3.0 / 120.0) * FRAC_PI_2;
        let expected = 1000.0 * ((4.0453 * 3.0 - 4.9710) * chi.tan() - 0.2155 * 3.0 + 2.4192);
        let seen = luminance(sky_of(45.0, 3.0).environment.radiance(Vec3::Y));
        assert!((seen / expected - 1.0).abs() < 0.01, "{seen} {expected}");
    }

    /// Handbook orders of magnitude for a clear day: some 100 klx of sun and 10 to 20 klx of sky with the sun high (the
    /// model gives 27), and a sun that turns weak and red as it sets.
    #[test]
    fn light_is_that_of_a_clear_day() {
        let strength = |sky: &SkyLight| match sky.sun {
            Some(Light::Directional { irradiance, .. }) => irradiance,
            _ => Vec3::ZERO,
        };
        let high = sky_of(60.0, 2.5);
        assert!((80_000.0..115_000.0).contains(&luminance(strength(&high))), "{}", luminance(strength(&high)));
        let from_sky = luminance(high.environment.irradiance(Vec3::Y));
        assert!((8_000.0..30_000.0).contains(&from_sky), "{from_sky}");
        let blue = high.environment.radiance(Vec3::Y);
        assert!(blue.z > 1.5 * blue.x, "the zenith is blue: {blue}");
        let low = strength(&sky_of(3.0, 2.5));
        assert!(luminance(low) < 0.2 * luminance(strength(&high)) && low.x > 3.0 * low.z, "{low}");
    }

    /// The limits that the module's text tells of.
    #[test]
    fn a_low_suns_sky_is_brighter_than_handbooks_say() {
        for (elevation, expected) in [(0.0f32, 11.0f32), (3.0, 2.45), (10.0, 1.96), (60.0, 2.07)] {
            let of_handbook = 800.0 + 15_500.0 * f32::sqrt(elevation.to_radians().sin());
            let ratio = luminance(sky_of(elevation, 3.0).environment.irradiance(Vec3::Y)) / of_handbook;
            println!("sun at {elevation}°: {ratio:.2} times {of_handbook:.0} lx");
            assert!((ratio / expected - 1.0).abs() < 0.05, "{elevation}°: {ratio}");
        }
        let opposite = |turbidity| {
            let (azimuth, elevation) = (Sky::default().sun_azimuth_deg.to_radians(), 1.0f32.to_radians());
            let direction =
                Vec3::new(-azimuth.sin() * elevation.cos(), elevation.sin(), azimuth.cos() * elevation.cos());
            luminance(sky_of(10.0, turbidity).environment.radiance(direction))
        };
        assert!((opposite(2.0) / opposite(3.0) / 2.87 - 1.0).abs() < 0.05, "{}", opposite(2.0) / opposite(3.0));
    }

    #[test]
    fn every_sky_is_finite() {
        for elevation in [0.0, 1.0, 30.0, 90.0] {
            for turbidity in [2.0, 5.0, 10.0] {
                let sky = sky_of(elevation, turbidity);
                assert!(sky.environment.texels.iter().all(|t| t.is_finite() && t.min_element() >= 0.0));
            }
        }
    }
}
