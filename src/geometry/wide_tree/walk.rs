//! The two walks over the tree: to the closest hit, and to any. The tests of boxes and triangles are left to [`super`].

use super::{Block, Candidates, Child, LANES, Met, Node, WideHit, WideTree};
use crate::geometry::simd;
use crate::geometry::triangle::{ShearedRay, TriangleHit};
use smallvec::SmallVec;

/// Children that wait while a walk is below their siblings. On the heap only where there are more than any tree of ours
/// had, and never cleared: to clear it takes 3 % of the Cornell box.
type Stack = SmallVec<[u64; 96]>;

/// What a child points at.
enum Below<'a> {
    Node(&'a Node),
    Block(usize, &'a Block),
}

impl WideTree {
    /// The walk of [`Self::closest`], over any pair of kernels: `meet` gives the children of a node, `hits` the
    /// triangles of a block that the ray meets before a distance.
    #[inline(always)]
    pub(in crate::geometry) fn walk_closest(
        &self,
        sheared: &ShearedRay,
        mut t_max: f32,
        meet: impl Fn(&Node, f32) -> Met,
        hits: impl Fn(&Block, f32) -> Candidates,
        accept: impl Fn(&WideHit) -> bool,
    ) -> Option<WideHit> {
        let mut current = self.root?;
        let mut best: Option<WideHit> = None;
        let mut stack = Stack::new();
        loop {
            match self.below(current) {
                Below::Node(node) => {
                    if let Some(nearest) = self.enter_nearest(node, &meet(node, t_max), &mut stack) {
                        current = nearest;
                        continue;
                    }
                }
                Below::Block(index, block) => {
                    let found = hits(block, t_max);
                    for lane in bits(found.lanes) {
                        let Some(hit) = hit_of_lane(block, &found, lane, sheared, t_max) else { continue };
                        let found = WideHit { place: place(index, lane), hit };
                        if self.stands(&found, best.as_ref(), t_max) && accept(&found) {
                            simd::prefetch(&self.references[found.place as usize]);
                            t_max = hit.t;
                            best = Some(found);
                        }
                    }
                }
            }
            current = loop {
                let Some(key) = stack.pop() else { return best };
                if f32::from_bits((key >> 32) as u32) <= t_max {
                    break Child(key as u32);
                }
            };
        }
    }

    /// The walk of [`Self::any`]: as above, but the first hit ends it and children are entered as they come.
    #[inline(always)]
    pub(in crate::geometry) fn walk_any(
        &self,
        sheared: &ShearedRay,
        t_max: f32,
        meet: impl Fn(&Node, f32) -> Met,
        hits: impl Fn(&Block, f32) -> Candidates,
        accept: impl Fn(&WideHit) -> bool,
    ) -> bool {
        let Some(mut current) = self.root else { return false };
        let mut stack = Stack::new();
        loop {
            match self.below(current) {
                Below::Node(node) => {
                    if let Some(first) = self.enter_first(node, &meet(node, t_max), &mut stack) {
                        current = first;
                        continue;
                    }
                }
                Below::Block(index, block) => {
                    let found = hits(block, t_max);
                    for lane in bits(found.lanes) {
                        if let Some(hit) = hit_of_lane(block, &found, lane, sheared, t_max)
                            && is_before(&hit, t_max, || sheared.distance_to_plane(&block.triangle(lane as usize)))
                            && accept(&WideHit { place: place(index, lane), hit })
                        {
                            return true;
                        }
                    }
                }
            }
            let Some(waiting) = stack.pop() else { return false };
            current = Child(waiting as u32);
        }
    }

    #[inline(always)]
    fn below(&self, child: Child) -> Below<'_> {
        let index = (child.0 & !Child::LEAF) as usize;
        if child.0 & Child::LEAF == 0 {
            Below::Node(&self.nodes[index])
        } else {
            Below::Block(index, &self.blocks[index])
        }
    }

    /// The nearest of the children that are met; the others wait, the farthest deepest.
    #[inline(always)]
    fn enter_nearest(&self, node: &Node, met: &Met, stack: &mut Stack) -> Option<Child> {
        // Distances are not negative, so their bits sort as they do.
        let key = |slot: u32| {
            let child = self.awaited(node, slot);
            u64::from(met.distances.get(slot).to_bits()) << 32 | u64::from(child.0)
        };
        let mut slots = bits(met.slots);
        let mut nearest = key(slots.next()?);
        let base = stack.len();
        for slot in slots {
            let next = key(slot);
            let far = nearest.max(next);
            nearest = nearest.min(next);
            stack.push(far);
            let siblings = &mut stack[base..];
            let mut place = siblings.len() - 1;
            while place > 0 && siblings[place - 1] < far {
                siblings[place] = siblings[place - 1];
                place -= 1;
            }
            siblings[place] = far;
        }
        Some(Child(nearest as u32))
    }

    /// The first of the children that are met; the others wait.
    #[inline(always)]
    fn enter_first(&self, node: &Node, met: &Met, stack: &mut Stack) -> Option<Child> {
        let mut slots = bits(met.slots);
        let first = self.awaited(node, slots.next()?);
        for slot in slots {
            stack.push(u64::from(self.awaited(node, slot).0));
        }
        Some(first)
    }

    /// The child of a slot, which is about to be entered: its cache lines are asked for.
    #[inline(always)]
    fn awaited(&self, node: &Node, slot: u32) -> Child {
        let child = node.children[slot as usize & (LANES - 1)];
        match self.below(child) {
            Below::Node(node) => simd::prefetch(node),
            Below::Block(_, block) => simd::prefetch(block),
        }
        child
    }

    /// Whether a hit is nearer than the best so far, or as near and of a smaller triangle.
    #[inline(always)]
    fn stands(&self, found: &WideHit, best: Option<&WideHit>, t_max: f32) -> bool {
        let t = found.hit.t;
        let is_better = match best {
            Some(best) => t < best.hit.t || self.reference(found.place) < self.reference(best.place),
            None => t < t_max,
        };
        is_better && t <= t_max
    }
}

/// The numbers of the bits that are set.
#[inline(always)]
fn bits(mut mask: u32) -> impl Iterator<Item = u32> {
    std::iter::from_fn(move || {
        let bit = mask.trailing_zeros();
        let is_left = mask != 0;
        mask &= mask.wrapping_sub(1);
        is_left.then_some(bit)
    })
}

#[inline(always)]
fn hit_of_lane(block: &Block, found: &Candidates, lane: u32, sheared: &ShearedRay, t_max: f32) -> Option<TriangleHit> {
    let is = |lanes: u32| lanes >> lane & 1 == 1;
    if is(found.doubtful) {
        return sheared.intersect(&block.triangle(lane as usize), t_max);
    }
    let t = if is(found.near) { sheared.distance_to_plane(&block.triangle(lane as usize))? } else { found.t.get(lane) };
    Some(TriangleHit { t, b1: found.b1.get(lane), b2: found.b2.get(lane) })
}

/// Whether a hit is before the end of a ray, which may lie just before the same triangle: where it is close, by its
/// plane, too.
#[inline(always)]
fn is_before(hit: &TriangleHit, t_max: f32, to_plane: impl Fn() -> Option<f32>) -> bool {
    const CLOSE: f32 = 0.99;
    hit.t < t_max && (hit.t <= CLOSE * t_max || to_plane().is_some_and(|t| t < t_max))
}

/// The place of a triangle by block and lane.
#[inline(always)]
fn place(block: usize, lane: u32) -> u32 {
    (block * LANES) as u32 + lane
}
