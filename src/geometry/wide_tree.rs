//! An eight-wide tree over triangles: what obvhs builds, cut and walked by us.
//!
//! A node holds the boxes of eight children, each plane of the eight side by side, so that one ray is tested
//! against all of them at once; a leaf is one block of up to [`LANES`] triangles in the same arrangement. The
//! nearest child is entered first. Two walks with the same arithmetic in the same order, one for AVX2 and one for
//! any machine, give equal bytes (`simd`); of hits at the same distance the smaller [`TriangleRef`] stands, so that
//! the order of the walk does not show.
//!
//! Not for primitives other than triangles, nor for a handful of them: the binary tree ([`super::tree`]) serves those.

mod walk;

use super::collapse;
use super::simd::{self, Kernels};
use super::tree::Bounds;
use super::triangle::{ShearedRay, TriangleHit};
use glam::Vec3A;

/// Children of a node, and triangles of a block.
pub(super) const LANES: usize = 8;

/// Which triangle of which instance.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct TriangleRef {
    /// Index of the instance in the scene; unused (0) where a tree is shared by several.
    pub(super) instance: u32,
    /// Index of the triangle in its mesh.
    pub(super) triangle: u32,
}

impl TriangleRef {
    /// Of the lanes of a block that hold no triangle.
    const NONE: Self = Self { instance: u32::MAX, triangle: u32::MAX };
}

/// A child of a node: another node, or a block of triangles.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Child(u32);

impl Child {
    const LEAF: u32 = 1 << 31;

    pub(super) fn node(index: usize) -> Self {
        Self(index as u32)
    }

    pub(super) fn block(index: usize) -> Self {
        Self(index as u32 | Self::LEAF)
    }
}

/// The boxes of eight children; 256 bytes, four cache lines.
#[derive(Clone, Debug)]
#[repr(C, align(64))]
pub(super) struct Node {
    /// Low x, high x, low y, high y, low z, high z. Children that are not there have boxes that no ray of numbers
    /// meets.
    pub(super) planes: [[f32; LANES]; 6],
    pub(super) children: [Child; LANES],
}

impl Node {
    pub(super) const EMPTY: Self = Self {
        planes: [
            [f32::INFINITY; LANES],
            [f32::NEG_INFINITY; LANES],
            [f32::INFINITY; LANES],
            [f32::NEG_INFINITY; LANES],
            [f32::INFINITY; LANES],
            [f32::NEG_INFINITY; LANES],
        ],
        // A leaf, not the root: a ray that is not a number is in every box, and must come to an end all the same.
        children: [Child(Child::LEAF); LANES],
    };

    pub(super) fn set(&mut self, slot: usize, min: Vec3A, max: Vec3A, child: Child) {
        for axis in 0..3 {
            self.planes[2 * axis][slot] = min[axis];
            self.planes[2 * axis + 1][slot] = max[axis];
        }
        self.children[slot] = child;
    }
}

/// Up to eight triangles.
#[derive(Clone, Debug)]
#[repr(C, align(32))]
pub(super) struct Block {
    /// Corners by axis, then vertex, then lane. Lanes without a triangle are NaN, which no test accepts.
    pub(super) corners: [[[f32; LANES]; 3]; 3],
}

impl Block {
    const EMPTY: Self = Self { corners: [[[f32::NAN; LANES]; 3]; 3] };

    #[inline(always)]
    fn triangle(&self, lane: usize) -> [[f32; 3]; 3] {
        std::array::from_fn(|vertex| std::array::from_fn(|axis| self.corners[axis][vertex][lane]))
    }
}

/// A ray made ready for box tests.
#[derive(Clone, Copy, Debug)]
pub(super) struct BoxRay {
    pub(super) origin: [f32; 3],
    /// Inverse direction.
    pub(super) inverse: [f32; 3],
    /// Inverse direction, a little longer, so that rounding never closes a box that the exact ray meets: two distances
    /// have three roundings each, 6 · 2⁻²⁴ = 3.6e-7 (Ize, "Robust BVH Ray Traversal", JCGT 2013).
    pub(super) inverse_far: [f32; 3],
    /// Rows of [`Node::planes`] that the ray meets first, by axis.
    pub(super) near: [usize; 3],
}

impl BoxRay {
    fn new(origin: Vec3A, direction: Vec3A) -> Self {
        // Finite, so that no product with it is NaN.
        const LEAST: Vec3A = Vec3A::splat(1e-18);
        let too_small = direction.abs().cmplt(LEAST);
        let inverse = 1.0 / Vec3A::select(too_small, LEAST.copysign(direction), direction);
        let negative = inverse.cmplt(Vec3A::ZERO).bitmask() as usize;
        Self {
            origin: origin.to_array(),
            inverse: inverse.to_array(),
            inverse_far: (inverse * 1.000_000_4).to_array(),
            near: std::array::from_fn(|axis| 2 * axis + (negative >> axis & 1)),
        }
    }
}

/// A number a lane, where vector stores do not straddle cache lines.
#[derive(Clone, Copy, Debug, PartialEq)]
#[repr(C, align(32))]
pub(super) struct Lanes(pub(super) [f32; LANES]);

impl Lanes {
    #[inline(always)]
    fn get(&self, lane: u32) -> f32 {
        self.0[lane as usize & (LANES - 1)]
    }
}

/// The children of a node that a ray meets: one bit each, and at what distances.
pub(super) struct Met {
    pub(super) slots: u32,
    pub(super) distances: Lanes,
}

/// The triangles of a block that a ray hits.
pub(super) struct Candidates {
    /// One bit each: hit at 0 < t ≤ `t_max`, or `near` or `doubtful`.
    pub(super) lanes: u32,
    /// One bit each: on an edge to within f32, so that [`ShearedRay::intersect`] must decide.
    pub(super) doubtful: u32,
    /// One bit each: so near that [`ShearedRay::distance_to_plane`] must say whether it is ahead, and where.
    pub(super) near: u32,
    pub(super) t: Lanes,
    pub(super) b1: Lanes,
    pub(super) b2: Lanes,
}

/// A triangle hit by a ray.
#[derive(Clone, Copy, Debug)]
pub(super) struct WideHit {
    /// Where the tree has the triangle, for [`WideTree::reference`] and [`WideTree::corners`].
    pub(super) place: u32,
    pub(super) hit: TriangleHit,
}

/// An eight-wide tree over triangles, as the module describes it.
pub(super) struct WideTree {
    nodes: Vec<Node>,
    blocks: Vec<Block>,
    /// By block and lane.
    references: Vec<TriangleRef>,
    root: Option<Child>,
    kernels: Kernels,
}

impl WideTree {
    /// Builds over triangles; those whose entry in `bounds` is not finite are left out.
    pub(super) fn build(triangles: &[[Vec3A; 3]], bounds: &[Bounds], references: &[TriangleRef]) -> Self {
        let cut = collapse::build(bounds);
        let mut tree = Self {
            nodes: cut.nodes,
            blocks: vec![Block::EMPTY; cut.blocks.len()],
            references: vec![TriangleRef::NONE; cut.blocks.len() * LANES],
            root: cut.root,
            kernels: Kernels::best(),
        };
        for (index, range) in cut.blocks.iter().enumerate() {
            for (lane, &number) in cut.order[range.clone()].iter().enumerate() {
                let corners = triangles[number as usize];
                for (vertex, corner) in corners.iter().enumerate() {
                    for axis in 0..3 {
                        tree.blocks[index].corners[axis][vertex][lane] = corner[axis];
                    }
                }
                tree.references[index * LANES + lane] = references[number as usize];
            }
        }
        tree
    }

    /// Which triangle is at a [`WideHit::place`]. Read once a ray, not once a candidate: in a large tree that is a wait
    /// for memory.
    #[inline]
    pub(super) fn reference(&self, place: u32) -> TriangleRef {
        self.references[place as usize]
    }

    /// The corners of the triangle of a [`WideHit::place`].
    #[inline]
    pub(super) fn corners(&self, place: u32) -> [Vec3A; 3] {
        let (block, lane) = (&self.blocks[place as usize / LANES], place as usize % LANES);
        let [x, y, z] = &block.corners;
        std::array::from_fn(|vertex| Vec3A::new(x[vertex][lane], y[vertex][lane], z[vertex][lane]))
    }

    /// Memory in bytes.
    pub(super) fn bytes(&self) -> usize {
        std::mem::size_of_val(&self.nodes[..])
            + std::mem::size_of_val(&self.blocks[..])
            + std::mem::size_of_val(&self.references[..])
    }

    /// The closest hit nearer than `t_max` that `accept` lets stand.
    #[inline]
    pub(super) fn closest(
        &self,
        origin: Vec3A,
        direction: Vec3A,
        t_max: f32,
        accept: impl Fn(&WideHit) -> bool,
    ) -> Option<WideHit> {
        let boxes = BoxRay::new(origin, direction);
        let sheared = ShearedRay::with_inverse(origin, direction, boxes.inverse);
        simd::closest(self.kernels, self, &boxes, &sheared, t_max, accept)
    }

    /// Whether anything that `accept` lets stand is nearer than `t_max`.
    #[inline]
    pub(super) fn any(&self, origin: Vec3A, direction: Vec3A, t_max: f32, accept: impl Fn(&WideHit) -> bool) -> bool {
        let boxes = BoxRay::new(origin, direction);
        let sheared = ShearedRay::with_inverse(origin, direction, boxes.inverse);
        simd::any(self.kernels, self, &boxes, &sheared, t_max, accept)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sampler::{hash_words, unit_of_hash};
    use glam::vec3a;

    fn unit(ray: u64, k: u64) -> f32 {
        unit_of_hash(hash_words(ray, k)) * 2.0 - 1.0
    }

    fn build(triangles: &[[Vec3A; 3]]) -> WideTree {
        let bounds: Vec<_> = triangles.iter().map(|t| Bounds::of_points(*t)).collect();
        let references: Vec<_> =
            (0..triangles.len() as u32).map(|triangle| TriangleRef { instance: 0, triangle }).collect();
        WideTree::build(triangles, &bounds, &references)
    }

    /// Small triangles all over the place, each given twice.
    fn clutter() -> Vec<[Vec3A; 3]> {
        let once = (0..700).map(|i| {
            let place = vec3a(unit(i, 0), unit(i, 1), unit(i, 2));
            [0, 1, 2].map(|corner| place + 0.2 * vec3a(unit(i, 3 + corner), unit(i, 6 + corner), unit(i, 9 + corner)))
        });
        once.clone().chain(once).collect()
    }

    /// Rays from anywhere to anywhere, some along an axis.
    fn rays() -> impl Iterator<Item = (Vec3A, Vec3A)> {
        (0..6000u64).map(|i| {
            let origin = 2.0 * vec3a(unit(i, 20), unit(i, 21), unit(i, 22));
            let direction = match i % 8 {
                0 => Vec3A::X,
                1 => Vec3A::NEG_Z,
                2 => vec3a(0.6, -0.8, 0.0),
                _ => (vec3a(unit(i, 23), unit(i, 24), unit(i, 25)) - origin).normalize(),
            };
            (origin, direction)
        })
    }

    fn bits(hit: &TriangleHit) -> [u32; 3] {
        [hit.t, hit.b1, hit.b2].map(f32::to_bits)
    }

    /// A ray that is not a number is in every box, those of empty slots among them, which lead back to the root.
    /// Regression: the walk took all memory.
    #[test]
    fn rays_without_numbers_end_and_hit_nothing() {
        let mut tree = build(&clutter());
        let nan = Vec3A::splat(f32::NAN);
        for kernels in [Kernels::best(), Kernels::PORTABLE] {
            tree.kernels = kernels;
            for (origin, direction) in [(nan, Vec3A::X), (Vec3A::ZERO, nan), (nan, nan)] {
                assert!(tree.closest(origin, direction, f32::INFINITY, |_| true).is_none());
                assert!(!tree.any(origin, direction, f32::INFINITY, |_| true));
            }
        }
    }

    /// Every set of instructions gives the same bytes as testing all triangles one by one does, of two equal hits the
    /// one with the smaller number.
    #[test]
    fn all_paths_equal_brute_force_to_the_bit() {
        let triangles = clutter();
        let mut tree = build(&triangles);
        let mut hits = 0;
        for (i, (origin, direction)) in rays().enumerate() {
            let sheared = ShearedRay::new(origin, direction);
            let mut brute: Option<(u32, TriangleHit)> = None;
            for (number, corners) in triangles.iter().enumerate() {
                let t_max = brute.map_or(f32::INFINITY, |(_, b)| b.t);
                match sheared.intersect(&corners.map(|c| c.to_array()), t_max) {
                    Some(hit) if hit.t < t_max => brute = Some((number as u32, hit)),
                    _ => {}
                }
            }
            hits += u32::from(brute.is_some());
            for kernels in [Kernels::best(), Kernels::PORTABLE] {
                tree.kernels = kernels;
                let closest = tree.closest(origin, direction, f32::INFINITY, |_| true);
                let found = closest.map(|h| (tree.reference(h.place).triangle, bits(&h.hit)));
                let expected = brute.map(|(number, hit)| (number, bits(&hit)));
                assert_eq!(found, expected, "ray {i}, {kernels:?}: {closest:?}, not {brute:?}");
                assert_eq!(
                    tree.any(origin, direction, f32::INFINITY, |_| true),
                    brute.is_some(),
                    "ray {i}, {kernels:?}"
                );
                if let Some((number, TriangleHit { t, .. })) = brute {
                    assert!(!tree.any(origin, direction, t, |_| true), "ray {i}: a hit at the end is not before it");
                    assert!(tree.closest(origin, direction, t, |_| true).is_none(), "ray {i}");
                    let is_other = |h: &WideHit| tree.reference(h.place).triangle != number;
                    let rest = tree.closest(origin, direction, f32::INFINITY, is_other);
                    let twin = tree.reference(rest.expect("each triangle is there twice").place).triangle;
                    assert_eq!(twin, number + 700, "ray {i}: the twin of what is not accepted");
                }
            }
        }
        assert!(hits > 2000, "{hits} rays hit: the test tests too little");
    }

    /// Each triangle is in one block once, and no box leaves out what lies under it.
    #[test]
    fn nodes_hold_what_is_below_them() {
        let triangles = clutter();
        let tree = build(&triangles);
        let mut seen = vec![0; triangles.len()];
        let everywhere = Bounds { min: Vec3A::NEG_INFINITY, max: Vec3A::INFINITY };
        let mut open = vec![(tree.root.expect("not empty"), everywhere)];
        while let Some((child, bounds)) = open.pop() {
            let index = (child.0 & !Child::LEAF) as usize;
            if child.0 & Child::LEAF != 0 {
                for lane in 0..LANES {
                    let reference = tree.references[index * LANES + lane];
                    if reference != TriangleRef::NONE {
                        seen[reference.triangle as usize] += 1;
                        for corner in tree.blocks[index].triangle(lane).map(Vec3A::from) {
                            assert!(corner.cmpge(bounds.min).all() && corner.cmple(bounds.max).all());
                        }
                    }
                }
                continue;
            }
            let node = &tree.nodes[index];
            let slots = (0..LANES).filter(|&slot| node.planes[0][slot] <= node.planes[1][slot]);
            for slot in slots {
                let plane = |row: usize| node.planes[row][slot];
                let min = vec3a(plane(0), plane(2), plane(4));
                let max = vec3a(plane(1), plane(3), plane(5));
                assert!(min.cmpge(bounds.min).all() && max.cmple(bounds.max).all());
                open.push((node.children[slot], Bounds { min, max }));
            }
        }
        assert!(seen.iter().all(|&times| times == 1));
    }
}
