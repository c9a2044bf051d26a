//! Reads `<texture>`. Pictures are noted here and decoded when the whole scene is read.

use super::super::error::LoadError;
use super::super::texture::{Adjust, IfMissing, Number, Picture, Request, has_alpha, is_grey};
use super::Reader;
use super::colors::{Meaning, number_of};
use super::element::{Element, canonical};
use super::transform;
use crate::scene::{ColorInput, Encoding, ScalarInput, TextureId, TextureLookup, Wrap};
use glam::{Vec2, Vec3};
use std::rc::Rc;

/// Deepest chain of textures and colours that use each other.
const DEEPEST: usize = 16;

/// Refuses what is used deeper inside others than [`DEEPEST`].
pub(super) fn check_depth(user: &Element, depth: usize) -> Result<(), LoadError> {
    if depth > DEEPEST {
        return Err(user.error("textures are nested too deeply, or one uses itself"));
    }
    Ok(())
}

impl Reader {
    /// The opacity of a mask. A picture with an alpha channel means that channel in files before version 2, whose
    /// exporters wrote leaves so; Mitsuba 3 takes the luminance of its colours.
    pub(super) fn opacity(&mut self, owner: &Element) -> Result<Option<ScalarInput>, LoadError> {
        if let Some(child) = owner.child("opacity").cloned() {
            let child = if child.tag == "ref" { self.resolve(&child)? } else { child };
            if child.tag == "texture"
                && let Some(name) = child.string("filename")?
                && has_alpha(&self.file(&child, name)?)
            {
                let place = child.place();
                if self.since_2 {
                    self.builder.note(format!(
                        "{place}: the opacity is the luminance of the picture's colours, as in Mitsuba 3: its alpha is not used."
                    ));
                    return self.scalar_input(owner, "opacity");
                }
                self.builder
                    .note(format!("{place}: the opacity is the picture's alpha, as files before version 2 mean it."));
                // As a surface's colour would ask for it: the luminance of its colours would be a second
                // picture that nothing reads.
                let picture = self.texture(&child, Meaning::Reflectance, 0)?;
                return Ok(Some(ScalarInput { factor: picture.factor.x, texture: picture.texture.map(|t| (t, 3)) }));
            }
        }
        self.scalar_input(owner, "opacity")
    }

    /// A texture inside, of any name, here or elsewhere in the file.
    pub(super) fn nested_texture(&mut self, owner: &Element) -> Result<Option<Rc<Element>>, LoadError> {
        if let Some(texture) = owner.tagged("texture").next() {
            return Ok(Some(texture.clone()));
        }
        for reference in owner.tagged("ref").cloned().collect::<Vec<_>>() {
            let found = self.resolve(&reference)?;
            if found.tag == "texture" {
                return Ok(Some(found));
            }
        }
        Ok(None)
    }

    /// A texture plugin.
    pub(super) fn texture(
        &mut self,
        texture: &Rc<Element>,
        meaning: Meaning,
        depth: usize,
    ) -> Result<ColorInput, LoadError> {
        check_depth(texture, depth)?;
        let input = match texture.kind().as_str() {
            "bitmap" => self.bitmap(texture, meaning)?,
            "checkerboard" => self.checkerboard(texture, meaning, depth)?,
            "scale" => {
                let inner = texture.tagged("texture").next().cloned();
                let factor = match texture.child("scale").is_some() {
                    true => self.nested_color(texture, "scale", Meaning::Coefficient, depth + 1)?.unwrap_or(Vec3::ONE),
                    false => Vec3::ONE,
                };
                let inner = inner.ok_or_else(|| texture.error("a scale needs a texture inside"))?;
                let inner = self.texture(&inner, meaning, depth + 1)?;
                ColorInput { factor: inner.factor * factor, ..inner }
            }
            other => {
                let note = format!("{}: texture \"{other}\" is not rendered: grey 0.5.", texture.place());
                self.builder.note(note);
                ColorInput::constant(Vec3::splat(0.5))
            }
        };
        texture.ignore(&["maxanisotropy", "cache", "format"]);
        self.note_unused("texture", texture);
        Ok(input)
    }

    fn bitmap(&mut self, texture: &Element, meaning: Meaning) -> Result<ColorInput, LoadError> {
        let Some(name) = texture.string("filename")? else { return Err(texture.error("a bitmap needs a filename")) };
        let file = self.file(texture, name)?;
        let mut is_bounded = false;
        let mut wrap = |name: &str| match texture.string(name)?.map(canonical).as_deref() {
            None | Some("repeat") => Ok(Wrap::Repeat),
            Some("mirror") => Ok(Wrap::Mirror),
            Some("clamp") => Ok(Wrap::Clamp),
            Some("zero" | "one") => {
                is_bounded = true;
                Ok(Wrap::Clamp)
            }
            Some(other) => Err(texture.error(format_args!("unknown wrap mode \"{other}\""))),
        };
        let both = wrap("wrapmode")?;
        let mut one = |name: &str| if texture.child(name).is_some() { wrap(name) } else { Ok(both) };
        let raw = texture.boolean_or("raw", false)? || texture.float("gamma")?.is_some_and(|gamma| gamma == 1.0);
        let filter = texture.string("filtertype")?.map(canonical);
        let encoding =
            if raw || matches!(meaning, Meaning::Coefficient | Meaning::Number) && texture.child("gamma").is_some() {
                Encoding::Linear
            } else {
                Encoding::Srgb
            };
        let (wrap_u, wrap_v) = (one("wrapmodeu")?, one("wrapmodev")?);
        if is_bounded {
            self.builder.note(format!(
                "{}: wrap modes zero and one are not rendered: the picture's edge goes on beyond it.",
                texture.place()
            ));
        }
        let to_number = (meaning == Meaning::Number && !is_grey(&file)).then_some(Number::Luminance);
        let mut lookup = self.mapping(texture)?;
        lookup.texture = self.builder.textures.add(Request {
            picture: Picture::File(file),
            encoding,
            wrap_u,
            wrap_v,
            nearest: filter.as_deref() == Some("nearest"),
            if_missing: IfMissing::Fail(texture.place()),
            adjust: Adjust { to_number, ..Adjust::NONE },
        });
        Ok(ColorInput { factor: Vec3::ONE, texture: Some(lookup) })
    }

    fn checkerboard(&mut self, texture: &Element, meaning: Meaning, depth: usize) -> Result<ColorInput, LoadError> {
        let mut color = |name: &str, default: f32| -> Result<[f32; 4], LoadError> {
            let color = self.nested_color(texture, name, Meaning::Reflectance, depth + 1)?;
            let color = color.unwrap_or(Vec3::splat(default));
            let color = if meaning == Meaning::Number { Vec3::splat(number_of(color)) } else { color };
            Ok(color.extend(1.0).to_array())
        };
        let (mut first, mut second) = (color("color0", 0.4)?, color("color1", 0.2)?);
        // Since version 2 the squares are exchanged where a number is asked for (`Checkerboard::eval_1`).
        if self.since_2 && meaning == Meaning::Number {
            (first, second) = (second, first);
        }
        let request =
            Request { nearest: true, ..Request::texels("checkerboard", [2, 2], &[first, second, second, first]) };
        let mut lookup = self.mapping(texture)?;
        lookup.texture = self.builder.textures.add(request);
        Ok(ColorInput { factor: Vec3::ONE, texture: Some(lookup) })
    }

    /// `uscale` and its like or `to_uv`.
    fn mapping(&mut self, texture: &Element) -> Result<TextureLookup, LoadError> {
        let all = texture.float_or("uvscale", 1.0)?;
        let scale = Vec2::new(texture.float_or("uscale", all)?, texture.float_or("vscale", all)?);
        let offset = Vec2::new(texture.float_or("uoffset", 0.0)?, texture.float_or("voffset", 0.0)?);
        let to_uv = transform::of(texture, "touv")?;
        let [along_u, along_v] = [to_uv.matrix3.x_axis * scale.x, to_uv.matrix3.y_axis * scale.y];
        let [along_u, along_v] = [along_u, along_v].map(|axis| Vec2::new(axis.x, axis.y));
        let offset = offset + Vec2::new(to_uv.translation.x, to_uv.translation.y);
        let (rotation, scale) = turn_and_stretch(along_u, along_v).unwrap_or_else(|| {
            self.builder.note(format!("{}: the shear of its \"to_uv\" is not rendered.", texture.place()));
            (0.0, Vec2::new(along_u.x, along_v.y))
        });
        Ok(TextureLookup { texture: TextureId(0), offset, rotation, scale })
    }
}

/// The rotation and the scale before it that take the axes of u and v to these; `None` where they do not stay
/// perpendicular.
fn turn_and_stretch(along_u: Vec2, along_v: Vec2) -> Option<(f32, Vec2)> {
    let (length_u, length_v) = (along_u.length(), along_v.length());
    if along_u.dot(along_v).abs() > 1e-5 * length_u * length_v {
        return None;
    }
    if along_u.y.abs() <= 1e-6 * length_u && along_v.x.abs() <= 1e-6 * length_v {
        return Some((0.0, Vec2::new(along_u.x, along_v.y)));
    }
    let side = along_u.perp_dot(along_v).signum();
    Some(((-along_u.y).atan2(along_u.x), Vec2::new(length_u, side * length_v)))
}
