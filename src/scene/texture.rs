//! Looking up textures: wrapping, bilinear interpolation. Nothing here allocates.

use super::{ColorInput, Encoding, ScalarInput, Texels, Texture, TextureLookup, Wrap};
use fechner_perception::eotf::srgb_to_linear;
use glam::{Vec2, Vec3, Vec4};
use std::sync::LazyLock;

/// The curve at all 256 byte values: `powf` for 12 values of every bilinear lookup would dominate it.
static SRGB_TO_LINEAR: LazyLock<[f32; 256]> =
    LazyLock::new(|| std::array::from_fn(|byte| srgb_to_linear(byte as f32 / 255.0)));

impl Encoding {
    /// The linear value of a stored colour.
    #[inline]
    pub fn linear(self, byte: u8) -> f32 {
        match self {
            Self::Srgb => SRGB_TO_LINEAR[usize::from(byte)],
            Self::Linear => f32::from(byte) / 255.0,
        }
    }
}

impl Wrap {
    /// The texel index in [0, size) for any whole position; `size` is at least 1.
    fn apply(self, position: i64, size: i64) -> i64 {
        // Most are within, and a 64-bit division costs more than all else in a look-up.
        if (0..size).contains(&position) {
            return position;
        }
        match self {
            Self::Repeat => position.rem_euclid(size),
            Self::Clamp => position.clamp(0, size - 1),
            Self::Mirror => {
                let folded = position.rem_euclid(2 * size);
                if folded < size { folded } else { 2 * size - 1 - folded }
            }
        }
    }
}

impl TextureLookup {
    /// The coordinates at which the texture is read.
    pub fn transform(&self, uv: Vec2) -> Vec2 {
        if self.rotation == 0.0 {
            return self.scale * uv + self.offset;
        }
        // KHR_texture_transform: offset · rotation · scale, its rotation being clockwise in our v-down coordinates.
        let (sin, cos) = self.rotation.sin_cos();
        let scaled = self.scale * uv;
        Vec2::new(cos * scaled.x + sin * scaled.y, cos * scaled.y - sin * scaled.x) + self.offset
    }
}

impl Texture {
    /// Linear RGBA at coordinates of which (0, 0) is the upper left corner of the picture and (1, 1) the lower right
    /// one. Bilinear between texel centres, or the nearest texel. Coordinates that are not finite read as (0, 0).
    pub fn sample_rgba(&self, uv: Vec2) -> Vec4 {
        match &self.texels {
            Texels::Bytes(texels, Encoding::Linear) => self.sample_of(uv, |index| {
                let [r, g, b, a] = texels[index].map(f32::from);
                Vec4::new(r, g, b, a) * (1.0 / 255.0)
            }),
            Texels::Bytes(texels, Encoding::Srgb) => {
                let linear: &[f32; 256] = &SRGB_TO_LINEAR;
                self.sample_of(uv, |index| {
                    let [r, g, b, a] = texels[index];
                    let of = |byte: u8| linear[usize::from(byte)];
                    Vec4::new(of(r), of(g), of(b), f32::from(a) * (1.0 / 255.0))
                })
            }
            Texels::Floats(texels) => self.sample_of(uv, |index| Vec4::from_array(texels[index])),
        }
    }

    /// The same with texels by index.
    #[inline(always)]
    fn sample_of(&self, uv: Vec2, texel: impl Fn(usize) -> Vec4) -> Vec4 {
        let Blend { texels: [upper_left, upper_right, lower_left, lower_right], fraction } = self.blend(uv);
        if self.nearest {
            return texel(upper_left);
        }
        let upper = texel(upper_left).lerp(texel(upper_right), fraction.x);
        let lower = texel(lower_left).lerp(texel(lower_right), fraction.x);
        upper.lerp(lower, fraction.y)
    }

    /// What is blended at coordinates.
    #[inline(always)]
    fn blend(&self, uv: Vec2) -> Blend {
        let uv = if uv.is_finite() { uv } else { Vec2::ZERO };
        let (width, height) = (i64::from(self.width), i64::from(self.height));
        let index = |column: i64, row: i64| (row * width + column) as usize;
        // Beyond 2^30 texels the fraction is lost in f32 anyway; the clamp keeps the integers from overflowing.
        let limit = (1_i64 << 30) as f32;
        let x = (uv.x * self.width as f32).clamp(-limit, limit);
        let y = (uv.y * self.height as f32).clamp(-limit, limit);
        if self.nearest {
            let texel = index(self.wrap_u.apply(floor(x), width), self.wrap_v.apply(floor(y), height));
            return Blend { texels: [texel; 4], fraction: Vec2::ZERO };
        }
        let (x, y) = (x - 0.5, y - 0.5);
        let (left, top) = (floor(x), floor(y));
        let columns = [self.wrap_u.apply(left, width), self.wrap_u.apply(left + 1, width)];
        let rows = [self.wrap_v.apply(top, height), self.wrap_v.apply(top + 1, height)];
        let [upper, lower] = rows.map(|row| columns.map(|column| index(column, row)));
        Blend { texels: [upper[0], upper[1], lower[0], lower[1]], fraction: Vec2::new(x - left as f32, y - top as f32) }
    }

    /// The stored texels that [`Self::sample_rgba`] will read at these coordinates, to be fetched ahead;
    /// `None` for textures of floats.
    pub(crate) fn stored_at(&self, uv: Vec2) -> Option<[&[u8; 4]; 4]> {
        match &self.texels {
            Texels::Bytes(texels, _) => Some(self.blend(uv).texels.map(|index| &texels[index])),
            Texels::Floats(_) => None,
        }
    }

    /// The largest linear colour value of any texel.
    pub fn brightest(&self) -> f32 {
        match &self.texels {
            Texels::Bytes(texels, encoding) => {
                let byte = texels.iter().map(|&[r, g, b, _]| r.max(g).max(b)).max().unwrap_or(0);
                encoding.linear(byte)
            }
            Texels::Floats(texels) => texels.iter().map(|&[r, g, b, _]| r.max(g).max(b)).fold(0.0, f32::max),
        }
    }

    /// Mean linear colour: of all texels if they are floats, else of at most 256 × 256 places. For choosing lights,
    /// telling pictures apart and what has no place for a picture, not for shading.
    pub fn mean_color(&self) -> Vec3 {
        if let Texels::Floats(texels) = &self.texels {
            let sum: glam::DVec3 = texels.iter().map(|t| Vec3::new(t[0], t[1], t[2]).as_dvec3()).sum();
            return (sum / texels.len().max(1) as f64).as_vec3();
        }
        let (columns, rows) = (self.width.min(256), self.height.min(256));
        let mut sum = glam::DVec3::ZERO;
        for y in 0..rows {
            for x in 0..columns {
                let uv = Vec2::new((x as f32 + 0.5) / columns as f32, (y as f32 + 0.5) / rows as f32);
                sum += self.sample_rgba(uv).truncate().as_dvec3();
            }
        }
        (sum / f64::from(columns * rows)).as_vec3()
    }
}

/// Texels that are blended.
struct Blend {
    /// By index: upper left, upper right, lower left, lower right.
    texels: [usize; 4],
    /// Way from the first to the last in [0, 1).
    fraction: Vec2,
}

/// The largest whole number that is not above a value of less than 2³¹: `f32::floor` is a call on machines without
/// SSE4.1.
fn floor(value: f32) -> i64 {
    let whole = value as i32;
    (whole - i32::from(whole as f32 > value)).into()
}

impl ColorInput {
    /// The colour at texture coordinates.
    pub fn evaluate(&self, textures: &[Texture], uv: Vec2) -> Vec3 {
        match &self.texture {
            None => self.factor,
            Some(lookup) => {
                self.factor * textures[lookup.texture.0 as usize].sample_rgba(lookup.transform(uv)).truncate()
            }
        }
    }
}

impl ScalarInput {
    /// The value at texture coordinates.
    pub fn evaluate(&self, textures: &[Texture], uv: Vec2) -> f32 {
        match &self.texture {
            None => self.factor,
            Some((lookup, channel)) => {
                let texel = textures[lookup.texture.0 as usize].sample_rgba(lookup.transform(uv));
                self.factor * texel[usize::from(*channel).min(3)]
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::TextureId;
    use super::*;
    use std::sync::Arc;

    fn two_by_one(wrap: Wrap) -> Texture {
        Texture {
            name: "test".to_owned(),
            width: 2,
            height: 1,
            texels: Texels::Bytes(Arc::new(vec![[0, 0, 0, 255], [255, 255, 255, 255]]), Encoding::Linear),
            wrap_u: wrap,
            wrap_v: wrap,
            nearest: false,
        }
    }

    #[test]
    fn texel_centres_are_exact_and_between_is_linear() {
        let texture = two_by_one(Wrap::Clamp);
        for (u, expected) in [(0.25, 0.0), (0.75, 1.0), (0.5, 0.5), (-3.0, 0.0), (7.0, 1.0)] {
            assert!((texture.sample_rgba(Vec2::new(u, 0.5)).x - expected).abs() < 1e-6, "u = {u}");
        }
    }

    #[test]
    fn wraps_continue_as_they_say() {
        for (wrap, u, expected) in [
            (Wrap::Repeat, 1.25, 0.0),
            (Wrap::Repeat, -0.25, 1.0),
            (Wrap::Repeat, 0.0, 0.5),
            (Wrap::Mirror, 1.25, 1.0),
            (Wrap::Mirror, -0.25, 0.0),
        ] {
            assert!((two_by_one(wrap).sample_rgba(Vec2::new(u, 0.5)).x - expected).abs() < 1e-6, "{wrap:?} {u}");
        }
    }

    #[test]
    fn any_coordinates_are_safe() {
        for wrap in [Wrap::Repeat, Wrap::Mirror, Wrap::Clamp] {
            for nearest in [false, true] {
                let texture = Texture { nearest, ..two_by_one(wrap) };
                for value in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY, f32::MAX, f32::MIN, 1e30, -1e12, 1e-45] {
                    assert!(texture.sample_rgba(Vec2::new(value, value)).is_finite());
                }
            }
        }
    }

    #[test]
    fn texture_coordinates_turn_as_in_gltf() {
        // The extension's matrices for a quarter turn: (u, v) goes to (v, −u).
        let lookup = TextureLookup { rotation: std::f32::consts::FRAC_PI_2, ..TextureLookup::plain(TextureId(0)) };
        assert!(lookup.transform(Vec2::new(0.25, 0.75)).abs_diff_eq(Vec2::new(0.75, -0.25), 1e-6));
    }

    #[test]
    fn srgb_bytes_are_linear_light() {
        let mut texture = two_by_one(Wrap::Clamp);
        texture.texels = Texels::Bytes(Arc::new(vec![[188, 0, 255, 128]; 2]), Encoding::Srgb);
        let texel = texture.sample_rgba(Vec2::splat(0.5));
        assert!((texel - Vec4::new(0.502_886, 0.0, 1.0, 128.0 / 255.0)).abs().max_element() < 1e-5, "{texel}");
    }
}
