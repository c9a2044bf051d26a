//! obvhs, fenced: the builder of every tree, and the walk of the binary ones.
//!
//! Triangles are walked in an eight-wide tree of our own (`wide_tree`), cut from what `build_binary` makes.
//!
//! Four hazards of obvhs 0.4, each kept out and each with a regression test (here, in `mesh_tree` and in `world`):
//! 1. its triangle test leaks at edges: we bring our own, and pad the boxes by 2e-7 of their largest coordinate;
//! 2. its wide tree drops hits nearer than a ray parameter of 1e-4: it is not used;
//! 3. boxes that are not finite panic the builder: they are given to no builder, and never hit;
//! 4. many coinciding centroids make the search quadratic: then the fastest preset is used.

use glam::Vec3A;
use obvhs::aabb::Aabb;
use obvhs::bvh2::Bvh2;
use obvhs::bvh2::reinsertion::ReinsertionOptimizer;
use obvhs::ploc::PlocBuilder;
use obvhs::ray::{Ray as TreeRay, RayHit};
use obvhs::{Boundable, BvhBuildParams};

/// Axis-aligned box of a primitive.
#[derive(Clone, Copy, Debug)]
pub struct Bounds {
    /// Smallest coordinates.
    pub min: Vec3A,
    /// Largest coordinates.
    pub max: Vec3A,
}

impl Bounds {
    /// The box of nothing; grows from here.
    pub const EMPTY: Self = Self { min: Vec3A::INFINITY, max: Vec3A::NEG_INFINITY };

    /// The box of some points.
    pub fn of_points(points: impl IntoIterator<Item = Vec3A>) -> Self {
        points.into_iter().fold(Self::EMPTY, |b, p| Self { min: b.min.min(p), max: b.max.max(p) })
    }

    /// The box of both.
    pub fn union(self, other: Self) -> Self {
        Self { min: self.min.min(other.min), max: self.max.max(other.max) }
    }

    /// The box's eight corners.
    pub(crate) fn corners(self) -> [Vec3A; 8] {
        let pick = |corner: usize, axis: usize| if corner >> axis & 1 == 0 { self.min[axis] } else { self.max[axis] };
        std::array::from_fn(|corner| Vec3A::new(pick(corner, 0), pick(corner, 1), pick(corner, 2)))
    }

    /// Whether all six numbers are finite (an empty box is not).
    pub fn is_finite(self) -> bool {
        self.min.is_finite() && self.max.is_finite()
    }

    /// Grown by 2e-7 of the largest coordinate, which closes the rounding of box and triangle tests (obvhs's own walk:
    /// 3 leaks in 153,600 rays at edges without, 0 with). Of all axes, since the triangle test shears one into another.
    fn padded(self) -> Self {
        let pad = Vec3A::splat(self.min.abs().max(self.max.abs()).max_element() * 2e-7 + f32::MIN_POSITIVE);
        Self { min: self.min - pad, max: self.max + pad }
    }
}

/// A padded box.
pub struct Boxed(Aabb);

impl Boundable for Boxed {
    fn aabb(&self) -> Aabb {
        self.0
    }
}

/// obvhs's binary tree over numbered primitives, walked by obvhs: for few large things such as instances, in
/// any coordinates. Callers reorder their primitives by [`BinaryTree::order`] once and are then called back
/// with positions in that order.
pub struct BinaryTree {
    tree: Bvh2,
    order: Vec<u32>,
}

/// Boxes that may be built with, and their primitive numbers.
struct Input {
    boxes: Vec<Boxed>,
    numbers: Vec<u32>,
    params: BvhBuildParams,
}

fn prepare(bounds: &[Bounds]) -> Input {
    let mut boxes = Vec::with_capacity(bounds.len());
    let mut numbers = Vec::with_capacity(bounds.len());
    for (number, b) in bounds.iter().enumerate() {
        if b.is_finite() {
            let padded = b.padded();
            boxes.push(Boxed(Aabb::new(padded.min, padded.max)));
            numbers.push(number as u32);
        }
    }
    let params = if most_coinciding_centroids(&boxes) > 1_000 {
        BvhBuildParams::fastest_build()
    } else {
        BvhBuildParams::medium_build()
    };
    Input { boxes, numbers, params }
}

/// What obvhs built.
pub(super) struct BuiltTree {
    pub(super) tree: Bvh2,
    /// Number of each box as it was given, by obvhs's primitive index.
    pub(super) numbers: Vec<u32>,
}

/// Builds obvhs's binary tree with one primitive a leaf; boxes that are not finite are left out.
pub(super) fn build_binary(bounds: &[Bounds]) -> BuiltTree {
    let Input { boxes, numbers, params } = prepare(bounds);
    let all = (0..boxes.len() as u32).collect();
    let mut tree = PlocBuilder::with_capacity(boxes.len()).build(
        params.ploc_search_distance,
        &boxes,
        all,
        params.sort_precision,
        params.search_depth_threshold,
    );
    ReinsertionOptimizer::default().run(&mut tree, params.reinsertion_batch_ratio, None);
    BuiltTree { tree, numbers }
}

/// The size of the largest set of boxes with the very same centroid.
fn most_coinciding_centroids(boxes: &[Boxed]) -> usize {
    let mut keys: Vec<[u32; 3]> = boxes.iter().map(|b| b.0.center().to_array().map(f32::to_bits)).collect();
    keys.sort_unstable();
    keys.chunk_by(|a, b| a == b).map(<[_]>::len).max().unwrap_or(0)
}

impl BinaryTree {
    /// Builds over the boxes of primitives 0, 1, …; primitives whose box is not finite are left out.
    pub fn build(bounds: &[Bounds]) -> Self {
        let BuiltTree { tree, numbers } = build_binary(bounds);
        let order = tree.primitive_indices.iter().map(|&i| numbers[i as usize]).collect();
        Self { tree, order }
    }

    /// Primitive numbers in tree order.
    pub fn order(&self) -> &[u32] {
        &self.order
    }

    /// Calls `test(position in tree order, current t_max)` for candidates along the ray; what it returns below the
    /// current `t_max` becomes the new one.
    #[inline]
    pub fn closest(&self, origin: Vec3A, direction: Vec3A, t_max: f32, mut test: impl FnMut(usize, f32) -> f32) {
        let ray = TreeRay::new(origin, direction, 0.0, t_max);
        self.tree.ray_traverse(ray, &mut RayHit::none(), |ray, id| test(id, ray.tmax));
    }

    /// Whether any `test` returns less than `t_max`; stops at the first.
    #[inline]
    pub fn any(&self, origin: Vec3A, direction: Vec3A, t_max: f32, mut test: impl FnMut(usize, f32) -> f32) -> bool {
        let ray = TreeRay::new(origin, direction, 0.0, t_max);
        !self.tree.ray_traverse_miss(ray, |ray, id| test(id, ray.tmax))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn unit_box(at: f32) -> Bounds {
        Bounds { min: Vec3A::splat(at), max: Vec3A::splat(at + 1.0) }
    }

    fn build_and_count(bounds: &[Bounds]) -> usize {
        let tree = BinaryTree::build(bounds);
        let mut found = 0;
        tree.any(Vec3A::splat(-10.0), Vec3A::ONE.normalize(), f32::INFINITY, |_, _| {
            found += 1;
            f32::INFINITY
        });
        found
    }

    #[test]
    fn boxes_that_are_not_finite_are_left_out() {
        let bad = Bounds { min: Vec3A::splat(f32::NAN), max: Vec3A::ONE };
        let infinite = Bounds { min: Vec3A::ZERO, max: Vec3A::splat(f32::INFINITY) };
        let bounds = [bad, unit_box(0.0), infinite, unit_box(3.0), Bounds::EMPTY];
        assert_eq!(BinaryTree::build(&bounds).order().len(), 2);
        assert_eq!(build_and_count(&bounds), 2);
    }

    #[test]
    fn nothing_and_one_thing_build() {
        assert_eq!(build_and_count(&[]), 0);
        assert_eq!(build_and_count(&[unit_box(0.0)]), 1);
    }

    /// 20,000 identical boxes take 11 s with the medium preset, 0.85 s with the fastest: chosen by count, not by a
    /// clock.
    #[test]
    fn coinciding_centroids_choose_the_fast_builder() {
        let fastest = BvhBuildParams::fastest_build().reinsertion_batch_ratio;
        assert_eq!(prepare(&[unit_box(0.0); 2_000]).params.reinsertion_batch_ratio, fastest);
        let spread: Vec<_> = (0..2_000).map(|i| unit_box(i as f32)).collect();
        assert!(prepare(&spread).params.reinsertion_batch_ratio > fastest);
    }
}
