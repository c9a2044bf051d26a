//! What the speed benches share: scenes, and clocks that other programs' work does not advance.

#![allow(dead_code, reason = "each bench uses a part")]

pub(crate) mod peer;

use anyhow::Result;
use fechner::scene::load::{LoadOptions, load, shapes};
use fechner::scene::{
    Alpha, Camera, ColorInput, Encoding, FilmDefaults, Instance, Material, MaterialId, Mesh, MeshId, Scene, Surface,
    Texels, Texture, TextureId, TextureLookup, Wrap,
};
use glam::{Affine3A, Vec2, Vec3};
use rustix::time::{ClockId, clock_gettime};
use std::path::Path;
use std::sync::Arc;

/// CPU time: what other programs on the machine do does not count (their use of the caches does).
pub(crate) struct CpuClock {
    id: ClockId,
    start: f64,
}

impl CpuClock {
    /// Starts now, for the thread that asks.
    pub(crate) fn of_thread() -> Self {
        Self::start(ClockId::ThreadCPUTime)
    }

    /// Starts now, for all threads of this program.
    pub(crate) fn of_process() -> Self {
        Self::start(ClockId::ProcessCPUTime)
    }

    /// Seconds since the start.
    pub(crate) fn seconds(&self) -> f64 {
        Self::now(self.id) - self.start
    }

    fn start(id: ClockId) -> Self {
        Self { id, start: Self::now(id) }
    }

    fn now(id: ClockId) -> f64 {
        let time = clock_gettime(id);
        time.tv_sec as f64 + time.tv_nsec as f64 * 1e-9
    }
}

/// Those of our scenes that the command line names, all where it names none.
pub(crate) fn scenes_asked_for(names: &[&'static str]) -> Result<Vec<(&'static str, Arc<Scene>)>> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes");
    let wanted: Vec<String> = std::env::args().skip(1).filter(|argument| !argument.starts_with('-')).collect();
    let is_wanted = |name: &&str| wanted.is_empty() || wanted.iter().any(|wanted| wanted == name);
    let loaded = |name| Ok((name, Arc::new(load(&root.join(format!("{name}.toml")), &LoadOptions::default())?)));
    names.iter().copied().filter(is_wanted).map(loaded).collect()
}

/// How finely the cave is cut.
#[derive(Clone, Copy)]
pub(crate) struct CaveSize {
    /// Cells along each side of floor and roof.
    pub(crate) grid: u32,
    /// Segments around each boulder; it has half as many rings.
    pub(crate) segments: u32,
}

impl CaveSize {
    /// 70,000 triangles.
    pub(crate) const SMALL: Self = Self { grid: 75, segments: 22 };
    /// 100,000 triangles.
    pub(crate) const MEDIUM: Self = Self { grid: 90, segments: 26 };
    /// 1 million triangles.
    pub(crate) const LARGE: Self = Self { grid: 300, segments: 81 };
}

const BOULDERS: u32 = 100;

/// Height of the floor over the plane, in [-0.1, 0.1]: a few waves that do not repeat within the cave.
fn relief(x: f32, z: f32) -> f32 {
    0.04 * (7.0 * x + 3.0 * z).sin()
        + 0.03 * (11.0 * z - 5.0 * x).sin()
        + 0.015 * (23.0 * x).sin() * (29.0 * z).cos()
        + 0.005 * (61.0 * (x + z)).sin()
}

/// A number in [0, 1) for a place in a sequence (the fractional part of multiples of an irrational number).
fn spread(index: u32, irrational: f64) -> f32 {
    (f64::from(index + 1) * irrational).fract() as f32
}

/// Where the normals of a sheet point.
#[derive(Clone, Copy)]
enum Facing {
    /// Along the cross product of the ways that v and u run.
    Up,
    /// Against it.
    Down,
}

/// A mesh with outward, unit normals left out (flat shading) and texture coordinates.
fn grid_sheet(mesh: &mut Mesh, columns: u32, rows: u32, place: impl Fn(f32, f32) -> Vec3, facing: Facing) {
    let first = mesh.positions.len() as u32;
    for row in 0..=rows {
        for column in 0..=columns {
            let (u, v) = (column as f32 / columns as f32, row as f32 / rows as f32);
            mesh.positions.push(place(u, v));
            mesh.uvs.push(Vec2::new(u, v));
        }
    }
    for row in 0..rows {
        for column in 0..columns {
            let a = first + row * (columns + 1) + column;
            let (b, c, d) = (a + 1, a + columns + 1, a + columns + 2);
            let pair = match facing {
                Facing::Up => [[a, c, b], [b, c, d]],
                Facing::Down => [[a, b, c], [b, d, c]],
            };
            mesh.triangles.extend(pair);
        }
    }
}

/// The closed cave's surface: floor and roof over x, z in [-1, 1], four walls, and boulders that overlap floor and air.
pub(crate) fn cave_mesh(size: CaveSize) -> Mesh {
    let mut mesh = Mesh { name: "cave".to_owned(), ..Mesh::default() };
    let flat = |u: f32, v: f32| (2.0 * u - 1.0, 2.0 * v - 1.0);
    grid_sheet(
        &mut mesh,
        size.grid,
        size.grid,
        |u, v| {
            let (x, z) = flat(u, v);
            Vec3::new(x, relief(x, z), z)
        },
        Facing::Up,
    );
    grid_sheet(
        &mut mesh,
        size.grid,
        size.grid,
        |u, v| {
            let (x, z) = flat(u, v);
            Vec3::new(x, 1.0 + relief(z, x), z)
        },
        Facing::Down,
    );
    for (side, x, z) in [(0, -1.0, 0.0), (1, 1.0, 0.0), (2, 0.0, -1.0), (3, 0.0, 1.0)] {
        grid_sheet(
            &mut mesh,
            8,
            8,
            |u, v| {
                let along = 2.0 * u - 1.0;
                let y = -0.2 + 1.4 * v;
                if side < 2 { Vec3::new(x, y, along) } else { Vec3::new(along, y, z) }
            },
            Facing::Up,
        );
    }
    for boulder in 0..BOULDERS {
        let center = Vec3::new(
            1.8 * spread(boulder, 0.754_877_666) - 0.9,
            0.7 * spread(boulder, 0.569_840_291).powi(2),
            1.8 * spread(boulder, 0.618_033_989) - 0.9,
        );
        let radius = 0.04 + 0.08 * spread(boulder, 0.414_213_562);
        let phase = boulder as f32;
        grid_sheet(
            &mut mesh,
            size.segments,
            size.segments / 2,
            |u, v| {
                // The seam closes exactly: its last column is its first.
                let u = if u == 1.0 { 0.0 } else { u };
                let (sin_phi, cos_phi) = (std::f32::consts::TAU * u).sin_cos();
                let (sin_theta, cos_theta) = (std::f32::consts::PI * v).sin_cos();
                let direction = Vec3::new(sin_theta * cos_phi, cos_theta, -sin_theta * sin_phi);
                let bumps = (9.0 * direction.x + phase).sin() * (8.0 * direction.y).sin() * (7.0 * direction.z).cos();
                center + direction * (radius * (1.0 + 0.08 * bumps))
            },
            Facing::Up,
        );
    }
    mesh
}

/// A scene of meshes that are placed once as they are, all of one grey.
pub(crate) fn grey_scene(meshes: Vec<Mesh>) -> Scene {
    let instances = (0..meshes.len() as u32)
        .map(|mesh| Instance {
            name: String::new(),
            mesh: MeshId(mesh),
            material: MaterialId(0),
            to_world: Affine3A::IDENTITY,
            motion: None,
        })
        .collect();
    Scene {
        name: "cave".to_owned(),
        camera: Camera::pinhole(Vec3::new(-0.9, 0.6, 0.9), Vec3::new(0.9, -0.25, -0.9).normalize(), Vec3::Y, 60.0),
        film: FilmDefaults { width: 512, height: 512 },
        meshes,
        instances,
        materials: vec![Material {
            name: "grey".to_owned(),
            surface: Surface::Diffuse { reflectance: ColorInput::constant(Vec3::splat(0.5)) },
            emission: ColorInput::constant(Vec3::ZERO),
            emits_both_sides: false,
            relief: None,
            stretch: None,
            alpha: Alpha::Opaque,
        }],
        ..Scene::default()
    }
}

/// The Cornell box of `scenes/`, everything in it diffuse.
pub(crate) fn cornell_box() -> Result<Scene> {
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/cornell-box.toml");
    Ok(load(&file, &LoadOptions::default())?)
}

/// The cave of 100,000 triangles under a texture of 1024×1024 texels, lit by a lamp below its roof.
pub(crate) fn textured_cave() -> Scene {
    let lamp = shapes::rectangle(Vec3::new(-0.3, 0.85, -0.3), Vec3::X * 0.6, Vec3::Z * 0.6);
    let mut scene = grey_scene(vec![cave_mesh(CaveSize::MEDIUM), lamp]);
    let texels = (0..1024 * 1024u32)
        .map(|i| {
            let (x, y) = (i % 1024, i / 1024);
            let wave = |k: f32, phase: f32| (0.5 + 0.5 * (k * x as f32 + 0.7 * k * y as f32 + phase).sin()) * 120.0;
            let check = if (x / 16 + y / 16) % 2 == 0 { 90.0 } else { 40.0 };
            [(wave(0.02, 0.0) + check) as u8, (wave(0.03, 1.0) + check) as u8, (wave(0.05, 2.0) + check) as u8, 255]
        })
        .collect();
    scene.textures.push(Texture {
        name: "rock".to_owned(),
        width: 1024,
        height: 1024,
        texels: Texels::Bytes(Arc::new(texels), Encoding::Srgb),
        wrap_u: Wrap::Repeat,
        wrap_v: Wrap::Repeat,
        nearest: false,
    });
    let lookup = TextureLookup::plain(TextureId(0));
    scene.materials[0].surface =
        Surface::Diffuse { reflectance: ColorInput { factor: Vec3::ONE, texture: Some(lookup) } };
    scene.materials.push(Material {
        name: "lamp".to_owned(),
        surface: Surface::Diffuse { reflectance: ColorInput::constant(Vec3::ZERO) },
        emission: ColorInput::constant(Vec3::splat(10.0)),
        ..scene.materials[0].clone()
    });
    scene.instances[1].material = MaterialId(1);
    scene
}
