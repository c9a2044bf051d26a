//! Smooth surfaces made from functions of (u, v), and Wavefront OBJ files made from surfaces.

use std::fmt::Write as _;
use std::path::Path;

/// A point or direction; y is up, lengths in metres.
pub(crate) type Vec3 = [f64; 3];

pub(crate) fn add(a: Vec3, b: Vec3) -> Vec3 {
    std::array::from_fn(|i| a[i] + b[i])
}

pub(crate) fn scale(a: Vec3, s: f64) -> Vec3 {
    a.map(|c| c * s)
}

fn sub(a: Vec3, b: Vec3) -> Vec3 {
    std::array::from_fn(|i| a[i] - b[i])
}

pub(crate) fn cross(a: Vec3, b: Vec3) -> Vec3 {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

fn length(a: Vec3) -> f64 {
    a.iter().map(|c| c * c).sum::<f64>().sqrt()
}

pub(crate) fn normalize(a: Vec3) -> Vec3 {
    scale(a, 1.0 / length(a))
}

/// A named surface with one material.
pub(crate) struct Part {
    name: String,
    material: String,
    positions: Vec<Vec3>,
    normals: Vec<Vec3>,
    uvs: Vec<[f64; 2]>,
    /// Corners in order around each face.
    faces: Vec<Vec<usize>>,
}

impl Part {
    /// The surface `point(u, v)` over [0, 1]², cut into `columns` × `rows` faces. Its front is where ∂u × ∂v points,
    /// its texture coordinates are (u, v) times `repeat`.
    pub(crate) fn surface(
        name: &str,
        material: &str,
        (columns, rows): (usize, usize),
        repeat: [f64; 2],
        point: impl Fn(f64, f64) -> Vec3,
    ) -> Self {
        let mut part = Self {
            name: name.to_owned(),
            material: material.to_owned(),
            positions: Vec::new(),
            normals: Vec::new(),
            uvs: Vec::new(),
            faces: Vec::new(),
        };
        for j in 0..=rows {
            for i in 0..=columns {
                let (u, v) = (i as f64 / columns as f64, j as f64 / rows as f64);
                part.positions.push(point(u, v));
                part.normals.push(normal(&point, u, v));
                part.uvs.push([u * repeat[0], v * repeat[1]]);
            }
        }
        for j in 0..rows {
            for i in 0..columns {
                let a = j * (columns + 1) + i;
                let mut face = vec![a, a + 1, a + columns + 2, a + columns + 1];
                // At a pole two corners of a face are one point.
                face.dedup_by(|b, a| length(sub(part.positions[*a], part.positions[*b])) < 1e-7);
                if face.len() > 2 && length(sub(part.positions[face[0]], part.positions[face[face.len() - 1]])) < 1e-7 {
                    face.pop();
                }
                if face.len() > 2 {
                    part.faces.push(face);
                }
            }
        }
        part
    }
}

/// The unit normal ∂u × ∂v; at a pole, where ∂u vanishes, that of a point nearby.
fn normal(point: &impl Fn(f64, f64) -> Vec3, u: f64, v: f64) -> Vec3 {
    const STEP: f64 = 1e-4;
    let v = v.clamp(2e-3, 1.0 - 2e-3);
    let along_u = sub(point(u + STEP, v), point(u - STEP, v));
    let along_v = sub(point(u, v + STEP), point(u, v - STEP));
    normalize(cross(along_u, along_v))
}

/// A number with as many decimals as told, without a tail of zeros.
fn short(value: f64, digits: usize) -> String {
    let text = format!("{value:.digits$}");
    let text = text.trim_end_matches('0').trim_end_matches('.');
    if text == "-0" { "0".to_owned() } else { text.to_owned() }
}

/// Writes parts as `folder/name.obj`, which uses `folder/materials.mtl`. Texture coordinates are written for those
/// materials that `textured` names; the others' would be a quarter of the file for nothing.
pub(crate) fn write_obj(
    folder: &Path,
    name: &str,
    parts: &[Part],
    textured: impl Fn(&str) -> bool,
) -> anyhow::Result<()> {
    let mut text = String::from("# Made by fechner's make-scenes.\nmtllib materials.mtl\n");
    let (mut base, mut uv_base) = (1, 1);
    for part in parts {
        let textured = textured(&part.material);
        let _ = writeln!(text, "o {}\nusemtl {}", part.name, part.material);
        for p in &part.positions {
            let _ = writeln!(text, "v {} {} {}", short(p[0], 5), short(p[1], 5), short(p[2], 5));
        }
        for t in part.uvs.iter().filter(|_| textured) {
            let _ = writeln!(text, "vt {} {}", short(t[0], 4), short(t[1], 4));
        }
        for n in &part.normals {
            let _ = writeln!(text, "vn {} {} {}", short(n[0], 3), short(n[1], 3), short(n[2], 3));
        }
        for face in &part.faces {
            text.push('f');
            for corner in face {
                let i = base + corner;
                let _ =
                    if textured { write!(text, " {i}/{}/{i}", uv_base + corner) } else { write!(text, " {i}//{i}") };
            }
            text.push('\n');
        }
        base += part.positions.len();
        if textured {
            uv_base += part.uvs.len();
        }
    }
    std::fs::write(folder.join(format!("{name}.obj")), text)?;
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lathe::around;

    #[test]
    fn a_turned_ball_is_closed_and_faces_outwards() {
        let ball = Part::surface("ball", "glaze", (24, 16), [1.0, 1.0], |u, v| {
            let (sin, cos) = (v * std::f64::consts::PI).sin_cos();
            around((sin, -cos), u)
        });
        let mut volume = 0.0;
        for face in &ball.faces {
            for i in 1..face.len() - 1 {
                let [a, b, c] = [face[0], face[i], face[i + 1]].map(|i| ball.positions[i]);
                let n = cross(b, c);
                volume += (0..3).map(|k| a[k] * n[k]).sum::<f64>() / 6.0;
            }
        }
        // Front faces outwards make it positive; 24 × 16 faces lose 4 % of the ball.
        let sphere = 4.0 / 3.0 * std::f64::consts::PI;
        assert!((0.94..1.0).contains(&(volume / sphere)), "{volume}");
        for (p, n) in ball.positions.iter().zip(&ball.normals) {
            assert!(length(sub(*p, *n)) < 0.01, "{p:?} {n:?}");
        }
    }
}
