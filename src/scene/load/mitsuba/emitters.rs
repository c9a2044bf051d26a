//! Reads `<emitter>`: lights, surroundings, and the radiance of surfaces.

use super::super::environment;
use super::super::error::{LoadError, names_of};
use super::super::sky::{self, Sky};
use super::Reader;
use super::colors::Meaning;
use super::element::Element;
use super::transform;
use crate::scene::{ColorInput, Environment, Light, Parametrisation, SpotFalloff};
use glam::{Affine3A, Mat3, Vec3};
use std::f32::consts::{FRAC_PI_2, PI};

/// Reads an emitter, which a transform places.
type Kind = fn(&mut Reader, &Element, &Affine3A) -> Result<(), LoadError>;

/// The emitters that are not a surface's.
const KINDS: &[(&str, Kind)] = &[
    ("point", Reader::point),
    ("spot", Reader::spot),
    ("directional", Reader::directional),
    ("constant", Reader::constant),
    ("envmap", Reader::environment_map),
    ("sky", Reader::sky),
    ("sun", Reader::sky),
    ("sunsky", Reader::sky),
];

impl Reader {
    /// An emitter that is not a surface's.
    pub(super) fn emitter(&mut self, emitter: &Element) -> Result<(), LoadError> {
        let to_world = transform::of(emitter, "toworld")?;
        let kind = emitter.kind();
        let Some((_, read)) = KINDS.iter().find(|(name, _)| *name == kind) else {
            let known = names_of(KINDS);
            return Err(emitter
                .unsupported(format_args!("emitter \"{kind}\" is not rendered; {known} are, and area on a shape")));
        };
        read(self, emitter, &to_world)?;
        emitter.ignore(&["samplingweight"]);
        self.note_unused(&format!("emitter \"{kind}\""), emitter);
        Ok(())
    }

    fn point(&mut self, emitter: &Element, to_world: &Affine3A) -> Result<(), LoadError> {
        check_placed_once(emitter, "position")?;
        let position = emitter.vector("position")?.unwrap_or(to_world.translation.into());
        let intensity = self.light_color(emitter, "intensity")?;
        self.builder.lights.push(Light::Point { position, intensity });
        Ok(())
    }

    fn spot(&mut self, emitter: &Element, to_world: &Affine3A) -> Result<(), LoadError> {
        let outer = emitter.float_or("cutoffangle", 20.0)?.clamp(0.01, 180.0);
        let inner = emitter.float_or("beamwidth", 0.75 * outer)?.clamp(0.0, outer);
        let intensity = self.light_color(emitter, "intensity")?;
        if emitter.child("texture").is_some() {
            self.builder.note(format!("{}: a spot's texture is not rendered.", emitter.place()));
        }
        self.builder.lights.push(Light::Spot {
            position: to_world.translation.into(),
            direction: ahead(emitter, to_world)?,
            intensity,
            inner_angle: inner.to_radians(),
            outer_angle: outer.to_radians(),
            falloff: SpotFalloff::LinearInAngle,
        });
        Ok(())
    }

    fn directional(&mut self, emitter: &Element, to_world: &Affine3A) -> Result<(), LoadError> {
        check_placed_once(emitter, "direction")?;
        let direction = match emitter.vector("direction")? {
            Some(direction) => direction.try_normalize().ok_or_else(|| emitter.error("a direction of no length"))?,
            None => ahead(emitter, to_world)?,
        };
        let irradiance = self.light_color(emitter, "irradiance")?;
        self.builder.lights.push(Light::Directional { direction, irradiance, angular_radius: 0.0, is_of_sky: false });
        Ok(())
    }

    fn constant(&mut self, emitter: &Element, _: &Affine3A) -> Result<(), LoadError> {
        let radiance = self.light_color(emitter, "radiance")?;
        self.surround(Environment::constant(radiance));
        Ok(())
    }

    fn environment_map(&mut self, emitter: &Element, to_world: &Affine3A) -> Result<(), LoadError> {
        let Some(name) = emitter.string("filename")? else {
            return Err(emitter.error("an envmap needs a filename"));
        };
        let file = self.file(emitter, name)?;
        let mut environment = environment::read(&file, Parametrisation::LatLong, &mut self.builder.notes)
            .map_err(|error| error.referenced_from(emitter.place()))?;
        environment.scale = emitter.float_or("scale", 1.0)?.max(0.0);
        // Mitsuba's picture has +z in its middle, ours −z; both turn the same way round.
        environment.from_world = Mat3::from_rotation_y(PI) * environment::rotation_of(to_world).transpose();
        emitter.ignore(&["gamma", "cache", "miscompensation"]);
        self.surround(environment);
        Ok(())
    }

    /// The sun's direction in our model's space.
    fn towards_sun(&mut self, emitter: &Element, from_world: Mat3) -> Result<Vec3, LoadError> {
        let Some(direction) = emitter.vector("sundirection")? else {
            self.builder.note(format!(
                "{}: a sun's place is not computed from date and place: it stands 45° high.",
                emitter.place()
            ));
            return Ok(Vec3::new(0.0, 1.0, -1.0).normalize());
        };
        // In the world's space, whatever the emitter's transform (Mitsuba 0.6, `sunsky.cpp`; 3, `sunsky.h`).
        let direction = direction.try_normalize().ok_or_else(|| emitter.error("a sun's direction of no length"))?;
        Ok(from_world * direction)
    }

    /// Sky, sun or both, by our own model of a clear day in cd/m² ([`sky`]).
    fn sky(&mut self, emitter: &Element, to_world: &Affine3A) -> Result<(), LoadError> {
        let kind = emitter.kind();
        // Version 3 has its zenith along +z, the dialects before it along +y; our model's is +y.
        let to_model = if self.since_2 { Mat3::from_rotation_x(-FRAC_PI_2) } else { Mat3::IDENTITY };
        let from_world = to_model * environment::rotation_of(to_world).transpose();
        let towards_sun = self.towards_sun(emitter, from_world)?;
        emitter.ignore(&["year", "month", "day", "hour", "minute", "second", "latitude", "longitude", "timezone"]);
        emitter.ignore(&["resolution", "sunaperture", "complexsun", "stretch", "extend", "sunradiusscale"]);
        let elevation = towards_sun.y.clamp(-1.0, 1.0).asin().to_degrees();
        let turbidity = emitter.float_or("turbidity", 3.0)?;
        let scale = emitter.float_or("scale", 1.0)?;
        let [sky_scale, sun_scale] = [emitter.float_or("skyscale", 1.0)?, emitter.float_or("sunscale", 1.0)?];
        let albedo = self.color(emitter, "albedo", Meaning::Reflectance)?.unwrap_or(Vec3::splat(0.2));
        if elevation < 0.0 {
            self.builder
                .note(format!("{}: a sun below the horizon gives no light, nor does its sky.", emitter.place()));
            return Ok(());
        }
        let day = Sky {
            sun_elevation_deg: elevation,
            sun_azimuth_deg: towards_sun.x.atan2(-towards_sun.z).to_degrees(),
            turbidity: turbidity.clamp(*Sky::TURBIDITY.start(), *Sky::TURBIDITY.end()),
            ground_albedo: super::super::luminance(albedo).clamp(0.0, 1.0),
            sun: kind != "sky",
        };
        let light = sky::light(&day, self.builder.nits_per_unit);
        self.builder.note(format!(
            "Emitter \"{kind}\": luminance is that of fechner's clear sky in cd/m², with the file's turbidity ({}).",
            day.turbidity
        ));
        if kind != "sun" {
            let scale = (light.environment.scale * scale * sky_scale).max(0.0);
            self.surround(Environment {
                scale,
                from_world: light.environment.from_world * from_world,
                ..light.environment
            });
        }
        if let Some(Light::Directional { direction, irradiance, angular_radius, is_of_sky }) = light.sun {
            let irradiance = irradiance * (scale * sun_scale).max(0.0);
            let direction = from_world.transpose() * direction;
            self.builder.lights.push(Light::Directional { direction, irradiance, angular_radius, is_of_sky });
        }
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
        let scale = emitter.float_or("scale", 1.0)?.max(0.0);
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

/// Where an emitter's own z points.
fn ahead(emitter: &Element, to_world: &Affine3A) -> Result<Vec3, LoadError> {
    let axis = to_world.transform_vector3(Vec3::Z).try_normalize();
    axis.ok_or_else(|| emitter.error("its transform has no direction"))
}

/// Refuses `to_world` beside a parameter that says the same, as Mitsuba 3 does.
fn check_placed_once(emitter: &Element, parameter: &str) -> Result<(), LoadError> {
    match (emitter.child(parameter), emitter.child("toworld")) {
        (Some(parameter), Some(_)) => Err(parameter.error("this and to_world exclude each other")),
        _ => Ok(()),
    }
}

#[cfg(test)]
mod tests {
    use super::super::super::{LoadOptions, load};
    use super::*;
    use crate::scene::Scene;

    fn scene_with(version: &str, emitter: &str) -> Scene {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("sky.xml");
        let text = format!("<scene version=\"{version}\">{emitter}<shape type=\"sphere\"/></scene>");
        std::fs::write(&path, text).unwrap();
        load(&path, &LoadOptions::default()).unwrap_or_else(|error| panic!("{error}"))
    }

    fn sun_of(version: &str, emitter: &str) -> (Vec3, Environment) {
        let scene = scene_with(version, emitter);
        let [Light::Directional { direction, .. }] = scene.lights.as_slice() else { panic!("{:?}", scene.lights) };
        (*direction, scene.environment.unwrap())
    }

    /// A night is no surroundings: those that the file has besides are rendered, in whichever order they stand.
    #[test]
    fn a_set_sun_leaves_other_surroundings() {
        let night = |kind| {
            format!("<emitter type=\"{kind}\"><vector name=\"sun_direction\" x=\"0\" y=\"0.1\" z=\"-1\"/></emitter>")
        };
        let dusk = "<emitter type=\"constant\"><rgb name=\"radiance\" value=\"0.5\"/></emitter>";
        for kind in ["sun", "sky", "sunsky"] {
            for emitters in [format!("{}{dusk}", night(kind)), format!("{dusk}{}", night(kind))] {
                let scene = scene_with("3.0.0", &emitters);
                let environment = scene.environment.as_ref().expect("the constant one");
                assert!((environment.radiance(Vec3::X).x - 0.5).abs() < 1e-3, "{emitters}: {:?}", scene.notes);
                assert!(scene.lights.is_empty(), "{emitters}");
                assert!(!scene.notes.iter().any(|note| note.contains("studio")), "{emitters}: {:?}", scene.notes);
            }
        }
    }

    /// Mitsuba's spots reach behind themselves.
    #[test]
    fn spots_may_be_wider_than_a_half_space() {
        let wide = "<emitter type=\"spot\"><float name=\"cutoff_angle\" value=\"150\"/></emitter>";
        let scene = scene_with("3.0.0", wide);
        let [Light::Spot { inner_angle, outer_angle, .. }] = scene.lights.as_slice() else {
            panic!("{:?}", scene.lights)
        };
        assert!((outer_angle.to_degrees() - 150.0).abs() < 1e-3, "{outer_angle}");
        assert!((inner_angle.to_degrees() - 112.5).abs() < 1e-3, "{inner_angle}");
    }

    /// The sun stands where the file says, and the sky is brightest there, with the zenith along +z and along +y.
    #[test]
    fn a_sky_has_its_sun_where_the_file_says() {
        let direction = Vec3::new(0.5, 0.6, 0.4).normalize();
        let old = ("0.5.0", "sunDirection", "toWorld", Vec3::Y);
        let new = ("3.0.0", "sun_direction", "to_world", Vec3::Z);
        for ((version, name, transform, up), turn_deg) in [(old, 0.0), (old, -15.0), (new, 0.0), (new, -15.0)] {
            let [x, y, z] = direction.to_array();
            let emitter = format!(
                "<emitter type=\"sunsky\"><transform name=\"{transform}\"><rotate x=\"1\" angle=\"{turn_deg}\"/></transform>\
                 <vector name=\"{name}\" x=\"{x}\" y=\"{y}\" z=\"{z}\"/></emitter>"
            );
            let (travels, sky) = sun_of(version, &emitter);
            // The sun is where it is said to be in the world; what the transform turns is the sky around it.
            assert!(travels.abs_diff_eq(-direction, 1e-5), "{version}, {turn_deg}°: {travels}");
            let up = Mat3::from_rotation_x(f32::to_radians(turn_deg)) * up;
            let (near, ground) = (sky.radiance(direction), sky.radiance(-up));
            let opposite = 2.0 * up.dot(direction) * up - direction;
            assert!(near.min_element() > 2.0 * sky.radiance(opposite).max_element(), "{version}: {near}");
            assert!(
                ground.max_element() > 0.0 && near.min_element() > 2.0 * ground.max_element(),
                "{version}: {ground}"
            );
        }
    }
}
