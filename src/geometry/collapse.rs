//! From obvhs's binary tree to eight-wide nodes and blocks of triangles.
//!
//! Which binary nodes become wide ones, which become leaves and which vanish is the cheapest of all choices under the
//! surface area heuristic, found by dynamic programming (Ylitie, Karras and Laine, "Efficient Incoherent Ray Traversal
//! on GPUs Through Compressed Wide BVHs", HPG 2017, section 3.1). A block costs the same whether it is full or not.

use super::tree::{Bounds, BuiltTree, build_binary};
use super::wide_tree::{Child, LANES, Node};
use obvhs::bvh2::Bvh2;
use std::ops::Range;

/// Cost of testing a block of triangles over that of testing a node's boxes.
const BLOCK_COST: f32 = 0.5;

/// A wide tree without its triangles.
pub(super) struct Collapsed {
    pub(super) nodes: Vec<Node>,
    /// Ranges of `order`, none longer than [`LANES`].
    pub(super) blocks: Vec<Range<usize>>,
    /// Primitive numbers.
    pub(super) order: Vec<u32>,
    /// Root of the tree; `None` where there is nothing.
    pub(super) root: Option<Child>,
}

/// Builds over boxes; those that are not finite are left out.
pub(super) fn build(bounds: &[Bounds]) -> Collapsed {
    let built = build_binary(bounds);
    let mut collapser = Collapser::new(&built);
    collapser.decide();
    collapser.emit();
    collapser.out
}

/// The cheapest way to make a binary subtree into at most 1 … 7 wide subtrees.
#[derive(Clone, Copy)]
struct Choice {
    /// By number of subtrees − 1.
    cost: [f32; 7],
    /// How many of the subtrees the left child makes; 0 where fewer are as good. Index 0 (one subtree) holds the split
    /// of all eight slots if it becomes a wide node, 0 if it becomes a leaf.
    left: [u8; 7],
    /// Triangles below, up to [`LANES`] + 1.
    count: u8,
}

struct Collapser<'a> {
    binary: &'a Bvh2,
    numbers: &'a [u32],
    choices: Vec<Choice>,
    out: Collapsed,
}

impl<'a> Collapser<'a> {
    fn new(built: &'a BuiltTree) -> Self {
        let empty = Choice { cost: [0.0; 7], left: [0; 7], count: 0 };
        Self {
            binary: &built.tree,
            numbers: &built.numbers,
            choices: vec![empty; built.tree.nodes.len()],
            out: Collapsed {
                nodes: Vec::new(),
                blocks: Vec::new(),
                order: Vec::with_capacity(built.numbers.len()),
                root: None,
            },
        }
    }

    /// Fills `choices` from the leaves up.
    fn decide(&mut self) {
        let nodes = &self.binary.nodes;
        let mut parents_first = Vec::with_capacity(nodes.len() / 2);
        let mut open = Vec::new();
        if !nodes.is_empty() {
            open.push(0u32);
        }
        while let Some(index) = open.pop() {
            let node = &nodes[index as usize];
            if node.is_leaf() {
                self.choices[index as usize] = Choice {
                    cost: [node.aabb().half_area() * BLOCK_COST; 7],
                    left: [0; 7],
                    count: node.prim_count.min(LANES as u32 + 1) as u8,
                };
            } else {
                parents_first.push(index);
                open.extend([node.first_index, node.first_index + 1]);
            }
        }
        for &index in parents_first.iter().rev() {
            let node = &nodes[index as usize];
            let (left, right) = (self.choices[node.first_index as usize], self.choices[node.first_index as usize + 1]);
            self.choices[index as usize] = choose(node.aabb().half_area(), &left, &right);
        }
    }

    /// Makes nodes and blocks, the children of a node side by side.
    fn emit(&mut self) {
        if self.binary.nodes.is_empty() {
            return;
        }
        if self.becomes_leaf(0) {
            self.out.root = Some(self.emit_block(0));
            return;
        }
        self.out.nodes.push(Node::EMPTY);
        self.out.root = Some(Child::node(0));
        let mut open = vec![(0u32, 0usize)];
        let mut members = Vec::with_capacity(LANES);
        while let Some((index, place)) = open.pop() {
            members.clear();
            let node = &self.binary.nodes[index as usize];
            let split = self.choices[index as usize].left[0];
            self.gather(node.first_index, split, &mut members);
            self.gather(node.first_index + 1, LANES as u8 - split, &mut members);
            for (slot, &member) in members.iter().enumerate() {
                let child = if self.becomes_leaf(member) {
                    self.emit_block(member)
                } else {
                    let place = self.out.nodes.len();
                    self.out.nodes.push(Node::EMPTY);
                    open.push((member, place));
                    Child::node(place)
                };
                let aabb = self.binary.nodes[member as usize].aabb();
                self.out.nodes[place].set(slot, aabb.min, aabb.max, child);
            }
        }
    }

    fn becomes_leaf(&self, index: u32) -> bool {
        self.choices[index as usize].left[0] == 0
    }

    /// The roots of the at most `slots` wide subtrees that a binary subtree makes.
    fn gather(&self, index: u32, slots: u8, members: &mut Vec<u32>) {
        let mut slots = usize::from(slots);
        let choice = &self.choices[index as usize];
        while slots > 1 && choice.left[slots - 1] == 0 {
            slots -= 1;
        }
        if slots <= 1 {
            members.push(index);
            return;
        }
        let first = self.binary.nodes[index as usize].first_index;
        let left = choice.left[slots - 1];
        self.gather(first, left, members);
        self.gather(first + 1, slots as u8 - left, members);
    }

    fn emit_block(&mut self, index: u32) -> Child {
        let start = self.out.order.len();
        let mut open = vec![index];
        while let Some(index) = open.pop() {
            let node = &self.binary.nodes[index as usize];
            if node.is_leaf() {
                let range = node.first_index as usize..(node.first_index + node.prim_count) as usize;
                let numbers = self.binary.primitive_indices[range].iter().map(|&i| self.numbers[i as usize]);
                self.out.order.extend(numbers);
            } else {
                open.extend([node.first_index + 1, node.first_index]);
            }
        }
        self.out.blocks.push(start..self.out.order.len());
        Child::block(self.out.blocks.len() - 1)
    }
}

/// The choices of a node from those of its children.
fn choose(half_area: f32, left: &Choice, right: &Choice) -> Choice {
    let cheapest_split = |slots: usize| {
        let mut best = (f32::INFINITY, 1);
        for of_left in 1..slots {
            let (l, r) = (of_left.min(7), (slots - of_left).min(7));
            let cost = left.cost[l - 1] + right.cost[r - 1];
            if cost < best.0 {
                best = (cost, of_left as u8);
            }
        }
        best
    };
    let mut choice = Choice { cost: [0.0; 7], left: [0; 7], count: (left.count + right.count).min(LANES as u8 + 1) };
    let (below, split) = cheapest_split(LANES);
    (choice.cost[0], choice.left[0]) = (below + half_area, split);
    let as_leaf = half_area * BLOCK_COST;
    if usize::from(choice.count) <= LANES && as_leaf <= choice.cost[0] {
        (choice.cost[0], choice.left[0]) = (as_leaf, 0);
    }
    for slots in 2..=7 {
        let (cost, split) = cheapest_split(slots);
        let fewer = choice.cost[slots - 2];
        (choice.cost[slots - 1], choice.left[slots - 1]) = if cost < fewer { (cost, split) } else { (fewer, 0) };
    }
    choice
}
