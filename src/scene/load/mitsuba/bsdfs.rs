//! `<bsdf>` and its wrappers.

use super::super::error::LoadError;
use super::super::luminance;
use super::super::spectrum::named;
use super::Reader;
use super::element::Element;
use super::textures::Meaning;
use crate::scene::{
    Alpha, ColorInput, Distribution, HeightMap, HeightUnit, Material, MetalRoughness, Relief, Roughness,
    RoughnessScale, ScalarInput, Surface,
};
use glam::Vec3;
use std::rc::Rc;

/// Deepest nesting of wrappers.
const DEEPEST: usize = 16;

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

/// What a BSDF comes to: the surface, and what its wrappers add.
pub(super) struct Look {
    /// `None` for a surface that is not there.
    pub(super) surface: Option<Surface>,
    pub(super) alpha: Alpha,
    relief: Option<Relief>,
}

impl From<Surface> for Look {
    fn from(surface: Surface) -> Self {
        Self { surface: Some(surface), alpha: Alpha::Opaque, relief: None }
    }
}

impl Look {
    pub(super) fn into_material(self, name: String) -> Option<Material> {
        let mut material = Material::plain(name, self.surface?);
        material.alpha = self.alpha;
        material.relief = self.relief;
        Some(material)
    }
}

impl Reader {
    /// Reads a BSDF.
    pub(super) fn bsdf(&mut self, bsdf: &Rc<Element>, depth: usize) -> Result<Look, LoadError> {
        if depth > DEEPEST {
            return Err(bsdf.error("BSDFs are nested too deeply, or one uses itself"));
        }
        let look = match bsdf.kind().as_str() {
            "twosided" => {
                let inner = self.inner(bsdf)?;
                if inner.len() > 1 {
                    self.builder.note(format!("{}: both sides look like the first.", bsdf.place()));
                }
                self.bsdf(&inner[0], depth + 1)?
            }
            "mask" => {
                let inner = self.inner(bsdf)?;
                let mut look = self.bsdf(&inner[0], depth + 1)?;
                if let Some(value) = self.opacity(bsdf)? {
                    look.alpha = Alpha::Blend { value };
                }
                look
            }
            "bumpmap" | "bump" => {
                let inner = self.inner(bsdf)?;
                let mut look = self.bsdf(&inner[0], depth + 1)?;
                let relief = self.heights(bsdf)?;
                self.add_relief(bsdf, &mut look, relief);
                look
            }
            "normalmap" => {
                let inner = self.inner(bsdf)?;
                let mut look = self.bsdf(&inner[0], depth + 1)?;
                // In 0.x the picture has no name.
                let named = self.color_input(bsdf, "normalmap", Meaning::Coefficient)?;
                let map = named.and_then(|input| input.texture);
                if map.is_none() {
                    self.builder.note(format!("{}: its normal map is not rendered.", bsdf.place()));
                }
                self.add_relief(bsdf, &mut look, map.map(|map| Relief::Normals { map, strength: 1.0 }));
                look
            }
            "blendbsdf" | "mixturebsdf" => self.mix(bsdf, depth)?,
            "coating" | "roughcoating" => self.coating(bsdf, depth)?,
            "null" => Look { surface: None, alpha: Alpha::Opaque, relief: None },
            kind => self.plain_surface(bsdf, kind)?.into(),
        };
        bsdf.ignore(&["sampleweight", "specularsamplingweight"]);
        self.note_unused(&format!("bsdf \"{}\"", bsdf.name()), bsdf);
        Ok(look)
    }

    /// What a wrapper adds. Two reliefs on top of each other are the outer one.
    fn add_relief(&mut self, bsdf: &Element, look: &mut Look, relief: Option<Relief>) {
        if look.relief.is_some() && relief.is_some() {
            self.builder.note(format!("{}: the relief inside another is not rendered.", bsdf.place()));
        }
        look.relief = relief.or(look.relief);
    }

    /// Heights of a bump map in scene units: its texture, whatever that is called, times its scale.
    fn heights(&mut self, bsdf: &Element) -> Result<Option<Relief>, LoadError> {
        let scale = bsdf.float_or("scale", 1.0)?;
        let Some(texture) = self.nested_texture(bsdf)? else {
            return Err(bsdf.error("needs a texture of heights inside"));
        };
        let input = self.texture(&texture, Meaning::Coefficient, 0)?;
        let height =
            ScalarInput { factor: scale * luminance(input.factor), texture: input.texture.map(|lookup| (lookup, 0)) };
        Ok(height.texture.map(|_| Relief::Heights(HeightMap { height, unit: HeightUnit::Scene })))
    }

    /// BSDFs inside another; at least one.
    fn inner(&mut self, bsdf: &Element) -> Result<Vec<Rc<Element>>, LoadError> {
        let mut inner: Vec<Rc<Element>> = bsdf.tagged("bsdf").cloned().collect();
        for reference in bsdf.tagged("ref").cloned().collect::<Vec<_>>() {
            let found = self.resolve(&reference)?;
            if found.tag == "bsdf" {
                inner.push(found);
            }
        }
        if inner.is_empty() { Err(bsdf.error("needs a BSDF inside")) } else { Ok(inner) }
    }

    fn plain_surface(&mut self, bsdf: &Element, kind: &str) -> Result<Surface, LoadError> {
        Ok(match kind {
            "diffuse" | "lambertian" => Surface::Diffuse { reflectance: self.reflectance(bsdf, "reflectance", 0.5)? },
            "roughdiffuse" => {
                bsdf.ignore(&["usefastapprox"]);
                Surface::OrenNayar {
                    reflectance: self.reflectance(bsdf, "reflectance", 0.5)?,
                    roughness: self.scalar_input(bsdf, "alpha")?.unwrap_or(ScalarInput::constant(0.2)),
                }
            }
            "difftrans" => Surface::DiffuseTransmission {
                reflectance: ColorInput::constant(Vec3::ZERO),
                transmittance: self.reflectance(bsdf, "transmittance", 0.5)?,
            },
            "dielectric" | "roughdielectric" => {
                self.note_tint(bsdf, "specularreflectance")?;
                Surface::Dielectric {
                    ior: self.relative_ior(bsdf, "bk7")?,
                    roughness: if kind == "dielectric" { Roughness::SMOOTH } else { self.roughness(bsdf)? },
                    transmittance: self.reflectance(bsdf, "speculartransmittance", 1.0)?,
                    absorption: Vec3::ZERO,
                }
            }
            "thindielectric" => {
                self.note_tint(bsdf, "specularreflectance")?;
                Surface::ThinDielectric {
                    ior: self.relative_ior(bsdf, "bk7")?,
                    transmittance: self.reflectance(bsdf, "speculartransmittance", 1.0)?,
                }
            }
            "conductor" | "roughconductor" => self.conductor(bsdf, kind == "roughconductor")?,
            "plastic" | "roughplastic" => {
                self.note_tint(bsdf, "specularreflectance")?;
                Surface::CoatedDiffuse {
                    reflectance: self.reflectance(bsdf, "diffusereflectance", 0.5)?,
                    ior: self.relative_ior(bsdf, "polypropylene")?.max(1.0),
                    roughness: if kind == "plastic" { Roughness::SMOOTH } else { self.roughness(bsdf)? },
                    saturates: bsdf.boolean_or("nonlinear", false)?,
                }
            }
            "principled" | "principledthin" | "disney" => self.principled(bsdf)?,
            "phong" | "ward" => {
                self.builder.note(format!(
                    "{}: \"{kind}\" is rendered as plastic with the microfacet width of its highlight.",
                    bsdf.place()
                ));
                bsdf.ignore(&["specularreflectance", "variant", "alphau", "alphav"]);
                let exponent = bsdf.float_or("exponent", 30.0)?.max(0.0);
                let alpha = (2.0 / (exponent + 2.0)).sqrt();
                Surface::CoatedDiffuse {
                    reflectance: self.reflectance(bsdf, "diffusereflectance", 0.5)?,
                    ior: 1.5,
                    roughness: Roughness { scale: RoughnessScale::Alpha, ..Roughness::constant(alpha.min(1.0)) },
                    saturates: false,
                }
            }
            other => {
                return Err(bsdf.unsupported(format_args!(
                    "BSDF \"{other}\" is not rendered; diffuse, roughdiffuse, dielectric, thindielectric, conductor, \
                     plastic, their rough forms, principled, mask, twosided, blendbsdf, coating, bumpmap and normalmap are"
                )));
            }
        })
    }

    fn reflectance(&mut self, bsdf: &Element, name: &str, default: f32) -> Result<ColorInput, LoadError> {
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
    fn relative_ior(&mut self, bsdf: &Element, default: &str) -> Result<f32, LoadError> {
        let inside = index(bsdf, "intior", default)?;
        let outside = index(bsdf, "extior", "air")?;
        Ok(inside / outside)
    }

    fn conductor(&mut self, bsdf: &Element, is_rough: bool) -> Result<Surface, LoadError> {
        let tint = self.reflectance(bsdf, "specularreflectance", 1.0)?;
        let material = bsdf.string("material")?;
        let roughness = if is_rough { self.roughness(bsdf)? } else { Roughness::SMOOTH };
        if material == Some("none") {
            return Ok(if is_rough {
                Surface::Conductor { eta: Vec3::splat(1e-3), k: Vec3::splat(1e3), tint, roughness }
            } else {
                Surface::Mirror { reflectance: tint }
            });
        }
        let eta = self.color(bsdf, "eta", Meaning::Coefficient)?;
        let k = self.color(bsdf, "k", Meaning::Coefficient)?;
        let outside = match bsdf.child("exteta").is_some() {
            true => index(bsdf, "exteta", "air")?,
            false => 1.0,
        };
        let symbol = material.unwrap_or("Cu");
        let (eta, k) = match (eta, k) {
            (Some(eta), Some(k)) => (eta, k),
            (None, None) => {
                // Variants of a metal ("Cu_palik") stand for the metal.
                let metal = named::metal(symbol.split('_').next().unwrap_or(symbol)).ok_or_else(|| {
                    let known = named::metal_symbols().join(", ");
                    bsdf.unsupported(format_args!(
                        "the metal \"{symbol}\" is not known; {known} are, and eta and k are read"
                    ))
                })?;
                (metal.eta, metal.k)
            }
            _ => return Err(bsdf.error("eta and k belong together")),
        };
        Ok(Surface::Conductor { eta: (eta / outside).max(Vec3::splat(1e-4)), k: k / outside, tint, roughness })
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
        let clamped = |input: ScalarInput| ScalarInput { factor: input.factor.clamp(0.0, 1.0), ..input };
        Ok(Roughness { u: clamped(u), v: (u != v).then_some(clamped(v)), scale: RoughnessScale::Alpha, distribution })
    }

    fn principled(&mut self, bsdf: &Element) -> Result<Surface, LoadError> {
        let input = |input: Option<ScalarInput>, default: f32| {
            let input = input.unwrap_or(ScalarInput::constant(default));
            ScalarInput { factor: input.factor.clamp(0.0, 1.0), ..input }
        };
        let mut base_color = self.reflectance(bsdf, "basecolor", 0.5)?;
        base_color.factor = base_color.factor.min(Vec3::ONE);
        let specular = bsdf.float("specular")?.unwrap_or(0.5).clamp(0.0, 0.99);
        let metal = MetalRoughness {
            base_color,
            metallic: input(self.scalar_input(bsdf, "metallic")?, 0.0),
            roughness: input(self.scalar_input(bsdf, "roughness")?, 0.5),
            // specular 0.5 reflects 4 %: 0.08 · specular.
            ior: bsdf.float("eta")?.unwrap_or_else(|| {
                let root = (0.08 * specular).sqrt();
                (1.0 + root) / (1.0 - root)
            }),
            transmission: input(self.scalar_input(bsdf, "spectrans")?, 0.0),
            ..MetalRoughness::default()
        };
        Ok(Surface::MetalRoughness(metal))
    }

    fn mix(&mut self, bsdf: &Element, depth: usize) -> Result<Look, LoadError> {
        let inner = self.inner(bsdf)?;
        let [first, second] = inner.as_slice() else {
            return Err(bsdf.unsupported("mixes of other than two BSDFs are not rendered"));
        };
        let amount = match self.scalar_input(bsdf, "weight")? {
            Some(weight) => weight,
            None => match bsdf.string("weights")? {
                Some(weights) => match bsdf.numbers(weights)?.as_slice() {
                    &[a, b] if a >= 0.0 && b >= 0.0 && a + b > 0.0 => {
                        if (a + b - 1.0).abs() > 1e-3 {
                            self.builder.note(format!("{}: weights are scaled to a sum of 1.", bsdf.place()));
                        }
                        ScalarInput::constant(b / (a + b))
                    }
                    _ => return Err(bsdf.error("expected two weights of 0 or more")),
                },
                None => ScalarInput::constant(0.5),
            },
        };
        let (first, second) = (self.bsdf(first, depth + 1)?, self.bsdf(second, depth + 1)?);
        let (Some(first), Some(second)) = (first.surface, second.surface) else {
            return Err(bsdf.unsupported("a mix with \"null\" is not rendered"));
        };
        let mixed = Surface::Mix { first: Box::new(first), second: Box::new(second), amount };
        let most = Surface::MOST_COMPONENTS;
        if mixed.components() > most {
            return Err(bsdf.unsupported(format_args!("mixes of more than {most} BSDFs are not rendered")));
        }
        Ok(mixed.into())
    }

    fn coating(&mut self, bsdf: &Element, depth: usize) -> Result<Look, LoadError> {
        let inner = self.inner(bsdf)?;
        let mut look = self.bsdf(&inner[0], depth + 1)?;
        let ior = self.relative_ior(bsdf, "bk7")?.max(1.0);
        let coat = if bsdf.kind() == "coating" { Roughness::SMOOTH } else { self.roughness(bsdf)? };
        if self.color(bsdf, "sigmaa", Meaning::Coefficient)?.is_some_and(|s| s.max_element() > 0.0) {
            self.builder.note(format!("{}: absorption inside the coat is not rendered.", bsdf.place()));
        }
        bsdf.ignore(&["thickness"]);
        look.surface = match look.surface {
            Some(Surface::Diffuse { reflectance }) => {
                Some(Surface::CoatedDiffuse { reflectance, ior, roughness: coat, saturates: true })
            }
            Some(Surface::Conductor { eta, k, tint, roughness }) => {
                if tint != ColorInput::constant(Vec3::ONE) {
                    self.builder.note(format!("{}: the metal's tint below the coat is not rendered.", bsdf.place()));
                }
                Some(Surface::CoatedConductor { eta, k, roughness, coat_ior: ior, coat_roughness: coat })
            }
            other => {
                self.builder.note(format!("{}: only diffuse surfaces and metals are rendered coated.", bsdf.place()));
                other
            }
        };
        Ok(look)
    }
}

/// An index of refraction: a number or a material's name.
fn index(bsdf: &Element, name: &str, default: &str) -> Result<f32, LoadError> {
    let known = |name: &str| INDICES.iter().find(|(known, _)| *known == name).map(|&(_, index)| index);
    let Some(child) = bsdf.child(name) else { return Ok(known(default).unwrap_or(1.5)) };
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
