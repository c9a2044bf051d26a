//! Radiance from infinitely far away: a picture around the scene, and how its pixels lie on the sphere.

use glam::{Mat3, Vec2, Vec3};
use std::f32::consts::{FRAC_2_PI, FRAC_PI_4, PI, TAU};
use std::sync::Arc;

/// Radiance from infinitely far away.
#[derive(Clone, Debug)]
pub struct Environment {
    /// How the picture lies on the sphere.
    pub parametrisation: Parametrisation,
    /// Columns of the picture of linear RGB radiance; a constant one is 1×1.
    pub width: u32,
    /// Rows of the picture; equal to `width` for [`Parametrisation::EqualArea`].
    pub height: u32,
    /// Texels, row-major, none below 0.
    pub texels: Arc<Vec<Vec3>>,
    /// Multiplies the texels.
    pub scale: f32,
    /// World directions to the picture's directions: a rotation, with or without a reflection.
    pub from_world: Mat3,
}

/// How a picture lies on the sphere of directions. (u, v) = (0, 0) is the corner of the first texel.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Parametrisation {
    /// Longitude and latitude: row 0 is +y (up), the middle column is −z, u grows towards +x.
    LatLong,
    /// The square of Clarberg ("Fast Equal-Area Mapping of the (Hemi)Sphere Using SIMD", 2008) as pbrt-v4 lays it: its
    /// centre is +z, its corners −z, u grows towards +x and v towards +y. All texels have the same solid angle.
    EqualArea,
}

impl Parametrisation {
    /// Picture coordinates in [0, 1]² of a unit direction.
    pub fn to_uv(self, direction: Vec3) -> Vec2 {
        match self {
            Self::LatLong => {
                // Not the arc cosine of y: near the poles one step of y is a quarter of a row of a picture of 2048.
                let theta = (direction.x * direction.x + direction.z * direction.z).sqrt().atan2(direction.y);
                Vec2::new(0.5 + direction.x.atan2(-direction.z) / TAU, theta / PI)
            }
            Self::EqualArea => {
                let Vec3 { x, y, z } = direction.abs();
                let in_plane_squared = x * x + y * y;
                // √(1 − z), without its cancellation near the pole.
                let radius = (in_plane_squared / (1.0 + z)).sqrt();
                let (small, large) = (x.min(y), x.max(y));
                let slope = if large > 0.0 { (small / large).atan() * FRAC_2_PI } else { 0.0 };
                let along_v = radius * if x < y { 1.0 - slope } else { slope };
                let mut folded = Vec2::new(radius - along_v, along_v);
                if direction.z < 0.0 {
                    folded = Vec2::new(1.0 - folded.y, 1.0 - folded.x);
                }
                let signed = Vec2::new(folded.x.copysign(direction.x), folded.y.copysign(direction.y));
                (signed * 0.5 + 0.5).clamp(Vec2::ZERO, Vec2::ONE)
            }
        }
    }

    /// The unit direction of picture coordinates in [0, 1]².
    pub fn to_direction(self, uv: Vec2) -> Vec3 {
        match self {
            Self::LatLong => {
                let (sin_theta, cos_theta) = (PI * uv.y).sin_cos();
                let (sin_phi, cos_phi) = ((uv.x - 0.5) * TAU).sin_cos();
                Vec3::new(sin_theta * sin_phi, cos_theta, -sin_theta * cos_phi)
            }
            Self::EqualArea => {
                let signed = uv * 2.0 - 1.0;
                let folded = signed.abs();
                let signed_distance = 1.0 - (folded.x + folded.y);
                let radius = 1.0 - signed_distance.abs();
                let phi = if radius == 0.0 { 0.0 } else { ((folded.y - folded.x) / radius + 1.0) * FRAC_PI_4 };
                let z = (1.0 - radius * radius).copysign(signed_distance);
                let in_plane = radius * (2.0 - radius * radius).max(0.0).sqrt();
                let (sin, cos) = phi.sin_cos();
                Vec3::new((cos * in_plane).copysign(signed.x), (sin * in_plane).copysign(signed.y), z)
            }
        }
    }

    /// Solid angle in steradian of one row of a picture of so many.
    pub fn row_solid_angle(self, row: u32, rows: u32) -> f64 {
        let rows = f64::from(rows);
        match self {
            Self::LatLong => {
                let cosine = |row: f64| (std::f64::consts::PI * row / rows).cos();
                std::f64::consts::TAU * (cosine(f64::from(row)) - cosine(f64::from(row) + 1.0))
            }
            Self::EqualArea => 2.0 * std::f64::consts::TAU / rows,
        }
    }

    /// A unit direction in one row of a picture of so many, uniform in solid angle for `along` the row and `across` it
    /// in [0, 1].
    pub fn direction_in_row(self, row: u32, rows: u32, along: f32, across: f32) -> Vec3 {
        let (row, rows) = (row as f32, rows as f32);
        match self {
            Self::EqualArea => self.to_direction(Vec2::new(along, (row + across) / rows)),
            Self::LatLong => {
                // 1 − cos of the angle from the nearer pole, which keeps its digits there.
                let (pole, to_top, to_bottom) = match row {
                    row if 2.0 * row < rows => (1.0, row, row + 1.0),
                    row => (-1.0, rows - row, rows - row - 1.0),
                };
                let versine = |from_pole: f32| 2.0 * (0.5 * PI * from_pole / rows).sin().powi(2);
                let (top, bottom) = (versine(to_top), versine(to_bottom));
                let versine = top + (bottom - top) * across;
                let (sin_theta, cos_theta) = ((versine * (2.0 - versine)).max(0.0).sqrt(), pole * (1.0 - versine));
                let (sin_phi, cos_phi) = ((along - 0.5) * TAU).sin_cos();
                Vec3::new(sin_theta * sin_phi, cos_theta, -sin_theta * cos_phi)
            }
        }
    }
}

impl Environment {
    /// An environment of the same radiance from everywhere, in scene units.
    pub fn constant(radiance: Vec3) -> Self {
        Self {
            parametrisation: Parametrisation::LatLong,
            width: 1,
            height: 1,
            texels: Arc::new(vec![radiance]),
            scale: 1.0,
            from_world: Mat3::IDENTITY,
        }
    }

    /// A lat-long picture of a function of the world direction.
    pub fn from_directions(width: u32, height: u32, radiance: impl Fn(Vec3) -> Vec3) -> Self {
        let mut texels = Vec::with_capacity(width as usize * height as usize);
        for row in 0..height {
            for column in 0..width {
                let uv = Vec2::new((column as f32 + 0.5) / width as f32, (row as f32 + 0.5) / height as f32);
                texels.push(radiance(Parametrisation::LatLong.to_direction(uv)));
            }
        }
        Self { width, height, texels: Arc::new(texels), ..Self::constant(Vec3::ZERO) }
    }

    /// Radiance from a world direction: bilinear between texel centres, across the picture's seams.
    pub fn radiance(&self, direction: Vec3) -> Vec3 {
        let uv = self.parametrisation.to_uv(self.from_world * direction);
        let (x, y) = (uv.x * self.width as f32 - 0.5, uv.y * self.height as f32 - 0.5);
        let (left, top) = (x.floor(), y.floor());
        let (left, top, fx, fy) = (left as i64, top as i64, x - left, y - top);
        let texel = |dx, dy| self.texels[self.texel_index(left + dx, top + dy)];
        texel(0, 0).lerp(texel(1, 0), fx).lerp(texel(0, 1).lerp(texel(1, 1), fx), fy) * self.scale
    }

    /// Index of a texel that may lie up to one picture beyond the edge: where the sphere goes on.
    pub fn texel_index(&self, column: i64, row: i64) -> usize {
        let (width, height) = (i64::from(self.width), i64::from(self.height));
        let (mut column, mut row) = (column, row);
        match self.parametrisation {
            Parametrisation::LatLong => {
                column = column.rem_euclid(width);
                row = row.clamp(0, height - 1);
            }
            Parametrisation::EqualArea => {
                // Each edge of the square is folded onto itself about its middle.
                if column < 0 || column >= width {
                    column = if column < 0 { -1 - column } else { 2 * width - 1 - column };
                    row = height - 1 - row;
                }
                if row < 0 || row >= height {
                    row = if row < 0 { -1 - row } else { 2 * height - 1 - row };
                    column = width - 1 - column;
                }
                (column, row) = (column.clamp(0, width - 1), row.clamp(0, height - 1));
            }
        }
        row as usize * self.width as usize + column as usize
    }

    /// Irradiance on a surface that faces along the world direction `normal`, from texel centres: what formats that
    /// give an illuminance scale by.
    pub fn irradiance(&self, normal: Vec3) -> Vec3 {
        let mut sum = glam::DVec3::ZERO;
        for row in 0..self.height {
            let solid_angle = self.parametrisation.row_solid_angle(row, self.height) / f64::from(self.width);
            for column in 0..self.width {
                let uv = Vec2::new((column as f32 + 0.5) / self.width as f32, (row as f32 + 0.5) / self.height as f32);
                let direction = self.from_world.transpose() * self.parametrisation.to_direction(uv);
                let cosine = f64::from(direction.dot(normal).max(0.0));
                let texel = self.texels[row as usize * self.width as usize + column as usize];
                sum += texel.as_dvec3() * (cosine * solid_angle);
            }
        }
        (sum * f64::from(self.scale)).as_vec3()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sampler::{hash_words, unit_of_hash};

    /// Directions over the whole sphere, poles, axes and seams among them.
    fn directions() -> impl Iterator<Item = Vec3> {
        let golden = (0..5000).map(|i| {
            let z = 1.0 - 2.0 * (i as f32 + 0.5) / 5000.0;
            let (sin, cos) = (i as f32 * 2.399_963).sin_cos();
            Vec3::new(cos, sin, 0.0) * (1.0 - z * z).sqrt() + Vec3::Z * z
        });
        golden.chain([Vec3::X, Vec3::NEG_X, Vec3::Y, Vec3::NEG_Y, Vec3::Z, Vec3::NEG_Z])
    }

    #[test]
    fn both_maps_come_back() {
        for map in [Parametrisation::LatLong, Parametrisation::EqualArea] {
            for direction in directions() {
                let there = map.to_uv(direction);
                assert!(there.cmpge(Vec2::ZERO).all() && there.cmple(Vec2::ONE).all(), "{map:?} {direction}: {there}");
                let back = map.to_direction(there);
                assert!(back.distance(direction) < 2e-6, "{map:?} {direction}: {there} came back as {back}");
                assert!((back.length() - 1.0).abs() < 1e-6);
            }
        }
    }

    /// Cells of the equal-area square get the same share of directions that are uniform on the sphere: χ² with 255
    /// degrees of freedom below its 99.9 % quantile, 330.5.
    #[test]
    fn the_equal_area_map_is_equal_area() {
        let n = 100_000u32;
        let mut counts = [0u32; 256];
        for i in 0..n {
            let unit = |k: u64| unit_of_hash(hash_words(u64::from(i), k));
            let z = 1.0 - 2.0 * unit(1);
            let (sin, cos) = (TAU * unit(2)).sin_cos();
            let r = (1.0 - z * z).max(0.0).sqrt();
            let uv = Parametrisation::EqualArea.to_uv(Vec3::new(cos * r, sin * r, z));
            counts[(uv.y * 16.0).min(15.0) as usize * 16 + (uv.x * 16.0).min(15.0) as usize] += 1;
        }
        let expected = f64::from(n) / 256.0;
        let chi_squared: f64 = counts.iter().map(|&c| (f64::from(c) - expected).powi(2) / expected).sum();
        assert!(chi_squared < 330.5, "{chi_squared}");
    }

    /// A smooth function on the sphere is looked up right everywhere, on the seams too.
    #[test]
    fn lookups_cross_the_seams() {
        let value = |d: Vec3| Vec3::new(1.0 + 0.5 * d.x, 1.0 + 0.5 * d.y, 1.0 + 0.5 * d.z);
        let size = 64u32;
        let texels = (0..size * size)
            .map(|i| {
                let uv = Vec2::new((i % size) as f32 + 0.5, (i / size) as f32 + 0.5) / size as f32;
                value(Parametrisation::EqualArea.to_direction(uv))
            })
            .collect();
        let equal_area = Environment {
            parametrisation: Parametrisation::EqualArea,
            width: size,
            height: size,
            texels: Arc::new(texels),
            ..Environment::constant(Vec3::ZERO)
        };
        let lat_long = Environment::from_directions(128, 64, value);
        for direction in directions() {
            for environment in [&equal_area, &lat_long] {
                let error = (environment.radiance(direction) - value(direction)).abs().max_element();
                assert!(error < 0.02, "{direction}: {error}");
            }
        }
        // ∫(1 + y/2) cos dω over the upper hemisphere is π + π/3.
        let expected = PI + PI / 3.0;
        for environment in [&equal_area, &lat_long] {
            let irradiance = environment.irradiance(Vec3::Y).y;
            assert!((irradiance / expected - 1.0).abs() < 2e-3, "{irradiance} {expected}");
        }
    }

    /// Where rows are narrow, too, at the poles of a picture of 4096×2048: what is drawn from a row is found in it,
    /// evenly.
    #[test]
    fn samples_of_a_row_lie_in_it() {
        let height = 2048;
        let map = Parametrisation::LatLong;
        for row in [0, 1, 2, 700, 1023, 1024, 2045, 2046, 2047] {
            let solid_angle = map.row_solid_angle(row, height);
            for step in 0..64 {
                let within = (step as f32 + 0.5) / 64.0;
                let direction = map.direction_in_row(row, height, 0.3, within);
                assert!((direction.length() - 1.0).abs() < 1e-6);
                let v = map.to_uv(direction).y * height as f32;
                assert_eq!(v as u32, row, "{v} of row {row}");
                // The solid angle of the part of the row that lies above.
                let angle = |rows: f64| (std::f64::consts::PI * rows / f64::from(height)).cos();
                let above = 2.0 * std::f64::consts::PI * (angle(f64::from(row)) - angle(f64::from(v)));
                assert!((above / solid_angle - f64::from(within)).abs() < 2e-3, "{above} of {solid_angle} at {within}");
            }
        }
    }
}
