//! Colours, numbers and spectra, which may be textures ([`super::textures`]).

use super::super::error::LoadError;
use super::super::files;
use super::super::spectrum::Spectrum;
use super::Reader;
use super::element::Element;
use super::textures::check_depth;
use crate::scene::{ColorInput, ScalarInput};
use fechner_perception::eotf::srgb_to_linear;
use glam::Vec3;

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

impl Reader {
    /// A colour without texture.
    pub(super) fn color(&mut self, owner: &Element, name: &str, meaning: Meaning) -> Result<Option<Vec3>, LoadError> {
        self.nested_color(owner, name, meaning, 0)
    }

    /// A colour without texture that is read inside so many textures.
    pub(super) fn nested_color(
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

    /// A colour that may be a texture, read inside so many textures.
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
