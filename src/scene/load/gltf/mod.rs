//! glTF 2.0 and GLB through the `gltf` crate's document, with buffers, accessors and images read by ourselves (see
//! [`buffers`]): its readers panic on damaged files.
//!
//! The first animation is played up to the time that the caller asks for; skins and morph targets bend the meshes of
//! that moment. While the shutter is open nodes and cameras go on, and the shapes of that moment with them.

mod animation;
mod buffers;
mod coordinates;
mod deform;
mod document;
mod extension;
mod instancing;
mod material;
mod motion;
mod textures;

use self::buffers::Buffers;
use self::material::Materials;
use super::builder::{Builder, IfDark, NamedCamera};
use super::error::LoadError;
use super::framing::Framing;
use super::{LoadOptions, Shutter, files};
use crate::scene::{Camera, Instance, Light, MaterialId, Mesh, MeshId, Motion, Projection, Scene, SpotFalloff};
use ::gltf::mesh::{Mode, Semantic};
use glam::{Affine3A, Mat4, Vec2, Vec3, Vec4};
use std::collections::HashMap;
use std::path::Path;

/// Deepest chain of nodes; the recursion would otherwise end at the stack's size.
const DEEPEST_NODE: usize = 256;
/// Most placed nodes: one below many parents is placed once for each.
const MAX_NODES: usize = 4_000_000;

/// Width over height, or the inverse, beyond which a camera's aspect is taken for a slip.
const MAX_OBLONG: f32 = 100.0;

/// Reads a glTF or GLB file.
pub(super) fn load(path: &Path, options: &LoadOptions) -> Result<Scene, LoadError> {
    read(path, options)?.finish(path, IfDark::Studio, options)
}

fn read(path: &Path, options: &LoadOptions) -> Result<Builder, LoadError> {
    let bytes = files::read(path)?;
    let container = buffers::split(path, &bytes)?;
    let mut builder = Builder::new(path, options);
    builder.tangents_follow_maps = true;
    let document = document::parse(path, container.json, &mut builder)?;
    let buffers = Buffers::read(path, &document, container.binary)?;

    let Some(scene) = document.default_scene().or_else(|| document.scenes().next()) else {
        return Err(LoadError::invalid(path, "nothing to render: the file has no scene"));
    };
    let mut reader = Reader {
        path,
        document: &document,
        buffers: &buffers,
        materials: Materials::new(path, &document, &buffers),
        meshes: HashMap::new(),
        ancestors: Vec::new(),
        moments: motion::moments(
            path,
            &document,
            &buffers,
            Shutter { opens: options.frame_time, stays_open: options.shutter_s },
        )?,
        placed: Vec::new(),
        world: HashMap::new(),
        builder: &mut builder,
    };
    for node in scene.nodes() {
        reader.walk(node, &vec![Mat4::IDENTITY; reader.moments.len()])?;
    }
    // Skins need the places of all nodes first.
    for (node, matrices) in std::mem::take(&mut reader.placed) {
        reader.node(&node, &matrices)?;
    }
    if let Some(first) = document.animations().next() {
        builder.at_another_time = Some(read);
        builder.shutter_s = options.shutter_s;
        let count = document.animations().count();
        let name = first.name().map_or_else(String::new, |name| format!(" \"{name}\""));
        let blur = match options.shutter_s > 0.0 {
            true => format!(
                "the shutter stays open for {} s, in which skins, the shapes of morph targets and lights rest",
                options.shutter_s
            ),
            false => "nothing blurs, since no side file gives the camera a shutter_s".to_owned(),
        };
        builder.note(format!("Animation{name} (1 of {count}) at {} s; {blur}.", options.frame_time));
    }
    Ok(builder)
}

struct Reader<'a> {
    path: &'a Path,
    document: &'a ::gltf::Document,
    buffers: &'a Buffers,
    materials: Materials<'a>,
    /// Meshes and materials of a mesh's primitives that are rendered, by its index.
    meshes: HashMap<usize, Vec<(MeshId, MaterialId)>>,
    /// Nodes above the current one.
    ancestors: Vec<usize>,
    /// At least one, the first when the shutter opens.
    moments: Vec<motion::Moment>,
    /// Every node with its transform at each of the moments, in the order of the file.
    placed: Vec<(::gltf::Node<'a>, Vec<Mat4>)>,
    /// Those when the shutter opens, by index: where joints are.
    world: HashMap<usize, Mat4>,
    builder: &'a mut Builder,
}

impl<'a> Reader<'a> {
    /// Notes where a node and all below it are.
    fn walk(&mut self, node: ::gltf::Node<'a>, parents: &[Mat4]) -> Result<(), LoadError> {
        if self.ancestors.contains(&node.index()) {
            return Err(LoadError::invalid(self.path, format_args!("node {} is its own ancestor", node.index())));
        }
        if self.ancestors.len() >= DEEPEST_NODE {
            return Err(LoadError::invalid(self.path, format_args!("nodes nested deeper than {DEEPEST_NODE}")));
        }
        if self.placed.len() >= MAX_NODES {
            return Err(LoadError::too_large(self.path, format_args!("more than {MAX_NODES} placed nodes")));
        }
        let posed = self.moments.iter().zip(parents);
        let matrices: Vec<Mat4> =
            posed.map(|(moment, parent)| *parent * animation::local(&node, &moment.pose)).collect();
        self.world.insert(node.index(), matrices[0]);
        self.ancestors.push(node.index());
        let place = self.placed.len();
        self.placed.push((node.clone(), Vec::new()));
        for child in node.children() {
            self.walk(child, &matrices)?;
        }
        self.placed[place].1 = matrices;
        self.ancestors.pop();
        Ok(())
    }

    /// Places what a node holds, by its transform at each of the moments.
    fn node(&mut self, node: &::gltf::Node<'a>, matrices: &[Mat4]) -> Result<(), LoadError> {
        let to_world = Affine3A::from_mat4(matrices[0]);
        let name = node.name().map_or_else(|| format!("node {}", node.index()), str::to_owned);
        if let Some(mesh) = node.mesh() {
            self.place(node, &mesh, &name, matrices)?;
        }
        if let Some(camera) = node.camera() {
            self.camera(&camera, &name, &to_world, motion::of_camera(&self.moments, matrices));
        }
        if let Some(light) = node.light() {
            self.light(&light, &name, &to_world);
        }
        Ok(())
    }

    /// Places a node's mesh, once or as often as its instances say.
    fn place(
        &mut self,
        node: &::gltf::Node<'a>,
        mesh: &::gltf::Mesh,
        name: &str,
        matrices: &[Mat4],
    ) -> Result<(), LoadError> {
        let animated = self.moments[0].pose.get(&node.index()).and_then(|posed| posed.weights.clone());
        let weights = animated.or(node.weights().map(<[f32]>::to_vec)).or(mesh.weights().map(<[f32]>::to_vec));
        let weights = weights.unwrap_or_default();
        let is_deformed = node.skin().is_some() || weights.iter().any(|weight| *weight != 0.0);
        let parts = if is_deformed { self.deformed(node, mesh, name, &weights)? } else { self.at_rest(mesh)? };
        let places = instancing::places(self.document, self.buffers, node)?;
        if node.skin().is_some() {
            if places.is_some() {
                self.builder.note(format!("\"{name}\" has a skin and instances: it is placed once, by its skin."));
            }
            // A skin's vertices are in world space already: the node's own transform does not count.
            return self.place_parts(&parts, name, Affine3A::IDENTITY, None);
        }
        for place in places.unwrap_or_else(|| vec![Mat4::IDENTITY]) {
            let matrices: Vec<Mat4> = matrices.iter().map(|matrix| *matrix * place).collect();
            let motion = motion::through(&self.moments, &matrices);
            let to_world = match &motion {
                Some(appears) if !motion::is_there(&matrices[0]) => appears.at(0.0),
                _ => Affine3A::from_mat4(matrices[0]),
            };
            self.place_parts(&parts, name, to_world, motion)?;
        }
        Ok(())
    }

    /// A mesh as it is in the file, the same for all nodes that place it.
    fn at_rest(&mut self, mesh: &::gltf::Mesh) -> Result<Vec<(MeshId, MaterialId)>, LoadError> {
        if let Some(parts) = self.meshes.get(&mesh.index()) {
            return Ok(parts.clone());
        }
        let mut parts = Vec::new();
        for primitive in mesh.primitives() {
            if let Some(converted) = self.primitive(mesh, &primitive)? {
                let material = self.materials.get(self.builder, &primitive.material())?;
                self.note_missing_coordinates(&converted, material);
                let mesh = self.builder.add_mesh(converted);
                if primitive.morph_targets().next().is_some() {
                    self.builder.deforming.insert(mesh);
                }
                parts.push((mesh, material));
            }
        }
        self.meshes.insert(mesh.index(), parts.clone());
        Ok(parts)
    }

    /// A mesh with a shape of its own: morphed, skinned or both.
    fn deformed(
        &mut self,
        node: &::gltf::Node,
        mesh: &::gltf::Mesh,
        name: &str,
        weights: &[f32],
    ) -> Result<Vec<(MeshId, MaterialId)>, LoadError> {
        let joints = node.skin().map(|skin| deform::joints(self.buffers, &skin, name, &self.world)).transpose()?;
        let mut parts = Vec::new();
        for primitive in mesh.primitives() {
            let Some(mut converted) = self.primitive(mesh, &primitive)? else { continue };
            deform::morph(self.buffers, &primitive, weights, &mut converted)?;
            if let Some(joints) = &joints {
                deform::skin(self.buffers, &primitive, joints, &mut converted)?;
            }
            let material = self.materials.get(self.builder, &primitive.material())?;
            self.note_missing_coordinates(&converted, material);
            let mesh = self.builder.add_mesh(converted);
            self.builder.deforming.insert(mesh);
            parts.push((mesh, material));
        }
        Ok(parts)
    }

    fn note_missing_coordinates(&mut self, mesh: &Mesh, material: MaterialId) {
        if mesh.uvs.is_empty() && self.builder.materials[material.0 as usize].reads_pictures() {
            let note = format!("\"{}\" has no texture coordinates: of its pictures it has one point alone.", mesh.name);
            self.builder.note(note);
        }
    }

    fn place_parts(
        &mut self,
        parts: &[(MeshId, MaterialId)],
        name: &str,
        to_world: Affine3A,
        motion: Option<Motion>,
    ) -> Result<(), LoadError> {
        super::check_placed(self.path, self.builder.placed() + parts.len())?;
        self.builder.instances.extend(parts.iter().map(|&(mesh, material)| Instance {
            name: name.to_owned(),
            mesh,
            material,
            to_world,
            motion: motion.clone(),
        }));
        Ok(())
    }

    fn primitive(&mut self, mesh: &::gltf::Mesh, from: &::gltf::Primitive) -> Result<Option<Mesh>, LoadError> {
        let name = mesh.name().map_or_else(|| format!("mesh {}", mesh.index()), str::to_owned);
        if matches!(from.mode(), Mode::Points | Mode::Lines | Mode::LineLoop | Mode::LineStrip) {
            self.builder.note(format!("\"{name}\": points and lines are not rendered."));
            return Ok(None);
        }
        let Some(positions) = from.get(&Semantic::Positions) else {
            self.builder.note(format!("\"{name}\" has no positions and is left out."));
            return Ok(None);
        };
        let positions: Vec<Vec3> = self.buffers.floats(&positions)?.into_iter().map(Vec3::from_array).collect();
        let vertices = positions.len();
        let normals = self.attribute::<3>(from, &Semantic::Normals, &name, vertices)?;
        let set = coordinates::set_of(self.document, &from.material(), &name, self.builder)
            .map_err(|error| LoadError::invalid(self.path, format_args!("\"{name}\": its material: {error}")))?;
        let uvs = self.attribute(from, &Semantic::TexCoords(set), &name, vertices)?;
        // Tangents mean nothing without normals.
        let tangents = match normals.is_empty() {
            true => Vec::new(),
            false => self.attribute(from, &Semantic::Tangents, &name, vertices)?,
        };
        let colors = self.colors(from, &name, vertices)?;
        let indices = match from.indices() {
            Some(accessor) => self.buffers.indices(&accessor)?,
            None => (0..positions.len() as u32).collect(),
        };
        if let Some(index) = indices.iter().find(|&&index| index as usize >= positions.len()) {
            let problem = format!("\"{name}\" has {} vertices, but index {index} is used", positions.len());
            return Err(LoadError::invalid(self.path, problem));
        }
        Ok(Some(Mesh {
            name,
            positions,
            normals: normals.into_iter().map(Vec3::from_array).collect(),
            uvs: uvs.into_iter().map(Vec2::from_array).collect(),
            tangents: tangents.into_iter().map(Vec4::from_array).collect(),
            colors,
            triangles: triangles(&indices, from.mode()),
        }))
    }

    /// An attribute of every vertex; empty where the primitive has none.
    fn attribute<const N: usize>(
        &self,
        from: &::gltf::Primitive,
        semantic: &Semantic,
        mesh: &str,
        vertices: usize,
    ) -> Result<Vec<[f32; N]>, LoadError> {
        let Some(accessor) = from.get(semantic) else { return Ok(Vec::new()) };
        self.buffers.of_vertices(&accessor, &semantic.to_string(), mesh, vertices)
    }

    /// Linear colours of vertices, without their alpha.
    fn colors(&mut self, from: &::gltf::Primitive, name: &str, vertices: usize) -> Result<Vec<Vec3>, LoadError> {
        let semantic = Semantic::Colors(0);
        if from.get(&semantic).is_none_or(|accessor| accessor.dimensions().multiplicity() != 4) {
            return Ok(self.attribute(from, &semantic, name, vertices)?.into_iter().map(Vec3::from_array).collect());
        }
        let colors = self.attribute(from, &semantic, name, vertices)?;
        let colors: Vec<Vec4> = colors.into_iter().map(Vec4::from_array).collect();
        if colors.iter().any(|color| color.w < 1.0) {
            self.builder.note(format!("\"{name}\": the alpha of its vertex colours is not used."));
        }
        Ok(colors.into_iter().map(Vec4::truncate).collect())
    }

    fn camera(&mut self, camera: &::gltf::Camera, node: &str, to_world: &Affine3A, motion: Option<Motion>) {
        let (name, holder) = match camera.name() {
            Some(name) => (name.to_owned(), Some(node.to_owned())),
            None => (node.to_owned(), None),
        };
        let position = Vec3::from(to_world.translation);
        let (projection, aspect, usable) = match camera.projection() {
            ::gltf::camera::Projection::Perspective(perspective) => {
                let vertical_fov_deg = perspective.yfov().to_degrees();
                let usable = Camera::FOV_DEG.contains(&f64::from(vertical_fov_deg));
                (Projection::Perspective { vertical_fov_deg }, perspective.aspect_ratio(), usable)
            }
            ::gltf::camera::Projection::Orthographic(parallel) => {
                let height = 2.0 * parallel.ymag();
                let aspect = Some(parallel.xmag() / parallel.ymag());
                (Projection::Orthographic { height }, aspect, height > 0.0 && height.is_finite())
            }
        };
        let aspect = aspect.filter(|aspect| (MAX_OBLONG.recip()..=MAX_OBLONG).contains(aspect));
        let axes =
            axes(to_world).filter(|axes| usable && position.is_finite() && Camera::axes_span(axes.forward, axes.up));
        let Some(Axes { forward, up }) = axes else {
            self.builder.note(format!("Camera \"{name}\" is left out: its transform, angle or height is not usable."));
            return;
        };
        let framing = aspect.map_or(Framing::Fixed, Framing::Stated);
        let camera = Camera { motion, ..Camera::placed(position, forward, up, projection) };
        self.builder.cameras.push(NamedCamera { name, holder, camera, framing });
    }

    fn light(&mut self, light: &::gltf::khr_lights_punctual::Light, node: &str, to_world: &Affine3A) {
        use ::gltf::khr_lights_punctual::Kind;
        let strength = Vec3::from_array(light.color()) * light.intensity() / self.builder.nits_per_unit as f32;
        let position = Vec3::from(to_world.translation);
        let direction = match (light.kind(), axes(to_world)) {
            (Kind::Point, None) => Some(Vec3::NEG_Z),
            (_, axes) => axes.map(|axes| axes.forward),
        };
        let Some(direction) = direction.filter(|_| strength.is_finite() && position.is_finite()) else {
            self.builder
                .note(format!("The light at \"{node}\" is left out: its place, direction or strength is not usable."));
            return;
        };
        if strength.min_element() < 0.0 {
            self.builder.note("Light below 0 is taken as 0: a light has a negative intensity or colour.");
        }
        let strength = strength.max(Vec3::ZERO);
        if light.range().is_some() && !matches!(light.kind(), Kind::Directional) {
            self.builder.note("The range of lights is not rendered: they go on by the inverse square of the distance.");
        }
        self.builder.lights.push(match light.kind() {
            Kind::Directional => {
                Light::Directional { direction, irradiance: strength, angular_radius: 0.0, is_of_sky: false }
            }
            Kind::Point => Light::Point { position, intensity: strength },
            Kind::Spot { inner_cone_angle, outer_cone_angle } => {
                let quarter = std::f32::consts::FRAC_PI_2;
                let outer = if outer_cone_angle > 0.0 { outer_cone_angle.min(quarter) } else { quarter / 2.0 };
                let inner = if inner_cone_angle >= 0.0 { inner_cone_angle.min(outer) } else { 0.0 };
                Light::Spot {
                    position,
                    direction,
                    intensity: strength,
                    inner_angle: inner,
                    outer_angle: outer,
                    falloff: SpotFalloff::Squared,
                }
            }
        });
    }
}

/// Where a node looks, and what is above it: along its own −z and y.
struct Axes {
    forward: Vec3,
    up: Vec3,
}

/// A node's axes, of length 1. Scale means nothing to cameras and lights: an axis that it takes away is perpendicular
/// to both others.
fn axes(to_world: &Affine3A) -> Option<Axes> {
    let [x, y, z] = [Vec3::X, Vec3::Y, Vec3::Z].map(|axis| to_world.transform_vector3(axis).try_normalize());
    let z = z.or_else(|| x?.cross(y?).try_normalize())?;
    let up = y.or_else(|| z.cross(x?).try_normalize())?;
    Some(Axes { forward: -z, up })
}

/// The triangles of lists, strips and fans; an incomplete last one is dropped.
fn triangles(indices: &[u32], mode: Mode) -> Vec<[u32; 3]> {
    match mode {
        Mode::TriangleStrip => {
            let flip = |(place, three): (usize, &[u32])| match place % 2 {
                0 => [three[0], three[1], three[2]],
                _ => [three[1], three[0], three[2]],
            };
            indices.windows(3).enumerate().map(flip).collect()
        }
        Mode::TriangleFan => indices.windows(2).skip(1).map(|pair| [indices[0], pair[0], pair[1]]).collect(),
        _ => indices.as_chunks::<3>().0.to_vec(),
    }
}
