//! A courtyard at night under strings of small coloured lamps: a scene file of many lights.

use crate::noise::random;
use std::f32::consts::TAU;
use std::fmt::Write as _;

/// Head of the file: camera, materials, floor, walls and columns.
const HEAD: &str = r#"# Written by make-scenes: change scenes/make/many_lights.rs, not this file.
name = "Many lights"
nits_per_unit = 100.0

[film]
size = [512, 384]

[view]
display = "desktop"
visibility = 2.0
exposure_stops = -1.4

[camera]
position = [0.0, 1.75, 6.6]
look_at = [0.0, 1.45, 0.0]
vertical_fov_deg = 42.0

[environment]
radiance = [0.002, 0.003, 0.006]

[textures.bricks]
file = "textures/bricks.png"
[textures.bricks-normal]
file = "textures/bricks-normal.png"
encoding = "linear"
[textures.terrazzo]
file = "textures/terrazzo.png"

[materials.floor]
type = "metal-roughness"
base_color = { texture = "terrazzo", scale = [6, 7] }
metallic = 0.0
roughness = 0.22

[materials.wall]
type = "metal-roughness"
base_color = { texture = "bricks", scale = [5, 3] }
metallic = 0.0
roughness = 0.85
normal_map = { texture = "bricks-normal", strength = 1.0, scale = [5, 3] }

[materials.plaster]
type = "diffuse"
reflectance = [0.70, 0.67, 0.62]

[materials.steel]
type = "conductor"
metal = "chromium"
roughness = 0.15

[[objects]]
name = "floor"
rectangle = { corner = [-4, 0, 7], edge_u = [8, 0, 0], edge_v = [0, 0, -10] }
material = "floor"

[[objects]]
name = "back wall"
rectangle = { corner = [-4, 0, -3], edge_u = [8, 0, 0], edge_v = [0, 5, 0] }
material = "wall"

[[objects]]
name = "left wall"
rectangle = { corner = [-4, 0, 7], edge_u = [0, 0, -10], edge_v = [0, 5, 0] }
material = "wall"

[[objects]]
name = "right wall"
rectangle = { corner = [4, 0, -3], edge_u = [0, 0, 10], edge_v = [0, 5, 0] }
material = "wall"
"#;

/// Colours of the lamps: linear, all of luminance 1.
const COLORS: [(&str, [f32; 3]); 5] = [
    ("amber", [2.30, 0.71, 0.02]),
    ("rose", [3.90, 0.18, 0.60]),
    ("mint", [0.10, 1.32, 0.45]),
    ("sky", [0.05, 0.75, 6.20]),
    ("cream", [1.35, 0.93, 0.65]),
];

/// The whole scene file.
pub(crate) fn scene() -> String {
    let mut text = HEAD.to_owned();
    for (name, color) in COLORS {
        let [r, g, b] = color.map(|c| c * 26.0);
        let _ = write!(
            text,
            "\n[materials.{name}]\ntype = \"diffuse\"\nreflectance = [0, 0, 0]\nemission = [{r:.1}, {g:.1}, {b:.1}]\n"
        );
    }
    // Columns of plaster with steel balls on them.
    for (i, (x, z, height)) in
        [(-2.3, -1.2, 1.5), (-0.8, -1.9, 1.1), (0.8, -1.9, 1.1), (2.3, -1.2, 1.5)].iter().enumerate()
    {
        let _ = write!(
            text,
            "\n[[objects]]\nname = \"column {i}\"\nbox = {{ min = [{:.2}, 0, {:.2}], max = [{:.2}, {height}, {:.2}] }}\nmaterial = \"plaster\"\n",
            x - 0.25,
            z - 0.25,
            x + 0.25,
            z + 0.25
        );
        let _ = write!(
            text,
            "\n[[objects]]\nname = \"ball {i}\"\nsphere = {{ center = [{x}, {:.3}, {z}], radius = 0.24 }}\nmaterial = \"steel\"\n",
            height + 0.24
        );
    }
    // Six strings from wall to wall, each sagging in a parabola.
    let (strings, lamps) = (6, 19);
    for string in 0..strings {
        let z = 3.0 - string as f32 * 0.95;
        for lamp in 0..lamps {
            let t = (lamp as f32 + 0.5) / lamps as f32;
            let x = -3.9 + 7.8 * t;
            let sag = 0.9 + 0.25 * random(string, 0, 1);
            let y = 3.3 - sag * 4.0 * t * (1.0 - t) + 0.05 * (TAU * 3.0 * t).sin();
            let (name, _) = COLORS[(random(string, lamp, 2) * COLORS.len() as f32) as usize % COLORS.len()];
            let jitter = 0.3 * (random(string, lamp, 3) - 0.5);
            let _ = write!(
                text,
                "\n[[objects]]\nsphere = {{ center = [{x:.3}, {y:.3}, {:.3}], radius = 0.045 }}\nmaterial = \"{name}\"\n",
                z + jitter
            );
        }
    }
    text
}
