//! `LightSource`, and the radiance of `AreaLightSource`.
//!
//! A light's RGB is radiance as it stands, any other spectrum gives luminance 1 (see [`super::inputs`]); `power` is
//! lumen and `illuminance` lux, spread as pbrt-v4 does (its `lights.cpp`).

use super::super::error::{LoadError, unknown};
use super::super::{environment, luminance};
use super::Reader;
use super::inputs::Meaning;
use super::parameters::Parameters;
use crate::scene::{ColorInput, Encoding, Environment, Light, Parametrisation, PhotometricWeb, SpotFalloff, Wrap};
use glam::{Affine3A, Mat3, Vec3};
use std::f32::consts::{PI, TAU};
use std::path::Path;
use std::sync::Arc;

/// What an area light gives.
pub(super) struct Emission {
    pub(super) radiance: ColorInput,
    pub(super) both_sides: bool,
    /// Luminous power of each shape, for which `radiance` is scaled once its area is known.
    pub(super) lumen: Option<f32>,
}

/// A goniometric light's picture, and its flux in lm, which takes as long as reading it.
#[derive(Clone)]
pub(super) struct GoniometricWeb {
    web: Arc<PhotometricWeb>,
    flux_lm: f64,
}

/// From a goniometric light's space into its picture's, whose z is the light's y (pbrt-v4, `GoniometricLight::Create`).
const SWAP_Y_AND_Z: Mat3 = Mat3::from_cols(Vec3::X, Vec3::Z, Vec3::Y);

impl Reader<'_> {
    /// Reads `LightSource`.
    pub(super) fn light(&mut self, kind: &str, parameters: &Parameters) -> Result<(), LoadError> {
        let to_world = self.here(&self.state.transforms);
        if self.state.transforms.moves() {
            self.builder.note("Lights do not move: they stay where they are when the shutter opens.");
        }
        match kind {
            "point" => {
                let intensity = self.light_color(parameters, "I", 2.0 * TAU)?;
                let from = parameters.point("from")?.unwrap_or(Vec3::ZERO);
                self.builder.lights.push(Light::Point { position: to_world.transform_point3(from), intensity });
            }
            "spot" => self.spot(parameters, &to_world)?,
            "distant" => {
                let (from, to) = (parameters.point("from")?, parameters.point("to")?);
                let travels = to.unwrap_or(Vec3::Z) - from.unwrap_or(Vec3::ZERO);
                let direction = to_world.transform_vector3(travels).try_normalize();
                let direction = direction.ok_or_else(|| parameters.error("\"from\" and \"to\" are the same point"))?;
                let illuminance = self.positive(parameters, "illuminance")?;
                let irradiance = self.scaled_color(parameters, "L")? * illuminance.unwrap_or(1.0);
                self.builder.lights.push(Light::Directional {
                    direction,
                    irradiance,
                    angular_radius: 0.0,
                    is_of_sky: false,
                });
            }
            "infinite" => {
                let environment = self.infinite(parameters, &to_world)?;
                self.add_environment(environment);
            }
            "goniometric" => self.goniometric(parameters, &to_world)?,
            "projection" => return Err(parameters.unsupported("lights of type \"projection\" are not rendered")),
            other => {
                let known = ["point", "spot", "distant", "infinite", "goniometric"];
                return Err(parameters.error(unknown("light", other, known)));
            }
        }
        self.note_unread(&format!("light \"{kind}\""), parameters);
        Ok(())
    }

    fn positive(&mut self, parameters: &Parameters, name: &str) -> Result<Option<f32>, LoadError> {
        let value = parameters.float(name)?.filter(|&value| value > 0.0);
        self.is_photometric |= value.is_some();
        Ok(value)
    }

    /// The light's colour times its scale and the sensor's.
    fn scaled_color(&mut self, parameters: &Parameters, name: &str) -> Result<Vec3, LoadError> {
        let color = self.color(parameters, name, Meaning::Light)?.unwrap_or(Vec3::ONE);
        let scale = parameters.float_or("scale", 1.0)?.max(0.0);
        Ok(color * scale * self.exposure)
    }

    /// The same times `power` over `full` steradian, where that is given.
    fn light_color(&mut self, parameters: &Parameters, name: &str, full: f32) -> Result<Vec3, LoadError> {
        let power = self.positive(parameters, "power")?.map_or(1.0, |lumen| lumen / full);
        Ok(self.scaled_color(parameters, name)? * power)
    }

    fn spot(&mut self, parameters: &Parameters, to_world: &Affine3A) -> Result<(), LoadError> {
        let from = parameters.point("from")?.unwrap_or(Vec3::ZERO);
        let to = parameters.point("to")?.unwrap_or(Vec3::Z);
        let direction = to_world.transform_vector3(to - from).try_normalize();
        let direction = direction.ok_or_else(|| parameters.error("\"from\" and \"to\" are the same point"))?;
        let outer = parameters.float_or("coneangle", 30.0)?;
        let delta = parameters.float_or("conedeltaangle", 5.0)?;
        if !(0.0..=180.0).contains(&outer) || delta < 0.0 {
            return Err(parameters.error("\"coneangle\" must lie in [0, 180], \"conedeltaangle\" must not be negative"));
        }
        // pbrt takes the cosine of the difference, whatever its sign.
        let (outer_angle, inner_angle) = (outer.to_radians(), (outer - delta).abs().min(outer).to_radians());
        let falloff = SpotFalloff::Smoothstep;
        let intensity = self.light_color(parameters, "I", falloff.solid_angle(inner_angle, outer_angle))?;
        self.builder.lights.push(Light::Spot {
            position: to_world.transform_point3(from),
            direction,
            intensity,
            inner_angle,
            outer_angle,
            falloff,
        });
        Ok(())
    }

    /// A point whose intensity is a picture's: the mean of R, G and B in pbrt's equal-area square.
    fn goniometric(&mut self, parameters: &Parameters, to_world: &Affine3A) -> Result<(), LoadError> {
        let position = Vec3::from(to_world.translation);
        let Some(file) = parameters.string("filename")? else {
            let note = "a goniometric light without a picture shines alike in all directions.";
            self.builder.note(format!("{}: {note}", parameters.place()));
            let intensity = self.light_color(parameters, "I", 2.0 * TAU)?;
            self.builder.lights.push(Light::Point { position, intensity });
            return Ok(());
        };
        let GoniometricWeb { web, flux_lm } = self.goniometric_web(&self.file(file), parameters)?;
        if flux_lm <= 0.0 {
            self.builder
                .note(format!("{}: a goniometric light whose picture is black gives none.", parameters.place()));
            return Ok(());
        }
        let per_candela = self.light_color(parameters, "I", flux_lm as f32)?;
        let from_world = SWAP_Y_AND_Z * environment::rotation_of(to_world).transpose();
        self.builder.lights.push(Light::Photometric { position, from_world, web, per_candela });
        Ok(())
    }

    /// The web of a picture, read once; its poles are the picture's.
    fn goniometric_web(&mut self, file: &Path, parameters: &Parameters) -> Result<GoniometricWeb, LoadError> {
        if let Some(known) = self.goniometric_webs.get(file) {
            return Ok(known.clone());
        }
        let picture = environment::read(file, Parametrisation::EqualArea, &mut self.builder.notes)
            .map_err(|error| error.referenced_from(parameters.place()))?;
        // A texel is about 203°/width across (4π/width² sr): a quarter of that, or of a degree where it is smaller.
        let step_deg = 180.0 / (4 * picture.width).clamp(180, 720) as f32;
        let web = PhotometricWeb::from_directions(step_deg, |own| picture.radiance(own).element_sum() / 3.0);
        let web = GoniometricWeb { flux_lm: web.flux_lm(), web: Arc::new(web) };
        self.goniometric_webs.insert(file.to_owned(), web.clone());
        Ok(web)
    }

    fn infinite(&mut self, parameters: &Parameters, to_world: &Affine3A) -> Result<Environment, LoadError> {
        if parameters.find(&["point3", "point"], "portal").is_some() {
            self.builder.note("An infinite light's portal is not used; its picture is rendered all around.");
        }
        let scale = parameters.float_or("scale", 1.0)?.max(0.0) * self.exposure;
        let illuminance = self.positive(parameters, "illuminance")?;
        let Some(file) = parameters.string("filename")? else {
            let color = self.color(parameters, "L", Meaning::Light)?.unwrap_or(Vec3::ONE);
            // pbrt takes a uniform hemisphere of luminance 1 for π lux.
            return Ok(Environment::constant(color * scale * illuminance.map_or(1.0, |lux| lux / PI)));
        };
        let file = self.file(file);
        let mut environment = environment::read(&file, Parametrisation::EqualArea, &mut self.builder.notes)
            .map_err(|error| error.referenced_from(parameters.place()))?;
        environment.from_world = environment::rotation_of(to_world).transpose();
        environment.scale = scale;
        if let Some(lux) = illuminance {
            let up = environment.from_world.transpose() * Vec3::Z;
            // pbrt sums its texels as if they covered half a sphere: its pictures are twice as bright as their lux say.
            let present = 0.5 * luminance(environment.irradiance(up)) / scale.max(f32::MIN_POSITIVE);
            if present > 0.0 {
                environment.scale *= lux / present;
            }
        }
        Ok(environment)
    }

    /// One environment is rendered: constant ones are added to it, a second picture is left out.
    fn add_environment(&mut self, new: Environment) {
        let Some(present) = self.builder.environment.take() else {
            self.builder.environment = Some(new);
            return;
        };
        let is_constant = |environment: &Environment| environment.texels.len() == 1;
        let (picture, constant) = if is_constant(&new) { (present, new) } else { (new, present) };
        if !is_constant(&constant) {
            self.builder.note("Several infinite lights with pictures: only the first one is rendered.");
            self.builder.environment = Some(constant);
            return;
        }
        let added = constant.texels[0] * constant.scale;
        let texels = picture.texels.iter().map(|&texel| texel * picture.scale + added).collect();
        self.builder.environment = Some(Environment { texels: Arc::new(texels), scale: 1.0, ..picture });
    }

    /// What the current area light gives.
    pub(super) fn emission(&mut self, parameters: &Parameters) -> Result<Emission, LoadError> {
        let lumen = self.positive(parameters, "power")?;
        let scale = parameters.float_or("scale", 1.0)?.max(0.0) * self.exposure;
        let radiance = match parameters.string("filename")? {
            None => {
                let color = self.color(parameters, "L", Meaning::Light)?.unwrap_or(Vec3::ONE);
                ColorInput::constant(color * scale)
            }
            Some(file) => {
                if lumen.is_some() {
                    let note = format!("{}: \"power\" of a picture is spread as if it were white.", parameters.place());
                    self.builder.note(note);
                }
                let picture = self.picture(file, parameters, Encoding::Srgb, Wrap::Clamp);
                ColorInput { factor: Vec3::splat(scale), texture: Some(picture) }
            }
        };
        let both_sides = parameters.boolean_or("twosided", false)?;
        self.note_unread("area light", parameters);
        Ok(Emission { radiance, both_sides, lumen })
    }
}
