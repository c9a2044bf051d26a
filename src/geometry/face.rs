//! Normal and area of a triangle of any size.
//!
//! The cross product of edges beyond 4·10⁹ units squares to more than a float holds, that of edges below 10⁻¹¹ to less.
//! So such edges are brought near 1 by powers of two first, which round nothing.

use glam::{Mat3A, Vec3, Vec3A};

/// The flat side of a triangle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Face {
    /// Unit, on the side from which the edges turn counter-clockwise.
    pub(crate) normal: Vec3,
    /// Area of the triangle in square scene units.
    pub(crate) area: f32,
}

impl Face {
    /// The face of a triangle by the two edges that leave one of its corners; `None` where they span no area or are not
    /// finite.
    #[inline(always)]
    pub(crate) fn spanned_by(edges: [Vec3A; 2]) -> Option<Self> {
        /// Squares of the cross products that lose nothing by their size.
        const PLAIN: std::ops::Range<f32> = 1e-30..1e30;
        let cross = Vec3::from(edges[0].cross(edges[1]));
        let squared = cross.length_squared();
        if PLAIN.contains(&squared) {
            Some(Self { normal: cross * squared.sqrt().recip(), area: 0.5 * squared.sqrt() })
        } else {
            Self::of_any_size(edges)
        }
    }

    /// The same with edges near 1. Apart, since hits pay for what is inlined: 4 % of the Cornell box.
    #[cold]
    fn of_any_size(edges: [Vec3A; 2]) -> Option<Self> {
        let [scale_1, scale_2] = edges.map(|edge| scale_to_one(edge.abs().max_element()));
        let cross = Vec3::from((edges[0] * scale_1).cross(edges[1] * scale_2));
        let scale = scale_to_one(cross.abs().max_element());
        let scaled = cross * scale;
        let normal = scaled.try_normalize()?;
        let area = 0.5 * scaled.length() / scale / scale_1 / scale_2;
        Some(Self { normal, area })
    }
}

/// A matrix times the power of two that brings its largest column entry near 1, for what counts by its direction alone.
pub(super) fn scaled_to_one(matrix: Mat3A) -> Mat3A {
    let columns = [matrix.x_axis, matrix.y_axis, matrix.z_axis];
    let largest = columns.into_iter().map(|column| column.abs().max_element()).fold(0.0, f32::max);
    matrix * scale_to_one(largest)
}

/// The power of two that brings a magnitude into [1, 2), or as near as a float's range allows.
#[inline]
fn scale_to_one(magnitude: f32) -> f32 {
    const MANTISSA_BITS: u32 = 23;
    /// Exponent of 1, as it is stored.
    const EXPONENT_OF_ONE: u32 = 127;
    let exponent = (magnitude.to_bits() >> MANTISSA_BITS) & 0xff;
    f32::from_bits((2 * EXPONENT_OF_ONE - exponent.clamp(1, 2 * EXPONENT_OF_ONE - 1)) << MANTISSA_BITS)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sampler::{hash_words, unit_of_hash};
    use glam::vec3a;

    const EDGES: [Vec3A; 2] = [vec3a(3.0, 0.25, -1.0), vec3a(-0.5, 2.0, 1.5)];

    #[test]
    fn triangles_of_any_size_have_their_normal_and_area() {
        let expected = Face::spanned_by(EDGES).unwrap();
        assert!((expected.area - 0.5 * EDGES[0].cross(EDGES[1]).length()).abs() < 1e-6);
        for exponent in [-60, -40, -20, 20, 40, 50] {
            let scale = 2f32.powi(exponent);
            let face = Face::spanned_by(EDGES.map(|edge| edge * scale)).unwrap();
            assert_eq!(face.normal, expected.normal, "2^{exponent}");
            assert_eq!(face.area, expected.area * scale * scale, "2^{exponent}");
        }
    }

    /// Bringing everything near 1 would be as right for triangles of ordinary size, bit for bit.
    #[test]
    fn ordinary_triangles_keep_the_bits_of_the_plain_formula() {
        let random = |index: u64, dimension: u64| {
            let unit = unit_of_hash(hash_words(index, dimension));
            (unit - 0.5) * 10f32.powi((index % 9) as i32 - 4)
        };
        for index in 0..10_000 {
            let edge = |first: u64| vec3a(random(index, first), random(index, first + 1), random(index, first + 2));
            let (edge_1, edge_2) = (edge(0), edge(3));
            let cross = Vec3::from(edge_1.cross(edge_2));
            let face = Face::spanned_by([edge_1, edge_2]).unwrap();
            assert_eq!(face, Face { normal: cross.normalize(), area: 0.5 * cross.length() });
            assert_eq!(Face::of_any_size([edge_1, edge_2]), Some(face));
        }
    }

    #[test]
    fn what_spans_no_area_has_no_face() {
        let [x, y, nan, infinite] = [Vec3A::X, Vec3A::Y, Vec3A::NAN, Vec3A::INFINITY];
        for edges in [[Vec3A::ZERO, x], [x, 2.0 * x], [nan, x], [infinite, y]] {
            assert_eq!(Face::spanned_by(edges), None, "{edges:?}");
        }
    }
}
