//! Where light comes from, one file a kind, and how one is chosen.
//!
//! First a kind is chosen (the environment, lights from afar, emitters that have a place), by what each gives to that
//! part of the scene, then one of the kind: by irradiance from afar, by a tree over what each can give to this point
//! among the placed. Then a direction by the light's own rule. All pdfs are per steradian at the receiver and include
//! the choices, so they can be weighed against those of BSDFs.

mod bilinear;
mod collect;
mod distant;
mod distribution;
mod emission;
mod environment;
mod flat;
mod givers;
mod kind_choice;
mod lanes;
mod parts;
mod punctual;
mod solid_angle;
mod sphere;
#[cfg(test)]
mod tests;
mod tree;

pub use emission::emitted;
pub use kind_choice::{Arrival, KindsByPlace, LightProbe};
pub use parts::LampPart;
pub use tree::LightReceiver;

use crate::geometry::{Hit, Ray, World};
use crate::scene::Light;
use collect::Collected;
use distant::DistantLights;
use environment::EnvironmentSampler;
use flat::FlatEmitter;
use glam::Vec3;
use sphere::SphereEmitter;
use tree::{ChosenEmitter, LightTree};

/// A direction towards a light, seen from a point.
#[derive(Clone, Copy, Debug)]
pub struct LightSample {
    /// Unit direction.
    pub direction: Vec3,
    /// Where the light is reached; `None` for environment and directional lights, which are infinitely far.
    pub place: Option<LightPlace>,
    /// Radiance that arrives if nothing is between; for lights without area, irradiance perpendicular to `direction`.
    pub radiance: Vec3,
    /// Probability per steradian; for lights without area, the probability of the choice.
    pub pdf: f32,
    /// Whether a BSDF could never find this light by chance.
    pub is_delta: bool,
}

/// Light from infinitely far away in a direction.
#[derive(Clone, Copy, Debug, Default)]
pub struct LightFromAfar {
    /// Radiance.
    pub radiance: Vec3,
    /// Probability per steradian that light sampling finds this light in the direction.
    pub pdf: f32,
}

/// A point on a light.
#[derive(Clone, Copy, Debug)]
pub struct LightPlace {
    /// World position.
    pub position: Vec3,
    /// Unit normal on the side that shines on the shaded point; zero for lights without a surface.
    pub normal: Vec3,
    /// How far before the surface a ray must end, to clear the rounding error of the surface alone.
    pub offset: f32,
}

#[derive(Clone, Debug)]
enum Emitter {
    Flat(FlatEmitter),
    Sphere(SphereEmitter),
    Point(Light),
    /// A triangle of an instance that moves while the shutter is open.
    MovingTriangle {
        object: u32,
        triangle: u32,
    },
    /// A sphere that moves.
    MovingSphere {
        object: u32,
    },
}

/// The lights of a world, ready to be sampled.
#[derive(Debug)]
pub struct Lights {
    emitters: Vec<Emitter>,
    /// Per object: the emitter of each triangle, for objects that emit.
    emitter_of: Vec<Option<Vec<u32>>>,
    tree: Option<LightTree>,
    distant: Option<DistantLights>,
    environment: Option<EnvironmentSampler>,
    shares: LightKindProbabilities,
    /// How kinds are chosen where; `None` where it is the same everywhere, or nobody has looked.
    kinds_by_place: Option<KindsByPlace>,
}

/// What lights are chosen from one by one.
#[derive(Clone, Copy, Debug)]
enum Kind {
    Environment,
    /// Lights from afar.
    Distant,
    /// Emitters that have a place.
    Placed,
}

impl Kind {
    const ALL: [Self; 3] = [Self::Environment, Self::Distant, Self::Placed];
}

/// What is left to a kind of light of the share that it has among equals, however weak it seems; a little less,
/// since all shares add up to 1.
const MIN_SHARE: f32 = 0.3;

/// Probabilities of the kinds.
#[derive(Clone, Copy, Debug, Default)]
struct LightKindProbabilities([f32; Kind::ALL.len()]);

impl LightKindProbabilities {
    /// The same for all that are there.
    fn even(there: [bool; Kind::ALL.len()]) -> Self {
        let weights = there.map(|there| if there { 1.0 } else { 0.0 });
        let total = weights.iter().sum::<f32>().max(1.0);
        Self(weights.map(|weight| weight / total))
    }

    /// In proportion to how strong samples of the kinds are, but that each keeps a part of what it has here.
    /// The same where all are 0.
    fn toward(self, strengths: [f32; Kind::ALL.len()]) -> Self {
        let total: f32 = strengths.iter().sum();
        if !(total > 0.0 && total.is_finite()) {
            return self;
        }
        let shares: [f32; Kind::ALL.len()] =
            std::array::from_fn(|kind| (strengths[kind] / total).max(MIN_SHARE * self.0[kind]));
        let sum: f32 = shares.iter().sum();
        Self(shares.map(|share| share / sum))
    }

    fn of(&self, kind: Kind) -> f32 {
        self.0[kind as usize]
    }

    fn choose(&self, u: f32) -> Choice {
        let Self([environment, distant, placed]) = *self;
        if u < environment {
            return Choice { kind: Kind::Environment, probability: environment, within: u / environment };
        }
        if u < environment + distant {
            return Choice { kind: Kind::Distant, probability: distant, within: (u - environment) / distant };
        }
        let within = ((u - environment - distant) / placed).clamp(0.0, 1.0 - f32::EPSILON / 2.0);
        Choice { kind: Kind::Placed, probability: placed, within }
    }
}

/// A kind of light, chosen by a number.
struct Choice {
    kind: Kind,
    probability: f32,
    /// Where in [0, 1) of its part the number lies.
    within: f32,
}

impl Lights {
    /// Collects every emitter of the world.
    pub fn new(world: &World) -> Self {
        let scene = world.scene();
        let Collected { emitters, bounds, emitter_of } = collect::placed(world);
        let tree = LightTree::new(&bounds);
        let distant = DistantLights::new(&scene.lights);
        let environment = scene.environment.as_ref().and_then(EnvironmentSampler::new);
        let sampled = environment.as_ref().is_some_and(EnvironmentSampler::is_sampled);
        let shares = LightKindProbabilities::even([sampled, distant.is_some(), tree.is_some()]);
        Self { emitters, emitter_of, tree, distant, environment, shares, kinds_by_place: None }
    }

    /// Whether there is more than one kind of light to sample.
    pub fn have_a_choice(&self) -> bool {
        self.shares.0.iter().filter(|share| **share > 0.0).count() > 1
    }

    /// How kinds are best chosen where paths get to, by what arrives at probes there; `None` where it is best the same
    /// everywhere.
    pub fn kinds_by_place(&self, world: &World, probes: &[LightProbe], arrival: &Arrival) -> Option<KindsByPlace> {
        KindsByPlace::new(self, world, probes, arrival)
    }

    /// Chooses kinds of light by these from now on.
    pub fn set_kinds_by_place(&mut self, kinds_by_place: Option<KindsByPlace>) {
        self.kinds_by_place = kinds_by_place;
    }

    fn shares_at(&self, position: Vec3) -> &LightKindProbabilities {
        self.kinds_by_place.as_ref().map_or(&self.shares, |kinds_by_place| kinds_by_place.at(position))
    }

    /// A direction from a receiver towards a light, for three numbers in [0, 1): two for the place, one for the choice.
    pub fn sample(&self, world: &World, receiver: &LightReceiver, time: f32, u: [f32; 3]) -> Option<LightSample> {
        let [u0, u1, select] = u;
        let Choice { kind, probability, within } = self.shares_at(receiver.position).choose(select);
        chosen_by(self.sample_kind(kind, world, receiver, time, [u0, u1, within]), probability)
    }

    /// The same for a kind of light.
    fn sample_kind(
        &self,
        kind: Kind,
        world: &World,
        receiver: &LightReceiver,
        time: f32,
        [u0, u1, select]: [f32; 3],
    ) -> Option<LightSample> {
        match kind {
            Kind::Environment => self.environment.as_ref()?.sample([u0, u1]),
            Kind::Distant => Some(self.distant.as_ref()?.sample([u0, u1, select])),
            Kind::Placed => {
                let ChosenEmitter { index, probability } = self.tree.as_ref()?.sample(receiver, select)?;
                chosen_by(self.sample_emitter(world, index, receiver, time, [u0, u1]), probability)
            }
        }
    }

    #[inline]
    fn sample_emitter(
        &self,
        world: &World,
        index: usize,
        receiver: &LightReceiver,
        time: f32,
        u: [f32; 2],
    ) -> Option<LightSample> {
        let from = receiver.position;
        match &self.emitters[index] {
            Emitter::Flat(emitter) => emitter.sample(world.scene(), receiver, u),
            Emitter::Sphere(emitter) => emitter.sample(world, from, u),
            Emitter::Point(light) => punctual::sample(light, from),
            Emitter::MovingTriangle { object, triangle } => {
                collect::triangle_at(world, *object, *triangle, time).sample(world.scene(), receiver, u)
            }
            Emitter::MovingSphere { object } => SphereEmitter::new(world, *object, time).sample(world, from, u),
        }
    }

    /// Probability per steradian that [`Lights::sample`] for this receiver would have chosen the direction of a
    /// ray from it that hit an emitting surface, at a distance from the receiver in scene units: the hit's,
    /// where the ray begins there.
    pub fn pdf_of_hit(&self, world: &World, receiver: &LightReceiver, ray: &Ray, hit: &Hit, distance: f32) -> f32 {
        let (Some(of_triangle), Some(tree)) = (&self.emitter_of[hit.object as usize], &self.tree) else {
            return 0.0;
        };
        let index = of_triangle[hit.triangle as usize] as usize;
        let chosen = tree.probability(receiver, index) * self.shares_at(receiver.position).of(Kind::Placed);
        if chosen == 0.0 {
            return 0.0;
        }
        let (from, direction) = (receiver.position, Vec3::from(ray.direction));
        chosen
            * match &self.emitters[index] {
                Emitter::Flat(emitter) => emitter.pdf(receiver, direction, distance),
                Emitter::Sphere(emitter) => emitter.pdf(from, direction, distance),
                Emitter::MovingTriangle { object, triangle } => {
                    collect::triangle_at(world, *object, *triangle, ray.time).pdf(receiver, direction, distance)
                }
                Emitter::MovingSphere { object } => {
                    SphereEmitter::new(world, *object, ray.time).pdf(from, direction, distance)
                }
                Emitter::Point(_) => 0.0,
            }
    }

    /// What a ray which meets no surface sees of the environment and of the discs of lights from afar, apart:
    /// [`Lights::sample`] gives light of the one it has chosen, so each is weighed against its own density.
    pub fn from_afar(&self, receiver: &LightReceiver, direction: Vec3) -> [LightFromAfar; 2] {
        let shares = self.shares_at(receiver.position);
        let environment = self.environment.as_ref().map(|e| LightFromAfar {
            radiance: e.radiance(direction),
            pdf: e.pdf(direction) * shares.of(Kind::Environment),
        });
        let discs = self.distant.as_ref().map(|d| LightFromAfar {
            radiance: d.radiance(direction),
            pdf: d.pdf(direction) * shares.of(Kind::Distant),
        });
        [environment.unwrap_or_default(), discs.unwrap_or_default()]
    }
}

/// A sample whose light was chosen with a probability.
#[inline(always)]
fn chosen_by(sample: Option<LightSample>, probability: f32) -> Option<LightSample> {
    let mut sample = sample?;
    sample.pdf *= probability;
    (sample.pdf > 0.0 && sample.pdf.is_finite()).then_some(sample)
}
