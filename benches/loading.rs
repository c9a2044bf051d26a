//! How long a mesh of a million triangles takes from file to tree, over reading its bytes and building the tree alone.
//!
//! `cargo bench -p fechner --bench loading` (nothing else running: the ratios are of minima of several interleaved
//! rounds)

use fechner::geometry::World;
use fechner::scene::load::{LoadOptions, load};
use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Instant;

/// Squares along each side of a hilly grid: twice as many triangles as squares.
const SIDE: u32 = 708;
const ROUNDS: usize = 5;

struct Grid {
    positions: Vec<[f32; 3]>,
    triangles: Vec<[u32; 3]>,
}

fn grid() -> Grid {
    let mut positions = Vec::new();
    for y in 0..=SIDE {
        for x in 0..=SIDE {
            let (u, v) = (x as f32 / SIDE as f32, y as f32 / SIDE as f32);
            positions.push([u, 0.1 * (20.0 * u).sin() * (17.0 * v).cos(), v]);
        }
    }
    let mut triangles = Vec::new();
    for y in 0..SIDE {
        for x in 0..SIDE {
            let a = y * (SIDE + 1) + x;
            let b = a + SIDE + 1;
            triangles.extend([[a, b, a + 1], [a + 1, b, b + 1]]);
        }
    }
    Grid { positions, triangles }
}

fn ply_header(grid: &Grid, format: &str) -> String {
    format!(
        "ply\nformat {format} 1.0\nelement vertex {}\nproperty float x\nproperty float y\nproperty float z\n\
         element face {}\nproperty list uchar int vertex_indices\nend_header\n",
        grid.positions.len(),
        grid.triangles.len()
    )
}

fn binary_ply(grid: &Grid) -> Vec<u8> {
    let mut bytes = ply_header(grid, "binary_little_endian").into_bytes();
    grid.positions.iter().flatten().for_each(|v| bytes.extend(v.to_le_bytes()));
    for triangle in &grid.triangles {
        bytes.push(3);
        triangle.iter().for_each(|index| bytes.extend(index.to_le_bytes()));
    }
    bytes
}

fn ascii_ply(grid: &Grid) -> Vec<u8> {
    let mut text = ply_header(grid, "ascii");
    grid.positions.iter().for_each(|[x, y, z]| _ = writeln!(text, "{x} {y} {z}"));
    grid.triangles.iter().for_each(|[a, b, c]| _ = writeln!(text, "3 {a} {b} {c}"));
    text.into_bytes()
}

fn obj(grid: &Grid) -> Vec<u8> {
    let mut text = String::new();
    grid.positions.iter().for_each(|[x, y, z]| _ = writeln!(text, "v {x} {y} {z}"));
    grid.triangles.iter().for_each(|[a, b, c]| _ = writeln!(text, "f {} {} {}", a + 1, b + 1, c + 1));
    text.into_bytes()
}

fn glb(grid: &Grid) -> Vec<u8> {
    let mut binary = Vec::new();
    grid.positions.iter().flatten().for_each(|v| binary.extend(v.to_le_bytes()));
    let split = binary.len();
    grid.triangles.iter().flatten().for_each(|index| binary.extend(index.to_le_bytes()));
    let mut json = format!(
        r#"{{"asset":{{"version":"2.0"}},"scene":0,"scenes":[{{"nodes":[0]}}],"nodes":[{{"mesh":0}}],
"meshes":[{{"primitives":[{{"attributes":{{"POSITION":0}},"indices":1}}]}}],
"accessors":[{{"bufferView":0,"componentType":5126,"count":{},"type":"VEC3","min":[0,-1,0],"max":[1,1,1]}},
{{"bufferView":1,"componentType":5125,"count":{},"type":"SCALAR"}}],
"bufferViews":[{{"buffer":0,"byteLength":{split}}},{{"buffer":0,"byteOffset":{split},"byteLength":{}}}],
"buffers":[{{"byteLength":{}}}]}}"#,
        grid.positions.len(),
        3 * grid.triangles.len(),
        binary.len() - split,
        binary.len()
    );
    while !json.len().is_multiple_of(4) {
        json.push(' ');
    }
    let mut bytes = b"glTF".to_vec();
    let total = 12 + 8 + json.len() + 8 + binary.len();
    for word in [2, total as u32, json.len() as u32, 0x4E4F_534A] {
        bytes.extend(word.to_le_bytes());
    }
    bytes.extend(json.as_bytes());
    for word in [binary.len() as u32, 0x004E_4942] {
        bytes.extend(word.to_le_bytes());
    }
    bytes.extend(binary);
    bytes
}

/// Seconds of reading and building, and of loading and building.
fn measure(path: &Path) -> [f64; 2] {
    let start = Instant::now();
    let bytes = std::fs::read(path).expect("the file is there");
    let read = start.elapsed().as_secs_f64();
    std::hint::black_box(bytes);
    let start = Instant::now();
    let scene = load(path, &LoadOptions::default()).unwrap_or_else(|error| panic!("{error}"));
    let loaded = start.elapsed().as_secs_f64();
    let scene = Arc::new(scene);
    let start = Instant::now();
    std::hint::black_box(World::new(scene));
    let built = start.elapsed().as_secs_f64();
    [read + built, loaded + built]
}

fn main() {
    let grid = grid();
    println!("{} triangles", grid.triangles.len());
    let folder = tempfile::tempdir().expect("a folder");
    let cases: Vec<(&str, PathBuf, f64)> = [
        ("binary.ply", binary_ply(&grid), 1.5),
        ("grid.glb", glb(&grid), 1.5),
        ("grid.obj", obj(&grid), 3.0),
        ("ascii.ply", ascii_ply(&grid), 3.0),
    ]
    .into_iter()
    .map(|(name, bytes, most)| {
        let path = folder.path().join(name);
        std::fs::write(&path, bytes).expect("the file is written");
        (name, path, most)
    })
    .collect();
    let mut best = vec![[f64::INFINITY; 2]; cases.len()];
    for _ in 0..ROUNDS {
        for (best, (_, path, _)) in best.iter_mut().zip(&cases) {
            let seconds = measure(path);
            *best = [best[0].min(seconds[0]), best[1].min(seconds[1])];
        }
    }
    println!("file | read + build s | load + build s | ratio | wanted at most");
    for ((name, _, most), [base, total]) in cases.iter().zip(&best) {
        println!("{name} | {base:.3} | {total:.3} | {:.2} | {most}", total / base);
    }
}
