//! A TOML tree whose every value knows its path and line, so that every complaint can name both.
//!
//! Serde's derive would say "data did not match any variant" for a colour that is neither number, list nor table, and
//! loses the line inside tagged tables; this reader keeps both for a few lines a field.

use super::super::error::{LoadError, Place, nearest, one_line, suggestion, unknown};
use super::super::lines::LineStarts;
use crate::digits::significant;
use glam::{Vec2, Vec3};
use std::path::Path;
use toml::Spanned;
use toml::de::{DeTable, DeValue};

/// A TOML file's text and name.
pub(super) struct Source<'a> {
    pub(super) file: &'a Path,
    pub(super) text: &'a str,
    lines: LineStarts,
}

impl<'a> Source<'a> {
    pub(super) fn new(file: &'a Path, text: &'a str) -> Self {
        Self { file, text, lines: LineStarts::of(text) }
    }

    fn line_of(&self, byte: usize) -> usize {
        self.lines.line_of(byte)
    }

    /// Turns the parser's error into ours.
    pub(super) fn syntax_error(&self, error: &toml::de::Error) -> LoadError {
        let line = error.span().map(|span| self.line_of(span.start));
        LoadError::Invalid {
            place: Place { file: self.file.to_owned(), line },
            problem: one_line(format_args!("not valid TOML: {}", error.message())),
        }
    }
}

/// A value with its path in the file ("materials.white.reflectance") and its line.
#[derive(Clone)]
pub(super) struct Value<'a> {
    source: &'a Source<'a>,
    pub(super) path: String,
    line: usize,
    value: &'a DeValue<'a>,
}

/// A table whose keys were checked against the list of known ones.
#[derive(Clone)]
pub(super) struct Fields<'a> {
    source: &'a Source<'a>,
    path: String,
    line: usize,
    table: &'a DeTable<'a>,
}

impl<'a> Value<'a> {
    /// Where the value stands.
    pub(super) fn place(&self) -> Place {
        Place::line(self.source.file, self.line)
    }

    /// An error about this value.
    pub(super) fn error(&self, problem: impl std::fmt::Display) -> LoadError {
        LoadError::invalid_at(self.place(), format_args!("{}: {problem}", self.path))
    }

    /// A note that this value, which is sound, changes nothing.
    pub(super) fn without_effect(&self, why: impl std::fmt::Display) -> String {
        format!("{}: {} has no effect: {why}.", self.place(), self.path)
    }

    fn wrong_type(&self, expected: &str) -> LoadError {
        self.error(format_args!("expected {expected}, found {}", describe(self.value)))
    }

    pub(super) fn is_table(&self) -> bool {
        self.value.is_table()
    }

    pub(super) fn is_array(&self) -> bool {
        self.value.is_array()
    }

    /// A finite number.
    pub(super) fn number(&self) -> Result<f64, LoadError> {
        let number = match self.value {
            // Neither TOML's 0x, 0o, 0b integers nor its underscores mean anything else than their value.
            DeValue::Integer(integer) => {
                i64::from_str_radix(integer.as_str(), integer.radix()).ok().map(|value| value as f64)
            }
            DeValue::Float(float) => float.as_str().parse().ok(),
            _ => return Err(self.wrong_type("a number")),
        };
        // The renderer works in f32: what overflows there is not finite either.
        match number {
            Some(number) if (number as f32).is_finite() => Ok(number),
            _ => Err(self.error("expected a finite number")),
        }
    }

    /// A number above 0.
    pub(super) fn positive(&self) -> Result<f64, LoadError> {
        let number = self.number()?;
        if (number as f32) > 0.0 {
            Ok(number)
        } else {
            Err(self.error(format_args!("must be above 0, not {}", significant(number, 9))))
        }
    }

    /// A number of 0 or more.
    pub(super) fn non_negative(&self) -> Result<f64, LoadError> {
        self.within(0.0, f64::INFINITY)
    }

    /// A number in [low, high].
    pub(super) fn within(&self, low: f64, high: f64) -> Result<f64, LoadError> {
        let number = self.number()?;
        if (low..=high).contains(&number) {
            Ok(number)
        } else if high.is_infinite() {
            Err(self.error(format_args!("must be at least {low}, not {}", significant(number, 9))))
        } else {
            Err(self.error(format_args!("must lie in [{low}, {high}], not {}", significant(number, 9))))
        }
    }

    /// A whole number in [1, most].
    pub(super) fn count(&self, most: u32) -> Result<u32, LoadError> {
        let number = self.number()?;
        if number.fract() == 0.0 && (1.0..=f64::from(most)).contains(&number) {
            Ok(number as u32)
        } else {
            Err(self.error(format_args!("must be a whole number from 1 to {most}, not {number}")))
        }
    }

    pub(super) fn string(&self) -> Result<&'a str, LoadError> {
        self.value.as_str().ok_or_else(|| self.wrong_type("a string"))
    }

    pub(super) fn boolean(&self) -> Result<bool, LoadError> {
        self.value.as_bool().ok_or_else(|| self.wrong_type("true or false"))
    }

    /// Reads one of some words and gives what stands beside it.
    pub(super) fn choice<T: Copy>(&self, words: &[(&'static str, T)]) -> Result<T, LoadError> {
        let written = self.string()?;
        words
            .iter()
            .find(|(word, _)| *word == written)
            .map(|&(_, choice)| choice)
            .ok_or_else(|| self.unknown_value(written, words.iter().map(|&(word, _)| word)))
    }

    /// Reads one of these words.
    pub(super) fn word_of(&self, words: impl Iterator<Item = &'static str> + Clone) -> Result<String, LoadError> {
        let written = self.string()?;
        match words.clone().any(|word| word == written) {
            true => Ok(written.to_owned()),
            false => Err(self.unknown_value(written, words)),
        }
    }

    fn unknown_value(&self, written: &str, known: impl Iterator<Item = &'static str> + Clone) -> LoadError {
        self.error(unknown("value", written, known))
    }

    /// The elements of a list.
    pub(super) fn array(&self) -> Result<Vec<Value<'a>>, LoadError> {
        let is_topmost = !self.path.contains(['.', '[']);
        let array = self.value.as_array().ok_or_else(|| match self.is_table() && is_topmost {
            true => self.wrong_type(&format!("a list, each of whose entries begins with [[{}]]", self.path)),
            false => self.wrong_type("a list"),
        })?;
        let element = |(index, value): (usize, &'a Spanned<DeValue<'a>>)| Value {
            source: self.source,
            path: format!("{}[{index}]", self.path),
            line: self.source.line_of(value.span().start),
            value: value.get_ref(),
        };
        Ok(array.iter().enumerate().map(element).collect())
    }

    fn numbers<const N: usize>(&self, expected: &str) -> Result<[f32; N], LoadError> {
        let elements = if self.is_array() {
            self.array()?
        } else {
            return Err(self.wrong_type(expected));
        };
        if elements.len() != N {
            return Err(self.error(format_args!("expected {expected}, found {} values", elements.len())));
        }
        let mut numbers = [0.0; N];
        for (number, element) in numbers.iter_mut().zip(&elements) {
            *number = element.number()? as f32;
        }
        Ok(numbers)
    }

    /// Three numbers.
    pub(super) fn vec3(&self) -> Result<Vec3, LoadError> {
        self.numbers::<3>("three numbers [x, y, z]").map(Vec3::from_array)
    }

    /// Three numbers that are not all 0, scaled to unit length.
    pub(super) fn direction(&self) -> Result<Vec3, LoadError> {
        self.vec3()?.try_normalize().ok_or_else(|| self.error("a direction must not have zero length"))
    }

    /// Reads two numbers.
    pub(super) fn vec2(&self) -> Result<Vec2, LoadError> {
        self.numbers::<2>("two numbers [u, v]").map(Vec2::from_array)
    }

    /// Reads one number for all three channels, or three; none below 0.
    pub(super) fn color(&self) -> Result<Vec3, LoadError> {
        let color = if self.is_array() {
            self.numbers::<3>("a colour [r, g, b]").map(Vec3::from_array)?
        } else if matches!(self.value, DeValue::Integer(_) | DeValue::Float(_)) {
            Vec3::splat(self.number()? as f32)
        } else {
            return Err(self.wrong_type("a number or a colour [r, g, b]"));
        };
        if color.min_element() < 0.0 {
            return Err(self.error("a colour must not be negative"));
        }
        Ok(color)
    }

    /// The keys of a table, each of which must be known.
    pub(super) fn fields(&self, known: &[&str]) -> Result<Fields<'a>, LoadError> {
        let fields = self.entries()?;
        fields.check_known(known)?;
        Ok(fields)
    }

    /// The keys of a table, whatever they are: names that the author chose.
    pub(super) fn entries(&self) -> Result<Fields<'a>, LoadError> {
        let table = self.value.as_table().ok_or_else(|| self.wrong_type("a table"))?;
        Ok(Fields { source: self.source, path: self.path.clone(), line: self.line, table })
    }
}

impl<'a> Fields<'a> {
    /// The file's topmost table.
    pub(super) fn root(source: &'a Source<'a>, table: &'a DeTable<'a>, known: &[&str]) -> Result<Self, LoadError> {
        let fields = Self::of_any(source, table);
        fields.check_known(known)?;
        Ok(fields)
    }

    /// The file's topmost table, whatever its keys are.
    pub(super) fn of_any(source: &'a Source<'a>, table: &'a DeTable<'a>) -> Self {
        Self { source, path: String::new(), line: 1, table }
    }

    /// Refuses keys that are not in the list.
    pub(super) fn check_known(&self, known: &[&str]) -> Result<(), LoadError> {
        // The first wrong key in the file's order, not in the alphabet's.
        let unknown = self.table.keys().filter(|key| !known.contains(&key.get_ref().as_ref()));
        let Some(key) = unknown.min_by_key(|key| key.span().start) else {
            return Ok(());
        };
        let written = key.get_ref().as_ref();
        let within = if self.path.is_empty() { String::new() } else { format!(" in {}", self.path) };
        let absent = known.iter().copied().filter(|&key| !self.table.contains_key(key));
        Err(LoadError::invalid_at(
            Place::line(self.source.file, self.source.line_of(key.span().start)),
            format_args!("unknown key \"{written}\"{within}{}", suggestion(written, absent)),
        ))
    }

    pub(super) fn place(&self) -> Place {
        Place::line(self.source.file, self.line)
    }

    /// An error about the table as a whole.
    pub(super) fn error(&self, problem: impl std::fmt::Display) -> LoadError {
        let path = if self.path.is_empty() { String::new() } else { format!("{}: ", self.path) };
        LoadError::invalid_at(self.place(), format_args!("{path}{problem}"))
    }

    fn value(&self, key: &str, value: &'a Spanned<DeValue<'a>>) -> Value<'a> {
        let path = if self.path.is_empty() { key.to_owned() } else { format!("{}.{key}", self.path) };
        let line = self.source.line_of(value.span().start);
        Value { source: self.source, path, line, value: value.get_ref() }
    }

    pub(super) fn get(&self, key: &str) -> Option<Value<'a>> {
        self.table.get(key).map(|value| self.value(key, value))
    }

    pub(super) fn require(&self, key: &str) -> Result<Value<'a>, LoadError> {
        self.get(key).ok_or_else(|| self.error(format_args!("\"{key}\" is missing")))
    }

    /// The same of a table whose keys were not checked, where another one may be meant for it.
    pub(super) fn require_of_any(&self, key: &str) -> Result<Value<'a>, LoadError> {
        self.get(key).ok_or_else(|| {
            let written = nearest(key, self.table.keys().map(|key| key.get_ref().as_ref()));
            let slip = written.map_or_else(String::new, |written| format!("; is \"{written}\" meant for it?"));
            self.error(format_args!("\"{key}\" is missing{slip}"))
        })
    }

    /// The value, read by `read`, or the default when it is not there.
    pub(super) fn get_or<T>(
        &self,
        key: &str,
        default: T,
        read: impl FnOnce(&Value<'a>) -> Result<T, LoadError>,
    ) -> Result<T, LoadError> {
        self.get(key).map_or(Ok(default), |value| read(&value))
    }

    /// The value, read by `read`, if it is there.
    pub(super) fn get_some<T>(
        &self,
        key: &str,
        read: impl FnOnce(&Value<'a>) -> Result<T, LoadError>,
    ) -> Result<Option<T>, LoadError> {
        self.get(key).map(|value| read(&value)).transpose()
    }

    /// Entries of the table, every one, in the file's order: a picture must not depend on the alphabet.
    pub(super) fn all(&self) -> Vec<(&'a str, Value<'a>)> {
        let mut entries: Vec<_> = self.table.iter().collect();
        entries.sort_by_key(|(key, _)| key.span().start);
        entries.into_iter().map(|(key, value)| (key.get_ref().as_ref(), self.value(key.get_ref(), value))).collect()
    }

    /// The only one of some keys that is there; none or several are errors.
    pub(super) fn exactly_one(&self, keys: &[&'static str]) -> Result<(&'static str, Value<'a>), LoadError> {
        let mut present = keys.iter().filter_map(|&key| self.get(key).map(|value| (key, value)));
        let first = present.next().ok_or_else(|| self.error(format_args!("one of {} is missing", keys.join(", "))))?;
        match present.next() {
            None => Ok(first),
            Some((second, value)) => {
                Err(value.error(format_args!("\"{}\" and \"{second}\" exclude each other", first.0)))
            }
        }
    }
}

fn describe(value: &DeValue<'_>) -> String {
    match value {
        DeValue::String(text) => format!("the string \"{}\"", text.chars().take(40).collect::<String>()),
        DeValue::Integer(integer) => format!("the number {}", integer.as_str()),
        DeValue::Float(float) => format!("the number {}", float.as_str()),
        DeValue::Boolean(value) => format!("{value}"),
        DeValue::Datetime(_) => "a date".to_owned(),
        DeValue::Array(array) => format!("a list of {}", array.len()),
        DeValue::Table(_) => "a table".to_owned(),
    }
}
