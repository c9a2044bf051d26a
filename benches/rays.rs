//! Rays per second of the tree, one thread, against Embree 3.13 (robust mode, one ray a call) on the same rays.
//!
//! `cargo bench --bench rays` writes the meshes and rays to `benches/cache/rays` and prints our own figures; `-- 1M`
//! measures that mesh alone. Embree joins if `benches/peers/embree/build.sh` was run before (it needs Debian's
//! `libembree-dev`): rounds of both alternate, seconds are the measuring thread's CPU time, the best round of each
//! counts, and the column `ratio` is ours over Embree's.

#[path = "support/mod.rs"]
mod support;

use anyhow::{Context, Result, bail};
use fechner::geometry::{Ray, World};
use fechner::integrator::{CameraRays, CameraSample};
use glam::{Vec2, Vec3, Vec3A};
use std::hint::black_box;
use std::io::{BufRead, BufReader, Write};
use std::path::{Path, PathBuf};
use std::process::{Child, ChildStdin, ChildStdout, Command, Stdio};
use std::sync::Arc;
use support::{CaveSize, CpuClock, cave_mesh, grey_scene};

const SIDE: u32 = 512;
const ROUNDS: usize = 7;

/// Rays of one kind. Shadow rays have a finite length and are asked for occlusion.
struct RaySet {
    name: &'static str,
    rays: Vec<(Ray, f32)>,
    any: bool,
}

/// What a pass over a set found: equal answers show that both did the same work.
#[derive(Clone, Copy, Default)]
struct Pass {
    seconds: f64,
    hits: u64,
    /// Sum of the hit distances.
    distance: f64,
}

fn main() -> Result<()> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let folder = root.join("benches/cache/rays");
    std::fs::create_dir_all(&folder)?;
    let program = root.join("benches/cache/embree-rays");
    println!("| mesh | rays | fechner M/s | Embree M/s | ratio | same hits |");
    println!("| --- | --- | --- | --- | --- | --- |");
    let mut notes = Vec::new();
    let only: Vec<String> = std::env::args().skip(1).filter(|word| !word.starts_with('-')).collect();
    for (name, size) in [("70k", CaveSize::SMALL), ("1M", CaveSize::LARGE)] {
        if !only.is_empty() && !only.iter().any(|word| word == name) {
            continue;
        }
        notes.push(bench_mesh(name, size, &folder, &program)?);
    }
    println!("\n| mesh | triangles | fechner build s | Embree build s | ratio | fechner tree MB | Embree MB | ratio |");
    println!("| --- | --- | --- | --- | --- | --- | --- | --- |");
    notes.iter().for_each(|note| println!("{note}"));
    Ok(())
}

/// Prints the rows of one mesh; returns its row of the second table.
fn bench_mesh(name: &str, size: CaveSize, folder: &Path, program: &Path) -> Result<String> {
    let mesh = cave_mesh(size);
    let scene = Arc::new(grey_scene(vec![mesh]));
    let one_thread = rayon::ThreadPoolBuilder::new().num_threads(1).build()?;
    let mut build_seconds = f64::INFINITY;
    let mut world = None;
    for _ in 0..3 {
        let seconds;
        (world, seconds) = one_thread.install(|| {
            let start = CpuClock::of_thread();
            let world = World::new(scene.clone());
            (Some(world), start.seconds())
        });
        build_seconds = build_seconds.min(seconds);
    }
    let world = world.context("built above")?;
    let mesh_file = folder.join(format!("{name}.mesh"));
    write_mesh(&mesh_file, &scene.meshes[0])?;
    let sets = ray_sets(&world);
    for set in &sets {
        write_rays(&ray_file(folder, name, set), set)?;
    }
    let mut embree = Embree::start(program, &mesh_file, &sets, folder, name)?;
    for (index, set) in sets.iter().enumerate() {
        let (mut ours, mut theirs) = (None, None);
        for _ in 0..ROUNDS {
            keep_faster(&mut ours, trace(&world, set));
            if let Some(embree) = &mut embree {
                keep_faster(&mut theirs, embree.trace(index)?);
            }
        }
        print_row(name, set, ours.unwrap_or_default(), theirs);
    }
    let triangles = scene.meshes[0].triangles.len();
    let megabytes = world.tree_bytes() as f64 / 1e6;
    Ok(match embree {
        Some(e) => format!(
            "| {name} | {triangles} | {build_seconds:.3} | {:.3} | {:.2} | {megabytes:.1} | {:.1} | {:.2} |",
            e.build_seconds,
            build_seconds / e.build_seconds,
            e.megabytes,
            megabytes / e.megabytes
        ),
        None => format!("| {name} | {triangles} | {build_seconds:.3} | | | {megabytes:.1} | | |"),
    })
}

fn keep_faster(best: &mut Option<Pass>, pass: Pass) {
    if best.is_none_or(|b| pass.seconds < b.seconds) {
        *best = Some(pass);
    }
}

fn print_row(mesh: &str, set: &RaySet, ours: Pass, theirs: Option<Pass>) {
    let rate = |pass: Pass| set.rays.len() as f64 / pass.seconds / 1e6;
    let Some(theirs) = theirs else {
        println!("| {mesh} | {} | {:.2} | | | |", set.name, rate(ours));
        return;
    };
    let apart = ours.hits.abs_diff(theirs.hits);
    println!(
        "| {mesh} | {} | {:.2} | {:.2} | **{:.2}** | {} of {} differ, mean distance {:+.1e} |",
        set.name,
        rate(ours),
        rate(theirs),
        rate(ours) / rate(theirs),
        apart,
        set.rays.len(),
        ours.distance / theirs.distance.max(1e-30) - 1.0,
    );
}

/// One pass of our own tree over a set.
fn trace(world: &World, set: &RaySet) -> Pass {
    let start = CpuClock::of_thread();
    let (mut hits, mut distance) = (0, 0.0);
    for (ray, t_max) in &set.rays {
        if set.any {
            hits += u64::from(world.occluded(black_box(ray), *t_max));
        } else if let Some(hit) = world.closest(black_box(ray)) {
            hits += 1;
            distance += f64::from(hit.distance);
        }
    }
    Pass { seconds: start.seconds(), hits, distance }
}

/// Camera rays; one cosine-distributed ray from each hit; one ray from each of their hits to a point of a square below
/// the roof. In pixel order, as a path tracer makes them.
fn ray_sets(world: &World) -> Vec<RaySet> {
    let camera = CameraRays::new(&world.scene().camera, SIDE, SIDE);
    let (mut primary, mut bounce, mut shadow) = (Vec::new(), Vec::new(), Vec::new());
    for pixel in 0..SIDE * SIDE {
        let place = Vec2::new((pixel % SIDE) as f32 + 0.5, (pixel / SIDE) as f32 + 0.5);
        let ray = camera.ray(&CameraSample { position_px: place, lens: [0.5, 0.5], time: 0.0 });
        primary.push((ray, f32::INFINITY));
        let Some(hit) = world.closest(&ray) else { continue };
        let point = world.surface(&ray, &hit);
        let direction = cosine_direction(facing(point.geometric_normal, &ray), uniform(pixel, 0), uniform(pixel, 1));
        let bounced = Ray::new(point.spawn(direction), direction.into());
        bounce.push((bounced, f32::INFINITY));
        let Some(hit) = world.closest(&bounced) else { continue };
        let point = world.surface(&bounced, &hit);
        let light = Vec3::new(0.6 * (uniform(pixel, 2) - 0.5), 0.85, 0.6 * (uniform(pixel, 3) - 0.5));
        let normal = facing(point.geometric_normal, &bounced);
        if (light - point.position).dot(normal) > 0.0 {
            let origin = point.spawn(normal);
            let way = Vec3A::from(light) - origin;
            shadow.push((Ray::new(origin, way.normalize()), way.length()));
        }
    }
    vec![
        RaySet { name: "primary", rays: primary, any: false },
        RaySet { name: "bounce", rays: bounce, any: false },
        RaySet { name: "shadow", rays: shadow, any: true },
    ]
}

/// A number in [0, 1) that looks random (the finaliser of SplitMix64: Steele, Lea and Flood 2014).
fn uniform(pixel: u32, dimension: u64) -> f32 {
    let mut x = (u64::from(pixel) << 8 | dimension).wrapping_mul(0x9e37_79b9_7f4a_7c15);
    x = (x ^ (x >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    x = (x ^ (x >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    (x >> 40) as f32 / 16_777_216.0
}

fn facing(normal: Vec3, ray: &Ray) -> Vec3 {
    if normal.dot(ray.direction.into()) > 0.0 { -normal } else { normal }
}

fn cosine_direction(normal: Vec3, u: f32, v: f32) -> Vec3 {
    let (x, y) = normal.any_orthonormal_pair();
    let (sin, cos) = (std::f32::consts::TAU * v).sin_cos();
    let radius = u.sqrt();
    (x * radius * cos + y * radius * sin + normal * (1.0 - u).sqrt()).normalize()
}

/// Counts of vertices and triangles, vertices, indices: all little-endian 32-bit words.
fn write_mesh(path: &Path, mesh: &fechner::scene::Mesh) -> Result<()> {
    let mut bytes = Vec::new();
    for count in [mesh.positions.len(), mesh.triangles.len()] {
        bytes.extend((count as u32).to_le_bytes());
    }
    bytes.extend(mesh.positions.iter().flat_map(|p| p.to_array()).flat_map(f32::to_le_bytes));
    bytes.extend(mesh.triangles.iter().flatten().flat_map(|i| i.to_le_bytes()));
    std::fs::write(path, bytes).with_context(|| path.display().to_string())
}

fn ray_file(folder: &Path, mesh: &str, set: &RaySet) -> PathBuf {
    folder.join(format!("{mesh}-{}.rays", set.name))
}

/// Eight floats a ray: origin, direction, length, and 1 where only occlusion is asked.
fn write_rays(path: &Path, set: &RaySet) -> Result<()> {
    let mut bytes = Vec::with_capacity(set.rays.len() * 32);
    for (ray, t_max) in &set.rays {
        let tail = [*t_max, f32::from(u8::from(set.any))];
        let words = ray.origin.to_array().into_iter().chain(ray.direction.to_array()).chain(tail);
        bytes.extend(words.flat_map(f32::to_le_bytes));
    }
    std::fs::write(path, bytes).with_context(|| path.display().to_string())
}

/// The Embree program, waiting for the number of a ray set on each line.
struct Embree {
    child: Child,
    ask: ChildStdin,
    answer: BufReader<ChildStdout>,
    build_seconds: f64,
    megabytes: f64,
}

impl Embree {
    /// `None` where the program was not built.
    fn start(program: &Path, mesh: &Path, sets: &[RaySet], folder: &Path, name: &str) -> Result<Option<Self>> {
        if !program.exists() {
            return Ok(None);
        }
        let mut child = Command::new(program)
            .arg(mesh)
            .args(sets.iter().map(|set| ray_file(folder, name, set)))
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .spawn()
            .with_context(|| program.display().to_string())?;
        let ask = child.stdin.take().context("stdin is piped")?;
        let answer = BufReader::new(child.stdout.take().context("stdout is piped")?);
        let mut embree = Self { child, ask, answer, build_seconds: 0.0, megabytes: 0.0 };
        [embree.build_seconds, embree.megabytes, _] = embree.read()?;
        Ok(Some(embree))
    }

    fn read(&mut self) -> Result<[f64; 3]> {
        let mut line = String::new();
        self.answer.read_line(&mut line)?;
        let words: Vec<f64> = line.split_whitespace().map(str::parse).collect::<Result<_, _>>()?;
        let Ok(words) = words.try_into() else { bail!("Embree answered `{line}`, not three numbers") };
        Ok(words)
    }

    fn trace(&mut self, set: usize) -> Result<Pass> {
        writeln!(self.ask, "{set}")?;
        self.ask.flush()?;
        let [seconds, hits, distance] = self.read()?;
        Ok(Pass { seconds, hits: hits as u64, distance })
    }
}

impl Drop for Embree {
    fn drop(&mut self) {
        // A line that is no number ends it; a child that is gone already is what we want too.
        let _ = writeln!(self.ask, "end");
        let _ = self.child.wait();
    }
}
