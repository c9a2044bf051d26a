//! Integrals over parts of the sphere of directions, for functions with narrow peaks.

use glam::Vec3;
use std::f64::consts::{PI, TAU};

/// Values integrated together.
pub(super) type Values = [f64; 2];

/// A part of the sphere between two polar angles and two azimuths. (Angles, not heights: a narrow peak at the pole
/// would be squeezed into the last 1e-6 of the heights.)
#[derive(Clone, Copy)]
pub(super) struct Cell {
    pub(super) theta: [f64; 2],
    pub(super) phi: [f64; 2],
}

/// Where a function is known to be narrow: direction and width in radians.
#[derive(Clone, Copy)]
pub(super) struct Peak {
    pub(super) direction: Vec3,
    pub(super) width: f64,
}

/// Bins that cover the sphere, the plane z = 0 being an edge between bins.
pub(super) struct Bins {
    pub(super) heights: usize,
    pub(super) azimuths: usize,
}

impl Bins {
    pub(super) fn count(&self) -> usize {
        self.heights * self.azimuths
    }

    pub(super) fn cell(&self, index: usize) -> Cell {
        let (row, column) = (index / self.azimuths, index % self.azimuths);
        let theta = |row: usize| PI * row as f64 / self.heights as f64;
        let phi = |column: usize| TAU * column as f64 / self.azimuths as f64;
        Cell { theta: [theta(row), theta(row + 1)], phi: [phi(column), phi(column + 1)] }
    }

    pub(super) fn index(&self, w: Vec3) -> usize {
        let w64 = w.as_dvec3();
        let theta = w64.truncate().length().atan2(w64.z);
        let row = (theta / PI * self.heights as f64) as usize;
        // A direction above the plane must not be rounded into a bin below it.
        let half = self.heights / 2;
        let row = if w.z >= 0.0 { row.min(half - 1) } else { row.clamp(half, self.heights - 1) };
        let phi = w64.y.atan2(w64.x).rem_euclid(TAU);
        let column = (phi / TAU * self.azimuths as f64) as usize;
        row * self.azimuths + column.min(self.azimuths - 1)
    }
}

/// ∫f dω over the cell, by 3×3 Gauss points, split in four until that changes nothing.
pub(super) fn integrate(cell: Cell, peaks: &[Peak], f: &impl Fn(Vec3) -> Values) -> Values {
    refine(cell, peaks, f, gauss(cell, f), 0)
}

fn refine(cell: Cell, peaks: &[Peak], f: &impl Fn(Vec3) -> Values, whole: Values, depth: u32) -> Values {
    const TOLERANCE: f64 = 3e-7;
    const DEEPEST: u32 = 11;
    let quarters = cell.quarters();
    let parts = quarters.map(|quarter| gauss(quarter, f));
    let sum = [0, 1].map(|k| parts.iter().map(|part| part[k]).sum::<f64>());
    let settled = (0..2).all(|k| (sum[k] - whole[k]).abs() < TOLERANCE);
    let hides_peak = peaks.iter().any(|peak| cell.hides(peak));
    if depth >= DEEPEST || (settled && !hides_peak) {
        return sum;
    }
    let mut total = [0.0; 2];
    for (quarter, part) in quarters.into_iter().zip(parts) {
        let values = refine(quarter, peaks, f, part, depth + 1);
        total[0] += values[0];
        total[1] += values[1];
    }
    total
}

impl Cell {
    fn quarters(&self) -> [Self; 4] {
        let theta = 0.5 * (self.theta[0] + self.theta[1]);
        let phi = 0.5 * (self.phi[0] + self.phi[1]);
        let lower = [self.theta[0], theta];
        let upper = [theta, self.theta[1]];
        let left = [self.phi[0], phi];
        let right = [phi, self.phi[1]];
        [(lower, left), (lower, right), (upper, left), (upper, right)].map(|(theta, phi)| Self { theta, phi })
    }

    /// Whether a peak lies within two widths of the cell and is narrower than the cell.
    fn hides(&self, peak: &Peak) -> bool {
        let center = self.direction(0.5, 0.5).as_dvec3();
        let radius = [0.0, 1.0]
            .iter()
            .flat_map(|&a| [0.0, 1.0].map(|b| self.direction(a, b)))
            .map(|corner| corner.as_dvec3().distance(center))
            .fold(0.0, f64::max);
        let distance = peak.direction.as_dvec3().distance(center);
        distance < radius + 2.0 * peak.width && radius > peak.width
    }

    fn theta_at(&self, a: f64) -> f64 {
        self.theta[0] + (self.theta[1] - self.theta[0]) * a
    }

    fn direction(&self, a: f64, b: f64) -> Vec3 {
        let (sin, cos) = self.theta_at(a).sin_cos();
        let phi = self.phi[0] + (self.phi[1] - self.phi[0]) * b;
        glam::DVec3::new(sin * phi.cos(), sin * phi.sin(), cos).as_vec3()
    }
}

fn gauss(cell: Cell, f: &impl Fn(Vec3) -> Values) -> Values {
    const NODES: [(f64, f64); 3] =
        [(0.112_701_665_379_258_31, 5.0 / 18.0), (0.5, 8.0 / 18.0), (0.887_298_334_620_741_7, 5.0 / 18.0)];
    let area = (cell.theta[1] - cell.theta[0]) * (cell.phi[1] - cell.phi[0]);
    let mut sum = [0.0; 2];
    for (a, weight_a) in NODES {
        for (b, weight_b) in NODES {
            let values = f(cell.direction(a, b));
            let weight = weight_a * weight_b * area * cell.theta_at(a).sin();
            sum[0] += weight * values[0];
            sum[1] += weight * values[1];
        }
    }
    sum
}

#[test]
fn bins_cover_the_sphere() {
    let bins = Bins { heights: 8, azimuths: 6 };
    let area: f64 = (0..bins.count()).map(|index| integrate(bins.cell(index), &[], &|_| [1.0, 0.0])[0]).sum();
    assert!((area - 2.0 * TAU).abs() < 1e-9, "{area}");
    for index in 0..bins.count() {
        let middle = bins.cell(index).direction(0.4, 0.6);
        assert_eq!(bins.index(middle), index);
    }
}
