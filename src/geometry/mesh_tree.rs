//! The wide tree of a mesh, in coordinates of its own.
//!
//! They are centred along the axes on which that rounds no coordinate, so that tests keep their precision far from the
//! origin, and scaled by a power of two until the largest extent is between 512 and 1024, so that no product of the
//! triangle test leaves the range of f32. Neither changes a bit of what a coordinate says: shared vertices stay shared,
//! distances scale exactly, and small things near the origin stay what they are however far away another one is.

use super::face::Face;
use super::tree::Bounds;
use super::wide_tree::{TriangleRef, WideHit, WideTree};
use glam::{Affine3A, Vec3A};

/// Where a triangle is hit.
#[derive(Clone, Copy, Debug)]
pub(super) struct MeshHit {
    /// Distance along the ray, in the units of the coordinates the tree was given.
    pub(super) t: f32,
    /// Where the tree has the triangle, for [`MeshTree::triangle`] and [`MeshTree::shape`].
    pub(super) place: u32,
    pub(super) b1: f32,
    pub(super) b2: f32,
}

/// A corner of a triangle and the edges that leave it.
#[derive(Clone, Copy, Debug)]
pub(super) struct TriangleShape {
    pub(super) corner: Vec3A,
    /// Edges from the corner to the second and to the third one.
    pub(super) edges: [Vec3A; 2],
}

impl TriangleShape {
    #[inline]
    pub(super) fn transformed(self, to_world: &Affine3A) -> Self {
        Self {
            corner: to_world.transform_point3a(self.corner),
            edges: self.edges.map(|edge| to_world.transform_vector3a(edge)),
        }
    }
}

pub(super) struct MeshTree {
    tree: WideTree,
    center: Vec3A,
    scale: f32,
    /// 1 / `scale`, exactly.
    inverse_scale: f32,
    bounds: Bounds,
    /// Triangles left out because they have no area or a coordinate that is not finite.
    pub(super) degenerate: usize,
}

impl MeshTree {
    /// Builds over triangles in any coordinates.
    pub(super) fn build(triangles: &[([Vec3A; 3], TriangleRef)]) -> Self {
        let usable =
            |t: &[Vec3A; 3]| t.iter().all(|p| p.is_finite()) && Face::spanned_by([t[1] - t[0], t[2] - t[0]]).is_some();
        let bounds = Bounds::of_points(triangles.iter().filter(|(t, _)| usable(t)).flat_map(|(t, _)| *t));
        let (center, scale) = if bounds.is_finite() {
            let extent = (bounds.max - bounds.min).max_element();
            (exact_center(&bounds), 2f32.powi(9 - extent.max(1e-30).log2().floor() as i32))
        } else {
            (Vec3A::ZERO, 1.0)
        };
        let local: Vec<[Vec3A; 3]> = triangles.iter().map(|(t, _)| t.map(|p| (p - center) * scale)).collect();
        let boxes: Vec<Bounds> = triangles
            .iter()
            .zip(&local)
            .map(|((original, _), t)| if usable(original) { Bounds::of_points(*t) } else { Bounds::EMPTY })
            .collect();
        let references: Vec<TriangleRef> = triangles.iter().map(|(_, reference)| *reference).collect();
        let tree = WideTree::build(&local, &boxes, &references);
        let degenerate = boxes.iter().filter(|b| !b.is_finite()).count();
        Self { tree, center, scale, inverse_scale: 1.0 / scale, bounds, degenerate }
    }

    /// Bounds in the coordinates the tree was given; not finite when it is empty.
    pub(super) fn bounds(&self) -> Bounds {
        self.bounds
    }

    /// Memory in bytes.
    pub(super) fn bytes(&self) -> usize {
        self.tree.bytes()
    }

    /// The closest hit nearer than `t_max` that `accept` lets stand. `direction` has unit length.
    #[inline]
    pub(super) fn closest(
        &self,
        origin: Vec3A,
        direction: Vec3A,
        t_max: f32,
        accept: impl Fn(&MeshHit) -> bool,
    ) -> Option<MeshHit> {
        let origin = (origin - self.center) * self.scale;
        let given = |hit: &WideHit| self.given(hit);
        self.tree.closest(origin, direction, t_max * self.scale, |h| accept(&given(h))).as_ref().map(given)
    }

    /// Whether anything that `accept` lets stand is nearer than `t_max`.
    #[inline]
    pub(super) fn any(&self, origin: Vec3A, direction: Vec3A, t_max: f32, accept: impl Fn(&MeshHit) -> bool) -> bool {
        let origin = (origin - self.center) * self.scale;
        self.tree.any(origin, direction, t_max * self.scale, |h| accept(&self.given(h)))
    }

    /// Which triangle is at a [`MeshHit::place`].
    #[inline]
    pub(super) fn triangle(&self, place: u32) -> TriangleRef {
        self.tree.reference(place)
    }

    /// The triangle at a [`MeshHit::place`], in the coordinates that the tree was given, from memory that the walk has
    /// just read. The corner is exact.
    #[inline]
    pub(super) fn shape(&self, place: u32) -> TriangleShape {
        let [a, b, c] = self.tree.corners(place);
        TriangleShape {
            corner: a * self.inverse_scale + self.center,
            edges: [(b - a) * self.inverse_scale, (c - a) * self.inverse_scale],
        }
    }

    /// A hit in the coordinates that the tree was given.
    #[inline]
    fn given(&self, found: &WideHit) -> MeshHit {
        let hit = &found.hit;
        MeshHit { t: hit.t * self.inverse_scale, place: found.place, b1: hit.b1, b2: hit.b2 }
    }
}

/// The centre along axes where no number of the bounds is three times another, 0 along the others. Taken from a number
/// of at least its half and at most its double, a number leaves an exact difference (Sterbenz 1974).
fn exact_center(bounds: &Bounds) -> Vec3A {
    let center = 0.5 * bounds.min + 0.5 * bounds.max;
    let (low, high) = (bounds.min.abs().min(bounds.max.abs()), bounds.min.abs().max(bounds.max.abs()));
    let on_one_side = (bounds.min * bounds.max).cmpgt(Vec3A::ZERO);
    Vec3A::select(on_one_side & high.cmplt(2.9 * low), center, Vec3A::ZERO)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::tree::BinaryTree;
    use crate::geometry::triangle::ShearedRay;
    use crate::sampler::{hash_words, unit_of_hash};
    use glam::{Vec3, vec3a};

    /// A closed sphere of 20·4^`subdivisions` triangles.
    fn icosphere(subdivisions: u32, radius: f32) -> Vec<[Vec3A; 3]> {
        let phi = (1.0 + 5f32.sqrt()) / 2.0;
        let mut corners = Vec::new();
        for (a, b) in [(1.0, phi), (-1.0, phi), (1.0, -phi), (-1.0, -phi)] {
            corners.extend([Vec3::new(0.0, a, b), Vec3::new(a, b, 0.0), Vec3::new(b, 0.0, a)]);
        }
        let corners: Vec<Vec3A> = corners.into_iter().map(|c| Vec3A::from(c.normalize())).collect();
        let edge = corners[0].distance(corners[1]).min(corners[0].distance(corners[3]));
        let near = |a: Vec3A, b: Vec3A| (a.distance(b) - edge).abs() < 0.2;
        let mut triangles = Vec::new();
        for i in 0..12 {
            for j in i + 1..12 {
                for k in j + 1..12 {
                    if near(corners[i], corners[j]) && near(corners[j], corners[k]) && near(corners[i], corners[k]) {
                        triangles.push([corners[i], corners[j], corners[k]]);
                    }
                }
            }
        }
        assert_eq!(triangles.len(), 20);
        for _ in 0..subdivisions {
            triangles = triangles
                .iter()
                .flat_map(|&[a, b, c]| {
                    let (ab, bc, ca) = ((a + b).normalize(), (b + c).normalize(), (c + a).normalize());
                    [[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]
                })
                .collect();
        }
        triangles.iter().map(|t| t.map(|p| p * radius)).collect()
    }

    fn tree_of(triangles: &[[Vec3A; 3]]) -> MeshTree {
        let numbered: Vec<_> =
            triangles.iter().enumerate().map(|(i, t)| (*t, TriangleRef { instance: 0, triangle: i as u32 })).collect();
        MeshTree::build(&numbered)
    }

    /// Hazard 1: rays from inside a closed mesh aimed exactly at its vertices and edge midpoints never escape.
    #[test]
    fn no_ray_leaks_through_an_edge() {
        let triangles = icosphere(4, 1.0);
        let tree = tree_of(&triangles);
        let mut rays = 0;
        for origin in [Vec3A::ZERO, vec3a(0.3, -0.2, 0.1), vec3a(-0.5, 0.25, 0.6)] {
            for [a, b, c] in &triangles {
                for target in [*a, *b, *c, (*a + *b) * 0.5, (*b + *c) * 0.5, (*c + *a) * 0.5] {
                    let direction = (target - origin).normalize();
                    assert!(
                        tree.closest(origin, direction, f32::INFINITY, |_| true).is_some(),
                        "leak from {origin} to {target}"
                    );
                    rays += 1;
                }
            }
        }
        assert_eq!(rays, 3 * 6 * 20 * 256);
    }

    /// Hazard 2: a mesh of any size keeps all its hits (obvhs's wide tree alone loses 11 % at 1e-4 and all at 1e-5).
    #[test]
    fn tiny_and_huge_meshes_keep_their_hits() {
        for radius in [1e-6f32, 1e-4, 1.0, 1e5] {
            let tree = tree_of(&icosphere(2, radius));
            for i in 0..500 {
                let angle = i as f32 * 2.399_963;
                let z = 1.0 - 2.0 * (i as f32 + 0.5) / 500.0;
                let r = (1.0 - z * z).sqrt();
                let direction = vec3a(r * angle.cos(), r * angle.sin(), z);
                let hit = tree.closest(-direction * radius * 3.0, direction, f32::INFINITY, |_| true);
                let t = hit.unwrap_or_else(|| panic!("radius {radius}, direction {direction}: missed")).t;
                assert!((t / radius - 2.0).abs() < 0.1, "radius {radius}: t {t}");
                // And from a hair above the surface, where t is small.
                let start = direction * radius * 0.9;
                assert!(tree.any(start, direction, f32::INFINITY, |_| true), "radius {radius} from inside");
            }
        }
    }

    /// A triangle far away, or a large one, rounds no corner of a small one.
    #[test]
    fn far_things_leave_small_ones_as_they_are() {
        let small = [vec3a(0.123_456_79, 0.2, -0.3), vec3a(0.234_567_9, 0.2, -0.3), vec3a(0.1, 0.3, -0.312_345_67)];
        for far in [1e3f32, 1e5, 1e7, 1e12] {
            let tree = tree_of(&[small, [vec3a(far, 0.0, 0.0), vec3a(far, far, 0.0), vec3a(far, 0.0, 1.0)]]);
            let middle = (small[0] + small[1] + small[2]) / 3.0;
            let hit = tree.closest(middle + Vec3A::Z, -Vec3A::Z, f32::INFINITY, |_| true).expect("the small one");
            let found = tree.shape(hit.place);
            assert_eq!([found.corner, found.corner + found.edges[0]], [small[0], small[1]], "far: {far}");
            assert!((hit.t - 1.0).abs() < 1e-5, "far: {far}: {}", hit.t);
        }
        // What lies beside its origin is centred.
        let away = small.map(|corner| corner + 1e4);
        let tree = tree_of(&[away]);
        let hit = tree.closest(
            away[0] + 0.3 * (away[1] - away[0]) + 0.3 * (away[2] - away[0]) + Vec3A::Z,
            -Vec3A::Z,
            2.0,
            |_| true,
        );
        assert_eq!(tree.shape(hit.expect("hit").place).corner, away[0]);
    }

    /// Hazard 3, and triangles without area.
    #[test]
    fn broken_triangles_are_left_out_and_counted() {
        let mut triangles = icosphere(1, 1.0);
        triangles.push([Vec3A::NAN; 3]);
        triangles.push([vec3a(f32::INFINITY, 0.0, 0.0), Vec3A::ONE, Vec3A::ZERO]);
        triangles.push([Vec3A::ONE; 3]);
        let tree = tree_of(&triangles);
        assert_eq!(tree.degenerate, 3);
        assert!(tree.any(Vec3A::ZERO, Vec3A::X, f32::INFINITY, |_| true));
        assert!(!tree_of(&[[Vec3A::NAN; 3]]).any(Vec3A::ZERO, Vec3A::X, f32::INFINITY, |_| true));
        assert!(!tree_of(&[]).any(Vec3A::ZERO, Vec3A::X, f32::INFINITY, |_| true));
    }

    /// The wide tree, the binary tree and brute force agree on every ray.
    #[test]
    fn trees_agree_with_brute_force() {
        let triangles = icosphere(2, 1.0);
        let tree = tree_of(&triangles);
        let boxes: Vec<_> = triangles.iter().map(|t| Bounds::of_points(*t)).collect();
        let binary = BinaryTree::build(&boxes);
        let flat = |i: usize| triangles[i].map(|p| p.to_array());
        let mut hits = 0;
        for i in 0..3000u32 {
            let unit = |k: u32| unit_of_hash(hash_words(u64::from(i), u64::from(k))) * 2.0 - 1.0;
            let origin = vec3a(unit(0), unit(1), unit(2)) * 2.0;
            let direction = vec3a(unit(3), unit(4), unit(5)).normalize();
            let sheared = ShearedRay::new(origin, direction);
            let brute = (0..triangles.len())
                .filter_map(|i| sheared.intersect(&flat(i), f32::INFINITY))
                .map(|h| h.t)
                .fold(f32::INFINITY, f32::min);
            let wide = tree.closest(origin, direction, f32::INFINITY, |_| true).map_or(f32::INFINITY, |h| h.t);
            let mut two = f32::INFINITY;
            binary.closest(origin, direction, f32::INFINITY, |k, t_max| {
                let hit = sheared.intersect(&flat(binary.order()[k] as usize), t_max);
                two = hit.map_or(two, |hit| hit.t);
                hit.map_or(f32::INFINITY, |hit| hit.t)
            });
            assert_eq!(two, brute, "ray {i}");
            assert!(wide == brute || (wide - brute).abs() < 1e-5, "ray {i}: {wide} {brute}");
            hits += u32::from(brute.is_finite());
        }
        assert!(hits > 300, "{hits} rays hit: the test tests too little");
    }
}
