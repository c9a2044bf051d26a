//! Reads BSDFs that wrap no other: what each comes to here.

use super::super::error::LoadError;
use super::super::spectrum::named;
use super::super::{luminance, share};
use super::Reader;
use super::colors::Meaning;
use super::element::Element;
use super::principled::Body;
use crate::scene::{ColorInput, Distribution, Roughness, RoughnessScale, ScalarInput, Surface, USUAL_IOR};
use glam::Vec3;

/// Indices of refraction by name, at the yellow sodium line.
const INDICES: &[(&str, f32)] = &[
    ("vacuum", 1.0),
    ("helium", 1.000_036),
    ("hydrogen", 1.000_132),
    ("air", 1.000_277),
    ("carbon dioxide", 1.000_45),
    ("water", 1.333),
    ("acetone", 1.36),
    ("ethanol", 1.361),
    ("carbon tetrachloride", 1.461),
    ("glycerol", 1.4729),
    ("benzene", 1.501),
    ("silicone oil", 1.520_45),
    ("bromine", 1.661),
    ("water ice", 1.31),
    ("fused quartz", 1.458),
    ("pyrex", 1.470),
    ("acrylic glass", 1.49),
    ("polypropylene", 1.49),
    ("bk7", 1.5046),
    ("sodium chloride", 1.544),
    ("amber", 1.55),
    ("pet", 1.575),
    ("diamond", 2.419),
];

/// Reads a BSDF that wraps no other.
type Plain = fn(&mut Reader, &Element) -> Result<Surface, LoadError>;

/// The BSDFs that wrap no other.
pub(super) const PLAIN: &[(&str, Plain)] = &[
    ("diffuse", Reader::diffuse),
    ("lambertian", Reader::diffuse),
    ("roughdiffuse", Reader::rough_diffuse),
    ("difftrans", Reader::diffuse_transmission),
    ("dielectric", Reader::dielectric),
    ("roughdielectric", Reader::dielectric),
    ("thindielectric", Reader::thin_dielectric),
    ("conductor", Reader::conductor),
    ("roughconductor", Reader::conductor),
    ("plastic", Reader::plastic),
    ("roughplastic", Reader::plastic),
    ("principled", |reader, bsdf| reader.principled(bsdf, Body::Solid)),
    ("principledthin", |reader, bsdf| reader.principled(bsdf, Body::Sheet)),
    ("disney", |reader, bsdf| reader.principled(bsdf, Body::Solid)),
    ("phong", Reader::highlight),
    ("ward", Reader::highlight),
];

impl Reader {
    fn diffuse(&mut self, bsdf: &Element) -> Result<Surface, LoadError> {
        Ok(Surface::Diffuse { reflectance: self.reflectance(bsdf, "reflectance", 0.5)? })
    }

    fn rough_diffuse(&mut self, bsdf: &Element) -> Result<Surface, LoadError> {
        bsdf.ignore(&["usefastapprox"]);
        Ok(Surface::OrenNayar {
            reflectance: self.reflectance(bsdf, "reflectance", 0.5)?,
            roughness: grooves(self.scalar_input(bsdf, "alpha")?.unwrap_or(ScalarInput::constant(0.2))),
        })
    }

    fn diffuse_transmission(&mut self, bsdf: &Element) -> Result<Surface, LoadError> {
        Ok(Surface::DiffuseTransmission {
            reflectance: ColorInput::constant(Vec3::ZERO),
            transmittance: self.reflectance(bsdf, "transmittance", 0.5)?,
        })
    }

    fn dielectric(&mut self, bsdf: &Element) -> Result<Surface, LoadError> {
        self.note_tint(bsdf, "specularreflectance")?;
        Ok(Surface::Dielectric {
            ior: self.relative_ior(bsdf, "bk7")?,
            roughness: self.roughness_of_kind(bsdf)?,
            transmittance: self.reflectance(bsdf, "speculartransmittance", 1.0)?,
            absorption: Vec3::ZERO,
        })
    }

    fn thin_dielectric(&mut self, bsdf: &Element) -> Result<Surface, LoadError> {
        self.note_tint(bsdf, "specularreflectance")?;
        Ok(Surface::ThinDielectric {
            ior: self.relative_ior(bsdf, "bk7")?,
            transmittance: self.reflectance(bsdf, "speculartransmittance", 1.0)?,
        })
    }

    fn plastic(&mut self, bsdf: &Element) -> Result<Surface, LoadError> {
        self.note_tint(bsdf, "specularreflectance")?;
        Ok(Surface::CoatedDiffuse {
            reflectance: self.reflectance(bsdf, "diffusereflectance", 0.5)?,
            ior: self.relative_ior(bsdf, "polypropylene")?.max(1.0),
            roughness: self.roughness_of_kind(bsdf)?,
            saturates: bsdf.boolean_or("nonlinear", false)?,
        })
    }

    /// Phong's and Ward's models.
    fn highlight(&mut self, bsdf: &Element) -> Result<Surface, LoadError> {
        self.builder.note(format!(
            "{}: \"{}\" is rendered as plastic with the microfacet width of its highlight.",
            bsdf.place(),
            bsdf.kind()
        ));
        bsdf.ignore(&["specularreflectance", "variant", "alphau", "alphav"]);
        let exponent = bsdf.float_or("exponent", 30.0)?.max(0.0);
        let alpha = (2.0 / (exponent + 2.0)).sqrt();
        Ok(Surface::CoatedDiffuse {
            reflectance: self.reflectance(bsdf, "diffusereflectance", 0.5)?,
            ior: USUAL_IOR,
            roughness: Roughness { scale: RoughnessScale::Alpha, ..Roughness::constant(alpha.min(1.0)) },
            saturates: false,
        })
    }

    pub(super) fn reflectance(&mut self, bsdf: &Element, name: &str, default: f32) -> Result<ColorInput, LoadError> {
        let color = self.color_input(bsdf, name, Meaning::Reflectance)?;
        Ok(color.unwrap_or(ColorInput::constant(Vec3::splat(default))))
    }

    /// A tint that our model does not have.
    fn note_tint(&mut self, bsdf: &Element, name: &str) -> Result<(), LoadError> {
        if self.color_input(bsdf, name, Meaning::Reflectance)?.is_some_and(|c| c != ColorInput::constant(Vec3::ONE)) {
            self.builder.note(format!("{}: \"{name}\" is not rendered: nothing tints the reflection.", bsdf.place()));
        }
        Ok(())
    }

    /// Inside over outside.
    pub(super) fn relative_ior(&mut self, bsdf: &Element, default: &str) -> Result<f32, LoadError> {
        let inside = index(bsdf, "intior", default)?;
        let outside = index(bsdf, "extior", "air")?;
        Ok(inside / outside)
    }

    fn conductor(&mut self, bsdf: &Element) -> Result<Surface, LoadError> {
        let tint = self.reflectance(bsdf, "specularreflectance", 1.0)?;
        let roughness = self.roughness_of_kind(bsdf)?;
        let eta = self.color(bsdf, "eta", Meaning::Coefficient)?;
        let k = self.color(bsdf, "k", Meaning::Coefficient)?;
        let outside = match bsdf.child("exteta").is_some() {
            true => index(bsdf, "exteta", "air")?,
            false => 1.0,
        };
        // Since version 2 what is not said is a perfect mirror of index i, before it was copper.
        let usual = if self.since_2 { "none" } else { "Cu" };
        let (eta, k) = match (eta, k, bsdf.string("material")?) {
            (Some(eta), k, None) if self.since_2 => (eta, k.unwrap_or(Vec3::ONE)),
            (Some(eta), Some(k), _) => (eta, k),
            (Some(_), None, _) => return Err(bsdf.error("eta and k belong together")),
            (None, Some(_), None) if !self.since_2 => return Err(bsdf.error("eta and k belong together")),
            (None, _, material) => match material.unwrap_or(usual) {
                "none" if is_rough(bsdf) => (Vec3::splat(1e-3), Vec3::splat(1e3)),
                "none" => return Ok(Surface::Mirror { reflectance: tint }),
                symbol => {
                    // Variants of a metal ("Cu_palik") stand for the metal.
                    let metal = named::metal(symbol.split('_').next().unwrap_or(symbol)).ok_or_else(|| {
                        let known = named::metal_symbols().join(", ");
                        bsdf.unsupported(format_args!(
                            "the metal \"{symbol}\" is not known; {known} are, and eta and k are read"
                        ))
                    })?;
                    (metal.eta, metal.k)
                }
            },
        };
        Ok(Surface::Conductor { eta: (eta / outside).max(Vec3::splat(1e-4)), k: k / outside, tint, roughness })
    }

    /// Roughness of a BSDF that comes smooth and, as "rough...", rough.
    pub(super) fn roughness_of_kind(&mut self, bsdf: &Element) -> Result<Roughness, LoadError> {
        if is_rough(bsdf) { self.roughness(bsdf) } else { Ok(Roughness::SMOOTH) }
    }

    fn roughness(&mut self, bsdf: &Element) -> Result<Roughness, LoadError> {
        let both = self.scalar_input(bsdf, "alpha")?.unwrap_or(ScalarInput::constant(0.1));
        let u = self.scalar_input(bsdf, "alphau")?.unwrap_or(both);
        let v = self.scalar_input(bsdf, "alphav")?.unwrap_or(both);
        bsdf.ignore(&["samplevisible"]);
        let distribution = match bsdf.string("distribution")? {
            None | Some("beckmann") => Distribution::Beckmann,
            Some("ggx") => Distribution::Ggx,
            Some(other) => {
                self.builder.note(format!("{}: distribution \"{other}\" is rendered as Beckmann's.", bsdf.place()));
                Distribution::Beckmann
            }
        };
        Ok(Roughness { u: share(u), v: (u != v).then_some(share(v)), scale: RoughnessScale::Alpha, distribution })
    }
}

fn is_rough(bsdf: &Element) -> bool {
    bsdf.kind().starts_with("rough")
}

/// Our roughness for the `alpha` of `roughdiffuse`: the ratio B/A of Oren and Nayar's lobes for slopes of a
/// standard deviation of α/√2 radians, as Mitsuba 0.6 has them. A picture is taken in proportion to what its
/// brightest is, within 0.03.
fn grooves(alpha: ScalarInput) -> ScalarInput {
    let variance = 0.5 * alpha.factor * alpha.factor;
    let flat = 1.0 - 0.5 * variance / (variance + 0.33);
    let towards_light = 0.45 * variance / (variance + 0.09);
    ScalarInput { factor: (towards_light / flat).min(1.0), ..alpha }
}

/// An index of refraction: a number or a material's name.
fn index(bsdf: &Element, name: &str, default: &str) -> Result<f32, LoadError> {
    let known = |name: &str| INDICES.iter().find(|(known, _)| *known == name).map(|&(_, index)| index);
    let Some(child) = bsdf.child(name) else { return Ok(known(default).unwrap_or(USUAL_IOR)) };
    let text = child.attribute("value").unwrap_or("");
    let index = match (child.tag.as_str(), known(&text.to_lowercase())) {
        ("string", Some(index)) => index,
        ("string", None) => return Err(child.error(format_args!("\"{text}\" is not a known substance"))),
        _ => {
            let numbers = child.numbers(text)?;
            if numbers.len() == 3 {
                luminance(Vec3::from_slice(&numbers))
            } else {
                numbers.first().copied().unwrap_or(0.0)
            }
        }
    };
    if index > 0.0 { Ok(index) } else { Err(child.error("an index of refraction must be above 0")) }
}
