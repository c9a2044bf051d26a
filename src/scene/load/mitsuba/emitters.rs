//! `<emitter>`: lights, surroundings, and the radiance of surfaces.

use super::super::environment;
use super::super::error::LoadError;
use super::Reader;
use super::element::Element;
use super::textures::Meaning;
use super::transform;
use crate::scene::{ColorInput, Environment, Light, Parametrisation, SpotFalloff};
use glam::{Affine3A, Mat3, Vec3};
use std::f32::consts::PI;

impl Reader {
    /// An emitter that is not a surface's.
    pub(super) fn emitter(&mut self, emitter: &Element) -> Result<(), LoadError> {
        let to_world = transform::of(emitter, "toworld")?;
        let kind = emitter.kind();
        let ahead = || {
            let axis = to_world.transform_vector3(Vec3::Z).try_normalize();
            axis.ok_or_else(|| emitter.error("its transform has no direction"))
        };
        match kind.as_str() {
            "point" => {
                let at = emitter.vector("position")?.unwrap_or(to_world.translation.into());
                let intensity = self.light_color(emitter, "intensity")?;
                self.builder.lights.push(Light::Point { position: at, intensity });
            }
            "spot" => {
                let outer = emitter.float_or("cutoffangle", 20.0)?.clamp(0.01, 90.0);
                let inner = emitter.float_or("beamwidth", 0.75 * outer)?.clamp(0.0, outer);
                let intensity = self.light_color(emitter, "intensity")?;
                if emitter.child("texture").is_some() {
                    self.builder.note(format!("{}: a spot's texture is not rendered.", emitter.place()));
                }
                let direction = ahead()?;
                self.builder.note("Spots fall off smoothly between their two angles, not linearly.");
                self.builder.lights.push(Light::Spot {
                    position: to_world.translation.into(),
                    direction,
                    intensity,
                    inner_angle: inner.to_radians(),
                    outer_angle: outer.to_radians(),
                    falloff: SpotFalloff::Smoothstep,
                });
            }
            "directional" => {
                let direction = match emitter.vector("direction")? {
                    Some(direction) => {
                        direction.try_normalize().ok_or_else(|| emitter.error("a direction of no length"))?
                    }
                    None => ahead()?,
                };
                let irradiance = self.light_color(emitter, "irradiance")?;
                self.builder.lights.push(Light::Directional { direction, irradiance, angular_radius: 0.0 });
            }
            "constant" => {
                let radiance = self.light_color(emitter, "radiance")?;
                self.surround(Environment::constant(radiance));
            }
            "envmap" => {
                let Some(name) = emitter.string("filename")? else {
                    return Err(emitter.error("an envmap needs a filename"));
                };
                let file = self.file(emitter, name);
                let mut environment = environment::read(&file, Parametrisation::LatLong)
                    .map_err(|error| error.referenced_from(emitter.place()))?;
                environment.scale = emitter.float_or("scale", 1.0)?.max(0.0);
                // Mitsuba's picture has +z in its middle, ours −z; both turn the same way round.
                environment.from_world = Mat3::from_rotation_y(PI) * rotation(&to_world).transpose();
                emitter.ignore(&["gamma", "cache", "miscompensation"]);
                self.surround(environment);
            }
            other => {
                return Err(emitter.unsupported(format_args!(
                    "emitter \"{other}\" is not rendered; area, point, spot, directional, constant and envmap are"
                )));
            }
        }
        emitter.ignore(&["samplingweight"]);
        self.note_unused(&format!("emitter \"{kind}\""), emitter);
        Ok(())
    }

    fn surround(&mut self, environment: Environment) {
        if self.builder.environment.is_some() {
            self.builder.note("Several emitters surround the scene: only the first one is rendered.");
        } else {
            self.builder.environment = Some(environment);
        }
    }

    fn light_color(&mut self, emitter: &Element, name: &str) -> Result<Vec3, LoadError> {
        let scale = if emitter.kind() == "envmap" { 1.0 } else { emitter.float_or("scale", 1.0)?.max(0.0) };
        Ok(self.color(emitter, name, Meaning::Light)?.unwrap_or(Vec3::ONE) * scale)
    }

    /// What a surface with an area emitter gives.
    pub(super) fn area_radiance(&mut self, emitter: &Element) -> Result<ColorInput, LoadError> {
        if emitter.kind() != "area" {
            return Err(
                emitter.unsupported(format_args!("emitter \"{}\" on a shape is not rendered; area is", emitter.kind()))
            );
        }
        let radiance =
            self.color_input(emitter, "radiance", Meaning::Light)?.unwrap_or(ColorInput::constant(Vec3::ONE));
        emitter.ignore(&["samplingweight"]);
        self.note_unused("emitter \"area\"", emitter);
        Ok(radiance)
    }
}

/// The rotation of a transform without its scale.
fn rotation(transform: &Affine3A) -> Mat3 {
    let [x, y, z] = [transform.matrix3.x_axis, transform.matrix3.y_axis, transform.matrix3.z_axis].map(Vec3::from);
    let x = x.normalize_or(Vec3::X);
    let y = (y - y.dot(x) * x).try_normalize().unwrap_or_else(|| x.any_orthonormal_vector());
    let upright = x.cross(y);
    Mat3::from_cols(x, y, if upright.dot(z) < 0.0 { -upright } else { upright })
}
