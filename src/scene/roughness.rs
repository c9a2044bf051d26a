//! Tells how rough microfacet surfaces are, by numbers or textures. What their facets do is left to `bsdf`.

use super::ScalarInput;

/// Shape of the distribution of microfacet slopes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum Distribution {
    /// Trowbridge and Reitz: long tails, fits most real surfaces.
    #[default]
    Ggx,
    /// Gaussian slopes: short tails.
    Beckmann,
}

/// How the numbers of a [`Roughness`] become the microfacet slope width α.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum RoughnessScale {
    /// α is the square of the number (Burley 2012).
    #[default]
    Perceptual,
    /// α is the number itself.
    Alpha,
    /// α is the square root of the number.
    SquareRoot,
}

/// Roughness of a microfacet surface; 0 is smooth.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Roughness {
    /// Along the tangent, in [0, 1].
    pub u: ScalarInput,
    /// Along the bitangent; `None` where it equals `u`.
    pub v: Option<ScalarInput>,
    /// What the numbers mean.
    pub scale: RoughnessScale,
    /// Shape of the distribution.
    pub distribution: Distribution,
}

impl Roughness {
    /// GGX, the same in all directions, perceptual.
    pub const fn isotropic(roughness: ScalarInput) -> Self {
        Self { u: roughness, v: None, scale: RoughnessScale::Perceptual, distribution: Distribution::Ggx }
    }

    /// Perfectly smooth.
    pub const SMOOTH: Self = Self::isotropic(ScalarInput::constant(0.0));

    /// GGX roughness that is the same everywhere, perceptual, in [0, 1].
    pub const fn constant(roughness: f32) -> Self {
        Self::isotropic(ScalarInput::constant(roughness))
    }

    pub(super) fn scalars(&self) -> impl Iterator<Item = &ScalarInput> {
        [Some(&self.u), self.v.as_ref()].into_iter().flatten()
    }

    /// Whether the surface is smooth wherever it is looked at.
    pub fn is_smooth(&self) -> bool {
        self.u.factor == 0.0 && self.v.is_none_or(|v| v.factor == 0.0)
    }
}

impl From<ScalarInput> for Roughness {
    fn from(roughness: ScalarInput) -> Self {
        Self::isotropic(roughness)
    }
}
