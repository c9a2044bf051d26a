//! Directives: what each does to the state, and which file is read next.

use super::super::error::{LoadError, Place, suggestion};
use super::super::files;
use super::lexer::{Lexer, Token};
use super::parameters::Parameters;
use super::state::{self, DEEPEST_STACK, Transforms};
use super::{MOST_INSTANCES, Reader, materials, shapes, textures};
use glam::{DMat4, DQuat, DVec3};
use std::path::Path;
use std::rc::Rc;

/// Deepest chain of includes.
const DEEPEST_INCLUDE: usize = 32;
/// What `Attribute` may set defaults of.
const ATTRIBUTE_TARGETS: [&str; 5] = ["shape", "light", "material", "medium", "texture"];
/// Scatterings of pbrt's paths where the file does not say.
const DEFAULT_DEPTH: i64 = 5;

impl Reader<'_> {
    pub(super) fn read_file(&mut self, path: &Path) -> Result<(), LoadError> {
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
                self.times = [start, end];
            }
            "ActiveTransform" => {
                self.builder.at_another_time = Some(super::read);
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
                if !ATTRIBUTE_TARGETS.contains(&target.as_str()) {
                    let problem = format!("Attribute \"{target}\"{}", suggestion(&target, ATTRIBUTE_TARGETS));
                    return Err(LoadError::invalid_at(lexer.place(line), problem));
                }
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
            "Include" => self.include(&string(lexer, line)?, lexer.place(line))?,
            "Import" => {
                let state = self.state.clone();
                self.include(&string(lexer, line)?, lexer.place(line))?;
                self.state = state;
            }
            "ColorSpace" => {
                let name = string(lexer, line)?;
                if !["srgb", "rec2020", "dci-p3", "aces2065-1"].contains(&name.as_str()) {
                    return Err(LoadError::invalid_at(
                        lexer.place(line),
                        format_args!("unknown colour space \"{name}\": srgb, rec2020, dci-p3 and aces2065-1 are"),
                    ));
                }
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
                        let meant = if other == "color" { materials::UPGRADE } else { ": expected spectrum or float" };
                        let problem = format!("texture \"{name}\" is of \"{other}\"{meant}");
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
                let user = Parameters::read(lexer, line)?;
                if directive == "Integrator" {
                    self.builder.note_depth(user.integer("maxdepth")?.unwrap_or(DEFAULT_DEPTH));
                }
                self.builder.note("Integrator, sampler, filter and accelerator are fechner's own, not the file's.");
            }
            other => {
                let known = [
                    "Shape",
                    "Texture",
                    "Material",
                    "NamedMaterial",
                    "AttributeBegin",
                    "AttributeEnd",
                    "LightSource",
                    "AreaLightSource",
                    "Transform",
                    "Translate",
                    "Rotate",
                    "Scale",
                    "WorldBegin",
                    "Include",
                    "Camera",
                    "Film",
                ];
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
                    return Err(
                        parameters.error(format_args!("unknown area light \"{name}\"; \"diffuse\" is the only one"))
                    );
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
