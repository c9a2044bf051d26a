//! Reads `<bsdf>` and its wrappers: blends, masks, bumps, coatings, two sides. BSDFs that wrap no other are left to
//! `surfaces`.

use super::super::error::{LoadError, names_of};
use super::colors::{Meaning, number_of};
use super::element::Element;
use super::surfaces::PLAIN;
use super::{Reader, blend};
use crate::scene::{Alpha, ColorInput, HeightMap, HeightUnit, Material, Relief, ScalarInput, Surface};
use glam::Vec3;
use std::rc::Rc;

/// Deepest nesting of wrappers.
const DEEPEST: usize = 16;

/// Reads a BSDF that stands for others, at a depth of nesting.
type Wrapper = fn(&mut Reader, &Element, usize) -> Result<Look, LoadError>;

/// The BSDFs that wrap others, and the one that is nothing.
const WRAPPERS: &[(&str, Wrapper)] = &[
    ("twosided", Reader::two_sided),
    ("mask", Reader::mask),
    ("bumpmap", Reader::bump_map),
    ("bump", Reader::bump_map),
    ("normalmap", Reader::normal_map),
    ("blendbsdf", Reader::mix),
    ("mixturebsdf", Reader::mix),
    ("coating", Reader::coating),
    ("roughcoating", Reader::coating),
    ("null", |_, _, _| Ok(Look { surface: None, alpha: Alpha::Opaque, relief: None })),
];

/// What a BSDF comes to: the surface, and what its wrappers add.
pub(super) struct Look {
    /// What the BSDF is; `None` for a surface that is not there.
    pub(super) surface: Option<Surface>,
    pub(super) alpha: Alpha,
    pub(super) relief: Option<Relief>,
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
        let kind = bsdf.kind();
        let look = match WRAPPERS.iter().find(|(name, _)| *name == kind) {
            Some((_, read)) => read(self, bsdf, depth)?,
            None => self.plain_surface(bsdf, &kind)?.into(),
        };
        bsdf.ignore(&["sampleweight", "specularsamplingweight"]);
        self.note_unused(&format!("bsdf \"{}\"", bsdf.name()), bsdf);
        Ok(look)
    }

    /// A BSDF that wraps no other.
    fn plain_surface(&mut self, bsdf: &Element, kind: &str) -> Result<Surface, LoadError> {
        let Some((_, read)) = PLAIN.iter().find(|(name, _)| *name == kind) else {
            return Err(bsdf.unsupported(format_args!(
                "BSDF \"{kind}\" is not rendered; {}, {} are",
                names_of(PLAIN),
                names_of(WRAPPERS)
            )));
        };
        read(self, bsdf)
    }

    fn two_sided(&mut self, bsdf: &Element, depth: usize) -> Result<Look, LoadError> {
        let inner = self.inner(bsdf)?;
        if inner.len() > 1 {
            self.builder.note(format!("{}: both sides look like the first.", bsdf.place()));
        }
        self.bsdf(&inner[0], depth + 1)
    }

    fn mask(&mut self, bsdf: &Element, depth: usize) -> Result<Look, LoadError> {
        let inner = self.inner(bsdf)?;
        let look = self.bsdf(&inner[0], depth + 1)?;
        let opacity = self.opacity(bsdf)?.unwrap_or(ScalarInput::constant(0.5));
        Ok(look.masked(opacity).unwrap_or_else(|| {
            self.builder.note(format!("{}: the picture of opacity inside another is not rendered.", bsdf.place()));
            Look { alpha: Alpha::Blend { value: opacity }, ..look }
        }))
    }

    fn bump_map(&mut self, bsdf: &Element, depth: usize) -> Result<Look, LoadError> {
        let inner = self.inner(bsdf)?;
        let mut look = self.bsdf(&inner[0], depth + 1)?;
        let relief = self.heights(bsdf)?;
        self.add_relief(bsdf, &mut look, relief);
        Ok(look)
    }

    fn normal_map(&mut self, bsdf: &Element, depth: usize) -> Result<Look, LoadError> {
        let inner = self.inner(bsdf)?;
        let mut look = self.bsdf(&inner[0], depth + 1)?;
        // In 0.x the picture has no name.
        let named = self.color_input(bsdf, "normalmap", Meaning::Coefficient)?;
        let map = named.and_then(|input| input.texture);
        if map.is_none() {
            self.builder.note(format!("{}: its normal map is not rendered.", bsdf.place()));
        }
        self.add_relief(bsdf, &mut look, map.map(|map| Relief::Normals { map, strength: 1.0 }));
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
        let input = self.texture(&texture, Meaning::Number, 0)?;
        let height =
            ScalarInput { factor: scale * number_of(input.factor), texture: input.texture.map(|lookup| (lookup, 0)) };
        Ok(height.texture.map(|_| Relief::Heights(HeightMap { height, unit: HeightUnit::Scene })))
    }

    /// BSDFs inside another in the document's order; at least one.
    fn inner(&mut self, bsdf: &Element) -> Result<Vec<Rc<Element>>, LoadError> {
        let mut inner = Vec::new();
        for child in &bsdf.children {
            let found = if child.tag == "ref" { self.resolve(child)? } else { Rc::clone(child) };
            if found.tag == "bsdf" {
                child.mark_used();
                inner.push(found);
            }
        }
        if inner.is_empty() { Err(bsdf.error("needs a BSDF inside")) } else { Ok(inner) }
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
        if let Some(alone) = blend::alone(&first, &second, amount) {
            return Ok(alone);
        }
        let (alpha, amount) = blend::coverage(&first, &second, amount).unwrap_or_else(|| {
            self.builder.note(format!("{}: of opacities in a blend the heavier part's is rendered.", bsdf.place()));
            (if amount.factor < 0.5 { first.alpha } else { second.alpha }, amount)
        });
        if first.relief != second.relief {
            self.builder.note(format!("{}: relief of a blend's parts is not rendered.", bsdf.place()));
        }
        let relief = first.relief.filter(|_| first.relief == second.relief);
        let (Some(first), Some(second)) = (first.surface, second.surface) else {
            return Err(bsdf.unsupported("a blend with \"null\" by a picture is only rendered with \"null\" first"));
        };
        let mixed = Surface::Mix { first: Box::new(first), second: Box::new(second), amount };
        let most = Surface::MAX_COMPONENTS;
        if mixed.components() > most {
            return Err(bsdf.unsupported(format_args!("mixes of more than {most} BSDFs are not rendered")));
        }
        Ok(Look { surface: Some(mixed), alpha, relief })
    }

    fn coating(&mut self, bsdf: &Element, depth: usize) -> Result<Look, LoadError> {
        let inner = self.inner(bsdf)?;
        let mut look = self.bsdf(&inner[0], depth + 1)?;
        let ior = self.relative_ior(bsdf, "bk7")?.max(1.0);
        let coat = self.roughness_of_kind(bsdf)?;
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
