//! Reads the `type` of a `[materials.*]` and the keys that belong to it.

use super::super::error::LoadError;
use super::super::metals::{METALS, Metal};
use super::Context;
use super::fields::{Fields, Value};
use super::material::{Entry, Materials, scalar, share, share_or_white};
use crate::scene::{
    Alpha, CoatRelief, ColorInput, Distribution, Material, MetalRoughness, Roughness, ScalarInput, Surface, USUAL_IOR,
};
use glam::Vec3;

/// Reads the keys of one kind of surface.
pub(super) type Reader<'a> = fn(&Materials<'a>, &mut Context<'a>, &Fields<'a>) -> Result<Surface, LoadError>;

/// A kind of surface: its name, its reader, the keys that it takes.
pub(super) type Kind<'a> = (&'static str, Reader<'a>, &'static [&'static str]);

/// The kinds of surface that a `type` may name.
pub(super) const fn kinds<'a>() -> [Kind<'a>; 14] {
    [
        ("diffuse", diffuse, &["reflectance"]),
        ("oren-nayar", oren_nayar, &["reflectance", "roughness"]),
        ("diffuse-transmission", diffuse_transmission, &["reflectance", "transmittance"]),
        ("mirror", mirror, &["reflectance"]),
        ("conductor", conductor, CONDUCTOR),
        ("dielectric", dielectric, DIELECTRIC),
        ("thin-dielectric", thin_dielectric, &["ior", "transmittance"]),
        ("coated-diffuse", coated_diffuse, COATED_DIFFUSE),
        ("coated-conductor", coated_conductor, COATED_CONDUCTOR),
        ("metal-roughness", metal_roughness, METAL_ROUGHNESS),
        ("phong", phong, &["diffuse", "specular", "exponent"]),
        ("ward", ward, &["diffuse", "specular", "roughness", "roughness_v"]),
        ("he-torrance", he_torrance, &["metal", "eta", "k", "height_nm", "correlation_nm", "diffuse"]),
        ("mix", mix, &["materials", "amount"]),
    ]
}

const CONDUCTOR: &[&str] = &["metal", "eta", "k", "tint", "roughness", "roughness_v", "distribution"];

const DIELECTRIC: &[&str] = &[
    "ior",
    "ior_outside",
    "roughness",
    "roughness_v",
    "distribution",
    "transmittance",
    "absorption",
    "attenuation_color",
    "attenuation_distance",
];

const COATED_DIFFUSE: &[&str] = &["reflectance", "ior", "roughness", "roughness_v", "distribution", "saturates"];

const COATED_CONDUCTOR: &[&str] = &[
    "metal",
    "eta",
    "k",
    "roughness",
    "roughness_v",
    "distribution",
    "coat_ior",
    "coat_roughness",
    "coat_roughness_v",
    "coat_distribution",
];

const METAL_ROUGHNESS: &[&str] = &[
    "base_color",
    "metallic",
    "roughness",
    "ior",
    "transmission",
    "specular",
    "specular_color",
    "anisotropy",
    "clearcoat",
    "clearcoat_roughness",
    "sheen_color",
    "sheen_roughness",
    "absorption",
    "attenuation_color",
    "attenuation_distance",
];

/// The keys of one roughness: along u, along v, the distribution.
const ROUGHNESS_KEYS: [&str; 3] = ["roughness", "roughness_v", "distribution"];
const COAT_ROUGHNESS_KEYS: [&str; 3] = ["coat_roughness", "coat_roughness_v", "coat_distribution"];

/// The keys that say what an inside absorbs.
const ABSORPTION_KEYS: [&str; 3] = ["absorption", "attenuation_color", "attenuation_distance"];

fn diffuse<'a>(_: &Materials<'a>, context: &mut Context<'a>, fields: &Fields<'a>) -> Result<Surface, LoadError> {
    Ok(Surface::Diffuse { reflectance: share(context, &fields.require("reflectance")?)? })
}

fn oren_nayar<'a>(_: &Materials<'a>, context: &mut Context<'a>, fields: &Fields<'a>) -> Result<Surface, LoadError> {
    Ok(Surface::OrenNayar {
        reflectance: share(context, &fields.require("reflectance")?)?,
        roughness: scalar(context, fields, "roughness", 0.5)?,
    })
}

fn diffuse_transmission<'a>(
    _: &Materials<'a>,
    context: &mut Context<'a>,
    fields: &Fields<'a>,
) -> Result<Surface, LoadError> {
    let reflectance = share(context, &fields.require("reflectance")?)?;
    let value = fields.require("transmittance")?;
    let transmittance = share(context, &value)?;
    let sum = reflectance.factor + transmittance.factor;
    if reflectance.texture.is_none() && transmittance.texture.is_none() && sum.max_element() > 1.0 {
        return Err(value.error(format_args!("with \"reflectance\" must not exceed 1 in any channel: {sum}")));
    }
    Ok(Surface::DiffuseTransmission { reflectance, transmittance })
}

fn mirror<'a>(_: &Materials<'a>, context: &mut Context<'a>, fields: &Fields<'a>) -> Result<Surface, LoadError> {
    Ok(Surface::Mirror { reflectance: share_or_white(context, fields, "reflectance")? })
}

/// `metal`, or `eta` and `k`.
fn metal(fields: &Fields<'_>) -> Result<Metal, LoadError> {
    match (fields.get("metal"), fields.get("eta"), fields.get("k")) {
        (Some(metal), None, None) => metal.choice(METALS),
        (None, Some(eta), Some(k)) => {
            let real = eta.color()?;
            if real.min_element() <= 0.0 {
                return Err(eta.error("the index of refraction must be above 0"));
            }
            Ok(Metal { eta: real, k: k.color()? })
        }
        _ => Err(fields.error("needs either \"metal\", or both \"eta\" and \"k\"")),
    }
}

/// Roughness along u and, if told, along v, and the distribution of facets.
fn roughness<'a>(
    context: &mut Context<'a>,
    fields: &Fields<'a>,
    [u, v, distribution]: [&str; 3],
) -> Result<Roughness, LoadError> {
    let kinds = [("ggx", Distribution::Ggx), ("beckmann", Distribution::Beckmann)];
    Ok(Roughness {
        v: match fields.get(v) {
            None => None,
            Some(_) => Some(scalar(context, fields, v, 0.0)?),
        },
        distribution: fields.get_or(distribution, Distribution::Ggx, |value| value.choice(&kinds))?,
        ..Roughness::isotropic(scalar(context, fields, u, 0.0)?)
    })
}

fn conductor<'a>(_: &Materials<'a>, context: &mut Context<'a>, fields: &Fields<'a>) -> Result<Surface, LoadError> {
    let Metal { eta, k } = metal(fields)?;
    Ok(Surface::Conductor {
        eta,
        k,
        tint: share_or_white(context, fields, "tint")?,
        roughness: roughness(context, fields, ROUGHNESS_KEYS)?,
    })
}

fn dielectric<'a>(_: &Materials<'a>, context: &mut Context<'a>, fields: &Fields<'a>) -> Result<Surface, LoadError> {
    Ok(Surface::Dielectric {
        ior: relative_ior(fields)?,
        roughness: roughness(context, fields, ROUGHNESS_KEYS)?,
        transmittance: share_or_white(context, fields, "transmittance")?,
        absorption: absorption(fields)?,
    })
}

/// Index of the inside over that of what is around it.
fn relative_ior(fields: &Fields<'_>) -> Result<f32, LoadError> {
    let inside = fields.get_or("ior", f64::from(USUAL_IOR), Value::positive)?;
    fields.get_or("ior_outside", inside as f32, |value| {
        let relative = (inside / value.positive()?) as f32;
        match relative > 0.0 && relative.is_finite() {
            true => Ok(relative),
            false => Err(value.error(format_args!("must be comparable to ior, {inside}"))),
        }
    })
}

/// Absorption of an inside per scene unit: as a coefficient, or as the colour that is left after a distance.
fn absorption(fields: &Fields<'_>) -> Result<Vec3, LoadError> {
    match ABSORPTION_KEYS.map(|key| fields.get(key)) {
        [None, None, None] => Ok(Vec3::ZERO),
        [Some(value), None, None] => value.color(),
        [None, Some(color), Some(distance)] => {
            let left = color.color()?;
            if left.max_element() > 1.0 || left.min_element() <= 0.0 {
                return Err(color.error(format_args!("must lie above 0 and not exceed 1 in any channel: {left}")));
            }
            Ok(Surface::absorption_of(left, distance.positive()? as f32))
        }
        _ => Err(fields.error(
            "needs either \"absorption\", or both \"attenuation_color\" and \"attenuation_distance\", or none of them",
        )),
    }
}

fn thin_dielectric<'a>(
    _: &Materials<'a>,
    context: &mut Context<'a>,
    fields: &Fields<'a>,
) -> Result<Surface, LoadError> {
    Ok(Surface::ThinDielectric {
        ior: fields.get_or("ior", f64::from(USUAL_IOR), Value::positive)? as f32,
        transmittance: share_or_white(context, fields, "transmittance")?,
    })
}

/// An index of refraction of a coat, which lies in air.
fn coat_ior(fields: &Fields<'_>, key: &str) -> Result<f32, LoadError> {
    fields.get_or(key, f64::from(USUAL_IOR), |value| value.within(1.0, 10.0)).map(|ior| ior as f32)
}

fn coated_diffuse<'a>(_: &Materials<'a>, context: &mut Context<'a>, fields: &Fields<'a>) -> Result<Surface, LoadError> {
    Ok(Surface::CoatedDiffuse {
        reflectance: share(context, &fields.require("reflectance")?)?,
        ior: coat_ior(fields, "ior")?,
        roughness: roughness(context, fields, ROUGHNESS_KEYS)?,
        saturates: fields.get_or("saturates", true, Value::boolean)?,
    })
}

fn coated_conductor<'a>(
    _: &Materials<'a>,
    context: &mut Context<'a>,
    fields: &Fields<'a>,
) -> Result<Surface, LoadError> {
    let Metal { eta, k } = metal(fields)?;
    Ok(Surface::CoatedConductor {
        eta,
        k,
        roughness: roughness(context, fields, ROUGHNESS_KEYS)?,
        coat_ior: coat_ior(fields, "coat_ior")?,
        coat_roughness: roughness(context, fields, COAT_ROUGHNESS_KEYS)?,
    })
}

fn metal_roughness<'a>(
    _: &Materials<'a>,
    context: &mut Context<'a>,
    fields: &Fields<'a>,
) -> Result<Surface, LoadError> {
    let volume = match ABSORPTION_KEYS.iter().any(|key| fields.get(key).is_some()) {
        true => Some(absorption(fields)?),
        false => None,
    };
    Ok(Surface::MetalRoughness(MetalRoughness {
        base_color: share_or_white(context, fields, "base_color")?,
        metallic: scalar(context, fields, "metallic", 0.0)?,
        roughness: scalar(context, fields, "roughness", 0.5)?,
        ior: fields.get_or("ior", USUAL_IOR, |value| {
            let ior = value.number()? as f32;
            MetalRoughness::problem_with_ior(ior, volume.is_some())
                .map_or(Ok(ior), |problem| Err(value.error(format_args!("{problem}, not {ior}"))))
        })?,
        transmission: scalar(context, fields, "transmission", 0.0)?,
        volume,
        specular: scalar(context, fields, "specular", 1.0)?,
        specular_color: share_or_white(context, fields, "specular_color")?,
        anisotropy: scalar(context, fields, "anisotropy", 0.0)?,
        clearcoat: scalar(context, fields, "clearcoat", 0.0)?,
        clearcoat_roughness: scalar(context, fields, "clearcoat_roughness", 0.0)?,
        coat_relief: CoatRelief::OfBase,
        sheen_color: fields.get_or("sheen_color", ColorInput::constant(Vec3::ZERO), |value| share(context, value))?,
        sheen_roughness: scalar(context, fields, "sheen_roughness", 0.0)?,
    }))
}

/// Two albedos of which neither defaults to white; their sum must not exceed 1.
fn base_and_lobe<'a>(context: &mut Context<'a>, fields: &Fields<'a>) -> Result<[ColorInput; 2], LoadError> {
    let black = ColorInput::constant(Vec3::ZERO);
    let diffuse = fields.get_or("diffuse", black, |value| share(context, value))?;
    let value = fields.require("specular")?;
    let specular = share(context, &value)?;
    let sum = diffuse.factor + specular.factor;
    if diffuse.texture.is_none() && specular.texture.is_none() && sum.max_element() > 1.0 {
        return Err(value.error(format_args!("with \"diffuse\" must not exceed 1 in any channel: {sum}")));
    }
    Ok([diffuse, specular])
}

fn phong<'a>(_: &Materials<'a>, context: &mut Context<'a>, fields: &Fields<'a>) -> Result<Surface, LoadError> {
    let [diffuse, specular] = base_and_lobe(context, fields)?;
    let exponent = fields.get_or("exponent", 50.0, |value| value.within(0.0, 1e6))? as f32;
    Ok(Surface::Phong { diffuse, specular, exponent: ScalarInput::constant(exponent) })
}

fn ward<'a>(_: &Materials<'a>, context: &mut Context<'a>, fields: &Fields<'a>) -> Result<Surface, LoadError> {
    let [diffuse, specular] = base_and_lobe(context, fields)?;
    Ok(Surface::Ward { diffuse, specular, roughness: roughness(context, fields, ROUGHNESS_KEYS)? })
}

fn he_torrance<'a>(_: &Materials<'a>, context: &mut Context<'a>, fields: &Fields<'a>) -> Result<Surface, LoadError> {
    let Metal { eta, k } = metal(fields)?;
    let black = ColorInput::constant(Vec3::ZERO);
    Ok(Surface::HeTorrance {
        eta,
        k,
        height_nm: fields.get_or("height_nm", 200.0, Value::non_negative)? as f32,
        correlation_nm: fields.get_or("correlation_nm", 3000.0, Value::positive)? as f32,
        diffuse: fields.get_or("diffuse", black, |value| share(context, value))?,
    })
}

fn mix<'a>(materials: &Materials<'a>, context: &mut Context<'a>, fields: &Fields<'a>) -> Result<Surface, LoadError> {
    let names = fields.require("materials")?;
    let elements = names.array()?;
    let [first, second] = elements.as_slice() else {
        return Err(names.error(format_args!("expected the names of two materials, found {}", elements.len())));
    };
    let surface = |context: &Context<'a>, name: &Value<'a>| -> Result<Box<Surface>, LoadError> {
        let entry = materials.find_above(name)?;
        let part = &context.builder.materials[entry.id.0 as usize];
        if let Some(what) = beyond_surface(part, entry) {
            return Err(name.error(format_args!(
                "\"{}\" has {what} of its own, which a mix does not take over: give it to the mix",
                part.name
            )));
        }
        Ok(Box::new(part.surface.clone()))
    };
    Ok(Surface::Mix {
        first: surface(context, first)?,
        second: surface(context, second)?,
        amount: scalar(context, fields, "amount", 0.5)?,
    })
}

/// What a material has that is not part of how its surface scatters.
fn beyond_surface(material: &Material, entry: Entry) -> Option<&'static str> {
    if entry.power.is_some() || material.emission.factor != Vec3::ZERO {
        Some("an emission")
    } else if material.alpha != Alpha::Opaque {
        Some("an alpha")
    } else if material.relief.is_some() {
        Some("a normal_map or bump_map")
    } else if material.stretch.is_some() {
        Some("a stretch_rotation_deg")
    } else {
        None
    }
}
