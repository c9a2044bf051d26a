//! Keyframes of materials and lights: numbers and colours that change in time.
//!
//! `keyframes = [{ time = 0, intensity_cd = 0 }, { time = 1, intensity_cd = 800 }]` stands for `intensity_cd = 400`
//! half a second after the beginning. What the keyframes say at the moment when the shutter opens is put in their place
//! before anything else is read, so that every number and colour of every material and light can move, and each is
//! checked as if it had been written. Nothing of this changes while the shutter is open. Not for cameras and objects,
//! which move meanwhile: see [`super::motion`].

use super::fields::{Fields, Source, Value};
use super::motion::{Between, Keyframes};
use crate::scene::load::LoadError;
use std::borrow::Cow;
use std::ops::Range;
use toml::Spanned;
use toml::de::{DeTable, DeValue};

const KEYFRAMES: &str = "keyframes";

/// Where a table with keyframes stands.
#[derive(Clone, Debug)]
enum Owner {
    Material(String),
    Light(usize),
}

/// What a table's keyframes amount to.
#[derive(Debug)]
pub(super) struct Snapshot {
    owner: Owner,
    entries: Vec<Entry>,
    /// Whether it is of a light, or of what a material emits.
    changes_light: bool,
}

/// What they amount to for one key of the table.
#[derive(Debug)]
struct Entry {
    key: String,
    /// In TOML, since numbers of a document come from its parser alone.
    value: String,
}

impl Snapshot {
    /// Whether something can be dark now and shine at other times.
    pub(super) fn changes_light(&self) -> bool {
        self.changes_light
    }
}

/// What all keyframes of materials and lights amount to at a time in seconds.
pub(super) fn snapshots(source: &Source, seconds: f64) -> Result<Vec<Snapshot>, LoadError> {
    let document = DeTable::parse(source.text).map_err(|error| source.syntax_error(&error))?;
    let root = Fields::of_any(source, document.get_ref());
    let mut found = Vec::new();
    if let Some(materials) = root.get("materials") {
        for (name, value) in materials.entries()?.all() {
            found.extend(snapshot(&value, Owner::Material(name.to_owned()), seconds)?);
        }
    }
    if let Some(lights) = root.get("lights") {
        for (index, value) in lights.array()?.iter().enumerate() {
            found.extend(snapshot(value, Owner::Light(index), seconds)?);
        }
    }
    Ok(found)
}

/// The file's document with the snapshots in the keyframes' places.
pub(super) fn parse<'a>(source: &Source<'a>, snapshots: &'a [Snapshot]) -> Result<Spanned<DeTable<'a>>, LoadError> {
    let mut document = DeTable::parse(source.text).map_err(|error| source.syntax_error(&error))?;
    for Snapshot { owner, entries, .. } in snapshots {
        let Some(table) = table_of(document.get_mut(), owner) else { continue };
        let Some(keyframes) = table.remove(KEYFRAMES) else { continue };
        for Entry { key, value } in entries {
            let value = DeValue::parse(value).map_err(|error| source.syntax_error(&error))?;
            let key = Spanned::new(keyframes.span(), Cow::Borrowed(key.as_str()));
            table.insert(key, placed(value, &keyframes.span()));
        }
    }
    Ok(document)
}

/// A number or a list of them as if it stood there, whose line errors about it will name.
fn placed<'a>(value: Spanned<DeValue<'a>>, there: &Range<usize>) -> Spanned<DeValue<'a>> {
    let value = match value.into_inner() {
        DeValue::Array(numbers) => DeValue::Array(numbers.into_iter().map(|number| placed(number, there)).collect()),
        number => number,
    };
    Spanned::new(there.clone(), value)
}

fn table_of<'d, 'a>(document: &'d mut DeTable<'a>, owner: &Owner) -> Option<&'d mut DeTable<'a>> {
    let value = match owner {
        Owner::Material(name) => match document.get_mut("materials")?.get_mut() {
            DeValue::Table(materials) => materials.get_mut(name.as_str())?.get_mut(),
            _ => return None,
        },
        Owner::Light(index) => match document.get_mut("lights")?.get_mut() {
            DeValue::Array(lights) => lights.get_mut(*index)?.get_mut(),
            _ => return None,
        },
    };
    match value {
        DeValue::Table(table) => Some(table),
        _ => None,
    }
}

fn snapshot(value: &Value, owner: Owner, seconds: f64) -> Result<Option<Snapshot>, LoadError> {
    let table = value.entries()?;
    let Some(list) = table.get(KEYFRAMES) else { return Ok(None) };
    let first = list.array()?.first().map(Value::entries).transpose()?;
    let keys: Vec<String> = first
        .map(|first| first.all().into_iter().map(|(key, _)| key.to_owned()).filter(|key| key != "time").collect())
        .unwrap_or_default();
    if keys.is_empty() {
        return Err(list.error("each needs a time and what changes"));
    }
    let known: Vec<&str> = keys.iter().map(String::as_str).chain(["time"]).collect();
    let keyframes = Keyframes::read(&list, &known, |fields| {
        keys.iter().map(|key| numbers(&fields.require(key)?)).collect::<Result<Vec<_>, _>>()
    })?;
    for (place, key) in keys.iter().enumerate() {
        // All of them, whatever time is asked for.
        let mut counts = keyframes.values().map(|values: &Vec<Vec<f64>>| values[place].len());
        let first = counts.next();
        if counts.any(|count| Some(count) != first) {
            return Err(list.error(format_args!("\"{key}\" must have as many values in each keyframe")));
        }
    }
    let Between { before, after, share } = keyframes.around(seconds);
    let mut entries = Vec::new();
    for (key, (before, after)) in keys.iter().zip(before.iter().zip(after)) {
        if let Some(fixed) = table.get(key) {
            return Err(fixed.error("is given by keyframes as well"));
        }
        let share = f64::from(share);
        let values: Vec<String> = before
            .iter()
            .zip(after)
            .map(|(before, after)| format!("{:?}", before + share * (after - before)))
            .collect();
        let value = if values.len() == 1 { values[0].clone() } else { format!("[{}]", values.join(", ")) };
        entries.push(Entry { key: key.clone(), value });
    }
    let is_emission = |key: &String| key.starts_with("emission") || key == "power_lm";
    let changes_light = matches!(owner, Owner::Light(_)) || keys.iter().any(is_emission);
    Ok(Some(Snapshot { owner, entries, changes_light }))
}

/// One number, or a list of them.
fn numbers(value: &Value) -> Result<Vec<f64>, LoadError> {
    if value.is_array() { value.array()?.iter().map(Value::number).collect() } else { Ok(vec![value.number()?]) }
}
