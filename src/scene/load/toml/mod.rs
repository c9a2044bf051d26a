//! Our own scene format; scenes/README.md describes it by an example that has everything.

mod animated;
mod camera;
mod fields;
mod light;
mod material;
mod motion;
mod object;
pub(super) mod side;
mod surface;
mod surroundings;

use self::animated::Snapshot;
use self::fields::{Fields, Source, Value};
use super::builder::{Builder, IfDark, NamedCamera};
use super::error::LoadError;
use super::framing::Framing;
use super::texture::{Adjust, IfMissing, Picture, Request};
use super::{LoadOptions, Shutter, files};
use crate::scene::{Encoding, FilmDefaults, MAX_EXPOSURE_STOPS, NITS_PER_UNIT, Scene, ViewingDefaults, Wrap};
use fechner_perception::display::Display;
use fechner_perception::tone;
use std::collections::HashMap;
use std::path::Path;

/// Most pixels along a side of the film.
const LONGEST_FILM_SIDE: u32 = 65_536;

/// What the parts of a file share while they are read.
struct Context<'a> {
    /// The folder that paths are relative to.
    folder: &'a Path,
    /// `[textures.*]` by name.
    textures: HashMap<&'a str, TextureEntry>,
    /// Names of all textures, in the file's order, for suggestions.
    texture_names: Vec<&'a str>,
    shutter: Shutter,
    builder: Builder,
    /// Whether a lamp gives no light now because it is flat, and will give some at other times.
    has_flat_lamp: bool,
}

/// A texture of the file; whether it is decoded as colour may depend on who uses it.
struct TextureEntry {
    request: Request,
    encoding: Option<Encoding>,
    /// Where the file has it, for a note should nobody use it.
    note_if_idle: String,
    is_used: bool,
}

/// Reads a scene file.
pub(super) fn load(path: &Path, options: &LoadOptions) -> Result<Scene, LoadError> {
    let (builder, if_dark) = read(path, options)?;
    builder.finish(path, if_dark, options)
}

/// What a file may have at its top.
const KEYS: &[&str] =
    &["name", "nits_per_unit", "film", "view", "camera", "environment", "textures", "materials", "objects", "lights"];

/// Everything in a scene file, and what to do if that is dark.
fn read(path: &Path, options: &LoadOptions) -> Result<(Builder, IfDark), LoadError> {
    let text = files::read_text(path)?;
    let source = Source::new(path, &text);
    let snapshots = animated::snapshots(&source, options.frame_time)?;
    let document = animated::parse(&source, &snapshots)?;
    let root = Fields::root(&source, document.get_ref(), KEYS)?;
    let mut context = Context {
        folder: path.parent().unwrap_or(Path::new("")),
        textures: HashMap::new(),
        texture_names: Vec::new(),
        shutter: Shutter { opens: options.frame_time, stays_open: 0.0 },
        builder: Builder::new(path, options),
        has_flat_lamp: false,
    };
    context.read_head(&root)?;
    context.read_camera(&root)?;
    context.read_surroundings(&root)?;
    context.read_textures(&root)?;
    let materials = context.read_materials(&root)?;
    let moves = context.read_objects(&root, &materials)?;
    context.read_lights(&root)?;
    context.note_idle_textures();
    if moves {
        context.builder.at_another_time = Some(|path, options| Ok(read(path, options)?.0));
    }
    let is_lit_later = context.has_flat_lamp || snapshots.iter().any(Snapshot::changes_light);
    Ok((context.builder, if is_lit_later { IfDark::Stay } else { IfDark::Fail }))
}

impl<'a> Context<'a> {
    /// What the whole scene is called, measured in, drawn on and seen on.
    fn read_head(&mut self, root: &Fields<'a>) -> Result<(), LoadError> {
        if let Some(name) = root.get_some("name", |value| value.string())? {
            self.builder.name = name.to_owned();
        }
        self.builder.set_nits_per_unit(root.get_or("nits_per_unit", 1.0, read_unit)?);
        if let Some(film) = root.get("film") {
            self.builder.film = read_film(&film)?;
        }
        if let Some(view) = root.get("view") {
            self.builder.viewing = read_view(&view, self.folder)?;
        }
        Ok(())
    }

    fn read_camera(&mut self, root: &Fields<'a>) -> Result<(), LoadError> {
        let Some(camera) = root.get("camera") else { return Ok(()) };
        self.shutter.stays_open = camera.entries()?.get_or("shutter_s", 0.0, Value::non_negative)?;
        self.builder.shutter_s = self.shutter.stays_open;
        let camera = camera::read(&camera, self.shutter)?;
        self.builder.cameras.push(NamedCamera {
            name: "camera".to_owned(),
            holder: None,
            camera,
            framing: Framing::Fixed,
        });
        Ok(())
    }

    fn read_surroundings(&mut self, root: &Fields<'a>) -> Result<(), LoadError> {
        let Some(surroundings) = root.get("environment") else { return Ok(()) };
        let surroundings =
            surroundings::read(&surroundings, self.folder, self.builder.nits_per_unit, &mut self.builder.notes)?;
        self.builder.environment = Some(surroundings.environment);
        self.builder.lights.extend(surroundings.sun);
        Ok(())
    }

    fn read_textures(&mut self, root: &Fields<'a>) -> Result<(), LoadError> {
        let Some(textures) = root.get("textures") else { return Ok(()) };
        for (name, value) in textures.entries()?.all() {
            self.textures.insert(name, read_texture(&value, self.folder)?);
            self.texture_names.push(name);
        }
        Ok(())
    }

    fn read_materials(&mut self, root: &Fields<'a>) -> Result<material::Materials<'a>, LoadError> {
        let mut materials = material::Materials::default();
        if let Some(entries) = root.get("materials") {
            for (name, value) in entries.entries()?.all() {
                materials.read(self, name, &value)?;
            }
        }
        Ok(materials)
    }

    /// Whether any of them moves.
    fn read_objects(&mut self, root: &Fields<'a>, materials: &material::Materials<'a>) -> Result<bool, LoadError> {
        let list = root.get_or("objects", Vec::new(), Value::array)?;
        let moves = |object: &&Value| object.entries().is_ok_and(|fields| fields.get("keyframes").is_some());
        let mut objects = object::Objects::new(materials, list.iter().filter(moves).count());
        for value in &list {
            objects.read(self, value)?;
        }
        Ok(objects.any_moves())
    }

    fn read_lights(&mut self, root: &Fields<'a>) -> Result<(), LoadError> {
        let mut reader = light::Reader::new(self.folder, self.builder.nits_per_unit);
        for value in root.get_or("lights", Vec::new(), Value::array)? {
            self.builder.lights.push(reader.read(&value)?);
        }
        reader.notes.into_iter().for_each(|note| self.builder.note(note));
        Ok(())
    }

    fn note_idle_textures(&mut self) {
        for name in &self.texture_names {
            if let Some(entry) = self.textures.get(name).filter(|entry| !entry.is_used) {
                self.builder.note(entry.note_if_idle.as_str());
            }
        }
    }
}

fn read_film(value: &Value) -> Result<FilmDefaults, LoadError> {
    let size = value.fields(&["size"])?.require("size")?;
    match size.array()?.as_slice() {
        [width, height] => {
            Ok(FilmDefaults { width: width.count(LONGEST_FILM_SIDE)?, height: height.count(LONGEST_FILM_SIDE)? })
        }
        other => Err(size.error(format_args!("expected [width, height], found {} values", other.len()))),
    }
}

/// Luminance of RGB (1, 1, 1).
fn read_unit(value: &Value) -> Result<f64, LoadError> {
    value.within(*NITS_PER_UNIT.start(), *NITS_PER_UNIT.end())
}

/// The file of a display is found from `folder`, like every file that a scene names.
fn read_view(value: &Value, folder: &Path) -> Result<ViewingDefaults, LoadError> {
    let fields = value.fields(&["display", "visibility", "operator", "exposure_stops"])?;
    Ok(ViewingDefaults {
        display: fields.get_some("display", |value| match value.string()? {
            file if file.ends_with(".toml") => Ok(folder.join(file).to_string_lossy().into_owned()),
            _ => value.word_of(Display::preset_names().iter().copied()),
        })?,
        visibility: fields.get_some("visibility", Value::positive)?,
        operator: fields.get_some("operator", read_operator)?,
        exposure_stops: fields
            .get_some("exposure_stops", |stops| stops.within(-MAX_EXPOSURE_STOPS, MAX_EXPOSURE_STOPS))?,
    })
}

/// A tone operator's name, or its authors' initials, which no list shows.
fn read_operator(value: &Value) -> Result<String, LoadError> {
    let written = value.string()?;
    if tone::operator_initials().iter().any(|(initials, _)| *initials == written) {
        return Ok(written.to_owned());
    }
    value.word_of(tone::operator_names().iter().copied())
}

fn read_texture(value: &Value, folder: &Path) -> Result<TextureEntry, LoadError> {
    let fields = value.fields(&["file", "encoding", "wrap", "nearest"])?;
    let file = fields.require("file")?;
    let encodings = [("srgb", Encoding::Srgb), ("linear", Encoding::Linear)];
    let wraps = [("repeat", Wrap::Repeat), ("mirror", Wrap::Mirror), ("clamp", Wrap::Clamp)];
    let wrap = fields.get_or("wrap", Wrap::Repeat, |value| value.choice(&wraps))?;
    Ok(TextureEntry {
        request: Request {
            picture: Picture::File(folder.join(file.string()?)),
            encoding: Encoding::Srgb,
            wrap_u: wrap,
            wrap_v: wrap,
            nearest: fields.get_or("nearest", false, Value::boolean)?,
            if_missing: IfMissing::Fail(file.place()),
            adjust: Adjust::NONE,
        },
        encoding: fields.get_some("encoding", |value| value.choice(&encodings))?,
        note_if_idle: value.without_effect("no material reads it"),
        is_used: false,
    })
}
