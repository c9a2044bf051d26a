//! Reads `[materials.*]`. The keys of a `type` are left to `surface`.

use super::fields::{Fields, Value};
use super::light::unit_luminance;
use super::{Context, surface};
use crate::scene::load::LoadError;
use crate::scene::load::error::{suggestion, unknown};
use crate::scene::load::texture::Requests;
use crate::scene::{
    Alpha, ColorInput, Encoding, HeightMap, HeightUnit, Material, MaterialId, Relief, ScalarInput, StretchDirection,
    Surface, TextureId, TextureLookup,
};
use glam::{Vec2, Vec3};
use std::collections::HashMap;

/// Keys that every material may have.
const COMMON: [&str; 11] = [
    "type",
    "emission",
    "emission_cd_m2",
    "power_lm",
    "emission_color",
    "emits_both_sides",
    "normal_map",
    "bump_map",
    "stretch_rotation_deg",
    "alpha",
    "alpha_cutoff",
];

/// The materials by name.
#[derive(Default)]
pub(super) struct Materials<'a> {
    by_name: HashMap<&'a str, Entry>,
    names: Vec<&'a str>,
}

/// A material, and the luminous power that each object of it gives, if that is how its emission was told.
#[derive(Clone, Copy)]
pub(super) struct Entry {
    pub(super) id: MaterialId,
    pub(super) power: Option<Power>,
}

/// Luminous power of a whole object; its radiance follows from the object's area.
#[derive(Clone, Copy)]
pub(super) struct Power {
    pub(super) lumen: f64,
    /// Colour of luminance 1.
    pub(super) tint: Vec3,
}

impl<'a> Materials<'a> {
    /// The material of this name.
    pub(super) fn find(&self, name: &Value) -> Result<Entry, LoadError> {
        let written = name.string()?;
        let found = self.by_name.get(written).copied();
        found.ok_or_else(|| name.error(unknown("material", written, self.names.iter().copied())))
    }

    /// The material of this name, where a later material refers to it.
    pub(super) fn find_above(&self, name: &Value) -> Result<Entry, LoadError> {
        let written = name.string()?;
        self.by_name.get(written).copied().ok_or_else(|| {
            let known = suggestion(written, self.names.iter().copied());
            name.error(format_args!("no material \"{written}\" above this one{known}"))
        })
    }

    /// Reads one material.
    pub(super) fn read(
        &mut self,
        context: &mut Context<'a>,
        name: &'a str,
        value: &Value<'a>,
    ) -> Result<(), LoadError> {
        let kinds = surface::kinds();
        let kind = value.entries()?.require_of_any("type")?;
        let choices: Vec<(&'static str, usize)> =
            kinds.iter().enumerate().map(|(place, kind)| (kind.0, place)).collect();
        let (_, read_surface, own) = kinds[kind.choice(&choices)?];
        let known: Vec<&str> = COMMON.iter().chain(own).copied().collect();
        let fields = value.fields(&known)?;

        let surface = read_surface(self, context, &fields)?;
        let (emission, power) = read_emission(context, &fields)?;
        let material = Material {
            name: name.to_owned(),
            surface,
            emission,
            emits_both_sides: fields.get_or("emits_both_sides", false, Value::boolean)?,
            relief: relief(context, &fields)?,
            stretch: fields.get_some("stretch_rotation_deg", |value| {
                Ok(StretchDirection { rotation: value.number()?.to_radians() as f32, map: None })
            })?,
            alpha: alpha(context, &fields)?,
        };
        note_without_effect(context, &fields, &material, power);
        let id = context.builder.add_material(material);
        self.by_name.insert(name, Entry { id, power });
        self.names.push(name);
        Ok(())
    }
}

/// Says which keys are there for nothing. What is told to be 0 may be more at other times.
fn note_without_effect(context: &mut Context, fields: &Fields, material: &Material, power: Option<Power>) {
    let emits = power.is_some() || ["emission", "emission_cd_m2"].iter().any(|key| fields.get(key).is_some());
    let is_stretched = material.surface.is_anisotropic() || fields.get("anisotropy").is_some();
    let lets_in = match &material.surface {
        Surface::MetalRoughness(model) => model.volume.is_none() || fields.get("transmission").is_some(),
        _ => true,
    };
    let idle = [
        ("emits_both_sides", !emits && material.emits_both_sides, "the material has no emission"),
        ("stretch_rotation_deg", !is_stretched, "the surface has no roughness_v or anisotropy that stretches it"),
        ("absorption", !lets_in, "the material has no transmission"),
        ("attenuation_color", !lets_in, "the material has no transmission"),
    ];
    for (key, is_idle, why) in idle {
        if is_idle && let Some(value) = fields.get(key) {
            context.builder.note(value.without_effect(why));
        }
    }
}

/// `emission` in scene units, or a luminance, or a luminous power of the object.
fn read_emission<'a>(context: &mut Context<'a>, fields: &Fields<'a>) -> Result<(ColorInput, Option<Power>), LoadError> {
    let black = ColorInput::constant(Vec3::ZERO);
    let kinds = ["emission", "emission_cd_m2", "power_lm"];
    let tint = fields.get_or("emission_color", Vec3::ONE, |value| unit_luminance(value, value.color()?))?;
    if kinds.iter().all(|kind| fields.get(kind).is_none()) {
        return match fields.get("emission_color") {
            Some(value) => Err(value.error("needs emission_cd_m2 or power_lm beside it")),
            None => Ok((black, None)),
        };
    }
    match fields.exactly_one(&kinds)? {
        ("emission", value) => match fields.get("emission_color") {
            Some(tint) => Err(tint.error("belongs to emission_cd_m2 or power_lm; \"emission\" has its own colour")),
            None => Ok((color(context, &value)?, None)),
        },
        ("emission_cd_m2", value) => {
            let radiance = value.non_negative()? / context.builder.nits_per_unit;
            Ok((ColorInput::constant(tint * radiance as f32), None))
        }
        (_, value) => Ok((black, Some(Power { lumen: value.non_negative()?, tint }))),
    }
}

fn alpha<'a>(context: &mut Context<'a>, fields: &Fields<'a>) -> Result<Alpha, LoadError> {
    let cutoff = fields.get_some("alpha_cutoff", |value| value.within(0.0, 1.0))?;
    match (fields.get("alpha"), cutoff) {
        (None, None) => Ok(Alpha::Opaque),
        (None, Some(_)) => Err(fields.error("\"alpha_cutoff\" needs \"alpha\"")),
        (Some(_), cutoff) => {
            let value = coverage(context, fields)?;
            Ok(cutoff.map_or(Alpha::Blend { value }, |cutoff| Alpha::Mask { value, cutoff: cutoff as f32 }))
        }
    }
}

/// `alpha`: of a picture that has an alpha channel, and where no channel is named, that.
fn coverage<'a>(context: &mut Context<'a>, fields: &Fields<'a>) -> Result<ScalarInput, LoadError> {
    let alpha_or_red = |textures: &Requests, texture| if textures.has_alpha(texture) { 3 } else { 0 };
    scalar_of_channel(context, fields, "alpha", 1.0, alpha_or_red)
}

/// A number, a colour, or a texture table.
fn color<'a>(context: &mut Context<'a>, value: &Value<'a>) -> Result<ColorInput, LoadError> {
    if !value.is_table() {
        return Ok(ColorInput::constant(value.color()?));
    }
    let fields = value.fields(&["texture", "factor", "scale", "offset", "rotation_deg"])?;
    Ok(ColorInput {
        factor: fields.get_or("factor", Vec3::ONE, Value::color)?,
        texture: Some(lookup(context, &fields, Encoding::Srgb)?),
    })
}

/// A colour of which no channel exceeds 1: more would reflect more light than comes in.
pub(super) fn share<'a>(context: &mut Context<'a>, value: &Value<'a>) -> Result<ColorInput, LoadError> {
    let color = color(context, value)?;
    if color.factor.max_element() > 1.0 {
        return Err(value.error(format_args!("must not exceed 1 in any channel: {}", color.factor)));
    }
    Ok(color)
}

pub(super) fn share_or_white<'a>(
    context: &mut Context<'a>,
    fields: &Fields<'a>,
    key: &str,
) -> Result<ColorInput, LoadError> {
    fields.get_or(key, ColorInput::constant(Vec3::ONE), |value| share(context, value))
}

/// A number in [0, 1], or a channel of a texture, red unless told.
pub(super) fn scalar<'a>(
    context: &mut Context<'a>,
    fields: &Fields<'a>,
    key: &str,
    default: f32,
) -> Result<ScalarInput, LoadError> {
    scalar_of_channel(context, fields, key, default, |_, _| 0)
}

/// A number in [0, 1], or a channel of a texture: `usual` says which, unless the file does.
fn scalar_of_channel<'a>(
    context: &mut Context<'a>,
    fields: &Fields<'a>,
    key: &str,
    default: f32,
    usual: impl Fn(&Requests, TextureId) -> u8,
) -> Result<ScalarInput, LoadError> {
    let Some(value) = fields.get(key) else {
        return Ok(ScalarInput::constant(default));
    };
    if !value.is_table() {
        return Ok(ScalarInput::constant(value.within(0.0, 1.0)? as f32));
    }
    let fields = value.fields(&["texture", "channel", "factor", "scale", "offset", "rotation_deg"])?;
    let lookup = lookup(context, &fields, Encoding::Linear)?;
    let channel = channel(&fields)?.unwrap_or_else(|| usual(&context.builder.textures, lookup.texture));
    Ok(ScalarInput {
        factor: fields.get_or("factor", 1.0, |value| value.within(0.0, 1.0))? as f32,
        texture: Some((lookup, channel)),
    })
}

fn channel(fields: &Fields<'_>) -> Result<Option<u8>, LoadError> {
    fields.get_some("channel", |value| value.choice(&[("r", 0), ("g", 1), ("b", 2), ("a", 3)]))
}

fn relief<'a>(context: &mut Context<'a>, fields: &Fields<'a>) -> Result<Option<Relief>, LoadError> {
    match (fields.get("normal_map"), fields.get("bump_map")) {
        (None, None) => Ok(None),
        (Some(value), None) => {
            let fields = value.fields(&["texture", "strength", "scale", "offset", "rotation_deg"])?;
            let strength = fields.get_or("strength", 1.0, Value::number)? as f32;
            Ok(Some(Relief::Normals { map: lookup(context, &fields, Encoding::Linear)?, strength }))
        }
        (None, Some(value)) => {
            let fields = value.fields(&["texture", "channel", "height", "scale", "offset", "rotation_deg"])?;
            let height = fields.require("height")?.number()? as f32;
            let texture = Some((lookup(context, &fields, Encoding::Linear)?, channel(&fields)?.unwrap_or(0)));
            let height = ScalarInput { factor: height, texture };
            Ok(Some(Relief::Heights(HeightMap { height, unit: HeightUnit::Scene })))
        }
        (Some(_), Some(bump)) => Err(bump.error("a material has either a normal_map or a bump_map")),
    }
}

/// The texture that a table names. Its own `encoding` wins over what its use suggests.
fn lookup<'a>(context: &mut Context<'a>, fields: &Fields<'a>, usual: Encoding) -> Result<TextureLookup, LoadError> {
    let name = fields.require("texture")?;
    let written = name.string()?;
    let Some(entry) = context.textures.get_mut(written) else {
        return Err(name.error(unknown("texture", written, context.texture_names.iter().copied())));
    };
    entry.is_used = true;
    let mut request = entry.request.clone();
    request.encoding = entry.encoding.unwrap_or(usual);
    let number_or_two = |value: &Value| {
        if value.is_array() { value.vec2() } else { value.number().map(|number| Vec2::splat(number as f32)) }
    };
    Ok(TextureLookup {
        texture: context.builder.textures.add(request),
        offset: fields.get_or("offset", Vec2::ZERO, Value::vec2)?,
        rotation: fields.get_or("rotation_deg", 0.0, Value::number)?.to_radians() as f32,
        scale: fields.get_or("scale", Vec2::ONE, number_or_two)?,
    })
}
