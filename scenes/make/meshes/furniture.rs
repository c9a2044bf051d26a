//! A table before a tiled wall, and the cloth on it.

use crate::mesh::Part;
use crate::noise::gradient;
use std::f64::consts::TAU;

/// A table top 1.8 m wide and 0.9 m deep with a rounded front edge at z = 0.45, and a tiled wall behind it at z =
/// -0.45.
pub(super) fn table() -> Vec<Part> {
    let (front, back, radius, thick) = (0.45, -0.45, 0.012, 0.05);
    let top = Part::surface("table-top", "table", (1, 1), [2.0, 1.0], |u, v| {
        [-0.9 + 1.8 * u, 0.0, front - radius + (back - front + radius) * v]
    });
    let edge = Part::surface("table-edge", "table", (1, 10), [2.0, 0.06], |u, v| {
        let angle = (1.0 - v) * TAU / 4.0;
        [-0.9 + 1.8 * u, radius * (angle.cos() - 1.0), front - radius + radius * angle.sin()]
    });
    let face = Part::surface("table-face", "table", (1, 1), [2.0, 0.06], |u, v| {
        [-0.9 + 1.8 * u, -thick + (thick - radius) * v, front]
    });
    let wall = Part::surface("wall", "tiles", (1, 1), [5.4, 3.6], |u, v| [-1.5 + 3.0 * u, -0.6 + 2.0 * v, back]);
    vec![top, edge, face, wall]
}

/// Linen that lies on the table and hangs over its front edge in folds.
pub(super) fn cloth() -> Part {
    // How far the threads run on the table, and how far they hang.
    let (flat, hang, width, edge, radius) = (0.40, 0.22, 0.46, 0.45, 0.022);
    Part::surface("cloth", "linen", (60, 64), [9.0, 12.0], |u, v| {
        let s = (1.0 - v) * (flat + hang) - flat; // 0 where it leaves the table
        let x = (u - 0.5) * width;
        let turn = radius * TAU / 4.0;
        let ([y, z], out) = if s < 0.0 {
            ([0.0, s], [1.0, 0.0])
        } else if s < turn {
            let angle = s / radius;
            ([radius * (angle.cos() - 1.0), radius * angle.sin()], [angle.cos(), angle.sin()])
        } else {
            ([turn - radius - s, radius], [0.0, 1.0])
        };
        let hanging = ((s - 0.01) / hang).clamp(0.0, 1.0);
        let ripple = |x: f64, y: f64, seed| f64::from(gradient(x as f32 + 40.0, y as f32 + 40.0, (997, 997), seed));
        // Folds grow as it hangs, and a few soft waves lie on the table; it never dips below the table.
        let fold = 0.020 * hanging * (1.0 + (u * 4.3 * TAU + 1.2 * ripple(x * 4.0, s * 3.0, 3)).sin());
        let wave = 0.0045 * (1.0 + ripple(x * 9.0 + s * 5.0, s * 11.0 - x * 3.0, 4));
        let lift = 0.0015 + fold + wave;
        let narrow = 1.0 - 0.10 * hanging * hanging;
        let skew = 0.10 * s;
        [x * narrow + skew, y + out[0] * lift, edge - 0.008 + z + out[1] * lift]
    })
}
