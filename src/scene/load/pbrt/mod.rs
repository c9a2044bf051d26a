//! pbrt-v4 scene files, by a reader of our own: the subset that scenes/README.md lists.
//!
//! pbrt's camera looks along +z with x to the right, so scenes written for it are left-handed or carry a mirroring camera
//! transform; both end in [`Camera::mirrored`](crate::scene::Camera::mirrored). Radiance is multiplied by the sensor's
//! exposure, so that pixels have pbrt's own values, and `nits_per_unit` divided by it. Integrators, samplers and filters
//! are fechner's.

mod camera;
mod inputs;
mod lexer;
mod lights;
mod materials;
mod parameters;
mod shapes;
mod state;
mod textures;

use super::builder::{Builder, IfDark};
use super::error::{LoadError, Place, suggestion};
use super::{LoadOptions, files};
use crate::scene::{Alpha, Material, MaterialId, MeshId, ScalarInput, Scene, Surface};
use glam::{DMat4, DQuat, DVec3};
use lexer::{Lexer, Token};
use parameters::Parameters;
use state::{DEEPEST_STACK, State, Transforms};
use std::collections::HashMap;
use std::path::{Path, PathBuf};
use std::rc::Rc;

/// Deepest chain of includes.
const DEEPEST_INCLUDE: usize = 32;
/// Most placed shapes.
const MOST_INSTANCES: usize = 4_000_000;
/// Luminance of RGB (1, 1, 1) where no light of the file is photometric.
const ASSUMED_NITS_PER_UNIT: f64 = 100.0;

/// Reads a pbrt file.
pub(super) fn load(path: &Path, options: &LoadOptions) -> Result<Scene, LoadError> {
    let mut reader = Reader {
        main: path.to_owned(),
        file: path.to_owned(),
        options,
        builder: Builder::new(path),
        state: State::new(),
        stack: Vec::new(),
        coordinate_systems: HashMap::new(),
        textures: HashMap::new(),
        named_materials: HashMap::new(),
        media: HashMap::new(),
        objects: HashMap::new(),
        current_object: None,
        converted: HashMap::new(),
        keep_alive: Vec::new(),
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
    };
    reader.read_file(path)?;
    reader.finish(path)
}

/// A shape of an object that may be placed many times.
struct Part {
    name: String,
    mesh: MeshId,
    material: MaterialId,
    transforms: Transforms,
}

/// What makes a material of its own out of a definition.
type MaterialKey = (usize, usize, Option<String>, Option<String>);

struct Reader<'a> {
    /// The file that was asked for, and the one that is being read.
    main: PathBuf,
    file: PathBuf,
    options: &'a LoadOptions,
    builder: Builder,
    state: State,
    /// Saved states, and what opened them.
    stack: Vec<(State, &'static str)>,
    coordinate_systems: HashMap<String, Transforms>,
    textures: HashMap<(&'static str, String), Rc<textures::Definition>>,
    named_materials: HashMap<String, Rc<materials::Definition>>,
    media: HashMap<String, materials::Medium>,
    objects: HashMap<String, Vec<Part>>,
    current_object: Option<String>,
    /// By addresses of material and area light, alpha, and medium.
    converted: HashMap<MaterialKey, Option<MaterialId>>,
    /// Whatever has an address in `converted`.
    keep_alive: Vec<(Rc<materials::Definition>, Option<Rc<Parameters>>)>,
    ply_files: HashMap<(PathBuf, bool), MeshId>,
    camera: Option<(String, Parameters, Transforms)>,
    film: Option<(String, Parameters)>,
    /// `TransformTimes`.
    times: [f32; 2],
    /// When the shutter opens and closes.
    shutter: [f32; 2],
    /// The sensor's factor.
    exposure: f32,
    in_world: bool,
    is_photometric: bool,
    includes: usize,
    /// Of meshes that stand for spheres and their like.
    made_vertices: usize,
}

impl Reader<'_> {
    /// A file that this one names: beside it, or beside the first one.
    fn file(&self, name: &str) -> PathBuf {
        let beside = |file: &Path| file.parent().unwrap_or(Path::new("")).join(name);
        let here = beside(&self.file);
        if here.is_file() { here } else { beside(&self.main) }
    }

    fn read_file(&mut self, path: &Path) -> Result<(), LoadError> {
        let text = files::decode_text(path, files::read_unpacked(path)?)?;
        let outer = std::mem::replace(&mut self.file, path.to_owned());
        let mut lexer = Lexer::new(path, &text);
        while let Some((token, line)) = lexer.next()? {
            let Token::Word(directive) = token else {
                return Err(LoadError::invalid_at(lexer.place(line), "expected a directive"));
            };
            self.directive(directive, &mut lexer, line)?;
        }
        self.file = outer;
        Ok(())
    }

    fn directive(&mut self, directive: &str, lexer: &mut Lexer, line: usize) -> Result<(), LoadError> {
        match directive {
            "Identity" => self.state.change(|_| DMat4::IDENTITY),
            "Translate" => {
                let [x, y, z] = numbers(lexer, line)?;
                self.state.change(|m| m * DMat4::from_translation(DVec3::new(x, y, z)));
            }
            "Scale" => {
                let [x, y, z] = numbers(lexer, line)?;
                self.state.change(|m| m * DMat4::from_scale(DVec3::new(x, y, z)));
            }
            "Rotate" => {
                let [angle, x, y, z] = numbers(lexer, line)?;
                let Some(axis) = DVec3::new(x, y, z).try_normalize() else {
                    return Err(LoadError::invalid_at(lexer.place(line), "Rotate about an axis of no length"));
                };
                self.state.change(|m| m * DMat4::from_quat(DQuat::from_axis_angle(axis, angle.to_radians())));
            }
            "LookAt" => {
                let [ex, ey, ez, tx, ty, tz, ux, uy, uz] = numbers(lexer, line)?;
                let [eye, target, up] = [[ex, ey, ez], [tx, ty, tz], [ux, uy, uz]].map(DVec3::from_array);
                let Some(look) = state::look_at(eye, target, up) else {
                    let problem = "LookAt needs two different points and an up vector that is not along their line";
                    return Err(LoadError::invalid_at(lexer.place(line), problem));
                };
                self.state.change(|m| m * look);
            }
            "Transform" | "ConcatTransform" => {
                let matrix = DMat4::from_cols_array(&numbers(lexer, line)?);
                let replace = directive == "Transform";
                self.state.change(|m| if replace { matrix } else { m * matrix });
            }
            "TransformTimes" => {
                let [start, end] = numbers(lexer, line)?;
                self.times = [start as f32, end as f32];
            }
            "ActiveTransform" => {
                self.state.active = match lexer.next()? {
                    Some((Token::Word("StartTime"), _)) => [true, false],
                    Some((Token::Word("EndTime"), _)) => [false, true],
                    Some((Token::Word("All"), _)) => [true, true],
                    _ => {
                        let problem = "ActiveTransform: expected StartTime, EndTime or All";
                        return Err(LoadError::invalid_at(lexer.place(line), problem));
                    }
                };
            }
            "CoordinateSystem" => {
                self.coordinate_systems.insert(string(lexer, line)?, self.state.transforms);
            }
            "CoordSysTransform" => {
                let name = string(lexer, line)?;
                match self.coordinate_systems.get(&name) {
                    Some(transforms) => self.state.transforms = *transforms,
                    None => self.builder.note(format!("{}: no coordinate system \"{name}\".", lexer.place(line))),
                }
            }
            "ReverseOrientation" => self.state.reverse_orientation ^= true,
            "AttributeBegin" => self.push("AttributeBegin", lexer.place(line))?,
            "TransformBegin" => self.push("TransformBegin", lexer.place(line))?,
            "AttributeEnd" => self.pop("AttributeBegin", directive, lexer.place(line))?,
            "TransformEnd" => self.pop("TransformBegin", directive, lexer.place(line))?,
            "Attribute" => {
                let target = string(lexer, line)?;
                let parameters = Parameters::read(lexer, line)?;
                self.state.attributes.entry(target).or_default().extend(parameters.into_list());
            }
            "ObjectBegin" => {
                let name = string(lexer, line)?;
                if self.current_object.is_some() {
                    return Err(LoadError::invalid_at(lexer.place(line), "ObjectBegin inside an object"));
                }
                self.push("ObjectBegin", lexer.place(line))?;
                self.objects.insert(name.clone(), Vec::new());
                self.current_object = Some(name);
            }
            "ObjectEnd" => {
                self.pop("ObjectBegin", directive, lexer.place(line))?;
                self.current_object = None;
            }
            "ObjectInstance" => self.place_object(&string(lexer, line)?, lexer.place(line))?,
            "WorldBegin" => {
                self.coordinate_systems.insert("world".to_owned(), Transforms::IDENTITY);
                self.place_camera()?;
                self.state.transforms = Transforms::IDENTITY;
                self.state.active = [true; 2];
                self.in_world = true;
            }
            "WorldEnd" => {}
            "Include" | "Import" => {
                let name = string(lexer, line)?;
                self.include(&name, lexer.place(line))?;
            }
            "ColorSpace" => {
                let name = string(lexer, line)?;
                if name != "srgb" {
                    self.builder.note(format!("Colours of the space \"{name}\" are taken for Rec.709."));
                }
            }
            "NamedMaterial" => {
                let name = string(lexer, line)?;
                let user = Parameters::none(lexer.place(line));
                self.state.material = Some(self.named_material(&user, &name)?);
            }
            "MediumInterface" => {
                let inside = string(lexer, line)?;
                let outside = match lexer.peek()? {
                    Some(Token::Quoted(_)) => string(lexer, line)?,
                    _ => inside.clone(),
                };
                let named = |name: String| Some(name).filter(|name| !name.is_empty());
                (self.state.inside_medium, self.state.outside_medium) = (named(inside), named(outside));
            }
            "Texture" => {
                let (name, class, kind) = (string(lexer, line)?, string(lexer, line)?, string(lexer, line)?);
                let class = match class.as_str() {
                    "spectrum" => "spectrum",
                    "float" => "float",
                    other => {
                        let problem = format!("texture \"{name}\" is of \"{other}\": expected spectrum or float");
                        return Err(LoadError::invalid_at(lexer.place(line), problem));
                    }
                };
                let parameters = self.parameters(lexer, line, "texture")?;
                self.textures.insert((class, name), Rc::new(textures::Definition::new(&kind, parameters)));
            }
            "Option" => {
                let user = Parameters::read(lexer, line)?;
                self.note_unread("Option", &user);
            }
            "Material" | "MakeNamedMaterial" | "MakeNamedMedium" | "LightSource" | "AreaLightSource" | "Shape"
            | "Camera" | "Film" => {
                let name = string(lexer, line)?;
                self.typed(directive, name, lexer, line)?;
            }
            "Integrator" | "Sampler" | "PixelFilter" | "Accelerator" => {
                string(lexer, line)?;
                Parameters::read(lexer, line)?;
                self.builder.note("Integrator, sampler, filter and accelerator are fechner's own, not the file's.");
            }
            other => {
                let known = ["Shape", "Texture", "Material", "NamedMaterial", "AttributeBegin", "AttributeEnd", "LightSource",
                    "AreaLightSource", "Transform", "Translate", "Rotate", "Scale", "WorldBegin", "Include", "Camera", "Film"];
                let problem = format!("unknown directive {other}{}", suggestion(other, known));
                return Err(LoadError::invalid_at(lexer.place(line), problem));
            }
        }
        Ok(())
    }

    /// Directives with a type or name and parameters.
    fn typed(&mut self, directive: &str, name: String, lexer: &mut Lexer, line: usize) -> Result<(), LoadError> {
        let class = match directive {
            "Material" | "MakeNamedMaterial" => "material",
            "MakeNamedMedium" => "medium",
            "LightSource" | "AreaLightSource" => "light",
            "Shape" => "shape",
            _ => "",
        };
        let parameters = self.parameters(lexer, line, class)?;
        match directive {
            "Material" => {
                let definition = materials::Definition { name: name.clone(), kind: name, parameters };
                self.state.material = Some(Rc::new(definition));
            }
            "MakeNamedMaterial" => {
                let kind = parameters.string("type")?.map(str::to_owned);
                let kind = kind.ok_or_else(|| parameters.error("a named material needs a \"string type\""))?;
                let definition = materials::Definition { name: name.clone(), kind, parameters };
                self.named_materials.insert(name, Rc::new(definition));
            }
            "MakeNamedMedium" => self.medium(&name, &parameters)?,
            "LightSource" => self.light(&name, &parameters)?,
            "AreaLightSource" => {
                if name != "diffuse" {
                    return Err(parameters.error(format_args!("unknown area light \"{name}\"; \"diffuse\" is the only one")));
                }
                self.state.area_light = Some(Rc::new(parameters));
            }
            "Shape" => {
                if self.builder.instances.len() >= MOST_INSTANCES {
                    return Err(LoadError::too_large(&self.main, format_args!("more than {MOST_INSTANCES} shapes")));
                }
                self.shape(&name, &parameters)?;
            }
            "Camera" => {
                if let Some(medium) = &self.state.outside_medium {
                    return Err(parameters.unsupported(format_args!(
                        "the camera stands in the medium \"{medium}\": a medium that fills the view is not rendered"
                    )));
                }
                self.coordinate_systems.insert("camera".to_owned(), self.state.transforms.inverse());
                self.camera = Some((name, parameters, self.state.transforms));
            }
            _ => self.film = Some((name, parameters)),
        }
        Ok(())
    }

    fn parameters(&self, lexer: &mut Lexer, line: usize, class: &str) -> Result<Parameters, LoadError> {
        let parameters = Parameters::read(lexer, line)?;
        Ok(match self.state.attributes.get(class) {
            Some(defaults) => parameters.with_defaults(defaults),
            None => parameters,
        })
    }

    fn push(&mut self, opened_by: &'static str, place: Place) -> Result<(), LoadError> {
        if self.stack.len() >= DEEPEST_STACK {
            return Err(LoadError::invalid_at(place, format_args!("attributes nested deeper than {DEEPEST_STACK}")));
        }
        self.stack.push((self.state.clone(), opened_by));
        Ok(())
    }

    fn pop(&mut self, opened_by: &str, directive: &str, place: Place) -> Result<(), LoadError> {
        match self.stack.pop() {
            Some((state, opened)) if opened == opened_by => {
                if opened == "TransformBegin" {
                    self.state.transforms = state.transforms;
                } else {
                    self.state = state;
                }
                Ok(())
            }
            Some((_, opened)) => {
                Err(LoadError::invalid_at(place, format_args!("{directive} closes what {opened} opened")))
            }
            None => Err(LoadError::invalid_at(place, format_args!("{directive} without {opened_by}"))),
        }
    }

    fn include(&mut self, name: &str, place: Place) -> Result<(), LoadError> {
        if self.includes >= DEEPEST_INCLUDE {
            let problem = format!("includes nested deeper than {DEEPEST_INCLUDE}, or a file that includes itself");
            return Err(LoadError::invalid_at(place, problem));
        }
        self.includes += 1;
        let file = self.file(name);
        let read = self.read_file(&file);
        self.includes -= 1;
        read.map_err(|error| if self.includes == 0 { error.referenced_from(place) } else { error })
    }

    fn place_object(&mut self, name: &str, place: Place) -> Result<(), LoadError> {
        let Some(parts) = self.objects.get(name) else {
            let mut known: Vec<&str> = self.objects.keys().map(String::as_str).collect();
            known.sort_unstable();
            let problem = format!("there is no object \"{name}\"{}", suggestion(name, known));
            return Err(LoadError::invalid_at(place, problem));
        };
        if self.current_object.is_some() {
            return Err(LoadError::invalid_at(place, "an object cannot hold an instance of another"));
        }
        if self.builder.instances.len() + parts.len() > MOST_INSTANCES {
            return Err(LoadError::too_large(&self.main, format_args!("more than {MOST_INSTANCES} placed shapes")));
        }
        let transforms = self.state.transforms;
        let placed: Vec<_> = parts.iter().map(|part| shapes::place_part(self, part, &transforms)).collect();
        self.builder.instances.extend(placed);
        Ok(())
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
        let mut light = self.state.area_light.clone();
        if light.is_some() && self.current_object.is_some() {
            self.builder.note("Area lights inside objects do not shine, as in pbrt.");
            light = None;
        }
        let alpha = shape.word(&["texture"], "alpha")?.map(str::to_owned);
        let alpha_number = shape.float("alpha")?;
        let medium = self.state.inside_medium.clone();
        // Luminous power is shared out over each shape's own area: such materials are never the same.
        let has_power = light.as_ref().is_some_and(|light| light.float("power").is_ok_and(|power| power.is_some()));
        let address = |pointer: *const ()| pointer as usize;
        let key = (
            address(Rc::as_ptr(&definition).cast()),
            light.as_ref().map_or(0, |light| address(Rc::as_ptr(light).cast())),
            alpha.clone().or(alpha_number.map(|number| format!("= {number}"))),
            medium.clone(),
        );
        if !has_power && let Some(id) = self.converted.get(&key) {
            return Ok(*id);
        }
        let id = match self.convert_material(&definition)? {
            None if light.is_none() => {
                if medium.is_some() {
                    return Err(shape.unsupported("a volume without a surface is not rendered; absorption behind glass is"));
                }
                self.builder.note("Shapes of material \"interface\" are not there.");
                None
            }
            converted => {
                let black = crate::scene::ColorInput::constant(glam::Vec3::ZERO);
                let mut material = converted
                    .unwrap_or_else(|| Material::plain(definition.name.clone(), Surface::Diffuse { reflectance: black }));
                if let Some(light) = &light {
                    let emission = self.emission(light)?;
                    material.emission = emission.radiance;
                    material.emits_both_sides = emission.both_sides;
                    if let Some(lumen) = emission.lumen {
                        let sides = if emission.both_sides { 2.0 } else { 1.0 };
                        let radiance = f64::from(lumen) / (std::f64::consts::PI * area.max(f64::MIN_POSITIVE) * sides);
                        material.emission.factor *= radiance.min(1e30) as f32;
                    }
                }
                if let Some(texture) = alpha {
                    material.alpha = Alpha::Blend { value: self.scalar_texture(shape, &texture, 0)? };
                } else if let Some(number) = alpha_number.filter(|&number| number < 1.0) {
                    material.alpha = Alpha::Blend { value: ScalarInput::constant(number.max(0.0)) };
                }
                if let Some(name) = medium {
                    self.fill(&mut material, &name, shape)?;
                }
                Some(self.builder.add_material(material))
            }
        };
        self.keep_alive.push((definition, light));
        self.converted.insert(key, id);
        Ok(id)
    }

    /// Puts the absorption of a medium behind a surface.
    fn fill(&mut self, material: &mut Material, name: &str, shape: &Parameters) -> Result<(), LoadError> {
        let Some(medium) = self.media.get(name) else {
            let mut known: Vec<&str> = self.media.keys().map(String::as_str).collect();
            known.sort_unstable();
            return Err(shape.error(format_args!("there is no medium \"{name}\"{}", suggestion(name, known))));
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

    fn finish(mut self, path: &Path) -> Result<Scene, LoadError> {
        if let Some((_, opened)) = self.stack.last() {
            return Err(LoadError::invalid(path, format_args!("{opened} is never closed")));
        }
        if !self.in_world {
            return Err(LoadError::invalid(path, "the file has no WorldBegin"));
        }
        let nits = if self.is_photometric {
            1.0
        } else {
            self.builder.note(format!(
                "Radiance has no unit in this file: 1 is taken as {ASSUMED_NITS_PER_UNIT} cd/m² (--nits-per-unit changes it)."
            ));
            ASSUMED_NITS_PER_UNIT
        };
        self.builder.nits_per_unit = nits / f64::from(self.exposure);
        self.builder.finish(path, IfDark::StudioWithoutLight, self.options)
    }
}

/// Numbers behind a directive, with or without brackets.
fn numbers<const N: usize>(lexer: &mut Lexer, line: usize) -> Result<[f64; N], LoadError> {
    let mut values = [0.0; N];
    let bracket = matches!(lexer.peek()?, Some(Token::Open));
    if bracket {
        lexer.next()?;
    }
    let wrong = |lexer: &Lexer| LoadError::invalid_at(lexer.place(line), format_args!("expected {N} finite numbers"));
    for value in &mut values {
        *value = match lexer.next()? {
            Some((Token::Word(word), _)) => word.parse().ok().filter(|n: &f64| (*n as f32).is_finite()),
            _ => None,
        }
        .ok_or_else(|| wrong(lexer))?;
    }
    if bracket && !matches!(lexer.next()?, Some((Token::Close, _))) {
        return Err(wrong(lexer));
    }
    Ok(values)
}

/// A string behind a directive.
fn string(lexer: &mut Lexer, line: usize) -> Result<String, LoadError> {
    match lexer.next()? {
        Some((Token::Quoted(text), _)) => Ok(text.into_owned()),
        _ => Err(LoadError::invalid_at(lexer.place(line), "expected a string in quotes")),
    }
}
