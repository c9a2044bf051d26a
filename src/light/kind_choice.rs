//! Which kind of light is worth asking for in which part of the scene: indoors the sky, not the sun that is behind the
//! wall.
//!
//! Places that paths get to are gathered in groups by where they are, and samples of each kind of light, taken with
//! their shadows, say how strong it is there. With one sample of a choice among kinds the variance is least where
//! each is chosen in proportion to the root of its samples' mean square. It is done once, before any picture's sample
//! is taken, so that a sample still depends on nothing but its own numbers. Each kind keeps a share, since what no
//! probe has found may be there.

use super::{Kind, LightKindProbabilities, LightReceiver, LightSample, Lights};
use crate::geometry::World;
use crate::sampler::{hash_words, unit_of_hash};
use glam::Vec3;
use rayon::prelude::*;

/// Probes in a group, at least.
const PROBES: usize = 32;
/// Samples of each kind of light by which a probe asks for it.
const SAMPLES: u64 = 4;

/// A place that paths get to, from which light is looked out for.
#[derive(Clone, Copy, Debug)]
pub struct LightProbe {
    /// Where it is.
    pub receiver: LightReceiver,
    /// Share of the open shutter, in [0, 1).
    pub time: f32,
}

/// What share (0 to 1) of a light's sample gets to a probe, by its number.
pub type Arrival<'a> = dyn Fn(usize, &LightSample) -> f32 + Sync + 'a;

/// How kinds of light are chosen in all parts of a scene.
#[derive(Debug)]
pub struct KindsByPlace {
    groups: Groups,
    /// By group.
    shares: Vec<LightKindProbabilities>,
}

impl KindsByPlace {
    /// Shares of the kinds by what arrives at probes; `None` of too few probes.
    pub(super) fn new(lights: &Lights, world: &World, probes: &[LightProbe], arrival: &Arrival) -> Option<Self> {
        let groups = Groups::new(probes)?;
        let strength = |kind: Kind, number: usize| -> f32 {
            let LightProbe { receiver, time } = &probes[number];
            let squared = |index| {
                let u = [0, 1, 2].map(|dimension| unit_of_hash(hash_words(number as u64 * SAMPLES + index, dimension)));
                let sample = lights.sample_kind(kind, world, receiver, *time, u);
                sample.map_or(0.0, |sample| squared_strength(receiver, &sample, || arrival(number, &sample)))
            };
            (0..SAMPLES).map(squared).sum()
        };
        let shares = groups.members.par_iter().map(|members| {
            let strength_of = |kind: Kind| members.iter().map(|&number| strength(kind, number)).sum::<f32>().sqrt();
            lights.shares.toward(Kind::ALL.map(strength_of))
        });
        Some(Self { shares: shares.collect(), groups })
    }

    /// How kinds are chosen at a position.
    pub(super) fn at(&self, position: Vec3) -> &LightKindProbabilities {
        &self.shares[self.groups.find(position)]
    }
}

/// Square of what a sample brings to a white surface, whose shadow is only asked for where it would bring anything.
fn squared_strength(receiver: &LightReceiver, sample: &LightSample, arrives: impl Fn() -> f32) -> f32 {
    let faces_all = receiver.normal == Vec3::ZERO;
    let cosine = if faces_all { 1.0 } else { receiver.normal.dot(sample.direction).max(0.0) };
    let strength = cosine * sample.radiance.max_element() / sample.pdf;
    if strength > 0.0 { (strength * arrives()).powi(2) } else { 0.0 }
}

/// Places in groups by where they are.
#[derive(Debug)]
struct Groups {
    /// A full binary tree: the children of i are 2 i + 1 and 2 i + 2.
    halvings: Vec<Halving>,
    /// By leaf of the tree: numbers of the probes.
    members: Vec<Vec<usize>>,
}

/// A plane that halves a group of places.
#[derive(Clone, Copy, Debug, Default)]
struct Halving {
    axis: usize,
    at: f32,
}

impl Groups {
    /// `None` of too few places.
    fn new(probes: &[LightProbe]) -> Option<Self> {
        let levels = (probes.len() / PROBES).checked_ilog2()?;
        let mut groups =
            Self { halvings: vec![Halving::default(); (1 << levels) - 1], members: vec![Vec::new(); 1 << levels] };
        let mut numbers: Vec<usize> = (0..probes.len()).collect();
        groups.halve(probes, &mut numbers, 0);
        for (number, probe) in probes.iter().enumerate() {
            let of = groups.find(probe.receiver.position);
            groups.members[of].push(number);
        }
        Some(groups)
    }

    /// Halves the places below a node by the axis along which they lie widest, down to the leaves.
    fn halve(&mut self, probes: &[LightProbe], numbers: &mut [usize], node: usize) {
        if node >= self.halvings.len() {
            return;
        }
        let position = |&number: &usize| probes[number].receiver.position;
        let least = numbers.iter().map(position).fold(Vec3::INFINITY, Vec3::min);
        let most = numbers.iter().map(position).fold(Vec3::NEG_INFINITY, Vec3::max);
        let axis = (most - least).max_position();
        let middle = numbers.len() / 2;
        numbers.select_nth_unstable_by(middle, |a, b| position(a)[axis].total_cmp(&position(b)[axis]));
        self.halvings[node] = Halving { axis, at: position(&numbers[middle])[axis] };
        let (below, above) = numbers.split_at_mut(middle);
        self.halve(probes, below, 2 * node + 1);
        self.halve(probes, above, 2 * node + 2);
    }

    /// The group that a position is in.
    fn find(&self, position: Vec3) -> usize {
        let mut node = 0;
        while let Some(halving) = self.halvings.get(node) {
            node = 2 * node + 1 + usize::from(position[halving.axis] >= halving.at);
        }
        node - self.halvings.len()
    }
}
