//! The XML of a Mitsuba scene as a tree of our own: includes followed, `$name` replaced, dialects made one.
//!
//! The dialects differ in the spelling of names only (`toWorld`, `to_world`): names are compared without
//! underscores and in lower case.

use super::super::error::{LoadError, Place};
use super::super::files;
use super::super::lines::LineStarts;
use glam::Vec3;
use std::cell::Cell;
use std::collections::HashMap;
use std::path::{Path, PathBuf};
use std::rc::Rc;

/// Deepest nesting of elements and of includes.
const DEEPEST: usize = 64;
/// Most elements of a document, and of all that it includes.
const MAX_NODES: u32 = 4_000_000;

/// Most bytes of a text whose `$name` are replaced: values that hold values grow without bounds.
const LONGEST_VALUE: usize = 1 << 12;

/// An element.
#[derive(Debug)]
pub(super) struct Element {
    pub(super) tag: String,
    attributes: Vec<(String, String)>,
    pub(super) children: Vec<Rc<Element>>,
    pub(super) file: Rc<PathBuf>,
    line: usize,
    used: Cell<bool>,
}

/// The spelling in which names are compared.
pub(super) fn canonical(name: &str) -> String {
    name.chars().filter(|&c| c != '_').flat_map(char::to_lowercase).collect()
}

/// What elements say of the whole document, and not of what they stand in.
#[derive(Debug, Default)]
pub(super) struct Given {
    /// Values of `$name`.
    defaults: HashMap<String, String>,
    /// Folders of `<path>`, the last one first.
    folders: Vec<PathBuf>,
    /// How many elements were read.
    elements: u32,
}

impl Given {
    /// Where a file may be that is named in one of `files`: in the folders of `<path>`, or beside those, in this order.
    fn candidates(&self, name: &str, files: &[&Path]) -> Vec<PathBuf> {
        let name = name.replace('\\', "/");
        let beside = files.iter().map(|file| parent_or_empty(file));
        let mut candidates: Vec<PathBuf> = Vec::new();
        for candidate in self.folders.iter().map(PathBuf::as_path).chain(beside).map(|folder| folder.join(&name)) {
            if !candidates.contains(&candidate) {
                candidates.push(candidate);
            }
        }
        candidates
    }

    /// The first of those that is a file, for a name that stands at `named_at`.
    pub(super) fn find(&self, name: &str, files: &[&Path], named_at: Place) -> Result<PathBuf, LoadError> {
        let candidates = self.candidates(name, files);
        let is_there = candidates.iter().find(|candidate| candidate.is_file());
        match (is_there.or(candidates.iter().find(|candidate| candidate.exists())), candidates.as_slice()) {
            (Some(found), _) | (None, [found]) => Ok(found.clone()),
            _ => {
                let tried: Vec<String> = candidates.iter().map(|candidate| candidate.display().to_string()).collect();
                let problem = format!("no such file at {}", tried.join(" or "));
                Err(LoadError::Unreadable { file: PathBuf::from(name), problem }.referenced_from(named_at))
            }
        }
    }
}

/// What a name beside a file is joined to: messages show it as the file is named.
fn parent_or_empty(file: &Path) -> &Path {
    file.parent().unwrap_or(Path::new(""))
}

/// Reads a file and all that it includes.
pub(super) fn read(path: &Path, given: &mut Given, depth: usize) -> Result<Rc<Element>, LoadError> {
    let text = files::decode_text(path, files::read_unpacked(path)?)?;
    let options = roxmltree::ParsingOptions { nodes_limit: MAX_NODES, ..Default::default() };
    let document = roxmltree::Document::parse_with_options(&text, options).map_err(|error| {
        LoadError::invalid_at(Place::line(path, error.pos().row as usize), format_args!("not valid XML: {error}"))
    })?;
    let file = Rc::new(path.to_owned());
    let mut builder = TreeBuilder { lines: LineStarts::of(&text), file, given, includes: depth };
    let root = document.root_element();
    builder.element(root, 0)
}

/// Elements that say how the file is read, and are no part of what it holds.
pub(super) const OF_READING: [&str; 3] = ["default", "path", "include"];

struct TreeBuilder<'a> {
    lines: LineStarts,
    file: Rc<PathBuf>,
    given: &'a mut Given,
    includes: usize,
}

impl TreeBuilder<'_> {
    fn element(&mut self, node: roxmltree::Node, depth: usize) -> Result<Rc<Element>, LoadError> {
        let line = self.lines.line_of(node.range().start);
        let place = Place::line(&self.file, line);
        if depth > DEEPEST {
            return Err(LoadError::invalid_at(place, format_args!("elements nested deeper than {DEEPEST}")));
        }
        self.given.elements += 1;
        if self.given.elements > MAX_NODES {
            return Err(LoadError::too_large(
                &self.file,
                format_args!("more than {MAX_NODES} elements with those included"),
            ));
        }
        let mut attributes = Vec::new();
        for attribute in node.attributes() {
            attributes.push((attribute.name().to_owned(), self.substitute(attribute.value(), &place)?));
        }
        let mut element = Element {
            tag: node.tag_name().name().to_owned(),
            attributes,
            children: Vec::new(),
            file: Rc::clone(&self.file),
            line,
            used: Cell::new(false),
        };
        for child in node.children().filter(roxmltree::Node::is_element) {
            let converted = self.element(child, depth + 1)?;
            match converted.tag.as_str() {
                "default" => {
                    let (name, value) = (converted.attribute("name"), converted.attribute("value"));
                    if let (Some(name), Some(value)) = (name, value) {
                        self.given.defaults.entry(name.to_owned()).or_insert_with(|| value.to_owned());
                    }
                }
                "path" => {
                    let folder = parent_or_empty(&self.file).join(converted.require("value")?.replace('\\', "/"));
                    self.given.folders.insert(0, folder);
                }
                "include" => {
                    if self.includes >= DEEPEST {
                        return Err(converted.error("includes nested too deeply, or a file that includes itself"));
                    }
                    let name = converted.require("filename")?;
                    let file = self.given.find(name, &[self.file.as_path()], converted.place())?;
                    let root = read(&file, self.given, self.includes + 1).map_err(|error| {
                        if self.includes == 0 { error.referenced_from(converted.place()) } else { error }
                    })?;
                    // A scene lends what it holds, any other file is one element.
                    if root.tag == "scene" {
                        element.children.extend(root.children.iter().cloned());
                    } else {
                        element.children.push(root);
                    }
                }
                _ => element.children.push(converted),
            }
        }
        Ok(Rc::new(element))
    }

    /// Replaces `$name` and `${name}`.
    fn substitute(&self, text: &str, place: &Place) -> Result<String, LoadError> {
        let mut result = String::new();
        let mut rest = text;
        while let Some(start) = rest.find('$') {
            result.push_str(&rest[..start]);
            let behind = &rest[start + 1..];
            let (name, after) = match behind.strip_prefix('{').and_then(|inner| inner.split_once('}')) {
                Some((name, after)) => (name, after),
                None => {
                    let end = behind.find(|c: char| !c.is_alphanumeric() && c != '_').unwrap_or(behind.len());
                    behind.split_at(end)
                }
            };
            let value = self.given.defaults.get(name).ok_or_else(|| {
                let problem =
                    format!("\"${name}\" has no value: a <default name=\"{name}\" value=\"...\"/> before it gives one");
                LoadError::invalid_at(place.clone(), problem)
            })?;
            result.push_str(value);
            if result.len() > LONGEST_VALUE {
                let problem = format!("with its values in place the text has more than {LONGEST_VALUE} bytes");
                return Err(LoadError::invalid_at(place.clone(), problem));
            }
            rest = after;
        }
        result.push_str(rest);
        Ok(result)
    }
}

impl Element {
    /// Where the element stands.
    pub(super) fn place(&self) -> Place {
        Place::line(&self.file, self.line)
    }

    /// An error about the element.
    pub(super) fn error(&self, problem: impl std::fmt::Display) -> LoadError {
        LoadError::invalid_at(self.place(), format_args!("<{}>: {problem}", self.tag))
    }

    /// An error about something that is not rendered.
    pub(super) fn unsupported(&self, problem: impl std::fmt::Display) -> LoadError {
        LoadError::Unsupported { place: self.place(), problem: super::super::error::one_line(problem) }
    }

    pub(super) fn attribute(&self, name: &str) -> Option<&str> {
        self.attributes.iter().find(|(known, _)| known == name).map(|(_, value)| value.as_str())
    }

    fn require(&self, name: &str) -> Result<&str, LoadError> {
        self.attribute(name).ok_or_else(|| self.error(format_args!("the attribute \"{name}\" is missing")))
    }

    /// Plugin of the element, in the spelling for comparison.
    pub(super) fn kind(&self) -> String {
        canonical(self.attribute("type").unwrap_or(""))
    }

    /// Id of the element, else its plugin.
    pub(super) fn name(&self) -> String {
        self.attribute("id").or(self.attribute("type")).unwrap_or(&self.tag).to_owned()
    }

    /// The child of this name (in the spelling for comparison).
    pub(super) fn child(&self, name: &str) -> Option<&Rc<Element>> {
        let found = self.children.iter().find(|c| c.attribute("name").is_some_and(|own| canonical(own) == name))?;
        found.used.set(true);
        Some(found)
    }

    /// Says that something has asked for the element.
    pub(super) fn mark_used(&self) {
        self.used.set(true);
    }

    /// Every child with this tag.
    pub(super) fn tagged<'e>(&'e self, tag: &'e str) -> impl Iterator<Item = &'e Rc<Element>> {
        self.children.iter().filter(move |child| child.tag == tag).inspect(|child| child.used.set(true))
    }

    /// Names of children that nothing has asked for.
    pub(super) fn unused(&self) -> Vec<String> {
        let unused = self.children.iter().filter(|child| !child.used.get());
        unused.map(|child| child.attribute("name").unwrap_or(&child.tag).to_owned()).collect()
    }

    /// Marks children as known although they change nothing here.
    pub(super) fn ignore(&self, names: &[&str]) {
        names.iter().for_each(|name| _ = self.child(name));
    }

    fn number(&self, text: &str) -> Result<f32, LoadError> {
        match text.trim().parse::<f32>() {
            Ok(number) if number.is_finite() => Ok(number),
            _ => Err(self.error(format_args!("\"{text}\" is not a finite number"))),
        }
    }

    /// Numbers apart by spaces or commas.
    pub(super) fn numbers(&self, text: &str) -> Result<Vec<f32>, LoadError> {
        let words = text.split([' ', ',', '\t', '\n', '\r']).filter(|word| !word.is_empty());
        words.map(|word| self.number(word)).collect()
    }

    pub(super) fn float(&self, name: &str) -> Result<Option<f32>, LoadError> {
        let Some(child) = self.child(name) else { return Ok(None) };
        child.number(child.require("value")?).map(Some)
    }

    pub(super) fn float_or(&self, name: &str, default: f32) -> Result<f32, LoadError> {
        Ok(self.float(name)?.unwrap_or(default))
    }

    pub(super) fn boolean_or(&self, name: &str, default: bool) -> Result<bool, LoadError> {
        let Some(child) = self.child(name) else { return Ok(default) };
        match child.require("value")?.trim().to_ascii_lowercase().as_str() {
            "true" => Ok(true),
            "false" => Ok(false),
            other => Err(child.error(format_args!("expected true or false, found \"{other}\""))),
        }
    }

    pub(super) fn string(&self, name: &str) -> Result<Option<&str>, LoadError> {
        self.child(name).map(|child| child.require("value")).transpose()
    }

    /// A `<point>` or `<vector>`.
    pub(super) fn vector(&self, name: &str) -> Result<Option<Vec3>, LoadError> {
        let Some(child) = self.child(name) else { return Ok(None) };
        child.own_vector(0.0).map(Some)
    }

    /// The element's own x, y and z, or its three values.
    pub(super) fn own_vector(&self, default: f32) -> Result<Vec3, LoadError> {
        if let Some(value) = self.attribute("value") {
            return match *self.numbers(value)?.as_slice() {
                [all] => Ok(Vec3::splat(all)),
                [x, y, z] => Ok(Vec3::new(x, y, z)),
                _ => Err(self.error("expected three numbers")),
            };
        }
        let part = |name: &str| self.attribute(name).map_or(Ok(default), |text| self.number(text));
        Ok(Vec3::new(part("x")?, part("y")?, part("z")?))
    }

    /// An attribute as three numbers.
    pub(super) fn triple(&self, name: &str) -> Result<Vec3, LoadError> {
        match self.numbers(self.require(name)?)?.as_slice() {
            &[x, y, z] => Ok(Vec3::new(x, y, z)),
            _ => Err(self.error(format_args!("\"{name}\": expected three numbers"))),
        }
    }

    /// An attribute as one number.
    pub(super) fn number_attribute(&self, name: &str) -> Result<f32, LoadError> {
        self.number(self.require(name)?)
    }
}
