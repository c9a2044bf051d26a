//! Noise that repeats, so that textures tile, and that is the same on every machine.

/// Mixes three whole numbers into 32 bits that look random.
pub(crate) fn hash(x: i32, y: i32, seed: u32) -> u32 {
    let mut h =
        (x as u32).wrapping_mul(0x8da6_b343) ^ (y as u32).wrapping_mul(0xd816_3841) ^ seed.wrapping_mul(0xcb1a_b31f);
    h = (h ^ (h >> 16)).wrapping_mul(0x7feb_352d);
    h = (h ^ (h >> 15)).wrapping_mul(0x846c_a68b);
    h ^ (h >> 16)
}

/// A number in [0, 1) for a lattice point.
pub(crate) fn random(x: i32, y: i32, seed: u32) -> f32 {
    (hash(x, y, seed) >> 8) as f32 / (1 << 24) as f32
}

fn smooth(t: f32) -> f32 {
    t * t * t * (t * (t * 6.0 - 15.0) + 10.0)
}

/// Linear interpolation.
pub(crate) fn mix(a: f32, b: f32, t: f32) -> f32 {
    a + (b - a) * t
}

/// 0 below `a`, 1 above `b`, smooth between.
pub(crate) fn step(a: f32, b: f32, x: f32) -> f32 {
    let t = ((x - a) / (b - a)).clamp(0.0, 1.0);
    t * t * (3.0 - 2.0 * t)
}

/// Gradient noise in about [-1, 1], one lattice cell a unit, that repeats after `period` cells in x and y.
pub(crate) fn gradient(x: f32, y: f32, period: (i32, i32), seed: u32) -> f32 {
    let (ix, iy) = (x.floor(), y.floor());
    let (fx, fy) = (x - ix, y - iy);
    let corner = |dx: i32, dy: i32| {
        let cell = ((ix as i32 + dx).rem_euclid(period.0), (iy as i32 + dy).rem_euclid(period.1));
        let (sin, cos) = (random(cell.0, cell.1, seed) * std::f32::consts::TAU).sin_cos();
        cos * (fx - dx as f32) + sin * (fy - dy as f32)
    };
    let (u, v) = (smooth(fx), smooth(fy));
    1.5 * mix(mix(corner(0, 0), corner(1, 0), u), mix(corner(0, 1), corner(1, 1), u), v)
}

/// Gradient noise of several octaves, each twice as fine and half as strong; in about [-1, 1].
pub(crate) fn fractal(x: f32, y: f32, period: (i32, i32), octaves: u32, seed: u32) -> f32 {
    let mut sum = 0.0;
    let mut weight = 0.5;
    let mut scale = 1;
    for octave in 0..octaves {
        let s = scale as f32;
        sum += weight * gradient(x * s, y * s, (period.0 * scale, period.1 * scale), seed.wrapping_add(octave * 101));
        weight *= 0.5;
        scale *= 2;
    }
    sum
}

/// Value noise in three dimensions, in [-1, 1], one lattice cell a unit; does not repeat.
pub(crate) fn solid([x, y, z]: [f32; 3], seed: u32) -> f32 {
    let (ix, iy, iz) = (x.floor(), y.floor(), z.floor());
    let (u, v, w) = (smooth(x - ix), smooth(y - iy), smooth(z - iz));
    let corner = |dx: i32, dy: i32, dz: i32| {
        let layer = seed.wrapping_add(((iz as i32 + dz) as u32).wrapping_mul(0x9e37_79b9));
        random(ix as i32 + dx, iy as i32 + dy, layer)
    };
    let plane =
        |dz: i32| mix(mix(corner(0, 0, dz), corner(1, 0, dz), u), mix(corner(0, 1, dz), corner(1, 1, dz), u), v);
    2.0 * mix(plane(0), plane(1), w) - 1.0
}

/// The nearest of one jittered point a cell.
pub(crate) struct Cell {
    /// Lattice cell of the nearest point, already wrapped.
    pub(crate) id: (i32, i32),
    /// Distance to it in cells.
    pub(crate) distance: f32,
    /// How much farther the second nearest is: 0 on the border between two.
    pub(crate) margin: f32,
}

/// Cellular noise that repeats after `period` cells.
pub(crate) fn cells(x: f32, y: f32, period: (i32, i32), seed: u32) -> Cell {
    let (ix, iy) = (x.floor() as i32, y.floor() as i32);
    let mut nearest = Cell { id: (0, 0), distance: f32::MAX, margin: f32::MAX };
    let mut second = f32::MAX;
    for dy in -2..=2 {
        for dx in -2..=2 {
            let id = ((ix + dx).rem_euclid(period.0), (iy + dy).rem_euclid(period.1));
            let px = (ix + dx) as f32 + random(id.0, id.1, seed);
            let py = (iy + dy) as f32 + random(id.0, id.1, seed ^ 0x5bd1_e995);
            let distance = (px - x).hypot(py - y);
            if distance < nearest.distance {
                second = nearest.distance;
                nearest = Cell { id, distance, margin: 0.0 };
            } else if distance < second {
                second = distance;
            }
        }
    }
    nearest.margin = second - nearest.distance;
    nearest
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn noise_repeats_after_its_period_and_stays_in_range() {
        let mut largest: f32 = 0.0;
        for i in 0..400 {
            let (x, y) = (i as f32 * 0.173, i as f32 * 0.311);
            let value = fractal(x, y, (5, 7), 4, 3);
            assert!((value - fractal(x + 5.0, y + 7.0, (5, 7), 4, 3)).abs() < 1e-3);
            let cell = cells(x, y, (5, 7), 3);
            assert!((cell.distance - cells(x + 5.0, y - 7.0, (5, 7), 3).distance).abs() < 1e-3);
            assert!(cell.margin >= 0.0);
            largest = largest.max(value.abs()).max(gradient(x, y, (5, 7), 9).abs());
        }
        assert!((0.4..1.2).contains(&largest), "{largest}");
    }
}
