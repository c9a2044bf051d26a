//! A scene written down for Mitsuba 3, and Mitsuba as a child process that renders it when asked.
//!
//! Diffuse, smooth conductor and smooth dielectric surfaces, textures on the diffuse ones, meshes and spheres that
//! emit: what both renderers mean the same thing by. Anything else is refused.

use anyhow::{Context, Result, bail};
use fechner::scene::{ColorInput, Encoding, Material, Projection, Scene, Surface, Texels};
use glam::Vec3;
use serde_json::{Value, json};
use std::io::{BufRead, BufReader, Write};
use std::path::{Path, PathBuf};
use std::process::{Child, ChildStdin, ChildStdout, Command, Stdio};

/// Scattering events that paths may have in both renderers. Mitsuba counts the camera's segment too.
pub(crate) const MAX_DEPTH: u32 = 8;

/// Python with Mitsuba: `FECHNER_MITSUBA_PYTHON`, or `python3`.
fn python() -> String {
    std::env::var("FECHNER_MITSUBA_PYTHON").unwrap_or_else(|_| "python3".to_owned())
}

/// Writes `scene.json` and the meshes and textures it names into a folder.
pub(crate) fn write_scene(scene: &Scene, folder: &Path) -> Result<()> {
    std::fs::create_dir_all(folder)?;
    let mut shapes = Vec::new();
    for (number, instance) in scene.instances.iter().enumerate() {
        let file = folder.join(format!("{number}.ply"));
        let mesh = &scene.meshes[instance.mesh.0 as usize];
        let corners: Vec<Vec3> = mesh.positions.iter().map(|p| instance.to_world.transform_point3(*p)).collect();
        if !mesh.normals.is_empty() {
            bail!("mesh `{}` has vertex normals: only flat ones are compared", mesh.name);
        }
        write_ply(&file, &corners, mesh)?;
        let material = material(scene, &scene.materials[instance.material.0 as usize], folder)?;
        shapes.push(json!({ "ply": file, "material": material }));
    }
    for sphere in &scene.spheres {
        let material = material(scene, &scene.materials[sphere.material.0 as usize], folder)?;
        let center = sphere.center.to_array();
        shapes.push(json!({ "center": center, "radius": sphere.radius, "material": material }));
    }
    let camera = &scene.camera;
    let Projection::Perspective { vertical_fov_deg } = camera.projection else {
        bail!("the peer's script knows perspective cameras only");
    };
    let description = json!({
        "origin": camera.position.to_array(),
        "target": (camera.position + camera.forward).to_array(),
        "up": camera.up.to_array(),
        "vertical_fov_deg": vertical_fov_deg,
        "max_depth": MAX_DEPTH + 1,
        "shapes": shapes,
    });
    std::fs::write(folder.join("scene.json"), serde_json::to_vec_pretty(&description)?)?;
    Ok(())
}

fn material(scene: &Scene, material: &Material, folder: &Path) -> Result<Value> {
    let surface = match &material.surface {
        Surface::Diffuse { reflectance } => json!({ "diffuse": color(scene, reflectance, folder)? }),
        Surface::Conductor { eta, k, roughness, tint }
            if roughness.is_smooth() && *tint == ColorInput::constant(Vec3::ONE) =>
        {
            json!({ "eta": eta.to_array(), "k": k.to_array() })
        }
        Surface::Dielectric { ior, roughness, transmittance, absorption }
            if roughness.is_smooth()
                && *transmittance == ColorInput::constant(Vec3::ONE)
                && *absorption == Vec3::ZERO =>
        {
            json!({ "ior": ior })
        }
        _ => bail!("material `{}` is none that is compared", material.name),
    };
    Ok(json!({ "surface": surface, "emission": material.emission.factor.to_array() }))
}

fn color(scene: &Scene, input: &ColorInput, folder: &Path) -> Result<Value> {
    let Some(lookup) = &input.texture else { return Ok(json!(input.factor.to_array())) };
    let texture = &scene.textures[lookup.texture.0 as usize];
    let Texels::Bytes(texels, Encoding::Srgb) = &texture.texels else { bail!("only sRGB textures are compared") };
    if input.factor != Vec3::ONE {
        bail!("only textures without a factor are compared");
    }
    let file = folder.join(format!("texture-{}.png", lookup.texture.0));
    let bytes = texels.iter().flat_map(|&[r, g, b, _]| [r, g, b]).collect();
    image::RgbImage::from_raw(texture.width, texture.height, bytes).context("a texel a pixel")?.save(&file)?;
    Ok(json!(file))
}

/// Binary little-endian PLY with texture coordinates where there are some.
fn write_ply(path: &Path, corners: &[Vec3], mesh: &fechner::scene::Mesh) -> Result<()> {
    let mut header = format!("ply\nformat binary_little_endian 1.0\nelement vertex {}\n", corners.len());
    let names: &[&str] = if mesh.uvs.is_empty() { &["x", "y", "z"] } else { &["x", "y", "z", "u", "v"] };
    names.iter().for_each(|name| header += &format!("property float {name}\n"));
    header += &format!("element face {}\nproperty list uchar int vertex_indices\nend_header\n", mesh.triangles.len());
    let mut bytes = header.into_bytes();
    for (index, corner) in corners.iter().enumerate() {
        bytes.extend(corner.to_array().into_iter().flat_map(f32::to_le_bytes));
        if let Some(uv) = mesh.uvs.get(index) {
            bytes.extend(uv.to_array().into_iter().flat_map(f32::to_le_bytes));
        }
    }
    for triangle in &mesh.triangles {
        bytes.push(3);
        bytes.extend(triangle.iter().flat_map(|i| i.to_le_bytes()));
    }
    std::fs::write(path, bytes).with_context(|| path.display().to_string())
}

/// What a render by Mitsuba took and gave.
pub(crate) struct PeerRender {
    /// CPU seconds of all its threads.
    pub(crate) cpu_seconds: f64,
    pub(crate) wall_seconds: f64,
    /// Linear RGB, row-major.
    pub(crate) pixels: Vec<[f32; 3]>,
}

/// Mitsuba, with a scene loaded.
pub(crate) struct Mitsuba {
    child: Child,
    ask: ChildStdin,
    answer: BufReader<ChildStdout>,
    picture: PathBuf,
}

impl Mitsuba {
    /// `None`, and a line that says so, where Python has no Mitsuba.
    pub(crate) fn start(folder: &Path, size: u32) -> Result<Option<Self>> {
        let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("benches/peers/mitsuba/serve.py");
        let mut child = Command::new(python())
            .arg(script)
            .arg(folder.join("scene.json"))
            .arg(size.to_string())
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .spawn()
            .context("python3")?;
        let ask = child.stdin.take().context("stdin is piped")?;
        let mut answer = BufReader::new(child.stdout.take().context("stdout is piped")?);
        let mut line = String::new();
        answer.read_line(&mut line)?;
        let picture = folder.join("picture.f32");
        let peer = Self { child, ask, answer, picture };
        if line.trim() != "ready" {
            println!("no Mitsuba: pip install mitsuba numpy, or set FECHNER_MITSUBA_PYTHON");
            return Ok(None);
        }
        Ok(Some(peer))
    }

    /// Renders with that many samples a pixel and threads.
    pub(crate) fn render(&mut self, samples: u32, seed: u32, threads: usize) -> Result<PeerRender> {
        writeln!(self.ask, "{samples} {seed} {threads} {}", self.picture.display())?;
        self.ask.flush()?;
        let mut line = String::new();
        self.answer.read_line(&mut line)?;
        let mut words = line.split_whitespace().map(str::parse::<f64>);
        let (Some(Ok(cpu_seconds)), Some(Ok(wall_seconds))) = (words.next(), words.next()) else {
            bail!("Mitsuba answered `{}`, not two numbers", line.trim())
        };
        let bytes = std::fs::read(&self.picture)?;
        let pixels = bytes
            .chunks_exact(12)
            .map(|p| std::array::from_fn(|c| f32::from_le_bytes([p[4 * c], p[4 * c + 1], p[4 * c + 2], p[4 * c + 3]])))
            .collect();
        Ok(PeerRender { cpu_seconds, wall_seconds, pixels })
    }
}

impl Drop for Mitsuba {
    fn drop(&mut self) {
        // An empty line ends it; a child that is gone already is what we want too.
        let _ = writeln!(self.ask);
        let _ = self.ask.flush();
        let _ = self.child.wait();
    }
}
