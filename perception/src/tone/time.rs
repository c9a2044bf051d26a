//! Eyes that adapt over time: neural adaptation and bleaching of cones and rods, carried from frame to frame.
//!
//! There is one state a view. It belongs to the eye and not to what is seen, so it is never reprojected with surfaces.
//!
//! After Pattanaik, Tumblin, Yee and Greenberg 2000. Not for the pupil's size or for chromatic adaptation, which are
//! left out.

use serde::{Deserialize, Serialize};

use super::guide::SceneGuide;
use super::statistics::{FLOOR_CD_M2, log_average_to_eyes, weighted_log_average_to_eyes};
use crate::display::PixelDensity;

/// The luminances, cd/m², that cones and rods would adapt to if the view stayed as it is.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Goal {
    /// Photopic luminance that cones would adapt to, cd/m².
    pub cones_cd_m2: f64,
    /// Scotopic luminance that rods would adapt to, cd/m²; the photopic one where it is not known.
    pub rods_cd_m2: f64,
}

/// Standard deviation, in degrees, of what counts around a given gaze. Ours: adaptation is mostly the fovea's and its
/// surroundings'; no source fixes the number.
const GAZE_SIGMA_DEG: f64 = 5.0;

impl Goal {
    /// One luminance, cd/m², for cones and rods.
    #[must_use]
    pub fn both(luminance_cd_m2: f64) -> Self {
        Self { cones_cd_m2: luminance_cd_m2, rods_cd_m2: luminance_cd_m2 }
    }

    /// The geometric mean of what is in view, around the gaze where one is given (a Gaussian of σ 5°); of a gaze
    /// beside the picture, around the picture's nearest pixel, since nothing is known of what is seen there. What is
    /// darker than the floor of vision, 1e-4 cd/m², counts as the floor; without a view the eye is in the dark.
    #[must_use]
    pub fn of(guide: &SceneGuide<'_>, density: PixelDensity) -> Self {
        let average = |plane| match guide.gaze {
            None => log_average_to_eyes(plane),
            Some(gaze) => weighted_log_average_to_eyes(plane, |x, y| {
                let within = |at: usize, size: usize| at.min(size.saturating_sub(1)) as f64;
                let dx = (x as f64 - within(gaze.x, plane.width())) / (GAZE_SIGMA_DEG * density.horizontal);
                let dy = (y as f64 - within(gaze.y, plane.height())) / (GAZE_SIGMA_DEG * density.vertical);
                (-0.5 * (dx * dx + dy * dy)).exp()
            }),
        };
        let of = |plane| average(plane).unwrap_or(f64::from(FLOOR_CD_M2));
        Self { cones_cd_m2: of(guide.luminance_cd_m2), rods_cd_m2: of(guide.rods()) }
    }

    /// The geometric mean of several views; the dark for none.
    #[must_use]
    pub fn mean(goals: &[Self]) -> Self {
        let of = |receptor: fn(&Self) -> f64| {
            let logs = goals.iter().map(|goal| receptor(goal).max(f64::from(FLOOR_CD_M2)).ln()).sum::<f64>();
            if goals.is_empty() { f64::from(FLOOR_CD_M2) } else { (logs / goals.len() as f64).exp() }
        };
        Self { cones_cd_m2: of(|goal| goal.cones_cd_m2), rods_cd_m2: of(|goal| goal.rods_cd_m2) }
    }
}

/// How fast a kind of receptor adapts.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct ReceptorKinetics {
    /// Time constant of neural adaptation, seconds.
    pub neural_s: f64,
    /// Time constant of the pigment's recovery in the dark, seconds.
    pub pigment_s: f64,
    /// Luminance, cd/m², that bleaches half of the pigment.
    pub half_bleach_cd_m2: f64,
}

impl ReceptorKinetics {
    /// Share of the pigment that is not bleached after long at this luminance.
    #[must_use]
    pub fn steady_pigment(&self, luminance_cd_m2: f64) -> f64 {
        self.half_bleach_cd_m2 / (self.half_bleach_cd_m2 + luminance_cd_m2.max(0.0))
    }
}

/// How fast an eye adapts.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Kinetics {
    /// How fast the cones adapt.
    pub cones: ReceptorKinetics,
    /// How fast the rods adapt.
    pub rods: ReceptorKinetics,
}

impl Kinetics {
    /// Pattanaik, Tumblin, Yee and Greenberg 2000: 80 ms and 110 s for cones, 150 ms and 400 s for rods.
    pub const PATTANAIK_2000: Self = Self {
        cones: ReceptorKinetics { neural_s: 0.080, pigment_s: 110.0, half_bleach_cd_m2: 2e6 },
        rods: ReceptorKinetics { neural_s: 0.150, pigment_s: 400.0, half_bleach_cd_m2: 0.04 },
    };
    /// What stands in for Durand and Dorsey 2000, whose text could not be had: neural time constants of 0.1 s and 0.4
    /// s, which no source at hand confirms. The pigment is [`Kinetics::PATTANAIK_2000`]'s.
    pub const DURAND_DORSEY_2000: Self = Self {
        cones: ReceptorKinetics { neural_s: 0.1, ..Self::PATTANAIK_2000.cones },
        rods: ReceptorKinetics { neural_s: 0.4, ..Self::PATTANAIK_2000.rods },
    };
}

/// What one kind of receptor is adapted to.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct ReceptorState {
    /// Luminance, cd/m², that the nerves behind the receptors are adapted to.
    pub neural_cd_m2: f64,
    /// Share of the pigment that is not bleached, 0 to 1.
    pub pigment: f64,
}

/// What an eye is adapted to at one moment; made of numbers, to be saved with a sequence.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct AdaptationState {
    /// What the cones are adapted to.
    pub cones: ReceptorState,
    /// What the rods are adapted to.
    pub rods: ReceptorState,
    /// The luminances that were in view last.
    pub goal: Goal,
}

impl AdaptationState {
    /// An eye that has looked at `goal` for as long as it takes.
    #[must_use]
    pub fn adapted_to(goal: Goal, kinetics: &Kinetics) -> Self {
        let receptor = |luminance_cd_m2: f64, kinetics: &ReceptorKinetics| ReceptorState {
            neural_cd_m2: luminance_cd_m2,
            pigment: kinetics.steady_pigment(luminance_cd_m2),
        };
        Self {
            cones: receptor(goal.cones_cd_m2, &kinetics.cones),
            rods: receptor(goal.rods_cd_m2, &kinetics.rods),
            goal,
        }
    }

    /// Whether an eye can be in this state: luminances are finite and not negative, shares of pigment from 0 to 1.
    #[must_use]
    pub fn is_possible(&self) -> bool {
        let is_light = |cd_m2: f64| cd_m2.is_finite() && cd_m2 >= 0.0;
        let receptors = [self.cones, self.rods];
        receptors.iter().all(|state| is_light(state.neural_cd_m2) && (0.0..=1.0).contains(&state.pigment))
            && is_light(self.goal.cones_cd_m2)
            && is_light(self.goal.rods_cd_m2)
    }

    /// A cut: from now on `goal` is in view, and no time has passed.
    #[must_use]
    pub fn looking_at(self, goal: Goal) -> Self {
        Self { goal, ..self }
    }

    /// The state `seconds` later, when what is in view has gone evenly from the last goal to `goal`.
    ///
    /// Exact for a goal that stays or changes at a constant rate, so that the curve does not depend on the frame
    /// rate; a time that is not positive and finite changes the goal only.
    #[must_use]
    pub fn after(self, goal: Goal, seconds: f64, kinetics: &Kinetics) -> Self {
        if !(seconds > 0.0 && seconds.is_finite()) {
            return self.looking_at(goal);
        }
        let receptor = |state: ReceptorState, kinetics: &ReceptorKinetics, from: f64, to: f64| {
            let view = Ramp { from: from.max(0.0), to: to.max(0.0), seconds };
            ReceptorState {
                neural_cd_m2: view.neural(state.neural_cd_m2, kinetics),
                pigment: view.pigment(state.pigment, kinetics),
            }
        };
        Self {
            cones: receptor(self.cones, &kinetics.cones, self.goal.cones_cd_m2, goal.cones_cd_m2),
            rods: receptor(self.rods, &kinetics.rods, self.goal.rods_cd_m2, goal.rods_cd_m2),
            goal,
        }
    }
}

/// Largest ratio by which (1 + G / half-bleach) may change within one step of the pigment.
const MAX_STEP_RATIO: f64 = 1.005;
const MAX_STEPS: f64 = 4096.0;

/// Luminance that changes evenly for a while.
#[derive(Clone, Copy)]
struct Ramp {
    from: f64,
    to: f64,
    seconds: f64,
}

impl Ramp {
    /// A' = (G − A) / τ with G on the ramp, solved exactly.
    fn neural(self, start: f64, kinetics: &ReceptorKinetics) -> f64 {
        let constants = self.seconds / kinetics.neural_s;
        let decay = (-constants).exp();
        let gained = -(-constants).exp_m1();
        // Share of the ramp's end in what is gained: 1 − (1 − e⁻ˣ)/x, whose terms cancel where x is small.
        let of_end = if constants < 1e-4 { constants * (0.5 - constants / 6.0) } else { 1.0 - gained / constants };
        start * decay + self.from * (gained - of_end) + self.to * of_end
    }

    /// B' = ((1 − B) − B G / G₀) / t₀.
    ///
    /// For a constant G this is one exponential. On a ramp the time is cut where G has grown by half a per cent, and
    /// G is its mean within each piece: the rods' rate, (1 + G / 0.04) / 400 s, is far too fast for Euler steps of a
    /// frame.
    fn pigment(self, start: f64, kinetics: &ReceptorKinetics) -> f64 {
        let (first, last) = (kinetics.half_bleach_cd_m2 + self.from, kinetics.half_bleach_cd_m2 + self.to);
        let steps = ((last / first).ln().abs() / MAX_STEP_RATIO.ln()).ceil().clamp(1.0, MAX_STEPS);
        let growth = (last / first).powf(steps.recip());
        let (mut pigment, mut low) = (start, first);
        for step in 0..steps as usize {
            let high = if step + 1 == steps as usize { last } else { low * growth };
            let share = if last == first { 1.0 } else { (high - low) / (last - first) };
            let mean = 0.5 * (low + high);
            let steady = kinetics.half_bleach_cd_m2 / mean;
            let rate = mean / (kinetics.half_bleach_cd_m2 * kinetics.pigment_s);
            pigment = steady + (pigment - steady) * (-rate * share * self.seconds).exp();
            low = high;
        }
        pigment
    }
}

#[cfg(test)]
mod tests;
