//! Operators by name.

use super::field::AdaptationScope;
use super::{
    Absolute, Agx, Ceiling, Constant, DurandDorsey00, Exposure, Ferwerda96, Linear, Pattanaik00, PbrNeutral,
    Reinhard02, Scheel00, Srgb, ToneOperator, TumblinRushmeier, Ward94, WardLarson97,
};
use crate::error::Error;
use crate::names::{NamedTable, find, names_of};

/// What an eye loses besides brightness, for the operators that can show it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Effects {
    /// Bright places veil their surroundings (`ward-larson97`).
    pub glare: bool,
    /// Fine detail is lost in dim light (`ward-larson97`, `ferwerda96`).
    pub acuity: bool,
    /// Colour is lost in dim light (`ward-larson97`; `ferwerda96`, `durand-dorsey00` and `pattanaik00` always lose it).
    pub colour: bool,
}

/// What may be chosen besides the operator.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ToneSettings {
    /// Multiplies light by 2^stops: before the curve of `agx`, `pbr-neutral` and `reinhard02`, after the others.
    pub exposure_stops: f64,
    /// Whether the eye is adapted to the view as a whole or to each place, for the operators that know both.
    pub scope: AdaptationScope,
    /// Effects that are shown; `None` for what the operator's authors had, which is acuity and colour for `ferwerda96`
    /// and nothing for `ward-larson97`.
    pub effects: Option<Effects>,
}

/// Name of the operator that is meant where none is named.
pub const DEFAULT_OPERATOR: &str = "constant";

/// Makes an operator that multiplies light by `exposure`, with the other settings that it knows.
type Constructor = fn(exposure: f64, &ToneSettings) -> Box<dyn ToneOperator>;

/// All operators, in the order in which they are listed.
const OPERATORS: NamedTable<Constructor, 16> = [
    (DEFAULT_OPERATOR, |exposure, _| Box::new(Constant { exposure, time: Exposure::Automatic })),
    ("constant-long", |exposure, _| Box::new(Constant { exposure, time: Exposure::Long })),
    ("constant-short", |exposure, _| Box::new(Constant { exposure, time: Exposure::Short })),
    ("absolute", |exposure, _| Box::new(Absolute { exposure })),
    ("tumblin-rushmeier", |exposure, settings| Box::new(TumblinRushmeier { exposure, scope: settings.scope })),
    ("ward94", |exposure, settings| Box::new(Ward94 { exposure, scope: settings.scope })),
    ("ferwerda96", |exposure, settings| {
        let acuity = settings.effects.is_none_or(|effects| effects.acuity);
        Box::new(Ferwerda96 { exposure, scope: settings.scope, acuity })
    }),
    ("ward-larson97", |exposure, settings| {
        let effects = settings.effects.unwrap_or_default();
        Box::new(WardLarson97 { exposure, ceiling: Ceiling::Human, effects })
    }),
    ("pattanaik00", |exposure, settings| Box::new(Pattanaik00 { exposure, scope: settings.scope })),
    ("durand-dorsey00", |exposure, settings| Box::new(DurandDorsey00 { exposure, scope: settings.scope })),
    ("scheel00", |exposure, _| Box::new(Scheel00 { exposure })),
    ("reinhard02", |exposure, settings| Box::new(Reinhard02 { exposure, scope: settings.scope })),
    ("linear", |exposure, _| Box::new(Linear { exposure })),
    ("srgb", |exposure, _| Box::new(Srgb { exposure })),
    ("pbr-neutral", |exposure, _| Box::new(PbrNeutral { exposure })),
    ("agx", |exposure, _| Box::new(Agx { exposure })),
];

const OPERATOR_NAMES: [&str; OPERATORS.len()] = names_of(&OPERATORS);

/// What operators are called by their authors' initials, and the names that these stand for.
const OPERATOR_INITIALS: NamedTable<&str, 4> =
    [("tr", "tumblin-rushmeier"), ("fpsg", "ferwerda96"), ("wrp", "ward-larson97"), ("ptyg", "pattanaik00")];

/// The operator of that name or initials; `None` where there is none. `exposure_stops` multiplies what it shows by
/// 2^stops; `None` is 0.
///
/// ```
/// use fechner_perception::tone;
/// assert!(tone::operator("ward94", None).is_some());
/// assert_eq!(tone::operator("ptyg", None).unwrap().name(), "pattanaik00");
/// assert!(tone::operator("darkroom", None).is_none());
/// ```
#[must_use]
pub fn operator(name: &str, exposure_stops: Option<f64>) -> Option<Box<dyn ToneOperator>> {
    operator_with(name, &ToneSettings { exposure_stops: exposure_stops.unwrap_or(0.0), ..ToneSettings::default() })
}

/// The operator of that name or of its authors' initials (`tr`, `fpsg`, `wrp`, `ptyg`), set like this; `None` where
/// there is none.
#[must_use]
pub fn operator_with(name: &str, settings: &ToneSettings) -> Option<Box<dyn ToneOperator>> {
    let stops = if settings.exposure_stops.is_finite() { settings.exposure_stops } else { 0.0 };
    let exposure = stops.clamp(-100.0, 100.0).exp2();
    let full_name = find(&OPERATOR_INITIALS, name).copied().unwrap_or(name);
    find(&OPERATORS, full_name).map(|constructor| constructor(exposure, settings))
}

/// The operator of a name that somebody has given: [`operator_with`], with an error instead of `None`.
///
/// # Errors
/// [`Error::UnknownName`], which lists those that there are.
pub fn operator_named(name: &str, settings: &ToneSettings) -> Result<Box<dyn ToneOperator>, Error> {
    operator_with(name, settings).ok_or_else(|| Error::unknown_name("tone operator", name, operator_names()))
}

/// The initials that [`operator`] knows besides, each with the name that it stands for.
#[must_use]
pub fn operator_initials() -> &'static [(&'static str, &'static str)] {
    &OPERATOR_INITIALS
}

/// The names that [`operator`] knows, initials aside.
#[must_use]
pub fn operator_names() -> &'static [&'static str] {
    &OPERATOR_NAMES
}
