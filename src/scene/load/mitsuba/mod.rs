//! Mitsuba scene files (XML, dialects 0.4 to 3), as far as scenes/README.md lists.
//!
//! RGB as it stands, tables of spectra through the CIE observer. One-sided BSDFs scatter on both sides here.
//! Integrators, samplers and reconstruction filters are fechner's.

mod blend;
mod bsdfs;
mod colors;
mod element;
mod emitters;
mod primitives;
mod principled;
mod sensor;
mod serialized;
mod shapes;
mod surfaces;
mod textures;
mod transform;

use super::LoadOptions;
use super::builder::{ASSUMED_NITS_PER_UNIT, Builder, IfDark};
use super::error::{LoadError, suggestion};
use crate::scene::{Alpha, ColorInput, Material, MaterialId, MeshId, ScalarInput, Scene, Surface};
use element::{Element, Given};
use glam::{Affine3A, Vec3};
use std::collections::HashMap;
use std::path::{Path, PathBuf};
use std::rc::Rc;

/// Takes an element of the scene in.
type TakeIn = fn(&mut Reader, &Rc<Element>) -> Result<(), LoadError>;

/// Elements that are something in the scene.
const ELEMENTS: &[(&str, TakeIn)] = &[
    ("shape", Reader::shape),
    ("emitter", |reader, emitter| reader.emitter(emitter)),
    ("luminaire", |reader, emitter| reader.emitter(emitter)),
    ("sensor", |reader, sensor| reader.sensor(sensor)),
    ("camera", |reader, sensor| reader.sensor(sensor)),
    ("integrator", Reader::integrator),
    ("sampler", Reader::integrator),
];

/// Elements that are defined here and used by reference.
const DEFINITIONS: [&str; 7] = ["bsdf", "texture", "ref", "alias", "medium", "spectrum", "rgb"];

/// Reads a Mitsuba file.
pub(super) fn load(path: &Path, options: &LoadOptions) -> Result<Scene, LoadError> {
    let mut given = Given::default();
    let root = element::read(path, &mut given, 0)?;
    if root.tag != "scene" {
        return Err(root.error("expected a <scene>"));
    }
    let mut reader = Reader {
        main: path.to_owned(),
        given,
        builder: Builder::new(path, options),
        named: HashMap::new(),
        materials: HashMap::new(),
        mesh_files: HashMap::new(),
        groups: HashMap::new(),
        current_group: None,
        made_vertices: 0,
        clips: None,
        since_2: root.attribute("version").is_none_or(|version| !version.trim_start().starts_with("0.")),
    };
    reader.builder.bitangent_ignores_v = true;
    reader.builder.set_nits_per_unit(ASSUMED_NITS_PER_UNIT);
    reader.name_all(&root)?;
    for child in &root.children {
        reader.element(child)?;
    }
    reader.note_clips();
    reader.builder.note_assumed_unit();
    reader.builder.finish(path, IfDark::StudioWithoutLight, options)
}

struct Reader {
    /// The file that was asked for.
    main: PathBuf,
    given: Given,
    builder: Builder,
    named: HashMap<String, Rc<Element>>,
    /// By [`Attached::key`].
    materials: HashMap<(usize, usize), Option<MaterialId>>,
    mesh_files: HashMap<shapes::MeshKey, Vec<MeshId>>,
    /// Parts of groups, by address.
    groups: HashMap<*const Element, Vec<(MeshId, MaterialId, Affine3A)>>,
    current_group: Option<Vec<(MeshId, MaterialId, Affine3A)>>,
    /// Vertices of meshes that stand for disks and their like.
    made_vertices: usize,
    /// Whether the file is of version 2 or later: other defaults, and skies with their zenith along +z.
    since_2: bool,
    /// Where the first camera stands in the file, and its clipping distances.
    clips: Option<sensor::Clips>,
}

/// What a shape has on it, of its own or by reference.
struct Attached {
    bsdf: Option<Rc<Element>>,
    emitter: Option<Rc<Element>>,
    media: Vec<Rc<Element>>,
}

impl Attached {
    /// Addresses of BSDF and emitter; 0 for none.
    fn key(&self) -> (usize, usize) {
        let address = |element: &Option<Rc<Element>>| element.as_ref().map_or(0, |rc| Rc::as_ptr(rc) as usize);
        (address(&self.bsdf), address(&self.emitter))
    }
}

impl Reader {
    fn element(&mut self, element: &Rc<Element>) -> Result<(), LoadError> {
        let tag = element.tag.as_str();
        if let Some((_, take_in)) = ELEMENTS.iter().find(|(name, _)| *name == tag) {
            return take_in(self, element);
        }
        if DEFINITIONS.contains(&tag) {
            return Ok(());
        }
        let known = ELEMENTS.iter().map(|(name, _)| *name).chain(DEFINITIONS).chain(element::OF_READING);
        Err(element.error(format_args!("unknown element{}", suggestion(tag, known))))
    }

    fn integrator(&mut self, integrator: &Rc<Element>) -> Result<(), LoadError> {
        // Edges, so one more than scatterings; −1 is no end.
        if let Some(edges) = integrator.float("maxdepth")?.filter(|&edges| edges >= 1.0) {
            self.builder.note_depth(edges as i64 - 1);
        }
        if integrator.boolean_or("hideemitters", false)? {
            self.builder.note(format!("{}: hide_emitters is not rendered: lights are seen.", integrator.place()));
        }
        self.builder.note("Integrator, sampler and filter are fechner's own, not the file's.");
        Ok(())
    }

    /// Finds everything that has an id, wherever it stands; two of one are refused, as by Mitsuba 3.
    fn name_all(&mut self, element: &Rc<Element>) -> Result<(), LoadError> {
        for child in &element.children {
            if !["ref", "alias"].contains(&child.tag.as_str())
                && let Some(id) = child.attribute("id").filter(|id| !id.is_empty())
            {
                self.name(id, child, child)?;
            }
            if child.tag == "alias"
                && let (Some(id), Some(target)) = (child.attribute("as"), child.attribute("id"))
                && let Some(target) = self.named.get(target).cloned()
            {
                self.name(id, &target, child)?;
            }
            self.name_all(child)?;
        }
        Ok(())
    }

    /// Gives an element a name that `namer` says.
    fn name(&mut self, id: &str, element: &Rc<Element>, namer: &Element) -> Result<(), LoadError> {
        match self.named.insert(id.to_owned(), Rc::clone(element)) {
            None => Ok(()),
            Some(other) => {
                Err(namer
                    .error(format_args!("the id \"{id}\" is that of another, {}; give each its own", other.place())))
            }
        }
    }

    /// What a `<ref>` means.
    fn resolve(&self, reference: &Element) -> Result<Rc<Element>, LoadError> {
        let id = reference.attribute("id").unwrap_or("");
        self.named.get(id).cloned().ok_or_else(|| {
            let mut known: Vec<&str> = self.named.keys().map(String::as_str).collect();
            known.sort_unstable();
            reference.error(format_args!("nothing has the id \"{id}\"{}", suggestion(id, known)))
        })
    }

    /// A file that an element names: in a folder of `<path>`, beside the file that it stands in, or beside the first
    /// one.
    fn file(&self, element: &Element, name: &str) -> Result<PathBuf, LoadError> {
        self.given.find(name, &[element.file.as_path(), &self.main], element.place())
    }

    /// The material of a shape; `None` where the surface is not there.
    fn material_of(&mut self, shape: &Element) -> Result<Option<MaterialId>, LoadError> {
        let attached = self.attached(shape)?;
        if shape.tagged("subsurface").next().is_some() {
            self.builder.note(format!("{}: light below the surface is not rendered.", shape.place()));
        }
        let key = attached.key();
        if attached.media.is_empty()
            && let Some(id) = self.materials.get(&key)
        {
            return Ok(*id);
        }
        let Some(mut material) = self.unlit_material(shape, &attached)? else {
            self.materials.insert(key, None);
            return Ok(None);
        };
        if let Some(emitter) = &attached.emitter {
            material.emission = self.area_radiance(emitter)?;
            self.shine_through_holes(&mut material, emitter);
        }
        for medium in &attached.media {
            self.fill(&mut material, medium)?;
        }
        let id = self.builder.add_material(material);
        if attached.media.is_empty() {
            self.materials.insert(key, Some(id));
        }
        Ok(Some(id))
    }

    fn attached(&mut self, shape: &Element) -> Result<Attached, LoadError> {
        let mut attached = Attached {
            bsdf: shape.tagged("bsdf").next().cloned(),
            emitter: shape.tagged("emitter").chain(shape.tagged("luminaire")).next().cloned(),
            media: shape.tagged("medium").cloned().collect(),
        };
        for reference in shape.tagged("ref") {
            let found = self.resolve(reference)?;
            match found.tag.as_str() {
                "bsdf" => attached.bsdf = Some(found),
                "emitter" | "luminaire" => attached.emitter = Some(found),
                "medium" if reference.attribute("name") == Some("interior") => attached.media.push(found),
                "medium" => self.builder.note(format!("{}: the medium outside is not rendered.", reference.place())),
                other => return Err(reference.error(format_args!("a shape cannot use a <{other}>"))),
            }
        }
        Ok(attached)
    }

    /// The material without its light and what is behind it; `None` where the surface is not there.
    fn unlit_material(&mut self, shape: &Element, attached: &Attached) -> Result<Option<Material>, LoadError> {
        let converted = match &attached.bsdf {
            Some(bsdf) => self.bsdf(bsdf, 0)?.into_material(bsdf.name()),
            // Mitsuba's own: what shines by itself is black.
            None => {
                let albedo = if attached.emitter.is_some() { 0.0 } else { 0.5 };
                let reflectance = ColorInput::constant(Vec3::splat(albedo));
                Some(Material::plain("default", Surface::Diffuse { reflectance }))
            }
        };
        if converted.is_some() {
            return Ok(converted);
        }
        if attached.emitter.is_some() {
            // A sheet of air: light goes through as if nothing were there.
            let transmittance = ColorInput::constant(Vec3::ONE);
            return Ok(Some(Material::plain("null", Surface::ThinDielectric { ior: 1.0, transmittance })));
        }
        if !attached.media.is_empty() {
            return Err(shape.unsupported("a volume without a surface is not rendered; absorption behind glass is"));
        }
        self.builder.note("Shapes with the BSDF \"null\" are not there.");
        Ok(None)
    }

    /// In Mitsuba opacity takes nothing from what a surface sends out; here a surface shines where it is.
    fn shine_through_holes(&mut self, material: &mut Material, emitter: &Element) {
        match material.alpha {
            Alpha::Blend { value: ScalarInput { factor, texture: None } } if factor > 0.0 => {
                material.emission.factor /= factor;
            }
            Alpha::Opaque => {}
            _ => {
                self.builder
                    .note(format!("{}: it shines where its opacity leaves it, not everywhere.", emitter.place()));
            }
        }
    }

    /// Puts the absorption of a medium behind a surface.
    fn fill(&mut self, material: &mut Material, medium: &Element) -> Result<(), LoadError> {
        use colors::Meaning::Coefficient;
        if medium.kind() != "homogeneous" {
            return Err(medium.unsupported("only homogeneous media behind glass are rendered, by their absorption"));
        }
        let scale = medium.float_or("scale", 1.0)?;
        let total = self.color(medium, "sigmat", Coefficient)?;
        let albedo = self.color(medium, "albedo", Coefficient)?.unwrap_or(Vec3::splat(0.75));
        let absorbed = self.color(medium, "sigmaa", Coefficient)?.or(total.map(|total| total * (1.0 - albedo)));
        match (&mut material.surface, absorbed) {
            (Surface::Dielectric { absorption, .. }, Some(absorbed)) => {
                *absorption = (absorbed * scale).max(Vec3::ZERO);
                self.builder
                    .note(format!("{}: a medium's absorption is rendered, its scattering is not.", medium.place()));
            }
            (Surface::Dielectric { .. }, None) => {
                self.builder.note(format!("{}: neither sigma_a nor sigma_t: nothing is absorbed.", medium.place()));
            }
            _ => self.builder.note(format!("{}: media are only rendered behind dielectric surfaces.", medium.place())),
        }
        Ok(())
    }

    fn note_unused(&mut self, what: &str, element: &Element) {
        let unused = element.unused();
        if !unused.is_empty() {
            self.builder.note(format!("{}: {what}: not used: {}.", element.place(), unused.join(", ")));
        }
    }
}
