//! Reads `[[objects]]`: meshes from files, and the simple shapes.

use super::Context;
use super::fields::{Fields, Value};
use super::material::{Entry, Materials};
use super::motion;
use crate::scene::load::{LoadError, obj, shapes};
use crate::scene::{Alpha, ColorInput, Instance, MaterialId, Mesh, MeshId, Motion, Sphere};
use glam::{Affine3A, Vec2, Vec3};
use std::collections::HashMap;
use std::f64::consts::PI;
use std::path::PathBuf;

/// Reads objects; each mesh file is read once.
pub(super) struct Objects<'m, 'a> {
    materials: &'m Materials<'a>,
    /// By path and whether its own materials are used.
    files: HashMap<(PathBuf, bool), Vec<(MeshId, MaterialId)>>,
    read: usize,
    any_moves: bool,
    /// Of each object's motion.
    most_cuts: u32,
}

/// What every object has.
struct Placement {
    name: String,
    material: Option<Entry>,
    to_world: Affine3A,
    motion: Option<Motion>,
    /// Whether a sphere is one at all times.
    stays_round: bool,
    /// Whether it has keyframes, which may give it another size at other times.
    has_keyframes: bool,
}

impl<'m, 'a> Objects<'m, 'a> {
    /// A reader of the objects of a file, of which so many have keyframes.
    pub(super) fn new(materials: &'m Materials<'a>, moving: usize) -> Self {
        Self { materials, files: HashMap::new(), read: 0, any_moves: false, most_cuts: motion::most_cuts(moving) }
    }

    /// Whether an object that was read has keyframes.
    pub(super) fn any_moves(&self) -> bool {
        self.any_moves
    }

    /// Reads one object.
    pub(super) fn read(&mut self, context: &mut Context<'a>, value: &Value<'a>) -> Result<(), LoadError> {
        let kinds = ["mesh", "rectangle", "box", "sphere", "disk"];
        let fields = value.fields(&[
            "name",
            "material",
            "transform",
            "keyframes",
            "mesh",
            "rectangle",
            "box",
            "sphere",
            "disk",
        ])?;
        let (kind, shape) = fields.exactly_one(&kinds)?;
        self.read += 1;

        let mut to_world = fields.get_or("transform", Affine3A::IDENTITY, motion::transform)?;
        let (mut moves, mut stays_round) = (None, shapes::similarity_scale(&to_world).is_some());
        if let Some(keyframes) = fields.get_some("keyframes", motion::object_keyframes)? {
            self.any_moves = true;
            stays_round = keyframes.leave_spheres(to_world);
            moves = keyframes.motion(to_world, context.shutter, self.most_cuts);
            to_world = keyframes.at(context.shutter.opens) * to_world;
        }
        let placement = Placement {
            name: fields
                .get_some("name", |name| name.string().map(str::to_owned))?
                .unwrap_or(format!("{kind} {}", self.read)),
            material: fields.get_some("material", |name| self.materials.find(name))?,
            to_world,
            motion: moves,
            stays_round,
            has_keyframes: fields.get("keyframes").is_some(),
        };
        if kind == "mesh" {
            return self.place_file(context, &shape, placement);
        }
        if placement.material.is_none() {
            fields.require("material")?;
        }
        if kind == "sphere" {
            return place_sphere(context, &shape, &fields, placement);
        }
        let mut mesh = match kind {
            "rectangle" => rectangle(&shape)?,
            "box" => cuboid(&shape)?,
            _ => disk(&shape)?,
        };
        mesh.name.clone_from(&placement.name);
        place_mesh(context, mesh, &fields, placement)
    }

    fn place_file(&mut self, context: &mut Context<'a>, file: &Value, placement: Placement) -> Result<(), LoadError> {
        let path = context.folder.join(file.string()?);
        let is_obj = path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("obj"));
        if !is_obj {
            return Err(file.error("only .obj meshes can be placed in a .toml scene"));
        }
        let key = (path, placement.material.is_none());
        let parts = match self.files.get(&key) {
            Some(parts) => parts.clone(),
            None => {
                let wanted = if key.1 { obj::Wanted::WithMaterials } else { obj::Wanted::Meshes };
                let parts = obj::read_into(&mut context.builder, &key.0, wanted)
                    .map_err(|error| error.referenced_from(file.place()))?;
                self.files.insert(key, parts.clone());
                parts
            }
        };
        let material = match placement.material {
            None => None,
            Some(entry) => {
                let area = parts
                    .iter()
                    .map(|(mesh, _)| shapes::area(&context.builder.meshes[mesh.0 as usize], &placement.to_world));
                let area = area.sum();
                Some(with_power(context, entry, area, &placement, file)?)
            }
        };
        for (part, (mesh, own)) in parts.iter().enumerate() {
            let name =
                if parts.len() == 1 { placement.name.clone() } else { format!("{} ({})", placement.name, part + 1) };
            context.builder.instances.push(Instance {
                name,
                mesh: *mesh,
                material: material.unwrap_or(*own),
                to_world: placement.to_world,
                motion: placement.motion.clone(),
            });
        }
        Ok(())
    }
}

fn place_mesh(context: &mut Context, mesh: Mesh, fields: &Fields, placement: Placement) -> Result<(), LoadError> {
    let entry = placement.material.ok_or_else(|| fields.error("\"material\" is missing"))?;
    let area = shapes::area(&mesh, &placement.to_world);
    let material = with_power(context, entry, area, &placement, &fields.require("material")?)?;
    let mesh = context.builder.add_mesh(mesh);
    let Placement { name, to_world, motion, .. } = placement;
    context.builder.instances.push(Instance { name, mesh, material, to_world, motion });
    Ok(())
}

/// A sphere stays analytic if its transform leaves it a sphere at all times: what is a sphere in one frame and a mesh
/// in another would change the numbers of other objects, by which velocities know them.
fn place_sphere(context: &mut Context, shape: &Value, fields: &Fields, placement: Placement) -> Result<(), LoadError> {
    let own = shape.fields(&["center", "radius"])?;
    let center = own.require("center")?.vec3()?;
    let radius = own.require("radius")?.positive()? as f32;
    let entry = placement.material.ok_or_else(|| fields.error("\"material\" is missing"))?;
    if !placement.stays_round {
        let mut mesh = shapes::sphere(center, radius);
        mesh.name.clone_from(&placement.name);
        return place_mesh(context, mesh, fields, placement);
    }
    // Between keyframes of opposite scales it is a point for a moment, too small to be met.
    let scale = shapes::similarity_scale(&placement.to_world).unwrap_or(f32::MIN_POSITIVE / radius);
    let radius = radius * scale;
    let center = placement.to_world.transform_point3(center);
    if !(radius > 0.0 && radius.is_finite() && center.is_finite()) {
        return Err(shape.error("its transform leaves no finite sphere"));
    }
    let area = 4.0 * PI * f64::from(radius) * f64::from(radius);
    let material = with_power(context, entry, area, &placement, &fields.require("material")?)?;
    let motion = placement.motion.map(|motion| motion.since_open());
    let axes = Sphere::axes_of(&placement.to_world);
    context.builder.spheres.push(Sphere { name: placement.name, center, radius, axes, material, motion });
    Ok(())
}

/// The material; one that gives luminous power becomes the object's own, with the radiance for this area. A lamp that
/// is flat for a moment of its keyframes is dark then.
fn with_power(
    context: &mut Context,
    entry: Entry,
    area: f64,
    placement: &Placement,
    place: &Value,
) -> Result<MaterialId, LoadError> {
    let Some(power) = entry.power else {
        return Ok(entry.id);
    };
    let mut own = context.builder.materials[entry.id.0 as usize].clone();
    let name = &placement.name;
    let Some(share) = opaque_share(&own.alpha) else {
        let problem = "power_lm is not divided by what a picture of alpha leaves of an object: use emission_cd_m2";
        return Err(place.error(problem));
    };
    // A Lambertian emitter of luminance L gives π·L lumen per area and side.
    let sides = if own.emits_both_sides { 2.0 } else { 1.0 };
    let mut radiance = power.lumen / (PI * area * share * sides) / context.builder.nits_per_unit;
    if !(radiance as f32).is_finite() {
        if !placement.has_keyframes {
            return Err(place.error("power_lm needs an object with an area above 0"));
        }
        context
            .builder
            .note(format!("\"{name}\" has no area now, and its power_lm no place to shine from: it is dark."));
        context.has_flat_lamp = true;
        radiance = 0.0;
    }
    own.name = format!("{} of {name}", own.name);
    own.emission = ColorInput::constant(power.tint * radiance as f32);
    Ok(context.builder.add_material(own))
}

/// Share of a surface that is there, and 1 where nothing is, which emits nothing at any radiance; `None` where a
/// picture says.
fn opaque_share(alpha: &Alpha) -> Option<f64> {
    match alpha {
        Alpha::Mask { value, .. } | Alpha::Blend { value } if value.texture.is_some() => None,
        _ => Some(f64::from(alpha.coverage(&[], Vec2::ZERO))).map(|share| if share > 0.0 { share } else { 1.0 }),
    }
}

fn rectangle(shape: &Value) -> Result<Mesh, LoadError> {
    let fields = shape.fields(&["corner", "edge_u", "edge_v"])?;
    let [corner, u, v] =
        [fields.require("corner")?.vec3()?, fields.require("edge_u")?.vec3()?, fields.require("edge_v")?.vec3()?];
    if u.as_dvec3().cross(v.as_dvec3()).length_squared() == 0.0 {
        return Err(shape.error("edge_u and edge_v must span an area"));
    }
    Ok(shapes::rectangle(corner, u, v))
}

fn cuboid(shape: &Value) -> Result<Mesh, LoadError> {
    let fields = shape.fields(&["min", "max"])?;
    let [min, max]: [Vec3; 2] = [fields.require("min")?.vec3()?, fields.require("max")?.vec3()?];
    if !max.cmpgt(min).all() {
        return Err(shape.error(format_args!("each coordinate of max {max} must be above that of min {min}")));
    }
    Ok(shapes::cuboid(min, max))
}

fn disk(shape: &Value) -> Result<Mesh, LoadError> {
    let fields = shape.fields(&["center", "normal", "radius"])?;
    let radius = fields.require("radius")?.positive()? as f32;
    Ok(shapes::disk(fields.require("center")?.vec3()?, fields.require("normal")?.direction()?, radius))
}
