//! The scene while it is being read: what all formats add to, and the last look that keeps their promises.

use super::bump::{self, Bump};
use super::error::{LoadError, nearest, suggestion};
use super::framing::Framing;
use super::notes::AlikeNotes;
use super::texture::Requests;
use super::{LoadOptions, default_view, environment, tangents, validate};
use crate::scene::{
    Camera, Environment, FilmDefaults, Instance, Light, Material, MaterialId, Mesh, MeshId, Relief, Scene, Sphere,
    TextureLookup, ViewingDefaults,
};
use glam::Vec3;
use rayon::prelude::*;
use std::collections::HashSet;
use std::path::Path;

/// A camera that a file holds.
#[derive(Clone, Debug)]
pub(super) struct NamedCamera {
    pub(super) name: String,
    /// The name of what holds it, which is another one where several hold one camera.
    pub(super) holder: Option<String>,
    pub(super) camera: Camera,
    pub(super) framing: Framing,
}

/// What to do with a scene that brings no light.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum IfDark {
    /// Our own format has lights: their absence is a slip.
    Fail,
    /// The format has none, or files come without: a studio sky stands in, also when the only emitters are weaker than
    /// `WEAK_EMITTER_CD_M2`.
    Studio,
    /// A studio sky stands in as by [`Self::Studio`], but the file's own lights are believed however weak they are.
    StudioWithoutLight,
    /// There is light at other times: the picture is black.
    Stay,
}

/// Emitters of interchange files below this many cd/m² are decoration (an "emissive" left at 1), not the scene's light.
const WEAK_EMITTER_CD_M2: f32 = 10.0;

/// Luminance of RGB (1, 1, 1) in formats without a unit.
pub(super) const ASSUMED_NITS_PER_UNIT: f64 = 100.0;

/// The note of a scene whose file has no camera, which holds until it is given one.
pub const NO_CAMERA: &str = "No camera in the file: a three-quarter view of the whole scene is used.";

/// Reads a file up to [`Builder::finish`].
pub(super) type Read = fn(&Path, &LoadOptions) -> Result<Builder, LoadError>;

/// The scene while it is being read.
#[derive(Debug)]
pub(super) struct Builder {
    pub(super) name: String,
    pub(super) nits_per_unit: f64,
    /// Whether the caller chose the unit: what files say of it does not count then.
    unit_is_chosen: bool,
    pub(super) cameras: Vec<NamedCamera>,
    pub(super) film: FilmDefaults,
    pub(super) viewing: ViewingDefaults,
    pub(super) meshes: Vec<Mesh>,
    /// Meshes, of `meshes`, that have another shape at other times.
    pub(super) deforming: HashSet<MeshId>,
    pub(super) instances: Vec<Instance>,
    pub(super) spheres: Vec<Sphere>,
    /// Things that wait in groups to be placed.
    pub(super) parts_of_groups: usize,
    pub(super) materials: Vec<Material>,
    pub(super) textures: Requests,
    /// What becomes [`Scene::bitangent_ignores_v`].
    pub(super) bitangent_ignores_v: bool,
    /// Whether tangents that the file does not have follow the coordinates at which a normal map is read, not the
    /// mesh's own.
    pub(super) tangents_follow_maps: bool,
    /// Reliefs that only their decoded pictures tell apart.
    pub(super) bumps: Vec<Bump>,
    pub(super) lights: Vec<Light>,
    pub(super) environment: Option<Environment>,
    pub(super) notes: Vec<String>,
    /// Seconds for which the shutter stays open.
    pub(super) shutter_s: f64,
    /// Reads the file as it is at another time; `None` where it is the same at all times.
    pub(super) at_another_time: Option<Read>,
    alike: AlikeNotes,
}

impl Builder {
    /// An empty scene named after its file, in the caller's unit or in cd/m².
    pub(super) fn new(path: &Path, options: &LoadOptions) -> Self {
        Self {
            name: path.file_stem().unwrap_or_default().to_string_lossy().into_owned(),
            nits_per_unit: options.nits_per_unit.unwrap_or(1.0),
            unit_is_chosen: options.nits_per_unit.is_some(),
            cameras: Vec::new(),
            film: FilmDefaults { width: 512, height: 512 },
            viewing: ViewingDefaults::default(),
            meshes: Vec::new(),
            deforming: HashSet::new(),
            instances: Vec::new(),
            spheres: Vec::new(),
            parts_of_groups: 0,
            materials: Vec::new(),
            textures: Requests::default(),
            bitangent_ignores_v: false,
            tangents_follow_maps: false,
            bumps: Vec::new(),
            lights: Vec::new(),
            environment: None,
            notes: Vec::new(),
            shutter_s: 0.0,
            at_another_time: None,
            alike: AlikeNotes::default(),
        }
    }

    /// Takes the file's unit, unless the caller chose one.
    pub(super) fn set_nits_per_unit(&mut self, of_file: f64) {
        if !self.unit_is_chosen {
            self.nits_per_unit = of_file;
        }
    }

    /// Says that the file has no unit, unless the caller chose one.
    pub(super) fn note_assumed_unit(&mut self) {
        if !self.unit_is_chosen {
            self.note(format!(
                "Radiance has no unit in this file: 1 is taken as {ASSUMED_NITS_PER_UNIT} cd/m² (--nits-per-unit changes it)."
            ));
        }
    }

    pub(super) fn add_mesh(&mut self, mesh: Mesh) -> MeshId {
        self.meshes.push(mesh);
        MeshId(self.meshes.len() as u32 - 1)
    }

    pub(super) fn add_material(&mut self, material: Material) -> MaterialId {
        self.materials.push(material);
        MaterialId(self.materials.len() as u32 - 1)
    }

    /// How many things are placed so far: see [`super::check_placed`].
    pub(super) fn placed(&self) -> usize {
        self.instances.len() + self.spheres.len() + self.lights.len() + self.parts_of_groups
    }

    /// Adds a sentence, once; those that differ in their line alone are counted.
    pub(super) fn note(&mut self, note: impl Into<String>) {
        self.alike.add(note.into(), &mut self.notes);
    }

    /// Names the scatterings after which the file ends its paths, unless nothing is left then. In closed rooms what
    /// comes after them counts: 8 % of veach-ajar's light after 13.
    pub(super) fn note_depth(&mut self, scatterings: i64) {
        const DEEP: i64 = 100;
        if scatterings >= DEEP {
            return;
        }
        self.note(format!(
            "The file ends paths after {scatterings} scatterings; here they go on to their end (--max-depth {scatterings} keeps the \
             file's)."
        ));
    }

    /// Chooses the camera, decodes the textures, checks everything, and adds what is missing.
    pub(super) fn finish(mut self, path: &Path, if_dark: IfDark, options: &LoadOptions) -> Result<Scene, LoadError> {
        validate::repair(&mut self, path)?;
        std::mem::take(&mut self.alike).count_into(&mut self.notes);
        let camera = self.choose_camera(path, options)?;
        let coverage = self.materials.iter().filter_map(|material| material.alpha.texture_of_coverage()).collect();
        let textures = std::mem::take(&mut self.textures).decode(&mut self.notes, options, &coverage)?;
        bump::settle(&self.bumps, &mut self.materials, &textures, &mut self.notes);
        let mut scene = Scene {
            name: self.name,
            nits_per_unit: self.nits_per_unit,
            camera,
            shutter_s: self.shutter_s,
            film: self.film,
            viewing: self.viewing,
            meshes: self.meshes,
            instances: self.instances,
            spheres: self.spheres,
            materials: self.materials,
            textures,
            bitangent_ignores_v: self.bitangent_ignores_v,
            lights: self.lights,
            environment: self.environment,
            notes: self.notes,
        };
        validate::check(&scene, path)?;
        add_tangents(&mut scene, self.tangents_follow_maps);
        if !options.environment_follows && needs_studio(&scene, path, if_dark)? {
            let start = at_start(self.at_another_time, path, options)?;
            // A camera that the file has at other times only is taken as it is.
            let aimed_by = start.and_then(|mut start| start.choose_camera(path, options).ok());
            add_studio(&mut scene, aimed_by.map(|camera| camera.forward));
        }
        note_long_shutter(&mut scene, options);
        Ok(scene)
    }

    fn choose_camera(&mut self, path: &Path, options: &LoadOptions) -> Result<Camera, LoadError> {
        let Some(wanted) = &options.camera else {
            let Some(first) = self.cameras.first().cloned() else {
                self.notes.push(NO_CAMERA.to_owned());
                let FilmDefaults { width, height } = options.film.unwrap_or(self.film);
                // Where everything is hidden at first, what is there now is framed, and then any place will do.
                let start = at_start(self.at_another_time, path, options)?;
                let bounds = start.and_then(|start| start.bounds()).or_else(|| self.bounds());
                let bounds = bounds.unwrap_or(default_view::Bounds { min: Vec3::NEG_ONE, max: Vec3::ONE });
                return Ok(default_view::framed(bounds, width as f32 / height as f32));
            };
            if self.cameras.len() > 1 {
                let note = format!("{} cameras; the first one, \"{}\", is used.", self.cameras.len(), first.name);
                self.notes.push(note);
            }
            return Ok(self.fitted(first, options));
        };
        let is_called = |camera: &&NamedCamera| camera.name == *wanted;
        let is_held = |camera: &&NamedCamera| camera.holder.as_ref() == Some(wanted);
        let named = self.cameras.iter().find(is_called).or_else(|| self.cameras.iter().find(is_held));
        if let Some(camera) = named.cloned() {
            return Ok(self.fitted(camera, options));
        }
        let names = || self.cameras.iter().map(|camera| self.best_name(camera));
        let problem = match names().count() {
            0 => format!("no camera \"{wanted}\": the scene has no named camera"),
            _ => format!("no camera \"{wanted}\"{}", {
                // A slip gets its correction, anything else the list.
                match nearest(wanted, names()) {
                    Some(_) => suggestion(wanted, names()),
                    None => format!("; the scene has {}", names().collect::<Vec<_>>().join(", ")),
                }
            }),
        };
        Err(LoadError::Option { problem })
    }

    /// The name by which a camera alone is chosen, if it has any.
    fn best_name<'a>(&self, camera: &'a NamedCamera) -> &'a str {
        let is_shared = self.cameras.iter().filter(|other| other.name == camera.name).nth(1).is_some();
        camera.holder.as_deref().filter(|_| is_shared).unwrap_or(&camera.name)
    }

    /// The bounds of what is rendered, if anything is.
    fn bounds(&self) -> Option<default_view::Bounds> {
        let bounds = default_view::bounds(&self.meshes, &self.instances, &self.spheres);
        (bounds.min.x <= bounds.max.x).then_some(bounds)
    }

    /// The camera for the picture.
    fn fitted(&mut self, NamedCamera { camera, framing, .. }: NamedCamera, options: &LoadOptions) -> Camera {
        if let Some(aspect) = framing.stated() {
            self.film = FilmDefaults::of_aspect(self.film.width.max(self.film.height), aspect);
        }
        framing.fit(camera, options.film.unwrap_or(self.film))
    }
}

/// Names a shutter that blurs what moves into the frames after it, as pbrt's does for a second where its file says
/// nothing.
fn note_long_shutter(scene: &mut Scene, options: &LoadOptions) {
    let shutter_s = scene.shutter_s;
    let is_longer = |frame_s: &f64| shutter_s > 1.001 * frame_s;
    if let Some(frame_s) = options.frame_s.filter(is_longer).filter(|_| scene.moves()) {
        let frames = shutter_s / frame_s;
        scene.notes.push(format!("The shutter stays open for {shutter_s} s, as long as {frames:.1} frames."));
    }
}

/// Gives smooth meshes the tangents that their materials ask for. Of several materials of a mesh that has to follow
/// their maps, the first one counts; glTF gives each mesh one.
fn add_tangents(scene: &mut Scene, follow_maps: bool) {
    let mut asked: Vec<Option<Option<TextureLookup>>> = vec![None; scene.meshes.len()];
    for instance in &scene.instances {
        let material = &scene.materials[instance.material.0 as usize];
        if material.needs_tangent() {
            let map = material.reliefs().filter(|_| follow_maps).find_map(Relief::texture).copied();
            asked[instance.mesh.0 as usize].get_or_insert(map);
        }
    }
    scene.meshes.par_iter_mut().zip(asked).for_each(|(mesh, asked)| match asked {
        None => {}
        Some(None) => tangents::add(mesh),
        Some(Some(map)) => tangents::add_for(mesh, &map),
    });
}

/// The file as it is at time 0, by which what is to stay for a whole shot is placed: the view of a scene without a
/// camera, and the studio. `None` where that is now, or always.
fn at_start(read: Option<Read>, path: &Path, options: &LoadOptions) -> Result<Option<Builder>, LoadError> {
    let Some(read) = read.filter(|_| options.frame_time != 0.0) else { return Ok(None) };
    let mut start = read(path, &LoadOptions { frame_time: 0.0, ..options.clone() })?;
    validate::repair(&mut start, path)?;
    start.at_another_time = None;
    Ok(Some(start))
}

/// Emitters weaker than this radiance are not the scene's light.
fn weakest_light(if_dark: IfDark, nits_per_unit: f64) -> f32 {
    match if_dark {
        IfDark::Fail | IfDark::StudioWithoutLight | IfDark::Stay => 0.0,
        IfDark::Studio => WEAK_EMITTER_CD_M2 / nits_per_unit as f32,
    }
}

/// Whether a scene has no light and its format allows a studio to stand in.
fn needs_studio(scene: &Scene, path: &Path, if_dark: IfDark) -> Result<bool, LoadError> {
    if if_dark == IfDark::Stay || is_lit(scene, weakest_light(if_dark, scene.nits_per_unit)) {
        return Ok(false);
    }
    if if_dark == IfDark::Fail {
        return Err(LoadError::invalid(
            path,
            "scene has no light: add an [environment], [[lights]] or an object whose material has an emission",
        ));
    }
    Ok(true)
}

/// Puts a studio around a scene, aimed by this direction or by its camera's.
fn add_studio(scene: &mut Scene, forward: Option<Vec3>) {
    let what = match is_lit(scene, 0.0) {
        true => format!("Only emitters below {WEAK_EMITTER_CD_M2} cd/m²"),
        false => "No light".to_owned(),
    };
    scene.environment = Some(environment::studio(scene.nits_per_unit, forward.unwrap_or(scene.camera.forward)));
    scene.notes.push(format!("{what} in the file: a soft studio of about 1000 cd/m² surrounds the scene."));
}

/// Whether anything gives light: more radiance than `weakest` for surfaces.
fn is_lit(scene: &Scene, weakest: f32) -> bool {
    let emits = |id: MaterialId| {
        let emission = scene.materials[id.0 as usize].emission;
        let brightest = emission.texture.map_or(1.0, |lookup| scene.textures[lookup.texture.0 as usize].brightest());
        emission.factor.max_element() * brightest > weakest
    };
    let shines = |light: &Light| match light {
        Light::Point { intensity, .. } | Light::Spot { intensity, .. } => intensity.max_element() > 0.0,
        Light::Photometric { web, per_candela, .. } => web.max_cd() * per_candela.max_element() > 0.0,
        Light::Directional { irradiance, .. } => irradiance.max_element() > 0.0,
    };
    let surrounded = scene.environment.as_ref().is_some_and(|environment| {
        environment.scale > 0.0 && environment.texels.iter().any(|texel| texel.max_element() > 0.0)
    });
    surrounded
        || scene.lights.iter().any(shines)
        || scene.instances.iter().any(|instance| emits(instance.material))
        || scene.spheres.iter().any(|sphere| emits(sphere.material))
}
