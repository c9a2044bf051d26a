//! Finds the MTL files of an OBJ file, and what its faces use of them. What is in them is left to `mtl`.

use super::super::builder::Builder;
use super::super::error::{LoadError, Place, nearest};
use super::super::mtl;
use crate::scene::MaterialId;
use std::collections::{HashMap, HashSet};
use std::path::Path;

/// The MTL files that an OBJ file names.
#[derive(Default)]
pub(super) struct Libraries {
    pub(super) materials: Vec<mtl::Written>,
    /// How many materials there are after each of the `mtllib` statements that were read.
    ends: Vec<usize>,
    notes: Vec<String>,
    /// Those that are not there, as they are named.
    missing: Vec<String>,
    pub(super) error: Option<LoadError>,
}

impl Libraries {
    /// What is to be said of them. Where others are there, materials that none of them has are named one by one.
    pub(super) fn notes(&self) -> impl Iterator<Item = String> {
        let instead = if self.materials.is_empty() { ": a plain grey stands in" } else { "" };
        let missing = self.missing.iter().map(move |name| format!("Material file \"{name}\" not found{instead}."));
        missing.chain(self.notes.iter().cloned())
    }

    /// `mtllib` names one file that may hold spaces, or several files apart by spaces.
    fn open(&mut self, obj: &Path, named: &str) {
        let folder = obj.parent().unwrap_or(Path::new(""));
        // A backslash before a space keeps it in the name; any other one is a separator of folders.
        const KEPT_SPACE: &str = "\u{0}";
        let kept = named.trim().trim_matches('"').replace("\\ ", KEPT_SPACE).replace('\\', "/");
        let name = |text: &str| text.replace(KEPT_SPACE, " ");
        let whole = name(&kept);
        let single = mtl::find_file(folder, &whole);
        let found: Vec<_> = if single.is_file() {
            vec![single]
        } else {
            kept.split_whitespace().map(|word| mtl::find_file(folder, &name(word))).filter(|f| f.is_file()).collect()
        };
        if found.is_empty() {
            self.missing.push(whole);
        }
        for file in found {
            match mtl::read(&file, &mut self.notes) {
                Ok(materials) => self.materials.extend(materials),
                Err(error) => self.error = Some(error),
            }
        }
    }

    /// What `tobj` wants to know of the materials of an `mtllib` statement: their names. It counts on from what it has.
    /// Its files are read when the first part of the text names them.
    pub(super) fn of_statement(&mut self, number: usize, obj: &Path, named: &str) -> tobj::MTLLoadResult {
        if number == self.ends.len() {
            self.open(obj, named);
            self.ends.push(self.materials.len());
        }
        let first = if number == 0 { 0 } else { self.ends[number - 1] };
        let new = &self.materials[first..self.ends[number]];
        let places = new.iter().enumerate().map(|(place, material)| (material.name.clone(), place)).collect();
        Ok((vec![tobj::Material::default(); new.len()], places))
    }
}

/// Materials are converted when a face uses them: libraries are often shared by many files.
pub(super) struct UsedMaterials<'a> {
    written: &'a [mtl::Written],
    converted: HashMap<Option<usize>, MaterialId>,
}

impl<'a> UsedMaterials<'a> {
    pub(super) fn new(libraries: &'a Libraries) -> Self {
        Self { written: &libraries.materials, converted: HashMap::new() }
    }

    pub(super) fn of(&mut self, model: &tobj::Model, builder: &mut Builder) -> MaterialId {
        let wanted = model.mesh.material_id.filter(|&id| id < self.written.len());
        *self.converted.entry(wanted).or_insert_with(|| match wanted {
            Some(index) => {
                let material = self.written[index].convert(builder);
                builder.add_material(material)
            }
            None => mtl::default_material(builder),
        })
    }
}

/// Notes `usemtl` names that no library has, with the nearest that one has.
pub(super) fn report_unknown_materials(
    builder: &mut Builder,
    path: &Path,
    text: &str,
    added_lines: usize,
    known: &[mtl::Written],
) {
    if known.is_empty() {
        return;
    }
    // What a file of thousands needs to be told is that its library is another one's.
    const MAX_NAMED: usize = 10;
    let names = || known.iter().map(|material| material.name.as_str());
    let is_known: HashSet<&str> = names().collect();
    let (mut named, mut others) = (Vec::new(), HashSet::new());
    for (number, line) in text.lines().skip(added_lines).enumerate() {
        let Some(name) = line.strip_prefix("usemtl ").map(str::trim) else {
            continue;
        };
        if is_known.contains(name) {
            continue;
        }
        if named.len() < MAX_NAMED && !named.contains(&name) {
            named.push(name);
        }
        if named.contains(&name) {
            let place = Place::line(path, number + 1);
            let guess = nearest(name, names()).map(|guess| format!(" (nearest: \"{guess}\")")).unwrap_or_default();
            builder.note(format!("{place}: unknown material \"{name}\"{guess}: a plain grey stands in."));
        } else {
            others.insert(name);
        }
    }
    if !others.is_empty() {
        builder.note(format!("{}: {} more unknown materials: a plain grey stands in.", path.display(), others.len()));
    }
}
