//! pbrt-v4 scene files, by a reader of our own: the subset that scenes/README.md lists.
//!
//! pbrt's camera looks along +z with x to the right, so scenes written for it are left-handed or carry a mirroring
//! camera transform; both end in [`Camera::mirrored`](crate::scene::Camera::mirrored). Radiance is multiplied by the
//! sensor's exposure, so that pixels have pbrt's own values, and `nits_per_unit` divided by it. Integrators, samplers
//! and filters are fechner's.

mod camera;
mod directives;
mod inputs;
mod lexer;
mod lights;
mod materials;
mod parameters;
mod shapes;
mod state;
mod textures;
mod transforms;

use super::LoadOptions;
use super::builder::{ASSUMED_NITS_PER_UNIT, Builder, IfDark};
use super::error::{LoadError, Place, no_such};
use crate::scene::{Alpha, Material, MaterialId, MeshId, ScalarInput, Scene, Surface};
use parameters::Parameters;
use state::{Opening, State, Transforms};
use std::collections::{HashMap, HashSet};
use std::hash::{Hash, Hasher};
use std::path::{Path, PathBuf};
use std::rc::Rc;

/// Reads a pbrt file.
pub(super) fn load(path: &Path, options: &LoadOptions) -> Result<Scene, LoadError> {
    read(path, options)?.finish(path, IfDark::StudioWithoutLight, options)
}

fn read(path: &Path, options: &LoadOptions) -> Result<Builder, LoadError> {
    let mut reader = Reader::new(path, options, Scope::All);
    reader.read_file(path)?;
    reader.into_builder(path)
}

/// What of a file is taken in.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Scope {
    All,
    /// All, and what is defined further on is known.
    AllKnownAhead,
    /// Named textures, materials and media alone.
    Definitions,
}

/// A shape of an object that may be placed many times.
struct Part {
    name: String,
    mesh: MeshId,
    material: MaterialId,
    transforms: Transforms,
}

/// A state that comes back when what opened it is closed.
struct Saved {
    state: State,
    opening: Opening,
    place: Place,
}

/// An object where it is placed.
struct UseOfObject {
    name: String,
    transforms: Transforms,
    place: Place,
}

/// A statement of the file: two that say the same are two.
struct Statement<T>(Rc<T>);

impl<T> PartialEq for Statement<T> {
    fn eq(&self, other: &Self) -> bool {
        Rc::ptr_eq(&self.0, &other.0)
    }
}

impl<T> Eq for Statement<T> {}

impl<T> Hash for Statement<T> {
    fn hash<H: Hasher>(&self, state: &mut H) {
        Rc::as_ptr(&self.0).hash(state);
    }
}

/// What makes a material of its own out of a definition.
#[derive(PartialEq, Eq, Hash)]
struct MaterialKey {
    material: Statement<materials::Definition>,
    light: Option<Statement<Parameters>>,
    alpha: AlphaKey,
    medium: Option<String>,
}

#[derive(PartialEq, Eq, Hash)]
enum AlphaKey {
    None,
    /// By its name.
    Texture(String),
    /// By its bits.
    Number(u32),
}

impl AlphaKey {
    fn of(shape: &Parameters) -> Result<Self, LoadError> {
        let texture = shape.word(&["texture"], "alpha")?.map(str::to_owned);
        let number = shape.float("alpha")?;
        Ok(match (texture, number) {
            (Some(texture), _) => Self::Texture(texture),
            (None, Some(number)) => Self::Number(number.to_bits()),
            (None, None) => Self::None,
        })
    }
}

struct Reader<'a> {
    /// The file that was asked for, and the one that is being read.
    main: PathBuf,
    file: PathBuf,
    options: &'a LoadOptions,
    scope: Scope,
    builder: Builder,
    state: State,
    stack: Vec<Saved>,
    coordinate_systems: HashMap<String, Transforms>,
    textures: HashMap<(&'static str, String), Rc<textures::Definition>>,
    named_materials: HashMap<String, Rc<materials::Definition>>,
    media: HashMap<String, materials::Medium>,
    objects: HashMap<String, Vec<Part>>,
    /// Objects that were placed before they were there.
    uses_ahead: Vec<UseOfObject>,
    /// Webs of goniometric lights by their pictures.
    goniometric_webs: HashMap<PathBuf, lights::GoniometricWeb>,
    current_object: Option<String>,
    /// Kind and name of what the file has defined so far.
    defined: HashSet<(&'static str, String)>,
    converted: HashMap<MaterialKey, Option<MaterialId>>,
    ply_files: HashMap<(PathBuf, bool), MeshId>,
    camera: Option<(String, Parameters, Transforms)>,
    film: Option<(String, Parameters)>,
    /// `TransformTimes`.
    times: [f64; 2],
    /// When the shutter opens and closes.
    shutter: [f32; 2],
    /// The sensor's factor.
    exposure: f32,
    in_world: bool,
    is_photometric: bool,
    includes: usize,
    /// Vertices of meshes that stand for spheres and their like.
    made_vertices: usize,
}

impl<'a> Reader<'a> {
    fn new(path: &Path, options: &'a LoadOptions, scope: Scope) -> Self {
        Self {
            main: path.to_owned(),
            file: path.to_owned(),
            options,
            scope,
            builder: Builder::new(path, options),
            state: State::new(),
            stack: Vec::new(),
            coordinate_systems: HashMap::new(),
            textures: HashMap::new(),
            named_materials: HashMap::new(),
            media: HashMap::new(),
            objects: HashMap::new(),
            uses_ahead: Vec::new(),
            goniometric_webs: HashMap::new(),
            current_object: None,
            defined: HashSet::new(),
            converted: HashMap::new(),
            ply_files: HashMap::new(),
            camera: None,
            film: None,
            times: [0.0, 1.0],
            shutter: [0.0, 0.0],
            exposure: 1.0,
            in_world: false,
            is_photometric: false,
            includes: 0,
            made_vertices: 0,
        }
    }

    /// Finds what the file defines further on, once: pbrt looks names up when it has read everything.
    fn look_ahead(&mut self) -> Result<(), LoadError> {
        if self.scope != Scope::All {
            return Ok(());
        }
        self.scope = Scope::AllKnownAhead;
        let mut ahead = Reader::new(&self.main, self.options, Scope::Definitions);
        ahead.read_file(&self.main)?;
        for (name, texture) in ahead.textures {
            self.textures.entry(name).or_insert(texture);
        }
        for (name, material) in ahead.named_materials {
            self.named_materials.entry(name).or_insert(material);
        }
        for (name, medium) in ahead.media {
            self.media.entry(name).or_insert(medium);
        }
        Ok(())
    }
}

impl Reader<'_> {
    /// A file that this one names: beside it, or beside the first one.
    fn file(&self, name: &str) -> PathBuf {
        let beside = |file: &Path| file.parent().unwrap_or(Path::new("")).join(name);
        let here = beside(&self.file);
        if here.is_file() { here } else { beside(&self.main) }
    }

    /// The material of the next shape, with its light, alpha and medium; `None` where the surface is not there.
    fn current_material(&mut self, shape: &Parameters, area: f64) -> Result<Option<MaterialId>, LoadError> {
        let definition = self.state.material.clone().unwrap_or_else(|| {
            Rc::new(materials::Definition {
                name: "default".to_owned(),
                kind: "diffuse".to_owned(),
                parameters: Parameters::none(shape.place()),
            })
        });
        let light = self.current_light();
        let alpha = AlphaKey::of(shape)?;
        let medium = self.state.inside_medium.clone();
        // Luminous power is shared out over each shape's own area: such materials are never the same.
        let has_power = light.as_ref().is_some_and(|light| light.float("power").is_ok_and(|power| power.is_some()));
        let key = MaterialKey {
            material: Statement(Rc::clone(&definition)),
            light: light.clone().map(Statement),
            alpha,
            medium,
        };
        if !has_power && let Some(id) = self.converted.get(&key) {
            return Ok(*id);
        }
        let id = match self.convert_material(&definition)? {
            None => {
                self.note_absent(shape, &key)?;
                None
            }
            Some(mut material) => {
                if let Some(light) = &light {
                    self.shine(&mut material, light, area)?;
                }
                self.cover(&mut material, shape, &key)?;
                if let Some(name) = &key.medium {
                    self.fill(&mut material, name, shape)?;
                }
                Some(self.builder.add_material(material))
            }
        };
        self.converted.insert(key, id);
        Ok(id)
    }

    fn current_light(&mut self) -> Option<Rc<Parameters>> {
        let light = self.state.area_light.clone()?;
        if self.current_object.is_some() {
            self.builder.note("Area lights inside objects do not shine, as in pbrt.");
            return None;
        }
        Some(light)
    }

    /// Says what of a shape without a surface is lost; an error where that is all there is to see of it.
    fn note_absent(&mut self, shape: &Parameters, key: &MaterialKey) -> Result<(), LoadError> {
        if key.medium.is_some() {
            return Err(shape.unsupported("a volume without a surface is not rendered; absorption behind glass is"));
        }
        if key.light.is_some() {
            self.builder.note("Area lights of material \"interface\" do not shine, as in pbrt.");
        }
        self.builder.note("Shapes of material \"interface\" are not there.");
        Ok(())
    }

    /// Gives a material the light of a shape of such an area.
    fn shine(&mut self, material: &mut Material, light: &Parameters, area: f64) -> Result<(), LoadError> {
        let emission = self.emission(light)?;
        material.emission = emission.radiance;
        material.emits_both_sides = emission.both_sides;
        if let Some(lumen) = emission.lumen {
            let sides = if emission.both_sides { 2.0 } else { 1.0 };
            let radiance = f64::from(lumen) / (std::f64::consts::PI * area.max(f64::MIN_POSITIVE) * sides);
            material.emission.factor *= radiance.min(1e30) as f32;
        }
        Ok(())
    }

    /// Gives a material the alpha of a shape.
    fn cover(&mut self, material: &mut Material, shape: &Parameters, key: &MaterialKey) -> Result<(), LoadError> {
        match &key.alpha {
            AlphaKey::Texture(texture) => {
                material.alpha = Alpha::Blend { value: self.scalar_texture(shape, texture, 0)? };
            }
            AlphaKey::Number(bits) => {
                let number = f32::from_bits(*bits);
                if number < 1.0 {
                    material.alpha = match key.light {
                        Some(_) if number <= 0.0 => Alpha::Unseen,
                        _ => Alpha::Blend { value: ScalarInput::constant(number.max(0.0)) },
                    };
                }
            }
            AlphaKey::None => {}
        }
        Ok(())
    }

    /// Puts the absorption of a medium behind a surface.
    fn fill(&mut self, material: &mut Material, name: &str, shape: &Parameters) -> Result<(), LoadError> {
        if !self.media.contains_key(name) {
            self.look_ahead()?;
        }
        let Some(medium) = self.media.get(name) else {
            return Err(shape.error(no_such("medium", name, self.media.keys())));
        };
        match &mut material.surface {
            Surface::Dielectric { absorption, .. } => *absorption = medium.absorption,
            _ => self.builder.note(format!("Medium \"{name}\" is only rendered behind dielectric surfaces.")),
        }
        Ok(())
    }

    fn note_unread(&mut self, what: &str, parameters: &Parameters) {
        let unread = parameters.unread();
        if !unread.is_empty() {
            self.builder.note(format!("{}: {what}: not used: {}.", parameters.place(), unread.join(", ")));
        }
    }

    fn into_builder(mut self, path: &Path) -> Result<Builder, LoadError> {
        if let Some(Saved { opening, place, .. }) = self.stack.pop() {
            return Err(LoadError::invalid_at(place, format_args!("{} is never closed", opening.begin())));
        }
        if !self.in_world {
            return Err(LoadError::invalid(path, "the file has no WorldBegin"));
        }
        self.place_objects_ahead()?;
        let nits = if self.is_photometric {
            1.0
        } else {
            self.builder.note_assumed_unit();
            ASSUMED_NITS_PER_UNIT
        };
        self.builder.bitangent_ignores_v = true;
        self.builder.set_nits_per_unit(nits / f64::from(self.exposure));
        Ok(self.builder)
    }
}
