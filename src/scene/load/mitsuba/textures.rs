//! Colours, spectra and `<texture>`.

use super::super::error::LoadError;
use super::super::files;
use super::super::spectrum::Spectrum;
use super::super::texture::{Adjust, IfMissing, Number, Picture, Request, has_alpha, is_grey};
use super::Reader;
use super::element::{Element, canonical};
use super::transform;
use crate::scene::{ColorInput, Encoding, ScalarInput, TextureId, TextureLookup, Wrap};
use fechner_perception::eotf::srgb_to_linear;
use glam::{Vec2, Vec3};
use std::rc::Rc;

/// What a colour stands for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Meaning {
    Reflectance,
    Coefficient,
    /// A single number: colours mean that of [`number_of`], pictures their luminance, as in Mitsuba 3.
    Number,
    Light,
}

/// What a colour means where a number is asked for: the mean of its channels.
pub(super) fn number_of(color: Vec3) -> f32 {
    color.element_sum() / 3.0
}

/// Deepest chain of textures and colours that use each other.
const DEEPEST: usize = 16;

/// Refuses what is used deeper inside others than [`DEEPEST`].
fn check_depth(user: &Element, depth: usize) -> Result<(), LoadError> {
    if depth > DEEPEST {
        return Err(user.error("textures are nested too deeply, or one uses itself"));
    }
    Ok(())
}

impl Reader {
    /// A colour without texture.
    pub(super) fn color(&mut self, owner: &Element, name: &str, meaning: Meaning) -> Result<Option<Vec3>, LoadError> {
        self.nested_color(owner, name, meaning, 0)
    }

    /// The same inside so many textures.
    fn nested_color(
        &mut self,
        owner: &Element,
        name: &str,
        meaning: Meaning,
        depth: usize,
    ) -> Result<Option<Vec3>, LoadError> {
        let Some(ColorInput { factor, texture }) = self.nested_input(owner, name, meaning, depth)? else {
            return Ok(None);
        };
        let Some(lookup) = texture else { return Ok(Some(factor)) };
        self.builder.note(format!("{}: \"{name}\": a texture is not rendered here: its mean colour.", owner.place()));
        Ok(Some(factor * self.builder.textures.mean_color(lookup.texture)?))
    }

    /// A colour that may be a texture.
    pub(super) fn color_input(
        &mut self,
        owner: &Element,
        name: &str,
        meaning: Meaning,
    ) -> Result<Option<ColorInput>, LoadError> {
        self.nested_input(owner, name, meaning, 0)
    }

    /// The same inside so many textures.
    fn nested_input(
        &mut self,
        owner: &Element,
        name: &str,
        meaning: Meaning,
        depth: usize,
    ) -> Result<Option<ColorInput>, LoadError> {
        check_depth(owner, depth)?;
        let Some(child) = owner.child(name).cloned() else { return Ok(None) };
        let child = if child.tag == "ref" { self.resolve(&child)? } else { child };
        let value = || child.attribute("value").unwrap_or("").trim();
        let color = match child.tag.as_str() {
            "texture" => return self.texture(&child, meaning, depth).map(Some),
            "float" | "integer" => Vec3::splat(child.numbers(value())?.first().copied().unwrap_or(0.0)),
            "rgb" => rgb(&child, value())?,
            "srgb" => {
                let encoded = rgb(&child, value())?;
                if value().starts_with('#') { encoded } else { encoded.map(srgb_to_linear) }
            }
            "spectrum" => self.spectrum(&child, value(), meaning, depth)?,
            "blackbody" => blackbody_of_attributes(&child)?,
            other => return Err(child.error(format_args!("\"{other}\" is no colour"))),
        };
        if color.min_element() < 0.0 {
            return Err(child.error("a colour must not be negative"));
        }
        let color = if meaning == Meaning::Reflectance && color.max_element() > 1.0 {
            self.builder.note(format!("{}: \"{name}\" above 1 is taken as 1.", child.place()));
            color.min(Vec3::ONE)
        } else {
            color
        };
        Ok(Some(ColorInput::constant(color)))
    }

    /// Light of the same power at all wavelengths, which is the equal-energy white and not RGB's own.
    fn flat_light(&self, child: &Element, value: &str) -> Result<Vec3, LoadError> {
        let flat = Spectrum::from_list(&[555.0, 1.0]).map_or(Vec3::ONE, |spectrum| spectrum.emission());
        Ok(rgb(child, value)? * flat)
    }

    fn spectrum(&mut self, child: &Element, value: &str, meaning: Meaning, depth: usize) -> Result<Vec3, LoadError> {
        let listed = match child.kind().as_str() {
            "" => None,
            // The white of RGB.
            "d65" => {
                let color = self.nested_color(child, "color", Meaning::Coefficient, depth + 1)?.unwrap_or(Vec3::ONE);
                return Ok(color * child.float_or("scale", 1.0)?);
            }
            "uniform" => return Ok(Vec3::splat(child.float_or("value", 1.0)?)),
            "srgb" => {
                let color = self.nested_color(child, "color", Meaning::Coefficient, depth + 1)?;
                return color.ok_or_else(|| child.error("a spectrum \"srgb\" needs a \"color\""));
            }
            "blackbody" => return blackbody_of_children(child),
            "regular" => Some(regular(child)?),
            "irregular" => Some(irregular(child)?),
            _ => {
                return Err(child.unsupported(format_args!(
                    "spectrum \"{}\" is not read; blackbody, d65, irregular, regular, srgb and uniform are",
                    child.attribute("type").unwrap_or("")
                )));
            }
        };
        let spectrum = if listed.is_some() {
            listed
        } else if let Some(name) = child.attribute("filename") {
            let text = files::read_text(&self.file(child, name)?).map_err(|e| e.referenced_from(child.place()))?;
            Spectrum::from_text(&text)
        } else if value.contains(':') {
            let numbers = value.split([',', ':', ' ', '\n', '\t', '\r']).filter(|word| !word.is_empty());
            let numbers: Result<Vec<f64>, _> = numbers.map(str::parse).collect();
            numbers.ok().and_then(|numbers| Spectrum::from_list(&numbers))
        } else if self.since_2 && meaning == Meaning::Light && !value.contains('#') {
            return self.flat_light(child, value);
        } else {
            return rgb(child, value);
        };
        let spectrum = spectrum.ok_or_else(|| child.error("expected a number or pairs \"nanometres:value\""))?;
        Ok(if meaning == Meaning::Light { spectrum.emission() } else { spectrum.reflectance() })
    }

    /// A number that may be a texture.
    pub(super) fn scalar_input(&mut self, owner: &Element, name: &str) -> Result<Option<ScalarInput>, LoadError> {
        let Some(child) = owner.child(name).cloned() else { return Ok(None) };
        if matches!(child.tag.as_str(), "float" | "integer") {
            return Ok(owner.float(name)?.map(ScalarInput::constant));
        }
        let Some(color) = self.color_input(owner, name, Meaning::Number)? else { return Ok(None) };
        Ok(Some(ScalarInput { factor: number_of(color.factor), texture: color.texture.map(|lookup| (lookup, 0)) }))
    }

    /// The opacity of a mask. A picture with an alpha channel means that channel in files before version 2, whose exporters wrote leaves
    /// so; Mitsuba 3 takes the luminance of its colours.
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
                // As a surface's colour would ask for it: the luminance of its colours would be a second picture that nothing reads.
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

/// The rotation and the scale before it that take the axes of u and v to these; `None` where they do not stay perpendicular.
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

/// Three numbers, one for all, or #rrggbb under the sRGB curve.
fn rgb(child: &Element, value: &str) -> Result<Vec3, LoadError> {
    if let Some(hex) = value.strip_prefix('#') {
        let number = u32::from_str_radix(hex, 16).ok().filter(|_| hex.len() == 6);
        let number = number.ok_or_else(|| child.error(format_args!("\"{value}\" is not #rrggbb")))?;
        let channel = |shift: u32| srgb_to_linear((number >> shift & 0xff) as f32 / 255.0);
        return Ok(Vec3::new(channel(16), channel(8), channel(0)));
    }
    match child.numbers(value)?.as_slice() {
        &[all] => Ok(Vec3::splat(all)),
        &[r, g, b] => Ok(Vec3::new(r, g, b)),
        other => Err(child.error(format_args!("expected one or three numbers, found {}", other.len()))),
    }
}

/// Values at equal steps between two wavelengths in nanometres, as Mitsuba 3 writes them.
fn regular(child: &Element) -> Result<Spectrum, LoadError> {
    let nanometres = |name: &str, written: &str| {
        let found = child.float(name)?.map(f64::from);
        found.ok_or_else(|| child.error(format_args!("a regular spectrum needs a \"{written}\"")))
    };
    let from_nm = nanometres("wavelengthmin", "wavelength_min")?;
    let to_nm = nanometres("wavelengthmax", "wavelength_max")?;
    let values = list(child, "values")?;
    if values.len() < 2 || from_nm >= to_nm {
        return Err(child.error("a regular spectrum needs two values or more, and wavelength_min below wavelength_max"));
    }
    let step_nm = (to_nm - from_nm) / (values.len() - 1) as f64;
    let pairs = values.iter().enumerate().map(|(place, &value)| [from_nm + step_nm * place as f64, f64::from(value)]);
    Spectrum::from_pairs(pairs).ok_or_else(|| child.error("expected finite wavelengths and values"))
}

/// Values at wavelengths in nanometres, two lists of one length.
fn irregular(child: &Element) -> Result<Spectrum, LoadError> {
    let (wavelengths_nm, values) = (list(child, "wavelengths")?, list(child, "values")?);
    if values.len() < 2 || wavelengths_nm.len() != values.len() {
        let problem = format!(
            "an irregular spectrum needs two wavelengths or more and as many values; found {} and {}",
            wavelengths_nm.len(),
            values.len()
        );
        return Err(child.error(problem));
    }
    if let Some(pair) = wavelengths_nm.windows(2).find(|pair| pair[0] >= pair[1]) {
        return Err(child.error(format_args!("wavelengths have to rise; found {} after {}", pair[1], pair[0])));
    }
    let pairs = wavelengths_nm.iter().zip(&values).map(|(&nm, &value)| [f64::from(nm), f64::from(value)]);
    Spectrum::from_pairs(pairs).ok_or_else(|| child.error("expected finite wavelengths and values"))
}

/// The numbers of a `<string>` inside.
fn list(owner: &Element, name: &str) -> Result<Vec<f32>, LoadError> {
    let text = owner.string(name)?;
    owner.numbers(text.ok_or_else(|| owner.error(format_args!("the string \"{name}\" is missing")))?)
}

/// `<blackbody>` as Mitsuba 0.x writes it.
fn blackbody_of_attributes(child: &Element) -> Result<Vec3, LoadError> {
    let text = child.attribute("temperature").unwrap_or("").trim().trim_end_matches(['K', 'k']);
    let kelvin = child.numbers(text)?.first().copied().map(f64::from).unwrap_or(0.0);
    let scale = if child.attribute("scale").is_some() { child.number_attribute("scale")? } else { 1.0 };
    blackbody(child, kelvin, scale, None)
}

/// `<spectrum type="blackbody">` as Mitsuba 3 writes it, dark outside its wavelengths.
fn blackbody_of_children(child: &Element) -> Result<Vec3, LoadError> {
    let nanometres = |name: &str| child.float(name).map(|nm| nm.map(f64::from));
    let (from_nm, to_nm) = (nanometres("wavelengthmin")?, nanometres("wavelengthmax")?);
    let range_nm = match (from_nm, to_nm) {
        (None, None) => None,
        _ => Some([from_nm.unwrap_or(f64::NEG_INFINITY), to_nm.unwrap_or(f64::INFINITY)]),
    };
    if range_nm.is_some_and(|[from_nm, to_nm]| from_nm >= to_nm) {
        return Err(child.error("a blackbody needs its wavelength_min below its wavelength_max"));
    }
    blackbody(child, f64::from(child.float_or("temperature", 0.0)?), child.float_or("scale", 1.0)?, range_nm)
}

/// Planck's law in W m⁻² sr⁻¹ nm⁻¹, as Mitsuba's spectra are, times `scale`; 0 outside a range of wavelengths.
fn blackbody(child: &Element, kelvin: f64, scale: f32, range_nm: Option<[f64; 2]>) -> Result<Vec3, LoadError> {
    let all = Spectrum::blackbody(kelvin).ok_or_else(|| child.error("expected a temperature in kelvin above 0"))?;
    let spectrum = match range_nm {
        Some([from_nm, to_nm]) => all.within(from_nm, to_nm),
        None => all,
    };
    // Radiance at the peak: 4.0957e-15 W m⁻² sr⁻¹ nm⁻¹ K⁻⁵ · T⁵.
    let color = spectrum.emission() * (4.0957e-15 * kelvin.powi(5)) as f32 * scale;
    if color.is_finite() { Ok(color) } else { Err(child.error("the temperature is too high")) }
}
