//! How surfaces scatter light, as scene files tell it: one variant a model of `crate::bsdf`. How they are
//! sampled is left to these models.

use super::{ColorInput, MetalRoughness, Roughness, ScalarInput};
use glam::Vec3;

/// How a surface scatters light.
#[expect(clippy::large_enum_variant, reason = "one a material, read in place: a box would only cost a look-up")]
#[derive(Clone, Debug)]
pub enum Surface {
    /// Lambert.
    Diffuse {
        /// Albedo in [0, 1].
        reflectance: ColorInput,
    },
    /// Rough diffuse: clay, unglazed ceramics, the moon.
    OrenNayar {
        /// Albedo of the grooves' walls in [0, 1].
        reflectance: ColorInput,
        /// Roughness in [0, 1]; 0 is Lambert.
        roughness: ScalarInput,
    },
    /// A thin diffuse sheet: paper, leaves.
    DiffuseTransmission {
        /// Albedo of the lit side in [0, 1].
        reflectance: ColorInput,
        /// Albedo of the other side in [0, 1]; where the sum exceeds 1, both are scaled down.
        transmittance: ColorInput,
    },
    /// A perfect mirror.
    Mirror {
        /// Reflectance in [0, 1].
        reflectance: ColorInput,
    },
    /// A metal with complex index of refraction η + ik per RGB channel.
    Conductor {
        /// Real part.
        eta: Vec3,
        /// Imaginary part.
        k: Vec3,
        /// Multiplies what is reflected, in [0, 1]; white for real metals.
        tint: ColorInput,
        /// Roughness.
        roughness: Roughness,
    },
    /// Glass, water: the boundary of a volume.
    Dielectric {
        /// Index of refraction inside relative to outside, above 0.
        ior: f32,
        /// Roughness.
        roughness: Roughness,
        /// Tint of the transmitted light at each crossing; white for clear glass.
        transmittance: ColorInput,
        /// Absorption coefficient of the inside per scene unit and channel, at least 0; 0 is clear.
        absorption: Vec3,
    },
    /// A thin clear sheet: light goes straight through or is reflected.
    ThinDielectric {
        /// Index of refraction of the sheet.
        ior: f32,
        /// Tint of the transmitted light.
        transmittance: ColorInput,
    },
    /// Plastic, varnish, glaze: a clear coat over a diffuse base, the light between the two counted.
    CoatedDiffuse {
        /// Albedo of the base in [0, 1].
        reflectance: ColorInput,
        /// Index of refraction of the coat, at least 1.
        ior: f32,
        /// Roughness of the coat.
        roughness: Roughness,
        /// Whether repeated reflection inside the coat saturates the base's colour, as it does in reality.
        saturates: bool,
    },
    /// Lacquered metal: a clear coat over a conductor.
    CoatedConductor {
        /// Real part of the metal's index, relative to air.
        eta: Vec3,
        /// Imaginary part.
        k: Vec3,
        /// Roughness of the metal.
        roughness: Roughness,
        /// Index of refraction of the coat, at least 1.
        coat_ior: f32,
        /// Roughness of the coat.
        coat_roughness: Roughness,
    },
    /// The metal-roughness model of glTF 2.0.
    MetalRoughness(MetalRoughness),
    /// The modified Phong model. Where the albedos' sum exceeds 1, both are scaled down.
    Phong {
        /// Albedo of the base in [0, 1].
        diffuse: ColorInput,
        /// Albedo of the lobe in [0, 1].
        specular: ColorInput,
        /// Exponent of the lobe, at least 0.
        exponent: ScalarInput,
    },
    /// Ward's anisotropic model. Where the albedos' sum exceeds 1, both are scaled down.
    Ward {
        /// Albedo of the base in [0, 1].
        diffuse: ColorInput,
        /// Albedo of the lobe in [0, 1].
        specular: ColorInput,
        /// Slope widths; the distribution is Gaussian whatever it says here.
        roughness: Roughness,
    },
    /// The wave-optical model of He, Torrance, Sillion and Greenberg.
    HeTorrance {
        /// Real part of the index of refraction.
        eta: Vec3,
        /// Imaginary part; 0 for dielectrics.
        k: Vec3,
        /// Root mean square height of the relief in nanometres, at least 0.
        height_nm: f32,
        /// Autocorrelation length of the relief in nanometres, above 0.
        correlation_nm: f32,
        /// Albedo in [0, 1] of what leaves after scattering beneath the surface.
        diffuse: ColorInput,
    },
    /// The sum of two, weighted. Relief, stretch direction, emission and alpha are the whole material's.
    Mix {
        /// Seen where `amount` is 0.
        first: Box<Surface>,
        /// Seen where `amount` is 1.
        second: Box<Surface>,
        /// Share of the second in [0, 1].
        amount: ScalarInput,
    },
}

impl Surface {
    /// Most components that nested mixes of one material may have together.
    pub const MAX_COMPONENTS: usize = 8;

    /// A clear, smooth dielectric boundary.
    pub const fn clear_dielectric(ior: f32) -> Self {
        Self::Dielectric {
            ior,
            roughness: Roughness::SMOOTH,
            transmittance: ColorInput::constant(Vec3::ONE),
            absorption: Vec3::ZERO,
        }
    }

    /// Absorption per scene unit of an inside that leaves the colour `left`, above 0, of white light after `distance`.
    pub fn absorption_of(left: Vec3, distance: f32) -> Vec3 {
        Vec3::new(left.x.ln(), left.y.ln(), left.z.ln()) / -distance
    }

    /// A metal without tint.
    pub const fn conductor(eta: Vec3, k: Vec3, roughness: Roughness) -> Self {
        Self::Conductor { eta, k, tint: ColorInput::constant(Vec3::ONE), roughness }
    }

    /// What the volume behind the surface absorbs per scene unit; `None` where it bounds none.
    pub fn interior_absorption(&self) -> Option<Vec3> {
        match self {
            Self::Dielectric { absorption, .. } => Some(*absorption),
            Self::MetalRoughness(model) => model.volume,
            Self::Mix { first, second, .. } => first.interior_absorption().or_else(|| second.interior_absorption()),
            Self::Diffuse { .. }
            | Self::OrenNayar { .. }
            | Self::DiffuseTransmission { .. }
            | Self::Mirror { .. }
            | Self::Conductor { .. }
            | Self::ThinDielectric { .. }
            | Self::CoatedDiffuse { .. }
            | Self::CoatedConductor { .. }
            | Self::Phong { .. }
            | Self::Ward { .. }
            | Self::HeTorrance { .. } => None,
        }
    }

    /// Whether light from behind may come through.
    pub fn transmits(&self) -> bool {
        match self {
            Self::DiffuseTransmission { .. }
            | Self::Dielectric { .. }
            | Self::ThinDielectric { .. }
            | Self::Mix { .. } => true,
            Self::MetalRoughness(model) => model.transmission.factor > 0.0,
            Self::Diffuse { .. }
            | Self::OrenNayar { .. }
            | Self::Mirror { .. }
            | Self::Conductor { .. }
            | Self::CoatedDiffuse { .. }
            | Self::CoatedConductor { .. }
            | Self::Phong { .. }
            | Self::Ward { .. }
            | Self::HeTorrance { .. } => false,
        }
    }

    /// Whether a clear coat, which keeps back some of what the surface emits, lies over any of it.
    pub fn has_clearcoat(&self) -> bool {
        match self {
            Self::MetalRoughness(model) => model.clearcoat.factor > 0.0,
            Self::Mix { first, second, .. } => first.has_clearcoat() || second.has_clearcoat(),
            // Coats of other kinds are parts of their models, which are not said to lie over what emits.
            _ => false,
        }
    }

    /// Models that it takes at a point: 1, but for mixes and for volumes, whose boundary is one more and layers over it
    /// another.
    pub fn components(&self) -> usize {
        match self {
            Self::Mix { first, second, .. } => first.components() + second.components(),
            Self::MetalRoughness(model) => match (model.volume.is_some(), model.is_varnished()) {
                (false, _) => 1,
                (true, false) => 2,
                (true, true) => 3,
            },
            _ => 1,
        }
    }

    /// The colour that most of its light depends on, of those which may have a picture.
    pub fn base_color(&self) -> Option<&ColorInput> {
        match self {
            Self::Diffuse { reflectance }
            | Self::OrenNayar { reflectance, .. }
            | Self::DiffuseTransmission { reflectance, .. }
            | Self::Mirror { reflectance }
            | Self::CoatedDiffuse { reflectance, .. } => Some(reflectance),
            Self::Conductor { tint, .. } => Some(tint),
            Self::Dielectric { transmittance, .. } | Self::ThinDielectric { transmittance, .. } => Some(transmittance),
            Self::Phong { diffuse, .. } | Self::Ward { diffuse, .. } | Self::HeTorrance { diffuse, .. } => {
                Some(diffuse)
            }
            Self::MetalRoughness(model) => Some(&model.base_color),
            Self::Mix { first, .. } => first.base_color(),
            Self::CoatedConductor { .. } => None,
        }
    }

    /// Whether it looks different when turned about its normal.
    pub fn is_anisotropic(&self) -> bool {
        match self {
            Self::Conductor { roughness, .. }
            | Self::Dielectric { roughness, .. }
            | Self::Ward { roughness, .. }
            | Self::CoatedDiffuse { roughness, .. } => roughness.v.is_some(),
            Self::CoatedConductor { roughness, coat_roughness, .. } => {
                roughness.v.is_some() || coat_roughness.v.is_some()
            }
            Self::Mix { first, second, .. } => first.is_anisotropic() || second.is_anisotropic(),
            Self::Diffuse { .. }
            | Self::OrenNayar { .. }
            | Self::DiffuseTransmission { .. }
            | Self::Mirror { .. }
            | Self::ThinDielectric { .. }
            | Self::Phong { .. }
            | Self::HeTorrance { .. } => false,
            Self::MetalRoughness(model) => model.anisotropy.factor > 0.0,
        }
    }

    /// Colours that the model reads, every one.
    pub fn colors(&self) -> Vec<&ColorInput> {
        match self {
            Self::Diffuse { reflectance }
            | Self::OrenNayar { reflectance, .. }
            | Self::Mirror { reflectance }
            | Self::CoatedDiffuse { reflectance, .. } => vec![reflectance],
            Self::DiffuseTransmission { reflectance, transmittance } => vec![reflectance, transmittance],
            Self::Conductor { tint, .. } => vec![tint],
            Self::Dielectric { transmittance, .. } | Self::ThinDielectric { transmittance, .. } => vec![transmittance],
            Self::CoatedConductor { .. } => Vec::new(),
            Self::Phong { diffuse, specular, .. } | Self::Ward { diffuse, specular, .. } => vec![diffuse, specular],
            Self::HeTorrance { diffuse, .. } => vec![diffuse],
            Self::MetalRoughness(model) => vec![&model.base_color, &model.specular_color, &model.sheen_color],
            Self::Mix { first, second, .. } => first.colors().into_iter().chain(second.colors()).collect(),
        }
    }

    /// Scalars that the model reads, every one.
    pub fn scalars(&self) -> Vec<&ScalarInput> {
        match self {
            Self::Diffuse { .. }
            | Self::DiffuseTransmission { .. }
            | Self::Mirror { .. }
            | Self::ThinDielectric { .. } => Vec::new(),
            Self::HeTorrance { .. } => Vec::new(),
            Self::OrenNayar { roughness, .. } => vec![roughness],
            Self::Phong { exponent, .. } => vec![exponent],
            Self::Conductor { roughness, .. }
            | Self::Dielectric { roughness, .. }
            | Self::Ward { roughness, .. }
            | Self::CoatedDiffuse { roughness, .. } => roughness.scalars().collect(),
            Self::CoatedConductor { roughness, coat_roughness, .. } => {
                roughness.scalars().chain(coat_roughness.scalars()).collect()
            }
            Self::MetalRoughness(model) => vec![
                &model.metallic,
                &model.roughness,
                &model.transmission,
                &model.specular,
                &model.anisotropy,
                &model.clearcoat,
                &model.clearcoat_roughness,
                &model.sheen_roughness,
            ],
            Self::Mix { first, second, amount } => {
                first.scalars().into_iter().chain(second.scalars()).chain([amount]).collect()
            }
        }
    }
}
