//! Reads `[[lights]]`: point, spot and directional, in photometric units. Surfaces that shine are materials.

use super::fields::{Fields, Value};
use crate::scene::load::{LoadError, luminance};
use crate::scene::{Light, SpotFalloff};
use glam::Vec3;
use std::f64::consts::TAU;

/// Reads one light; `nits_per_unit` turns candela and lux into scene units.
pub(super) fn read(value: &Value, nits_per_unit: f64) -> Result<Light, LoadError> {
    let any = value.entries()?;
    let kinds = [("point", "point"), ("spot", "spot"), ("directional", "directional")];
    match any.require("type")?.choice(&kinds)? {
        "point" => {
            let fields = value.fields(&["type", "name", "position", "intensity_cd", "power_lm", "color"])?;
            let position = fields.require("position")?.vec3()?;
            Ok(Light::Point { position, intensity: intensity(&fields, 2.0 * TAU, nits_per_unit)? })
        }
        "spot" => {
            let known = [
                "type",
                "name",
                "position",
                "target",
                "direction",
                "intensity_cd",
                "power_lm",
                "color",
                "inner_deg",
                "outer_deg",
            ];
            let fields = value.fields(&known)?;
            let position = fields.require("position")?.vec3()?;
            let (kind, aim) = fields.exactly_one(&["target", "direction"])?;
            let direction = if kind == "direction" {
                aim.direction()?
            } else {
                (aim.vec3()? - position).try_normalize().ok_or_else(|| aim.error("is the light's own position"))?
            };
            let outer = fields.get_or("outer_deg", 30.0, |value| value.within(0.01, 180.0))?;
            let inner = fields.get_or("inner_deg", 0.8 * outer, |value| value.within(0.0, outer))?;
            let (inner, outer) = (inner.to_radians(), outer.to_radians());
            let falloff = SpotFalloff::Smoothstep;
            let solid_angle = f64::from(falloff.solid_angle(inner as f32, outer as f32));
            Ok(Light::Spot {
                position,
                direction,
                intensity: intensity(&fields, solid_angle, nits_per_unit)?,
                inner_angle: inner as f32,
                outer_angle: outer as f32,
                falloff,
            })
        }
        _ => {
            let fields = value.fields(&["type", "name", "direction", "illuminance_lx", "color", "diameter_deg"])?;
            let lux = amount(&fields.require("illuminance_lx")?, &fields)?;
            Ok(Light::Directional {
                direction: fields.require("direction")?.direction()?,
                irradiance: lux / nits_per_unit as f32,
                angular_radius: 0.5 * fields.get_or("diameter_deg", 0.0, |v| v.within(0.0, 170.0))?.to_radians() as f32,
                is_of_sky: false,
            })
        }
    }
}

/// Candela, or lumen spread over a solid angle.
fn intensity(fields: &Fields, solid_angle: f64, nits_per_unit: f64) -> Result<Vec3, LoadError> {
    let (kind, value) = fields.exactly_one(&["intensity_cd", "power_lm"])?;
    let per = if kind == "power_lm" { solid_angle } else { 1.0 };
    Ok(amount(&value, fields)? / (per * nits_per_unit) as f32)
}

/// A photometric amount: one number of the tint `color`, or one a channel (then `color` multiplies it).
fn amount(value: &Value, fields: &Fields) -> Result<Vec3, LoadError> {
    let amount = value.color()?;
    let Some(color) = fields.get("color") else {
        return Ok(amount);
    };
    let tint = color.color()?;
    if value.is_array() { Ok(amount * tint) } else { Ok(amount * unit_luminance(&color, tint)?) }
}

/// The tint at luminance 1, so that a number of candela or lumen stays that number.
pub(super) fn unit_luminance(value: &Value, tint: Vec3) -> Result<Vec3, LoadError> {
    let luminance = luminance(tint);
    if luminance > 0.0 { Ok(tint / luminance) } else { Err(value.error("a colour of light must not be black")) }
}
