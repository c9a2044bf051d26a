//! `principled` and `principledthin`: Burley's model, by ours of metal and roughness.

use super::super::error::LoadError;
use super::super::share;
use super::Reader;
use super::element::Element;
use crate::scene::{ColorInput, MetalRoughness, Roughness, ScalarInput, Surface};
use glam::Vec3;

/// What the surface bounds.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Body {
    Solid,
    Sheet,
}

impl Reader {
    pub(super) fn principled(&mut self, bsdf: &Element, body: Body) -> Result<Surface, LoadError> {
        let base_color = self.reflectance(bsdf, "basecolor", 0.5)?;
        let specular = bsdf.float("specular")?.unwrap_or(0.5).clamp(0.0, 0.99);
        let transmission = self.share(bsdf, "spectrans", 0.0)?;
        let has_volume = body == Body::Solid && transmission.factor > 0.0;
        let eta = bsdf.float("eta")?;
        if let Some((eta, problem)) = eta.and_then(|e| Some((e, MetalRoughness::problem_with_ior(e, has_volume)?))) {
            return Err(bsdf.error(format_args!("eta {eta}: {problem}")));
        }
        let model = MetalRoughness {
            base_color,
            metallic: self.share(bsdf, "metallic", 0.0)?,
            roughness: self.share(bsdf, "roughness", 0.5)?,
            // specular 0.5 reflects 4 %: 0.08 · specular.
            ior: eta.unwrap_or_else(|| {
                let root = (0.08 * specular).sqrt();
                (1.0 + root) / (1.0 - root)
            }),
            transmission,
            ..MetalRoughness::default()
        };
        if body == Body::Sheet && model.transmission.factor > 0.0 && model.roughness.factor > 0.0 {
            self.builder.note(format!(
                "{}: what \"spec_trans\" lets through is blurred as much as the reflection, not by 0.65 eta - 0.35 of its roughness.",
                bsdf.place()
            ));
        }
        Ok(if has_volume { self.glass(bsdf, model) } else { Surface::MetalRoughness(model) })
    }

    fn share(&mut self, bsdf: &Element, name: &str, default: f32) -> Result<ScalarInput, LoadError> {
        Ok(share(self.scalar_input(bsdf, name)?.unwrap_or(ScalarInput::constant(default))))
    }

    /// What goes through is tinted by √base_color at each crossing, so by base_color through a whole body: glTF's model
    /// tints each by all of it, and a ball of base colour 0.25 let through 0.0625 of the light.
    fn glass(&mut self, bsdf: &Element, model: MetalRoughness) -> Surface {
        let Some(amount) = share_of_glass(model.transmission, model.metallic) else {
            self.builder.note(format!(
                "{}: where \"metallic\" is a picture, or \"spec_trans\" one that is multiplied by more than 1, what \
                 \"spec_trans\" lets through is tinted at each crossing by all of \
                 \"base_color\", not by its square root.",
                bsdf.place()
            ));
            return Surface::MetalRoughness(MetalRoughness { volume: Some(Vec3::ZERO), ..model });
        };
        let boundary = Surface::Dielectric {
            ior: model.ior,
            roughness: Roughness::isotropic(model.roughness),
            transmittance: self.square_root(model.base_color),
            absorption: Vec3::ZERO,
        };
        if amount == ScalarInput::constant(1.0) {
            return boundary;
        }
        let opaque = Surface::MetalRoughness(MetalRoughness { transmission: ScalarInput::constant(0.0), ..model });
        Surface::Mix { first: Box::new(opaque), second: Box::new(boundary), amount }
    }

    fn square_root(&mut self, color: ColorInput) -> ColorInput {
        let texture = color.texture.map(|mut lookup| {
            lookup.texture = self.builder.textures.raised(lookup.texture, 0.5);
            lookup
        });
        ColorInput { factor: color.factor.map(f32::sqrt), texture }
    }
}

/// `transmission` · (1 − `metallic`), where one picture is enough for it and is nowhere cut at 1 before metal takes its
/// share.
fn share_of_glass(transmission: ScalarInput, metallic: ScalarInput) -> Option<ScalarInput> {
    let is_cut = transmission.texture.is_some() && transmission.factor > 1.0;
    if metallic.factor > 0.0 && (metallic.texture.is_some() || is_cut) {
        return None;
    }
    Some(ScalarInput { factor: transmission.factor * (1.0 - metallic.factor), ..transmission })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{TextureId, TextureLookup};
    use glam::Vec2;

    /// min(1, 2 · picture) · (1 − 0.5) is no picture times a factor.
    #[test]
    fn metal_takes_its_share_of_what_a_picture_comes_to() {
        let lookup = TextureLookup { texture: TextureId(0), offset: Vec2::ZERO, rotation: 0.0, scale: Vec2::ONE };
        let picture_times = |factor: f32| ScalarInput { factor, texture: Some((lookup, 0)) };
        let [none, half] = [0.0, 0.5].map(ScalarInput::constant);
        assert_eq!(share_of_glass(picture_times(2.0), half), None);
        assert_eq!(share_of_glass(picture_times(2.0), none), Some(picture_times(2.0)));
        assert_eq!(share_of_glass(picture_times(0.8), half), Some(picture_times(0.4)));
        assert_eq!(share_of_glass(half, picture_times(1.0)), None);
    }
}
