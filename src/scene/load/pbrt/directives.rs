//! Reads directives: what each does to the state, and which file is read next.

use super::super::error::{LoadError, Place, no_such, suggestion};
use super::super::files;
use super::lexer::{Lexer, Token};
use super::parameters::{self, Parameters};
use super::state::{DEEPEST_STACK, Opening, Transforms};
use super::transforms::TransformDirective;
use super::{Reader, Saved, Scope, UseOfObject, materials, shapes, textures};
use std::path::Path;
use std::rc::Rc;

/// Deepest chain of includes.
const DEEPEST_INCLUDE: usize = 32;
/// What `Attribute` may set defaults of.
const ATTRIBUTE_TARGETS: [&str; 5] = ["shape", "light", "material", "medium", "texture"];
/// Scatterings of pbrt's paths where the file does not say.
const DEFAULT_DEPTH: i64 = 5;

/// What a statement is for, by its first word.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Directive {
    Transform(TransformDirective),
    State(StateDirective),
    Open(Opening),
    Close(Opening),
    ObjectInstance,
    WorldBegin,
    WorldEnd,
    Include,
    Import,
    Texture,
    Entity(Entity),
    Option,
    Method(Method),
}

/// What changes the graphics state but for its transform.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum StateDirective {
    ReverseOrientation,
    Attribute,
    ColorSpace,
    NamedMaterial,
    MediumInterface,
}

/// What has a type or a name, then parameters.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Entity {
    Material,
    MakeNamedMaterial,
    MakeNamedMedium,
    LightSource,
    AreaLightSource,
    Shape,
    Camera,
    Film,
}

/// How pbrt would render, which is fechner's own here.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Method {
    Integrator,
    Sampler,
    PixelFilter,
    Accelerator,
}

const DIRECTIVES: [(&str, Directive); 41] = [
    ("Identity", Directive::Transform(TransformDirective::Identity)),
    ("Translate", Directive::Transform(TransformDirective::Translate)),
    ("Scale", Directive::Transform(TransformDirective::Scale)),
    ("Rotate", Directive::Transform(TransformDirective::Rotate)),
    ("LookAt", Directive::Transform(TransformDirective::LookAt)),
    ("Transform", Directive::Transform(TransformDirective::Replace)),
    ("ConcatTransform", Directive::Transform(TransformDirective::Concat)),
    ("TransformTimes", Directive::Transform(TransformDirective::Times)),
    ("ActiveTransform", Directive::Transform(TransformDirective::Activate)),
    ("CoordinateSystem", Directive::Transform(TransformDirective::NameSystem)),
    ("CoordSysTransform", Directive::Transform(TransformDirective::UseSystem)),
    ("ReverseOrientation", Directive::State(StateDirective::ReverseOrientation)),
    ("Attribute", Directive::State(StateDirective::Attribute)),
    ("ColorSpace", Directive::State(StateDirective::ColorSpace)),
    ("NamedMaterial", Directive::State(StateDirective::NamedMaterial)),
    ("MediumInterface", Directive::State(StateDirective::MediumInterface)),
    ("AttributeBegin", Directive::Open(Opening::Attribute)),
    ("AttributeEnd", Directive::Close(Opening::Attribute)),
    // Another name of the same in version 4.
    ("TransformBegin", Directive::Open(Opening::Attribute)),
    ("TransformEnd", Directive::Close(Opening::Attribute)),
    ("ObjectBegin", Directive::Open(Opening::Object)),
    ("ObjectEnd", Directive::Close(Opening::Object)),
    ("ObjectInstance", Directive::ObjectInstance),
    ("WorldBegin", Directive::WorldBegin),
    ("WorldEnd", Directive::WorldEnd),
    ("Include", Directive::Include),
    ("Import", Directive::Import),
    ("Texture", Directive::Texture),
    ("Material", Directive::Entity(Entity::Material)),
    ("MakeNamedMaterial", Directive::Entity(Entity::MakeNamedMaterial)),
    ("MakeNamedMedium", Directive::Entity(Entity::MakeNamedMedium)),
    ("LightSource", Directive::Entity(Entity::LightSource)),
    ("AreaLightSource", Directive::Entity(Entity::AreaLightSource)),
    ("Shape", Directive::Entity(Entity::Shape)),
    ("Camera", Directive::Entity(Entity::Camera)),
    ("Film", Directive::Entity(Entity::Film)),
    ("Option", Directive::Option),
    ("Integrator", Directive::Method(Method::Integrator)),
    ("Sampler", Directive::Method(Method::Sampler)),
    ("PixelFilter", Directive::Method(Method::PixelFilter)),
    ("Accelerator", Directive::Method(Method::Accelerator)),
];

/// Which part of a file a statement belongs to, as pbrt-v4 checks it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Part {
    /// What stands before `WorldBegin`: camera and film.
    Options,
    /// What stands behind it: the scene.
    World,
    Any,
}

impl Directive {
    fn named(word: &str) -> Option<Self> {
        DIRECTIVES.iter().find(|(name, _)| *name == word).map(|&(_, directive)| directive)
    }

    /// Where it has to stand. Integrator, sampler, filter and options may stand anywhere; pbrt wants them first.
    fn part(self) -> Part {
        match self {
            Self::WorldBegin | Self::Entity(Entity::Camera | Entity::Film) => Part::Options,
            Self::Transform(TransformDirective::Times) => Part::Options,
            Self::Open(_) | Self::Close(_) | Self::ObjectInstance | Self::Texture => Part::World,
            Self::State(StateDirective::ReverseOrientation | StateDirective::NamedMaterial) => Part::World,
            Self::Entity(Entity::MakeNamedMedium) => Part::Any,
            Self::Entity(_) => Part::World,
            Self::Transform(_) | Self::State(_) | Self::WorldEnd | Self::Include | Self::Import => Part::Any,
            Self::Option | Self::Method(_) => Part::Any,
        }
    }
}

impl Entity {
    /// Whether others refer to it by its name.
    fn is_named(self) -> bool {
        matches!(self, Self::MakeNamedMaterial | Self::MakeNamedMedium)
    }

    /// What `Attribute` calls it, if that may set defaults for it.
    fn attribute_target(self) -> Option<&'static str> {
        match self {
            Self::Material | Self::MakeNamedMaterial => Some("material"),
            Self::MakeNamedMedium => Some("medium"),
            Self::LightSource | Self::AreaLightSource => Some("light"),
            Self::Shape => Some("shape"),
            Self::Camera | Self::Film => None,
        }
    }
}

impl Reader<'_> {
    pub(super) fn read_file(&mut self, path: &Path) -> Result<(), LoadError> {
        let text = files::decode_text(path, files::read_unpacked(path)?)?;
        let outer = std::mem::replace(&mut self.file, path.to_owned());
        let mut lexer = Lexer::new(path, &text);
        while let Some((token, line)) = lexer.next()? {
            let Token::Word(word) = token else {
                return Err(LoadError::invalid_at(lexer.place(line), "expected a directive"));
            };
            self.directive(word, &mut lexer, line)?;
        }
        self.file = outer;
        Ok(())
    }

    fn directive(&mut self, word: &str, lexer: &mut Lexer, line: usize) -> Result<(), LoadError> {
        let Some(directive) = Directive::named(word) else {
            let known = DIRECTIVES.iter().map(|(name, _)| *name);
            let problem = format!("unknown directive {word}{}", suggestion(word, known));
            return Err(LoadError::invalid_at(lexer.place(line), problem));
        };
        self.check_part(word, directive, lexer.place(line))?;
        match directive {
            Directive::Transform(directive) => self.transform(directive, lexer, line)?,
            Directive::State(directive) => self.change_state(directive, lexer, line)?,
            Directive::Open(Opening::Object) => self.begin_object(lexer, line)?,
            Directive::Open(opening) => self.push(opening, lexer.place(line))?,
            Directive::Close(opening) => self.pop(opening, word, lexer.place(line))?,
            Directive::ObjectInstance => {
                let name = string(lexer, line)?;
                if self.scope != Scope::Definitions {
                    self.place_object(name, lexer.place(line))?;
                }
            }
            Directive::WorldBegin => self.begin_world()?,
            Directive::WorldEnd => {}
            Directive::Include => self.include(&string(lexer, line)?, lexer.place(line))?,
            Directive::Import => {
                let state = self.state.clone();
                self.include(&string(lexer, line)?, lexer.place(line))?;
                self.state = state;
            }
            Directive::Texture => self.texture(lexer, line)?,
            Directive::Entity(entity) => self.entity(entity, lexer, line)?,
            Directive::Option => self.option(lexer, line)?,
            Directive::Method(method) => self.method(method, lexer, line)?,
        }
        Ok(())
    }

    /// Refuses what stands on the wrong side of `WorldBegin`: it would be lost, or seen in the camera's transform.
    fn check_part(&self, word: &str, directive: Directive, place: Place) -> Result<(), LoadError> {
        let problem = match (directive.part(), self.in_world) {
            (Part::Options, true) if directive == Directive::WorldBegin => "there is a second WorldBegin".to_owned(),
            (Part::Options, true) => format!("{word} has to stand before WorldBegin"),
            (Part::World, false) => format!("{word} has to stand behind WorldBegin"),
            _ => return Ok(()),
        };
        Err(LoadError::invalid_at(place, problem))
    }

    /// Refuses a second thing of a kind and name, as pbrt-v4 does: the first would be lost.
    fn define(&mut self, kind: &'static str, name: &str, place: Place) -> Result<(), LoadError> {
        if self.defined.insert((kind, name.to_owned())) {
            return Ok(());
        }
        Err(LoadError::invalid_at(
            place,
            format_args!("there are two {kind}s of the name \"{name}\"; give each its own"),
        ))
    }

    fn change_state(&mut self, directive: StateDirective, lexer: &mut Lexer, line: usize) -> Result<(), LoadError> {
        match directive {
            StateDirective::ReverseOrientation => self.state.reverse_orientation ^= true,
            StateDirective::Attribute => self.attribute(lexer, line)?,
            StateDirective::ColorSpace => self.color_space(&string(lexer, line)?, lexer.place(line))?,
            StateDirective::NamedMaterial => {
                let name = string(lexer, line)?;
                if self.scope != Scope::Definitions {
                    let user = Parameters::none(lexer.place(line));
                    self.state.material = Some(self.named_material(&user, &name)?);
                }
            }
            StateDirective::MediumInterface => {
                let inside = string(lexer, line)?;
                let outside = match lexer.peek()? {
                    Some(Token::Quoted(_)) => string(lexer, line)?,
                    _ => inside.clone(),
                };
                let named = |name: String| Some(name).filter(|name| !name.is_empty());
                (self.state.inside_medium, self.state.outside_medium) = (named(inside), named(outside));
            }
        }
        Ok(())
    }

    fn attribute(&mut self, lexer: &mut Lexer, line: usize) -> Result<(), LoadError> {
        let target = string(lexer, line)?;
        if !ATTRIBUTE_TARGETS.contains(&target.as_str()) {
            let problem = format!("Attribute \"{target}\"{}", suggestion(&target, ATTRIBUTE_TARGETS));
            return Err(LoadError::invalid_at(lexer.place(line), problem));
        }
        let parameters = Parameters::read(lexer, line)?;
        self.state.attributes.entry(target).or_default().extend(parameters.into_list());
        Ok(())
    }

    fn color_space(&mut self, name: &str, place: Place) -> Result<(), LoadError> {
        if !["srgb", "rec2020", "dci-p3", "aces2065-1"].contains(&name) {
            let problem = format_args!("unknown colour space \"{name}\": srgb, rec2020, dci-p3 and aces2065-1 are");
            return Err(LoadError::invalid_at(place, problem));
        }
        if name != "srgb" {
            self.builder.note(format!("Colours of the space \"{name}\" are taken for Rec.709."));
        }
        Ok(())
    }

    fn begin_object(&mut self, lexer: &mut Lexer, line: usize) -> Result<(), LoadError> {
        let name = string(lexer, line)?;
        if self.current_object.is_some() {
            return Err(LoadError::invalid_at(lexer.place(line), "ObjectBegin inside an object"));
        }
        self.define("object", &name, lexer.place(line))?;
        self.push(Opening::Object, lexer.place(line))?;
        self.objects.insert(name.clone(), Vec::new());
        self.current_object = Some(name);
        Ok(())
    }

    fn begin_world(&mut self) -> Result<(), LoadError> {
        self.coordinate_systems.insert("world".to_owned(), Transforms::IDENTITY);
        self.place_camera()?;
        self.state.transforms = Transforms::IDENTITY;
        self.state.active = [true; 2];
        self.in_world = true;
        Ok(())
    }

    fn texture(&mut self, lexer: &mut Lexer, line: usize) -> Result<(), LoadError> {
        let (name, class, kind) = (string(lexer, line)?, string(lexer, line)?, string(lexer, line)?);
        let class = match class.as_str() {
            "spectrum" => "spectrum",
            "float" => "float",
            other => {
                let meant = if other == "color" { materials::UPGRADE } else { ": expected spectrum or float" };
                let problem = format!("texture \"{name}\" is of \"{other}\"{meant}");
                return Err(LoadError::invalid_at(lexer.place(line), problem));
            }
        };
        self.define(if class == "float" { "float texture" } else { "spectrum texture" }, &name, lexer.place(line))?;
        let parameters = self.parameters(lexer, line, Some("texture"))?;
        self.textures.insert((class, name), Rc::new(textures::Definition::new(&kind, parameters)));
        Ok(())
    }

    /// A name and one value, as pbrt-v4 has it, or a list of parameters.
    fn option(&mut self, lexer: &mut Lexer, line: usize) -> Result<(), LoadError> {
        let name = match lexer.peek()? {
            Some(Token::Quoted(name)) if !name.contains(char::is_whitespace) => name.to_string(),
            _ => {
                let user = Parameters::read(lexer, line)?;
                self.note_unread("Option", &user);
                return Ok(());
            }
        };
        lexer.next()?;
        parameters::read_values(lexer, line)?;
        self.builder.note(format!("{}: Option: not used: \"{name}\".", lexer.place(line)));
        Ok(())
    }

    fn method(&mut self, method: Method, lexer: &mut Lexer, line: usize) -> Result<(), LoadError> {
        string(lexer, line)?;
        let user = Parameters::read(lexer, line)?;
        if method == Method::Integrator {
            self.builder.note_depth(user.integer("maxdepth")?.unwrap_or(DEFAULT_DEPTH));
        }
        self.builder.note("Integrator, sampler, filter and accelerator are fechner's own, not the file's.");
        Ok(())
    }

    fn entity(&mut self, entity: Entity, lexer: &mut Lexer, line: usize) -> Result<(), LoadError> {
        let name = string(lexer, line)?;
        let parameters = self.parameters(lexer, line, entity.attribute_target())?;
        if self.scope == Scope::Definitions && !entity.is_named() {
            return Ok(());
        }
        match entity {
            Entity::Material => {
                let definition = materials::Definition { name: name.clone(), kind: name, parameters };
                self.state.material = Some(Rc::new(definition));
            }
            Entity::MakeNamedMaterial => {
                let kind = parameters.string("type")?.map(str::to_owned);
                let kind = kind.ok_or_else(|| parameters.error("a named material needs a \"string type\""))?;
                self.define("material", &name, parameters.place())?;
                let definition = materials::Definition { name: name.clone(), kind, parameters };
                self.named_materials.insert(name, Rc::new(definition));
            }
            Entity::MakeNamedMedium => {
                self.define("medium", &name, parameters.place())?;
                self.medium(&name, &parameters)?;
            }
            Entity::LightSource => {
                super::super::check_placed(&self.main, self.builder.placed() + 1)?;
                self.light(&name, &parameters)?;
            }
            Entity::AreaLightSource => {
                if name != "diffuse" {
                    return Err(
                        parameters.error(format_args!("unknown area light \"{name}\"; \"diffuse\" is the only one"))
                    );
                }
                self.state.area_light = Some(Rc::new(parameters));
            }
            Entity::Shape => {
                super::super::check_placed(&self.main, self.builder.placed() + 1)?;
                self.shape(&name, &parameters)?;
            }
            Entity::Camera => {
                if let Some(medium) = &self.state.outside_medium {
                    return Err(parameters.unsupported(format_args!(
                        "the camera stands in the medium \"{medium}\": a medium that fills the view is not rendered"
                    )));
                }
                self.coordinate_systems.insert("camera".to_owned(), self.state.transforms.inverse());
                self.camera = Some((name, parameters, self.state.transforms));
            }
            Entity::Film => self.film = Some((name, parameters)),
        }
        Ok(())
    }

    /// What follows a directive, with the defaults that `Attribute` has set for its target.
    fn parameters(&self, lexer: &mut Lexer, line: usize, target: Option<&str>) -> Result<Parameters, LoadError> {
        let parameters = Parameters::read(lexer, line)?;
        Ok(match target.and_then(|target| self.state.attributes.get(target)) {
            Some(defaults) => parameters.with_defaults(defaults),
            None => parameters,
        })
    }

    fn push(&mut self, opening: Opening, place: Place) -> Result<(), LoadError> {
        if self.stack.len() >= DEEPEST_STACK {
            return Err(LoadError::invalid_at(place, format_args!("attributes nested deeper than {DEEPEST_STACK}")));
        }
        self.stack.push(Saved { state: self.state.clone(), opening, place });
        Ok(())
    }

    fn pop(&mut self, opening: Opening, word: &str, place: Place) -> Result<(), LoadError> {
        let Some(Saved { state, opening: opened, .. }) = self.stack.pop() else {
            return Err(LoadError::invalid_at(place, format_args!("{word} without {}", opening.begin())));
        };
        if opened != opening {
            return Err(LoadError::invalid_at(place, format_args!("{word} closes what {} opened", opened.begin())));
        }
        self.state = state;
        if opening == Opening::Object {
            self.current_object = None;
        }
        Ok(())
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

    /// Places an object here, or at the file's end where it is not there yet: pbrt looks for it then.
    fn place_object(&mut self, name: String, place: Place) -> Result<(), LoadError> {
        if self.current_object.is_some() {
            return Err(LoadError::invalid_at(place, "an object cannot hold an instance of another"));
        }
        let use_of_object = UseOfObject { name, transforms: self.state.transforms, place };
        if self.objects.contains_key(&use_of_object.name) {
            return self.place_parts(&use_of_object);
        }
        super::super::check_placed(&self.main, self.builder.placed() + self.uses_ahead.len() + 1)?;
        self.uses_ahead.push(use_of_object);
        Ok(())
    }

    /// Places what was used before it was there.
    pub(super) fn place_objects_ahead(&mut self) -> Result<(), LoadError> {
        std::mem::take(&mut self.uses_ahead).iter().try_for_each(|use_of_object| self.place_parts(use_of_object))
    }

    fn place_parts(&mut self, use_of_object: &UseOfObject) -> Result<(), LoadError> {
        let UseOfObject { name, transforms, place } = use_of_object;
        let Some(parts) = self.objects.get(name) else {
            return Err(LoadError::invalid_at(place.clone(), no_such("object", name, self.objects.keys())));
        };
        super::super::check_placed(&self.main, self.builder.placed() + parts.len())?;
        let placed: Vec<_> = parts.iter().map(|part| shapes::place_part(self, part, transforms)).collect();
        self.builder.instances.extend(placed);
        Ok(())
    }
}

/// A string behind a directive.
pub(super) fn string(lexer: &mut Lexer, line: usize) -> Result<String, LoadError> {
    match lexer.next()? {
        Some((Token::Quoted(text), _)) => Ok(text.into_owned()),
        _ => Err(LoadError::invalid_at(lexer.place(line), "expected a string in quotes")),
    }
}
