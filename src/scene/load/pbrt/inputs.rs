//! Colours and numbers of parameters: RGB, spectra in all their forms, textures.

use super::super::error::LoadError;
use super::super::luminance;
use super::super::spectrum::{Spectrum, named};
use super::Reader;
use super::parameters::{Parameters, Values};
use crate::scene::{ColorInput, ScalarInput};
use glam::Vec3;

/// What a spectrum stands for; it decides how it becomes RGB.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Meaning {
    /// A share of light in [0, 1].
    Reflectance,
    /// An index of refraction or a coefficient.
    Coefficient,
    /// Light: RGB as written; any other spectrum has its colour and luminance 1 (pbrt-v4, `SpectrumToPhotometric`).
    Light,
}

const KINDS: [&str; 3] = ["rgb", "spectrum", "blackbody"];

impl Reader<'_> {
    /// A colour parameter, if it is there.
    pub(super) fn color(
        &mut self,
        parameters: &Parameters,
        name: &str,
        meaning: Meaning,
    ) -> Result<Option<Vec3>, LoadError> {
        if parameters.find(&["rgb"], name).is_some() {
            let rgb = parameters.rgb(name)?.unwrap_or(Vec3::ZERO);
            if rgb.min_element() < 0.0 {
                return Err(parameters.error(format_args!("\"rgb {name}\": a colour must not be negative")));
            }
            if meaning == Meaning::Reflectance && rgb.max_element() > 1.0 {
                self.builder.note(format!("{}: \"{name}\" above 1 is taken as 1.", parameters.place()));
                return Ok(Some(rgb.min(Vec3::ONE)));
            }
            return Ok(Some(rgb));
        }
        let Some(parameter) = parameters.find(&KINDS, name) else { return Ok(None) };
        let wrong = |problem: &str| parameters.error_at(parameter, problem);
        let spectrum = match (&parameter.values, parameter.kind.as_str()) {
            (Values::Numbers(numbers), "blackbody") => {
                if meaning != Meaning::Light {
                    return Err(wrong("a blackbody is light, not a surface"));
                }
                let [kelvin] = numbers[..] else {
                    return Err(wrong(
                        "expected one temperature in kelvin (a scale, as of version 3, goes into \"scale\")",
                    ));
                };
                Spectrum::blackbody(kelvin).ok_or_else(|| wrong("expected a temperature in kelvin above 0"))?
            }
            (Values::Numbers(numbers), _) => {
                Spectrum::from_list(numbers).ok_or_else(|| wrong("expected pairs of nanometres and values"))?
            }
            (Values::Strings(words), _) if words.len() == 1 => {
                if let Some(color) = named_spectrum(&words[0]) {
                    return Ok(Some(color));
                }
                let file = self.file(&words[0]);
                let text = super::super::files::read_text(&file).map_err(|error| {
                    wrong(&format!("\"{}\" is neither a known spectrum nor a readable file ({error})", words[0]))
                })?;
                Spectrum::from_text(&text).ok_or_else(|| wrong("its file is not a list of nanometres and values"))?
            }
            _ => return Err(wrong("expected a spectrum")),
        };
        let color = match meaning {
            Meaning::Reflectance => spectrum.reflectance().min(Vec3::ONE),
            Meaning::Coefficient => spectrum.reflectance(),
            Meaning::Light => spectrum.emission_of_luminance_1().ok_or_else(|| wrong("gives no visible light"))?,
        };
        Ok(Some(color))
    }

    /// A colour parameter that may be a texture.
    pub(super) fn color_input(
        &mut self,
        parameters: &Parameters,
        name: &str,
        meaning: Meaning,
    ) -> Result<Option<ColorInput>, LoadError> {
        match parameters.word(&["texture"], name)? {
            Some(texture) => {
                let texture = texture.to_owned();
                Ok(Some(self.color_texture(parameters, &texture, 0)?))
            }
            None => Ok(self.color(parameters, name, meaning)?.map(ColorInput::constant)),
        }
    }

    /// A number that may be a texture.
    pub(super) fn scalar_input(
        &mut self,
        parameters: &Parameters,
        name: &str,
    ) -> Result<Option<ScalarInput>, LoadError> {
        match parameters.word(&["texture"], name)? {
            Some(texture) => {
                let texture = texture.to_owned();
                Ok(Some(self.scalar_texture(parameters, &texture, 0)?))
            }
            None => Ok(parameters.float(name)?.map(ScalarInput::constant)),
        }
    }

    /// An index of refraction: a number, or a glass by name, or a spectrum's mean.
    pub(super) fn ior(&mut self, parameters: &Parameters, name: &str, default: f32) -> Result<f32, LoadError> {
        let ior = match parameters.float(name)? {
            Some(ior) => ior,
            None => match self.color(parameters, name, Meaning::Coefficient)? {
                Some(color) => {
                    self.builder.note("Dispersion is not rendered: a spectral index of refraction is its mean.");
                    luminance(color)
                }
                None => default,
            },
        };
        if ior > 0.0 { Ok(ior) } else { Err(parameters.error(format_args!("\"{name}\" must be above 0, not {ior}"))) }
    }
}

/// A spectrum that pbrt knows by name. Its light spectra have luminance 1.
fn named_spectrum(name: &str) -> Option<Vec3> {
    if let Some(light) = name.strip_prefix("stdillum-").or_else(|| name.strip_prefix("illum-")) {
        return named::illuminant(light);
    }
    if let Some(glass) = name.strip_prefix("glass-") {
        return named::glass(glass).map(Vec3::splat);
    }
    let (symbol, part) = name.strip_prefix("metal-")?.rsplit_once('-')?;
    let metal = named::metal(symbol)?;
    match part {
        "eta" => Some(metal.eta),
        "k" => Some(metal.k),
        _ => None,
    }
}
