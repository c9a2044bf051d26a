//! Box and triangle tests of eight lanes at once, for AVX2 and for any machine, the choice between the two, and the
//! same choice for work elsewhere that the compiler turns into vectors.
//!
//! Both have the same operations in the same order and no fused multiply-add, so their results are equal to the bit;
//! minimum and maximum are x86's: the second operand where one is NaN. The only `unsafe` besides that of
//! `denoise/oidn/library.rs` is here: calling a function that was compiled for AVX2, after asking the machine whether
//! it has it, and prefetching.

#![allow(
    unsafe_code,
    reason = "calls into functions compiled for AVX2: 2 times the rays a second (benches/results/transport.md)"
)]

use super::triangle::ShearedRay;
use super::wide_tree::{Block, BoxRay, Candidates, LANES, Lanes, Met, Node, WideHit, WideTree};

/// Which kernels a tree is walked with.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Kernels(Instructions);

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Instructions {
    Portable,
    #[cfg(target_arch = "x86_64")]
    Avx2,
}

impl Kernels {
    /// Kernels for any machine.
    pub(super) const PORTABLE: Self = Self(Instructions::Portable);

    /// The fastest that this machine has.
    pub(super) fn best() -> Self {
        #[cfg(target_arch = "x86_64")]
        if is_x86_feature_detected!("avx2") {
            return Self(Instructions::Avx2);
        }
        Self::PORTABLE
    }
}

/// Work on several values at once, as loops that the compiler turns into vectors.
pub(crate) trait VectorWork {
    /// Does it. `#[inline(always)]`, as must be all that it calls: what is no part of [`with_vectors`] is not compiled
    /// for vectors.
    fn run(self);
}

/// Does work with the best vectors that this machine has. The results are equal to the bit on all.
#[inline]
pub(crate) fn with_vectors(work: impl VectorWork) {
    match Kernels::best().0 {
        // SAFETY: `Avx2` is made by `Kernels::best` alone, and only where the machine has AVX2.
        #[cfg(target_arch = "x86_64")]
        Instructions::Avx2 => unsafe { avx2::run(work) },
        Instructions::Portable => work.run(),
    }
}

/// Asks for the cache lines of a value that is about to be read.
#[inline(always)]
pub(crate) fn prefetch<T>(value: &T) {
    #[cfg(target_arch = "x86_64")]
    for offset in (0..size_of::<T>()).step_by(64) {
        use std::arch::x86_64::{_MM_HINT_T0, _mm_prefetch};
        let line = std::ptr::from_ref(value).cast::<i8>().wrapping_add(offset);
        // SAFETY: a prefetch reads nothing that the program sees and faults at no address.
        unsafe { _mm_prefetch::<_MM_HINT_T0>(line) };
    }
}

/// [`WideTree::walk_closest`] with the kernels that are told.
#[inline]
pub(super) fn closest(
    kernels: Kernels,
    tree: &WideTree,
    boxes: &BoxRay,
    sheared: &ShearedRay,
    t_max: f32,
    accept: impl Fn(&WideHit) -> bool,
) -> Option<WideHit> {
    match kernels.0 {
        // SAFETY: `Avx2` is made by `Kernels::best` alone, and only where the machine has AVX2.
        #[cfg(target_arch = "x86_64")]
        Instructions::Avx2 => unsafe { avx2::closest(tree, boxes, sheared, t_max, accept) },
        Instructions::Portable => tree.walk_closest(
            sheared,
            t_max,
            |node, t_max| portable::meet(node, boxes, t_max),
            |block, t_max| portable::hits(block, sheared, t_max),
            accept,
        ),
    }
}

/// [`WideTree::walk_any`] with the kernels that are told.
#[inline]
pub(super) fn any(
    kernels: Kernels,
    tree: &WideTree,
    boxes: &BoxRay,
    sheared: &ShearedRay,
    t_max: f32,
    accept: impl Fn(&WideHit) -> bool,
) -> bool {
    match kernels.0 {
        // SAFETY: `Avx2` is made by `Kernels::best` alone, and only where the machine has AVX2.
        #[cfg(target_arch = "x86_64")]
        Instructions::Avx2 => unsafe { avx2::any(tree, boxes, sheared, t_max, accept) },
        Instructions::Portable => tree.walk_any(
            sheared,
            t_max,
            |node, t_max| portable::meet(node, boxes, t_max),
            |block, t_max| portable::hits(block, sheared, t_max),
            accept,
        ),
    }
}

#[cfg(target_arch = "x86_64")]
mod avx2 {
    use super::*;
    use bytemuck::cast;
    use std::arch::x86_64::*;

    #[target_feature(enable = "avx2")]
    pub(super) fn run(work: impl VectorWork) {
        work.run();
    }

    #[target_feature(enable = "avx2")]
    pub(super) fn closest(
        tree: &WideTree,
        boxes: &BoxRay,
        sheared: &ShearedRay,
        t_max: f32,
        accept: impl Fn(&WideHit) -> bool,
    ) -> Option<WideHit> {
        let (boxes, edges) = (WideBoxRay::new(boxes), WideShear::new(sheared));
        tree.walk_closest(
            sheared,
            t_max,
            |node, t_max| meet(node, &boxes, t_max),
            |block, t_max| hits(block, &edges, t_max),
            accept,
        )
    }

    #[target_feature(enable = "avx2")]
    pub(super) fn any(
        tree: &WideTree,
        boxes: &BoxRay,
        sheared: &ShearedRay,
        t_max: f32,
        accept: impl Fn(&WideHit) -> bool,
    ) -> bool {
        let (boxes, edges) = (WideBoxRay::new(boxes), WideShear::new(sheared));
        tree.walk_any(
            sheared,
            t_max,
            |node, t_max| meet(node, &boxes, t_max),
            |block, t_max| hits(block, &edges, t_max),
            accept,
        )
    }

    struct WideBoxRay {
        origin: [__m256; 3],
        inverse: [__m256; 3],
        inverse_far: [__m256; 3],
        near: [usize; 3],
    }

    impl WideBoxRay {
        #[inline]
        #[target_feature(enable = "avx2")]
        fn new(ray: &BoxRay) -> Self {
            let splat = |v: [f32; 3]| [_mm256_set1_ps(v[0]), _mm256_set1_ps(v[1]), _mm256_set1_ps(v[2])];
            Self {
                origin: splat(ray.origin),
                inverse: splat(ray.inverse),
                inverse_far: splat(ray.inverse_far),
                near: ray.near,
            }
        }
    }

    #[inline]
    #[target_feature(enable = "avx2")]
    fn meet(node: &Node, ray: &WideBoxRay, t_max: f32) -> Met {
        let near = |axis: usize| {
            let plane: __m256 = cast(node.planes[ray.near[axis]]);
            _mm256_mul_ps(_mm256_sub_ps(plane, ray.origin[axis]), ray.inverse[axis])
        };
        let far = |axis: usize| {
            let plane: __m256 = cast(node.planes[ray.near[axis] ^ 1]);
            _mm256_mul_ps(_mm256_sub_ps(plane, ray.origin[axis]), ray.inverse_far[axis])
        };
        let enter = _mm256_max_ps(_mm256_max_ps(near(0), near(1)), _mm256_max_ps(near(2), _mm256_setzero_ps()));
        let leave = _mm256_min_ps(_mm256_min_ps(far(0), far(1)), _mm256_min_ps(far(2), _mm256_set1_ps(t_max)));
        let met = _mm256_movemask_ps(_mm256_cmp_ps::<_CMP_LE_OQ>(enter, leave));
        Met { slots: met as u32, distances: Lanes(cast(enter)) }
    }

    struct WideShear {
        origin: [__m256; 3],
        shear: [__m256; 2],
        scale_z: __m256,
        near_scale: __m256,
        axes: [usize; 3],
    }

    impl WideShear {
        #[inline]
        #[target_feature(enable = "avx2")]
        fn new(ray: &ShearedRay) -> Self {
            Self {
                origin: [
                    _mm256_set1_ps(ray.origin[ray.axes[0]]),
                    _mm256_set1_ps(ray.origin[ray.axes[1]]),
                    _mm256_set1_ps(ray.origin[ray.axes[2]]),
                ],
                shear: [_mm256_set1_ps(ray.shear_x), _mm256_set1_ps(ray.shear_y)],
                scale_z: _mm256_set1_ps(ray.scale_z),
                near_scale: _mm256_set1_ps(ray.near_scale),
                axes: ray.axes,
            }
        }
    }

    #[inline]
    #[target_feature(enable = "avx2")]
    fn hits(block: &Block, ray: &WideShear, t_max: f32) -> Candidates {
        let [xs, ys, zs] = [&block.corners[ray.axes[0]], &block.corners[ray.axes[1]], &block.corners[ray.axes[2]]];
        let sheared = |vertex: usize| {
            let z = _mm256_sub_ps(cast(zs[vertex]), ray.origin[2]);
            let x = _mm256_sub_ps(cast(xs[vertex]), ray.origin[0]);
            let y = _mm256_sub_ps(cast(ys[vertex]), ray.origin[1]);
            [_mm256_sub_ps(x, _mm256_mul_ps(ray.shear[0], z)), _mm256_sub_ps(y, _mm256_mul_ps(ray.shear[1], z)), z]
        };
        let (a, b, c) = (sheared(0), sheared(1), sheared(2));
        let cross =
            |p: &[__m256; 3], q: &[__m256; 3]| _mm256_sub_ps(_mm256_mul_ps(p[0], q[1]), _mm256_mul_ps(p[1], q[0]));
        let (u, v, w) = (cross(&c, &b), cross(&a, &c), cross(&b, &a));
        let zero = _mm256_setzero_ps();
        let least = _mm256_min_ps(_mm256_min_ps(u, v), w);
        let most = _mm256_max_ps(_mm256_max_ps(u, v), w);
        let inside = _mm256_or_ps(_mm256_cmp_ps::<_CMP_GE_OQ>(least, zero), _mm256_cmp_ps::<_CMP_LE_OQ>(most, zero));
        let inside_lanes = _mm256_movemask_ps(inside) as u32;
        if inside_lanes == 0 {
            let none = Lanes([0.0; LANES]);
            return Candidates { lanes: 0, doubtful: 0, near: 0, t: none, b1: none, b2: none };
        }
        let equal = |x: __m256| _mm256_cmp_ps::<_CMP_EQ_OQ>(x, zero);
        let doubtful =
            inside_lanes & _mm256_movemask_ps(_mm256_or_ps(equal(u), _mm256_or_ps(equal(v), equal(w)))) as u32;
        let inverse = _mm256_div_ps(_mm256_set1_ps(1.0), _mm256_add_ps(_mm256_add_ps(u, v), w));
        let sum = _mm256_add_ps(_mm256_add_ps(_mm256_mul_ps(u, a[2]), _mm256_mul_ps(v, b[2])), _mm256_mul_ps(w, c[2]));
        let t = _mm256_mul_ps(_mm256_mul_ps(ray.scale_z, sum), inverse);
        let ahead = _mm256_cmp_ps::<_CMP_GT_OQ>(t, zero);
        let before = _mm256_cmp_ps::<_CMP_LE_OQ>(t, _mm256_set1_ps(t_max));
        let between = _mm256_movemask_ps(_mm256_and_ps(ahead, before)) as u32;
        let sign = _mm256_set1_ps(-0.0);
        let magnitude = |x: __m256| _mm256_andnot_ps(sign, x);
        let farthest = _mm256_max_ps(_mm256_max_ps(magnitude(a[2]), magnitude(b[2])), magnitude(c[2]));
        let near = _mm256_cmp_ps::<_CMP_LT_OQ>(magnitude(t), _mm256_mul_ps(ray.near_scale, farthest));
        let near = inside_lanes & _mm256_movemask_ps(near) as u32;
        Candidates {
            lanes: inside_lanes & between | near | doubtful,
            doubtful,
            near,
            t: Lanes(cast(t)),
            b1: Lanes(cast(_mm256_mul_ps(v, inverse))),
            b2: Lanes(cast(_mm256_mul_ps(w, inverse))),
        }
    }
}

/// Whole arrays at each step, so that the compiler can use what vectors the target has.
mod portable {
    use super::*;
    use std::array::from_fn;

    type Row = [f32; LANES];

    fn min(a: f32, b: f32) -> f32 {
        if a < b { a } else { b }
    }

    fn max(a: f32, b: f32) -> f32 {
        if a > b { a } else { b }
    }

    /// One bit for each lane.
    fn mask(lanes: [bool; LANES]) -> u32 {
        let bits: [u32; LANES] = from_fn(|lane| u32::from(lanes[lane]) << lane);
        bits.iter().fold(0, |all, bit| all | bit)
    }

    #[inline]
    pub(super) fn meet(node: &Node, ray: &BoxRay, t_max: f32) -> Met {
        let near = |axis: usize| -> Row {
            let plane = &node.planes[ray.near[axis]];
            from_fn(|lane| (plane[lane] - ray.origin[axis]) * ray.inverse[axis])
        };
        let far = |axis: usize| -> Row {
            let plane = &node.planes[ray.near[axis] ^ 1];
            from_fn(|lane| (plane[lane] - ray.origin[axis]) * ray.inverse_far[axis])
        };
        let (x, y, z) = (near(0), near(1), near(2));
        let enter: Row = from_fn(|lane| max(max(x[lane], y[lane]), max(z[lane], 0.0)));
        let (x, y, z) = (far(0), far(1), far(2));
        let leave: Row = from_fn(|lane| min(min(x[lane], y[lane]), min(z[lane], t_max)));
        Met { slots: mask(from_fn(|lane| enter[lane] <= leave[lane])), distances: Lanes(enter) }
    }

    #[inline]
    pub(super) fn hits(block: &Block, ray: &ShearedRay, t_max: f32) -> Candidates {
        let [xs, ys, zs] = ray.axes.map(|axis| &block.corners[axis]);
        let origin = ray.axes.map(|axis| ray.origin[axis]);
        let sheared = |vertex: usize| -> [Row; 3] {
            let z: Row = from_fn(|lane| zs[vertex][lane] - origin[2]);
            [
                from_fn(|lane| (xs[vertex][lane] - origin[0]) - ray.shear_x * z[lane]),
                from_fn(|lane| (ys[vertex][lane] - origin[1]) - ray.shear_y * z[lane]),
                z,
            ]
        };
        let (a, b, c) = (sheared(0), sheared(1), sheared(2));
        let cross =
            |p: &[Row; 3], q: &[Row; 3]| -> Row { from_fn(|lane| p[0][lane] * q[1][lane] - p[1][lane] * q[0][lane]) };
        let (u, v, w) = (cross(&c, &b), cross(&a, &c), cross(&b, &a));
        let least: Row = from_fn(|lane| min(min(u[lane], v[lane]), w[lane]));
        let most: Row = from_fn(|lane| max(max(u[lane], v[lane]), w[lane]));
        let inside = mask(from_fn(|lane| (least[lane] >= 0.0) | (most[lane] <= 0.0)));
        if inside == 0 {
            let none = Lanes([0.0; LANES]);
            return Candidates { lanes: 0, doubtful: 0, near: 0, t: none, b1: none, b2: none };
        }
        let doubtful = inside & mask(from_fn(|lane| (u[lane] == 0.0) | (v[lane] == 0.0) | (w[lane] == 0.0)));
        let inverse: Row = from_fn(|lane| 1.0 / (u[lane] + v[lane] + w[lane]));
        let t: Row = from_fn(|lane| {
            ray.scale_z * (u[lane] * a[2][lane] + v[lane] * b[2][lane] + w[lane] * c[2][lane]) * inverse[lane]
        });
        let between = mask(from_fn(|lane| (t[lane] > 0.0) & (t[lane] <= t_max)));
        let farthest: Row = from_fn(|lane| max(max(a[2][lane].abs(), b[2][lane].abs()), c[2][lane].abs()));
        let near = inside & mask(from_fn(|lane| t[lane].abs() < ray.near_scale * farthest[lane]));
        Candidates {
            lanes: inside & between | near | doubtful,
            doubtful,
            near,
            t: Lanes(t),
            b1: Lanes(from_fn(|lane| v[lane] * inverse[lane])),
            b2: Lanes(from_fn(|lane| w[lane] * inverse[lane])),
        }
    }
}
