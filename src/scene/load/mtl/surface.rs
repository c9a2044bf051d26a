//! How an MTL material scatters: which of our models stands for what its numbers and its `illum` say.

use super::super::builder::Builder;
use super::{DEFAULT_KD, Written};
use crate::scene::{
    ColorInput, Encoding, MetalRoughness, Roughness, ScalarInput, StretchDirection, Surface, USUAL_IOR,
};
use glam::Vec3;

/// Diffuse colours up to this do not keep glass from being glass: exporters write 0.01 for black.
const NEARLY_BLACK: f32 = 0.02;
/// The `Ks` of a dielectric of index 1.5, which reflects 4 % face on: what Blender writes for it.
const USUAL_KS: f32 = 0.5;
/// Roughness of fibres, of which `Ps` tells the strength alone.
const SHEEN_ROUGHNESS: f32 = 0.5;

impl Written {
    /// The surface without alpha, relief and emission.
    pub(super) fn surface(&self, builder: &mut Builder) -> Surface {
        if let Some(glass) = self.glass(builder) {
            return glass;
        }
        let illumination = self.illumination();
        let specular = self.color("ks").unwrap_or(Vec3::ZERO).min(Vec3::ONE);
        let has_specular = specular.max_element() > 0.0 || self.maps.contains_key("map_ks");
        if self.is_physically_based() {
            return Surface::MetalRoughness(self.physically_based(builder, has_specular));
        }
        let is_black = self.is_black(0.0);
        if matches!(illumination, 3 | 5 | 8) && is_black && has_specular {
            return Surface::Mirror { reflectance: self.share_input(builder, "ks") };
        }
        let is_metal = specular.max_element() > 0.1 || self.maps.contains_key("map_ks");
        if is_black && is_metal && illumination >= 2 {
            return Surface::MetalRoughness(MetalRoughness {
                base_color: self.share_input(builder, "ks"),
                metallic: ScalarInput::constant(1.0),
                roughness: ScalarInput::constant(self.roughness_of_exponent()),
                ..MetalRoughness::default()
            });
        }
        if illumination < 2 || !has_specular {
            return Surface::Diffuse { reflectance: self.share_input(builder, "kd") };
        }
        // A Phong highlight over a diffuse colour: plastic with the microfacet width of that exponent.
        let (specular, specular_color) = self.highlight(builder);
        Surface::MetalRoughness(MetalRoughness {
            base_color: self.share_input(builder, "kd"),
            roughness: ScalarInput::constant(self.roughness_of_exponent()),
            specular,
            specular_color,
            ..MetalRoughness::default()
        })
    }

    /// Where anisotropic facets lie, in turns.
    pub(super) fn stretch(&self) -> Option<StretchDirection> {
        let turns = self.number("anisor").filter(|&turns| turns != 0.0 && self.is_anisotropic())?;
        Some(StretchDirection { rotation: turns * std::f32::consts::TAU, map: None })
    }

    fn illumination(&self) -> i32 {
        self.number("illum").unwrap_or(2.0) as i32
    }

    /// Whether nothing is reflected diffusely, or hardly more than `most`.
    fn is_black(&self, most: f32) -> bool {
        let diffuse = self.color("kd").unwrap_or(Vec3::splat(DEFAULT_KD));
        diffuse.max_element() <= most && !self.maps.contains_key("map_kd")
    }

    /// The roughness whose microfacets are as wide as a Phong lobe of the exponent.
    fn roughness_of_exponent(&self) -> f32 {
        self.number("ns").map_or(0.5, |exponent| (2.0 / (exponent.max(0.0) + 2.0)).sqrt().sqrt())
    }

    /// Strength and tint of a dielectric's reflection: face on in proportion to `Ks`, at 0.5 that of index 1.5, and at
    /// grazing angles no stronger than all. It takes its light from what is diffuse. A picture gives the strength.
    fn highlight(&self, builder: &mut Builder) -> (ScalarInput, ColorInput) {
        let told = self.color("ks").map(|told| told.min(Vec3::ONE)).filter(|told| told.max_element() > 0.0);
        let relative = told.unwrap_or(Vec3::ONE) / USUAL_KS;
        let strength = relative.max_element().min(1.0);
        let tint = ColorInput::constant(relative / strength);
        match self.map(&["map_ks"]) {
            None => (ScalarInput::constant(strength), tint),
            Some(map) => {
                let lookup = self.lookup(builder, map, Encoding::Srgb, [255; 4]);
                let texture = Some((lookup, map.channel.unwrap_or(1).min(2)));
                (ScalarInput { factor: strength * map.gain.max(0.0), texture }, tint)
            }
        }
    }

    /// White fibres.
    fn sheen(&self, builder: &mut Builder) -> MetalRoughness {
        let strength = self.scalar_input(builder, "ps", 0.0);
        MetalRoughness {
            sheen_color: ColorInput {
                factor: Vec3::splat(strength.factor),
                texture: strength.texture.map(|(lookup, _)| lookup),
            },
            sheen_roughness: ScalarInput::constant(SHEEN_ROUGHNESS),
            ..MetalRoughness::default()
        }
    }

    /// 4, 6, 7, 9 are "glass" in the format's list and 5 is a mirror that is used for glass, but exporters write 4 for
    /// all that they have and 9 for whatever alpha leaves out. It is glass where something else says so: a tint of what
    /// comes through, a diffuse colour of nothing, an index that bends what it lets through.
    fn glass(&self, builder: &mut Builder) -> Option<Surface> {
        let illumination = self.illumination();
        if !matches!(illumination, 4..=7 | 9) {
            return None;
        }
        let filter = self.color("tf");
        let is_tinted = filter.is_some_and(|tint| tint.max_element() > 0.0 && tint.min_element() < 1.0);
        let bends = self.number("ni").is_some_and(|ior| ior > 1.0);
        let is_black = self.is_black(NEARLY_BLACK);
        let lets_through = self.opacity() < 1.0 || filter.is_some();
        let is_glass = match illumination {
            5 => is_tinted || lets_through && is_black || bends && self.opacity() < 1.0,
            6 | 7 => is_tinted || is_black || bends,
            4 => is_tinted || is_black || bends && self.opacity() < 1.0,
            _ => is_tinted || is_black,
        };
        let name = &self.name;
        if !is_glass {
            if illumination != 5 {
                builder.note(format!(
                    "Material \"{name}\": illum {illumination} is for glass, and the rest does not describe glass: rendered as a \
                     surface with its colour and alpha."
                ));
            }
            return None;
        }
        if !is_black {
            builder.note(format!("Material \"{name}\": illum {illumination}, rendered as glass: Kd is not used."));
        }
        let tint = filter.filter(|tint| tint.max_element() > 0.0).unwrap_or(Vec3::ONE).min(Vec3::ONE);
        Some(Surface::Dielectric {
            ior: self.number("ni").filter(|&ior| ior > 1.0).unwrap_or(USUAL_IOR),
            roughness: Roughness::constant(self.number("pr").unwrap_or(0.0).clamp(0.0, 1.0)),
            transmittance: ColorInput::constant(tint),
            absorption: Vec3::ZERO,
        })
    }

    fn is_anisotropic(&self) -> bool {
        self.number("aniso").is_some_and(|strength| strength > 0.0)
    }

    fn is_physically_based(&self) -> bool {
        let is_told = |key: &str| self.numbers.contains_key(key) || self.maps.contains_key(&format!("map_{key}"));
        let is_there = |key: &str| {
            self.number(key).is_some_and(|share| share > 0.0) || self.maps.contains_key(&format!("map_{key}"))
        };
        ["pr", "pm"].into_iter().any(is_told) || ["pc", "ps", "aniso"].into_iter().any(is_there)
    }

    fn physically_based(&self, builder: &mut Builder, has_specular: bool) -> MetalRoughness {
        // Writers of the extension that know no Ks write 0 for it.
        let (specular, specular_color) = match has_specular {
            true => self.highlight(builder),
            false => (ScalarInput::constant(1.0), ColorInput::constant(Vec3::ONE)),
        };
        let roughness = if self.numbers.contains_key("ns") { self.roughness_of_exponent() } else { 0.5 };
        MetalRoughness {
            base_color: self.share_input(builder, "kd"),
            metallic: self.scalar_input(builder, "pm", 0.0),
            roughness: self.scalar_input(builder, "pr", roughness),
            ior: self.number("ni").filter(|&ior| ior > 1.0).unwrap_or(USUAL_IOR),
            specular,
            specular_color,
            anisotropy: ScalarInput::constant(self.number("aniso").unwrap_or(0.0).clamp(0.0, 1.0)),
            clearcoat: self.scalar_input(builder, "pc", 0.0),
            clearcoat_roughness: self.scalar_input(builder, "pcr", 0.0),
            ..self.sheen(builder)
        }
    }
}
