//! Reads `Material` and its named kin, and the media behind their surfaces.

use super::super::error::{LoadError, no_such, suggestion};
use super::super::metals::Metal;
use super::super::share;
use super::super::spectrum::named;
use super::Reader;
use super::inputs::Meaning;
use super::parameters::Parameters;
use crate::scene::{
    ColorInput, Distribution, Encoding, HeightMap, HeightUnit, Material, Relief, Roughness, RoughnessScale,
    ScalarInput, Surface, USUAL_IOR, Wrap,
};
use glam::Vec3;
use std::rc::Rc;

/// Deepest nesting of mixes.
const DEEPEST: usize = 16;

/// What a metal may reflect face on: for all light k would be infinite.
const MAX_REFLECTED: Vec3 = Vec3::splat(0.9999);

/// Reads a material that wraps no other.
type Plain<'a> = fn(&mut Reader<'a>, &Parameters) -> Result<Surface, LoadError>;

/// The materials that wrap no other.
const fn plain_kinds<'a>() -> [(&'static str, Plain<'a>); 8] {
    [
        ("diffuse", Reader::diffuse),
        ("coateddiffuse", Reader::coated_diffuse),
        ("coatedconductor", Reader::coated_conductor),
        ("conductor", Reader::conductor),
        ("dielectric", Reader::dielectric),
        ("thindielectric", Reader::thin_dielectric),
        ("diffusetransmission", Reader::diffuse_transmission),
        ("subsurface", Reader::subsurface),
    ]
}

/// Materials of version 4 that are not rendered.
const NOT_RENDERED: [&str; 2] = ["hair", "measured"];

/// What to do with a word that version 4 has no more.
pub(super) const UPGRADE: &str = " of pbrt-v3: `pbrt --upgrade` writes the file for version 4, which is read";

/// Materials that version 4 has no more, or under another name.
const OF_VERSION_3: [&str; 11] = [
    "matte",
    "plastic",
    "metal",
    "glass",
    "mirror",
    "substrate",
    "translucent",
    "uber",
    "kdsubsurface",
    "fourier",
    "disney",
];

/// A material as it was written; it is converted when a shape uses it.
#[derive(Debug)]
pub(super) struct Definition {
    pub(super) name: String,
    pub(super) kind: String,
    pub(super) parameters: Parameters,
}

/// A medium as far as surfaces can show it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Medium {
    /// Absorption coefficient per scene unit.
    pub(super) absorption: Vec3,
}

impl Reader<'_> {
    /// Reads `MakeNamedMedium`: absorption is kept, scattering and its like are named.
    pub(super) fn medium(&mut self, name: &str, parameters: &Parameters) -> Result<(), LoadError> {
        let kind = parameters.string("type")?.unwrap_or("homogeneous");
        if kind != "homogeneous" {
            return Err(parameters.unsupported(format_args!(
                "medium \"{name}\": volumes of type \"{kind}\" are not rendered; homogeneous absorption behind glass is"
            )));
        }
        let scale = parameters.float_or("scale", 1.0)?;
        let absorption = self.color(parameters, "sigma_a", Meaning::Coefficient)?;
        let scattering = self.color(parameters, "sigma_s", Meaning::Coefficient)?;
        if parameters.string("preset")?.is_some() {
            self.builder.note(format!("Medium \"{name}\": presets are not known; it absorbs nothing."));
        } else if scattering.is_none_or(|s| s.max_element() > 0.0) {
            self.builder.note(format!("Medium \"{name}\": its absorption is rendered, its scattering is not."));
        }
        // pbrt's defaults are the coefficients of milk-like stuff, in mm⁻¹.
        let absorption = absorption.unwrap_or(Vec3::new(0.0011, 0.0024, 0.014)) * scale;
        self.media.insert(name.to_owned(), Medium { absorption: absorption.max(Vec3::ZERO) });
        parameters.find(&["float"], "g");
        self.note_unread(&format!("medium \"{name}\""), parameters);
        Ok(())
    }

    /// The material of a name.
    pub(super) fn named_material(&mut self, user: &Parameters, name: &str) -> Result<Rc<Definition>, LoadError> {
        if !self.named_materials.contains_key(name) {
            self.look_ahead()?;
        }
        let found = self.named_materials.get(name).cloned();
        found.ok_or_else(|| user.error(no_such("material", name, self.named_materials.keys())))
    }

    /// Our material; `None` for one that is not there ("interface").
    pub(super) fn convert_material(&mut self, definition: &Definition) -> Result<Option<Material>, LoadError> {
        let parameters = &definition.parameters;
        let Some(surface) = self.surface(definition, 0)? else { return Ok(None) };
        if surface.components() > Surface::MAX_COMPONENTS {
            let most = Surface::MAX_COMPONENTS;
            return Err(parameters.unsupported(format_args!("mixes of more than {most} materials are not rendered")));
        }
        let mut material = Material::plain(definition.name.clone(), surface);
        material.relief = self.relief(parameters)?;
        self.note_unread(&format!("material \"{}\"", definition.name), parameters);
        Ok(Some(material))
    }

    /// Heights in scene units, which win over normals where both are there.
    fn relief(&mut self, parameters: &Parameters) -> Result<Option<Relief>, LoadError> {
        let heights = self.scalar_input(parameters, "displacement")?;
        let normals = parameters.string("normalmap")?;
        if let Some(height) = heights.filter(|height| height.texture.is_some()) {
            return Ok(Some(Relief::Heights(HeightMap { height, unit: HeightUnit::Scene })));
        }
        let Some(file) = normals else { return Ok(None) };
        let map = self.picture(file, parameters, Encoding::Linear, Wrap::Repeat);
        Ok(Some(Relief::Normals { map, strength: 1.0 }))
    }

    fn surface(&mut self, definition: &Definition, depth: usize) -> Result<Option<Surface>, LoadError> {
        let parameters = &definition.parameters;
        match definition.kind.as_str() {
            "mix" => self.mix(parameters, depth),
            "interface" | "none" | "" => Ok(None),
            kind => match plain_kinds().iter().find(|(name, _)| *name == kind) {
                Some((_, read)) => read(self, parameters).map(Some),
                None => Err(not_read(parameters, kind)),
            },
        }
    }

    fn diffuse(&mut self, parameters: &Parameters) -> Result<Surface, LoadError> {
        Ok(Surface::Diffuse { reflectance: self.reflectance(parameters, 0.5)? })
    }

    fn coated_diffuse(&mut self, parameters: &Parameters) -> Result<Surface, LoadError> {
        self.note_coat(parameters);
        self.under_coat(parameters, USUAL_IOR)
    }

    fn subsurface(&mut self, parameters: &Parameters) -> Result<Surface, LoadError> {
        self.builder.note(format!(
            "{}: light below the surface is not rendered: \"subsurface\" is a coated diffuse surface.",
            parameters.place()
        ));
        self.under_coat(parameters, 1.33)
    }

    /// A diffuse base under a coat of the index that is told, or of a usual one.
    fn under_coat(&mut self, parameters: &Parameters, usual_ior: f32) -> Result<Surface, LoadError> {
        Ok(Surface::CoatedDiffuse {
            reflectance: self.reflectance(parameters, 0.5)?,
            ior: self.ior(parameters, "eta", usual_ior)?.max(1.0),
            roughness: self.roughness(parameters, "")?,
            saturates: true,
        })
    }

    fn coated_conductor(&mut self, parameters: &Parameters) -> Result<Surface, LoadError> {
        self.note_coat(parameters);
        let Metal { eta, k } = self.coated_metal(parameters)?;
        Ok(Surface::CoatedConductor {
            eta,
            k,
            roughness: self.roughness(parameters, "conductor.")?,
            coat_ior: self.ior(parameters, "interface.eta", USUAL_IOR)?.max(1.0),
            coat_roughness: self.roughness(parameters, "interface.")?,
        })
    }

    fn dielectric(&mut self, parameters: &Parameters) -> Result<Surface, LoadError> {
        Ok(Surface::Dielectric {
            ior: self.ior(parameters, "eta", USUAL_IOR)?,
            roughness: self.roughness(parameters, "")?,
            transmittance: ColorInput::constant(Vec3::ONE),
            absorption: Vec3::ZERO,
        })
    }

    fn thin_dielectric(&mut self, parameters: &Parameters) -> Result<Surface, LoadError> {
        Ok(Surface::ThinDielectric {
            ior: self.ior(parameters, "eta", USUAL_IOR)?,
            transmittance: ColorInput::constant(Vec3::ONE),
        })
    }

    fn diffuse_transmission(&mut self, parameters: &Parameters) -> Result<Surface, LoadError> {
        let scale = parameters.float_or("scale", 1.0)?.max(0.0);
        let scaled = |color: ColorInput| ColorInput { factor: color.factor * scale, ..color };
        let transmittance = self.color_input(parameters, "transmittance", Meaning::Reflectance)?;
        let transmittance = scaled(transmittance.unwrap_or(ColorInput::constant(Vec3::splat(0.25))));
        let reflectance = scaled(self.reflectance(parameters, 0.25)?);
        if reflectance.texture.is_none() && transmittance.texture.is_none() {
            let sum = reflectance.factor.min(Vec3::ONE) + transmittance.factor.min(Vec3::ONE);
            if sum.max_element() > 1.0 {
                self.builder.note(format!(
                    "{}: \"reflectance\" and \"transmittance\" make light together, {sum}: both are scaled down to 1 in each such channel.",
                    parameters.place()
                ));
            }
        }
        Ok(Surface::DiffuseTransmission { reflectance, transmittance })
    }

    fn note_coat(&mut self, parameters: &Parameters) {
        let thick = parameters.find(&["rgb", "spectrum", "texture"], "albedo").is_some();
        for (kind, name) in [("float", "thickness"), ("float", "g"), ("integer", "maxdepth"), ("integer", "nsamples")] {
            parameters.find(&[kind, "texture"], name);
        }
        if thick {
            self.builder.note(format!("{}: the medium inside the coat is not rendered.", parameters.place()));
        }
    }

    fn mix(&mut self, parameters: &Parameters, depth: usize) -> Result<Option<Surface>, LoadError> {
        if depth > DEEPEST {
            return Err(parameters.error("mixes are nested too deeply, or a mix uses itself"));
        }
        let [first, second] = parameters.strings("materials")? else {
            return Err(parameters.error("a mix needs \"string materials\" with two names"));
        };
        let amount = self.scalar_input(parameters, "amount")?.unwrap_or(ScalarInput::constant(0.5));
        let mut parts = Vec::new();
        for name in [first, second] {
            let definition = self.named_material(parameters, name)?;
            let surface = self.surface(&definition, depth + 1)?;
            let part = &definition.parameters;
            if part.find(&["texture"], "displacement").is_some() || part.string("normalmap")?.is_some() {
                self.builder.note(format!("{}: relief of a mix's parts is not rendered.", part.place()));
            }
            // Nested mixes double at each level: stop before they are many.
            let most = Surface::MAX_COMPONENTS;
            if surface.as_ref().is_some_and(|surface| surface.components() > most) {
                return Err(
                    parameters.unsupported(format_args!("mixes of more than {most} materials are not rendered"))
                );
            }
            parts.push(surface.ok_or_else(|| parameters.unsupported("a mix with \"interface\" is not rendered"))?);
        }
        let (Some(second), Some(first)) = (parts.pop(), parts.pop()) else { return Ok(None) };
        Ok(Some(Surface::Mix { first: Box::new(first), second: Box::new(second), amount }))
    }

    fn reflectance(&mut self, parameters: &Parameters, default: f32) -> Result<ColorInput, LoadError> {
        let color = self.color_input(parameters, "reflectance", Meaning::Reflectance)?;
        Ok(color.unwrap_or(ColorInput::constant(Vec3::splat(default))))
    }

    /// A picture of reflectances darkens the metal of its brightest texel: as in pbrt face on, and no
    /// brighter at grazing angles.
    fn conductor(&mut self, parameters: &Parameters) -> Result<Surface, LoadError> {
        let Some(color) = self.metal_color(parameters, "")? else {
            let Metal { eta, k } = self.metal(parameters, "")?;
            return Ok(Surface::conductor(eta, k, self.roughness(parameters, "")?));
        };
        let Some(lookup) = color.texture else {
            let Metal { eta, k } = metal_that_reflects(color.factor);
            return Ok(Surface::conductor(eta, k, self.roughness(parameters, "")?));
        };
        self.builder.note(format!(
            "{}: a metal's textured reflectance darkens one metal: what is dark stays dark at grazing angles.",
            parameters.place()
        ));
        let brightest =
            (color.factor * self.builder.textures.brightest(lookup.texture)?).clamp(Vec3::ZERO, MAX_REFLECTED);
        let Metal { eta, k } = metal_that_reflects(brightest);
        let factor = color.factor / brightest.max(Vec3::splat(f32::MIN_POSITIVE));
        let tint = ColorInput { factor: factor.min(Vec3::MAX), texture: color.texture };
        Ok(Surface::Conductor { eta, k, tint, roughness: self.roughness(parameters, "")? })
    }

    /// The metal of a coated conductor, which has no place for a picture.
    fn coated_metal(&mut self, parameters: &Parameters) -> Result<Metal, LoadError> {
        let Some(color) = self.metal_color(parameters, "conductor.")? else {
            return self.metal(parameters, "conductor.");
        };
        if color.texture.is_some() {
            let note = format!("{}: a metal's textured reflectance is its mean under a coat.", parameters.place());
            self.builder.note(note);
        }
        Ok(metal_that_reflects(self.mean_of_color(&color)?))
    }

    fn metal_color(&mut self, parameters: &Parameters, prefix: &str) -> Result<Option<ColorInput>, LoadError> {
        for name in [format!("{prefix}reflectance"), "reflectance".to_owned()] {
            if let Some(color) = self.color_input(parameters, &name, Meaning::Reflectance)? {
                return Ok(Some(color));
            }
        }
        Ok(None)
    }

    fn metal(&mut self, parameters: &Parameters, prefix: &str) -> Result<Metal, LoadError> {
        let copper = named::metal("Cu").unwrap_or(Metal { eta: Vec3::ONE, k: Vec3::ONE });
        let eta = self.color(parameters, &format!("{prefix}eta"), Meaning::Coefficient)?.unwrap_or(copper.eta);
        let k = self.color(parameters, &format!("{prefix}k"), Meaning::Coefficient)?.unwrap_or(copper.k);
        if eta.min_element() <= 0.0 {
            return Err(parameters.error(format_args!("a metal's eta must be above 0 in every channel: {eta}")));
        }
        Ok(Metal { eta, k })
    }

    fn roughness(&mut self, parameters: &Parameters, prefix: &str) -> Result<Roughness, LoadError> {
        let both = self.scalar_input(parameters, &format!("{prefix}roughness"))?.unwrap_or(ScalarInput::constant(0.0));
        let u = self.scalar_input(parameters, &format!("{prefix}uroughness"))?.unwrap_or(both);
        let v = self.scalar_input(parameters, &format!("{prefix}vroughness"))?.unwrap_or(both);
        let remap = parameters.boolean_or("remaproughness", true)?;
        Ok(Roughness {
            u: share(u),
            v: (u != v).then_some(share(v)),
            scale: if remap { RoughnessScale::SquareRoot } else { RoughnessScale::Alpha },
            distribution: Distribution::Ggx,
        })
    }
}

/// The error about a material that is none of ours.
fn not_read(parameters: &Parameters, kind: &str) -> LoadError {
    let read = plain_kinds().map(|(name, _)| name).into_iter().chain(["mix", "interface"]);
    if NOT_RENDERED.contains(&kind) {
        let read: Vec<&str> = read.collect();
        return parameters.unsupported(format_args!("material \"{kind}\" is not rendered; {} are", read.join(", ")));
    }
    let meant = match OF_VERSION_3.contains(&kind) {
        true => UPGRADE.to_owned(),
        false => suggestion(kind, read),
    };
    parameters.error(format_args!("unknown material \"{kind}\"{meant}"))
}

/// The η and k that reflect a colour at normal incidence as pbrt makes them: η = 1, k = 2√r / √(1 − r).
fn metal_that_reflects(color: Vec3) -> Metal {
    let r = color.clamp(Vec3::ZERO, MAX_REFLECTED);
    Metal { eta: Vec3::ONE, k: 2.0 * (r / (Vec3::ONE - r)).powf(0.5) }
}
