//! Reads `[environment]`: a picture, one colour, or the sky of a place of the sun.

use super::fields::Value;
use super::light::unit_luminance;
use crate::scene::load::sky::{self, Sky};
use crate::scene::load::{LoadError, environment};
use crate::scene::{Environment, Light, Parametrisation};
use glam::{Mat3, Vec3};
use std::ops::RangeInclusive;
use std::path::Path;

/// What surrounds the scene, and the sun if there is one.
pub(super) struct Surroundings {
    pub(super) environment: Environment,
    pub(super) sun: Option<Light>,
}

/// Reads the environment; `nits_per_unit` turns cd/m² into scene units, `notes` gets what was done to a picture's
/// values.
pub(super) fn read(
    value: &Value,
    folder: &Path,
    nits_per_unit: f64,
    notes: &mut Vec<String>,
) -> Result<Surroundings, LoadError> {
    let known = ["image", "radiance", "luminance_cd_m2", "color", "sky", "parametrisation", "scale", "rotation_deg"];
    let fields = value.fields(&known)?;
    let scale = fields.get_or("scale", 1.0, Value::non_negative)? as f32;
    let rotation_deg = fields.get_or("rotation_deg", 0.0, Value::number)? as f32;
    let from_world = Mat3::from_rotation_y(-rotation_deg.to_radians());
    let (kind, source) = fields.exactly_one(&["image", "radiance", "luminance_cd_m2", "sky"])?;
    for (key, belongs_to) in [("parametrisation", "image"), ("color", "luminance_cd_m2")] {
        if kind != belongs_to
            && let Some(value) = fields.get(key)
        {
            return Err(value.error(format_args!("belongs to {belongs_to} only")));
        }
    }
    let environment = match kind {
        "sky" => {
            if let Some(value) = fields.get("scale") {
                return Err(value.error("belongs to image and radiance: a sky has its own luminance"));
            }
            let mut sky = read_sky(&source)?;
            // The sun's azimuth counts towards +x, a turned picture's angle counter-clockwise.
            sky.sun_azimuth_deg -= rotation_deg;
            let light = sky::light(&sky, nits_per_unit);
            return Ok(Surroundings { environment: light.environment, sun: light.sun });
        }
        "image" => {
            let kinds = [("lat-long", Parametrisation::LatLong), ("equal-area", Parametrisation::EqualArea)];
            let parametrisation =
                fields.get_or("parametrisation", Parametrisation::LatLong, |value| value.choice(&kinds))?;
            environment::read(&folder.join(source.string()?), parametrisation, notes)
                .map_err(|error| error.referenced_from(source.place()))?
        }
        "radiance" => Environment::constant(source.color()?),
        _ => {
            let tint = match fields.get("color") {
                Some(color) => unit_luminance(&color, color.color()?)?,
                None => Vec3::ONE,
            };
            Environment::constant(tint * (source.non_negative()? / nits_per_unit) as f32)
        }
    };
    Ok(Surroundings { environment: Environment { scale, from_world, ..environment }, sun: None })
}

fn read_sky(value: &Value) -> Result<Sky, LoadError> {
    let fields = value.fields(&["sun_elevation_deg", "sun_azimuth_deg", "turbidity", "ground_albedo", "sun"])?;
    let default = Sky::default();
    let number = |key, default: f32, range: RangeInclusive<f32>| {
        let (low, high) = range.into_inner();
        let within = |value: &Value| value.within(f64::from(low), f64::from(high));
        fields.get_or(key, f64::from(default), within).map(|number| number as f32)
    };
    Ok(Sky {
        sun_elevation_deg: number("sun_elevation_deg", default.sun_elevation_deg, Sky::ELEVATION_DEG)?,
        sun_azimuth_deg: fields.get_or("sun_azimuth_deg", f64::from(default.sun_azimuth_deg), Value::number)? as f32,
        turbidity: number("turbidity", default.turbidity, Sky::TURBIDITY)?,
        ground_albedo: number("ground_albedo", default.ground_albedo, 0.0..=1.0)?,
        sun: fields.get_or("sun", default.sun, Value::boolean)?,
    })
}
