//! Reads `[[lights]]`: point, spot, photometric and directional, in photometric units. Surfaces that shine are
//! materials.

use super::fields::{Fields, Value};
use crate::scene::load::{LoadError, ies, luminance};
use crate::scene::{Light, PhotometricWeb, SpotFalloff};
use glam::Vec3;
use std::collections::HashMap;
use std::f64::consts::TAU;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// What the lights of a file share while they are read.
pub(super) struct Reader<'a> {
    /// The folder that paths are relative to.
    folder: &'a Path,
    /// Turns candela and lux into scene units.
    nits_per_unit: f64,
    /// Webs by their files: hundreds of lamps may be of one kind.
    webs: HashMap<PathBuf, Arc<PhotometricWeb>>,
    /// A sentence for whatever was not taken as it stands.
    pub(super) notes: Vec<String>,
}

impl<'a> Reader<'a> {
    pub(super) fn new(folder: &'a Path, nits_per_unit: f64) -> Self {
        Self { folder, nits_per_unit, webs: HashMap::new(), notes: Vec::new() }
    }

    /// Reads one light.
    pub(super) fn read(&mut self, value: &Value) -> Result<Light, LoadError> {
        let kinds = ["point", "spot", "photometric", "directional"].map(|kind| (kind, kind));
        match value.entries()?.require_of_any("type")?.choice(&kinds)? {
            "point" => self.point(value),
            "spot" => self.spot(value),
            "photometric" => self.photometric(value),
            _ => self.directional(value),
        }
    }

    fn point(&self, value: &Value) -> Result<Light, LoadError> {
        let fields = value.fields(&["type", "name", "position", "intensity_cd", "power_lm", "color"])?;
        let position = fields.require("position")?.vec3()?;
        Ok(Light::Point { position, intensity: self.intensity(&fields, 2.0 * TAU)? })
    }

    fn spot(&self, value: &Value) -> Result<Light, LoadError> {
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
        let direction = axis(&fields, position)?;
        let outer = fields.get_or("outer_deg", 30.0, |value| value.within(0.01, 180.0))?;
        let inner = fields.get_or("inner_deg", 0.8 * outer, |value| value.within(0.0, outer))?;
        let (inner, outer) = (inner.to_radians(), outer.to_radians());
        let falloff = SpotFalloff::Smoothstep;
        let solid_angle = f64::from(falloff.solid_angle(inner as f32, outer as f32));
        Ok(Light::Spot {
            position,
            direction,
            intensity: self.intensity(&fields, solid_angle)?,
            inner_angle: inner as f32,
            outer_angle: outer as f32,
            falloff,
        })
    }

    fn photometric(&mut self, value: &Value) -> Result<Light, LoadError> {
        let known =
            ["type", "name", "file", "position", "target", "direction", "rotation_deg", "power_lm", "scale", "color"];
        let fields = value.fields(&known)?;
        let position = fields.require("position")?.vec3()?;
        let is_aimed = fields.get("target").is_some() || fields.get("direction").is_some();
        let axis = if is_aimed { axis(&fields, position)? } else { Vec3::NEG_Y };
        let rotation_deg = fields.get_or("rotation_deg", 0.0, Value::number)?;
        let file = fields.require("file")?;
        let web = self.web(&file)?;
        let tint = fields.get_or("color", Vec3::ONE, |color| unit_luminance(color, color.color()?))?;
        Ok(Light::Photometric {
            position,
            from_world: PhotometricWeb::from_world(axis, rotation_deg.to_radians() as f32),
            per_candela: tint * (scale_of(&fields, &web)? / self.nits_per_unit) as f32,
            web,
        })
    }

    /// The web of a file, read once.
    fn web(&mut self, file: &Value) -> Result<Arc<PhotometricWeb>, LoadError> {
        let path = self.folder.join(file.string()?);
        if let Some(known) = self.webs.get(&path) {
            return Ok(Arc::clone(known));
        }
        let web = ies::read(&path, &mut self.notes).map_err(|error| error.referenced_from(file.place()))?;
        let web = Arc::new(web);
        self.webs.insert(path, Arc::clone(&web));
        Ok(web)
    }

    fn directional(&self, value: &Value) -> Result<Light, LoadError> {
        let fields = value.fields(&["type", "name", "direction", "illuminance_lx", "color", "diameter_deg"])?;
        let lux = amount(&fields.require("illuminance_lx")?, &fields)?;
        Ok(Light::Directional {
            direction: fields.require("direction")?.direction()?,
            irradiance: lux / self.nits_per_unit as f32,
            angular_radius: 0.5 * fields.get_or("diameter_deg", 0.0, |v| v.within(0.0, 170.0))?.to_radians() as f32,
            is_of_sky: false,
        })
    }

    /// Candela, or lumen spread over a solid angle.
    fn intensity(&self, fields: &Fields, solid_angle: f64) -> Result<Vec3, LoadError> {
        let (kind, value) = fields.exactly_one(&["intensity_cd", "power_lm"])?;
        let per = if kind == "power_lm" { solid_angle } else { 1.0 };
        Ok(amount(&value, fields)? / (per * self.nits_per_unit) as f32)
    }
}

/// Where a lamp at a place is aimed: in a direction, or at a target.
fn axis(fields: &Fields, position: Vec3) -> Result<Vec3, LoadError> {
    let (kind, aim) = fields.exactly_one(&["target", "direction"])?;
    if kind == "direction" {
        return aim.direction();
    }
    (aim.vec3()? - position).try_normalize().ok_or_else(|| aim.error("is the light's own position"))
}

/// What a web is multiplied by: 1 unless told, or what makes its flux so many lumen.
fn scale_of(fields: &Fields, web: &PhotometricWeb) -> Result<f64, LoadError> {
    let is_told = fields.get("power_lm").is_some() || fields.get("scale").is_some();
    if !is_told {
        return Ok(1.0);
    }
    let (kind, value) = fields.exactly_one(&["power_lm", "scale"])?;
    let amount = value.non_negative()?;
    if kind == "scale" {
        return Ok(amount);
    }
    let flux_lm = web.flux_lm();
    if flux_lm > 0.0 {
        Ok(amount / flux_lm)
    } else {
        Err(value.error("a file without any light cannot be scaled to it"))
    }
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
