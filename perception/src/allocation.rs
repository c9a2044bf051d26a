//! How many samples each pixel needs: the cheapest counts that bring visibility down to a target everywhere.
//!
//! Minimise Σ cᵢ nᵢ subject to 2 g ⊗ (N σ²/n) ≤ v\*² at every pixel and `min_samples` ≤ n ≤ `max_samples`. The
//! problem is convex in 1/n. With a multiplier λ(x) ≥ 0 for each constraint and μ = g ⊗ λ (g is symmetric), the best
//! counts are nᵢ = √(wᵢ μᵢ / cᵢ), w = 2 N σ², clamped: Neyman's allocation, weighted by what the eye pools.
//! Multipliers grow where the constraint is violated and fade where it is slack; by weak duality any of them bounds
//! the cheapest cost from below, which is the certificate every [`Allocation`] carries.
//!
//! For noise that is independent from pixel to pixel and whose variance falls as 1/n. Not for bias, which no count
//! brings down, nor for masks that change while samples come: thresholds are taken as given.

mod block_grid;
mod solver;

use crate::error::{Error, check_range};
use crate::plane::Plane;
use crate::threshold::ThresholdMap;
use solver::Solver;

/// What is to be sampled, how visible it may stay and what sampling costs.
#[derive(Clone, Copy, Debug)]
pub struct AllocationProblem<'a> {
    /// Variance of one sample, (cd/m²)² on the display.
    pub variance_per_sample: &'a Plane,
    /// What can be seen of the picture that is sampled.
    pub thresholds: &'a ThresholdMap,
    /// Cost of one sample, in any unit (rays and node visits, not seconds); positive.
    pub cost: &'a Plane,
    /// Multiplies the visibility allowed at each pixel (a user's importance map: below 1 where it matters more);
    /// `None` is 1 everywhere. Beside a steep step noise comes over that bands smear further than the pooling window
    /// that counts are found by: behind one from 4 to 0.25 [`ThresholdMap::predicted_visibility`] is up to 1.13 times
    /// what is asked for at 4 pixels a degree, 1.04 at 10 to 38, 1.02 from 60 on, though every constraint here is
    /// met; behind one from 2 to 0.5 1.03 and 1.01.
    pub tolerance: Option<&'a Plane>,
    /// Visibility v\* that may remain, in threshold units.
    pub visibility: f64,
    /// Fewest samples a pixel gets; at least 1e-6.
    pub min_samples: f64,
    /// Most samples a pixel gets.
    pub max_samples: f64,
    /// Share above the cheapest cost at which the search may end: [`FINE_GAP`], or more where counts are rounded
    /// anyway. Not a promise: the search also ends after a number of updates.
    pub enough_gap: f64,
}

/// A gap as fine as the search reaches on most pictures.
pub const FINE_GAP: f64 = 3e-3;

/// Least step of the search for a budget's log visibility until it has come from both sides; doubled each time.
const MIN_STEP: f64 = 0.25;

/// Sample counts, and how far from the best they can at most be.
#[derive(Clone, Debug, PartialEq)]
pub struct Allocation {
    /// Total samples of each pixel, real-valued.
    pub samples: Plane,
    /// What these counts cost, Σ cᵢ nᵢ, in the unit of [`AllocationProblem::cost`].
    pub cost: f64,
    /// No counts within the limits that meet the constraints cost less than this.
    pub lower_bound: f64,
    /// Share by which the counts cost more than the cheapest at most: `cost / lower_bound − 1`, not below 0.
    pub gap: f64,
    /// The visibility that was asked for. For a fixed budget: the greatest that the counts leave anywhere, over what
    /// is tolerated there, be it because `max_samples` does not reach further.
    pub visibility: f64,
    /// Pixels whose visibility stays above what was asked for even with `max_samples` everywhere. Their constraints are
    /// relaxed to what can be reached (plus 1 % of v²).
    pub unreachable_pixels: usize,
    /// How many times the multipliers were updated for these counts; of a fixed budget, in the round that they come
    /// from.
    pub iterations: usize,
}

/// Finds the cheapest counts that bring visibility to the target.
///
/// # Errors
/// [`Error::SizeMismatch`], [`Error::BadPixel`] and [`Error::OutOfRange`] for planes that do not fit the threshold
/// map, values that are negative or not finite, costs of 0 and impossible limits.
///
/// ```
/// use fechner_perception::{CastleCsf, Plane, ThresholdInputs, Viewing, threshold_map};
/// use fechner_perception::allocation::{AllocationProblem, FINE_GAP, allocate};
/// let grey = Plane::filled(64, 64, 50.0);
/// let inputs = ThresholdInputs::clean(&grey);
/// let thresholds = threshold_map(&inputs, &Viewing::default(), &CastleCsf::default())?;
/// let allocation = allocate(&AllocationProblem {
///     variance_per_sample: &Plane::from_fn(64, 64, |x, _| if x < 32 { 400.0 } else { 25.0 }),
///     thresholds: &thresholds,
///     cost: &Plane::filled(64, 64, 1.0),
///     tolerance: None,
///     visibility: 1.0,
///     min_samples: 1.0,
///     max_samples: 1e6,
///     enough_gap: FINE_GAP,
/// })?;
/// assert!(allocation.samples.get(5, 30) > 3.0 * allocation.samples.get(60, 30));
/// assert!(allocation.gap < 0.02, "{}", allocation.gap);
/// # Ok::<(), fechner_perception::Error>(())
/// ```
pub fn allocate(problem: &AllocationProblem<'_>) -> Result<Allocation, Error> {
    let solver = Solver::new(problem)?;
    let mut multipliers = solver.first_multipliers(problem.visibility);
    Ok(solver.solve(problem.visibility, &mut multipliers))
}

/// Largest log visibility that the search goes to, either way: ln 10⁹.
const FARTHEST: f64 = 20.7;

/// Share of the budget that counts as all of it.
const MIN_SPENT: f64 = 0.99;

/// Visibilities that the search tries at most. Eight doubled steps cross all that there are; the others are for
/// brackets. A search that is not done then ends with the best that it has.
const MAX_ROUNDS: u32 = 40;

/// Width of a bracket of log visibility at which the search ends though less than [`MIN_SPENT`] of the budget is
/// spent: cost goes as v⁻², so that 0.02 % of it is left to be found, and what jumps within is limits.
const NARROWEST_BRACKET: f64 = 1e-4;

/// Share of a bracket that goes in every round at least, wherever the aim is.
const MIN_CUT: f64 = 0.1;

/// Share by which rounding may bring the sum of the fewest counts over the cheapest cost.
const ROUNDING: f64 = 1e-9;

/// Finds the lowest visibility that `budget` (Σ cᵢ nᵢ) can pay for, and the counts for it; `problem.visibility` is
/// where the search begins.
///
/// The cost stays within 1 % below the budget, unless `min_samples` everywhere costs more (they are paid for all the
/// same) or `max_samples` less. The certificate is of the visibility that is reached.
///
/// # Errors
/// As [`allocate`], and [`Error::OutOfRange`] for a budget that is not positive.
pub fn allocate_budget(problem: &AllocationProblem<'_>, budget: f64) -> Result<Allocation, Error> {
    check_range("budget", budget, f64::MIN_POSITIVE, f64::MAX, "positive and finite")?;
    let solver = Solver::new(problem)?;
    let mut visibility = problem.visibility;
    let mut multipliers = solver.first_multipliers(visibility);
    // Bracket of log visibility; cost falls as visibility rises.
    let (mut too_dear, mut affordable) = (f64::NEG_INFINITY, f64::INFINITY);
    let mut best: Option<Allocation> = None;
    let mut least_step = MIN_STEP;
    for _ in 0..MAX_ROUNDS {
        let found = solver.solve(visibility, &mut multipliers);
        let excess = found.cost / budget;
        if excess <= 1.0 {
            affordable = visibility.ln();
            let enough = excess > MIN_SPENT;
            if best.as_ref().is_none_or(|best| best.visibility > visibility) {
                best = Some(found);
            }
            if enough {
                break;
            }
        } else {
            too_dear = visibility.ln();
            if best.is_none() && found.cost <= solver.cheapest * (1.0 + ROUNDING) {
                // Not even the fewest samples are affordable: they are the answer.
                best = Some(found);
                break;
            }
        }
        // Without limits cost goes as v⁻²; aim amid what is enough.
        let aimed = visibility.ln() + 0.5 * (excess / (0.5 * (MIN_SPENT + 1.0))).ln();
        let next = if too_dear.is_finite() && affordable.is_finite() {
            if affordable - too_dear < NARROWEST_BRACKET {
                break;
            }
            let margin = MIN_CUT * (affordable - too_dear);
            aimed.clamp(too_dear + margin, affordable - margin)
        } else {
            // Limits make the cost respond less than the law says, and far from the answer not at all: ever greater
            // steps.
            let step = (aimed - visibility.ln()).abs().max(least_step);
            least_step *= 2.0;
            visibility.ln() + (aimed - visibility.ln()).signum() * step
        };
        let next = next.clamp(-FARTHEST, FARTHEST);
        if next == visibility.ln() {
            break;
        }
        let factor = (visibility.ln() - next).exp().powi(4) as f32;
        multipliers.iter_mut().for_each(|multiplier| *multiplier = (*multiplier * factor).clamp(1e-30, 1e30));
        visibility = next.exp();
    }
    let mut found = best.unwrap_or_else(|| solver.solve(visibility, &mut multipliers));
    let reached = solver.reached(&found.samples);
    if found.unreachable_pixels > 0 || (reached / found.visibility).ln().abs() > 0.01 {
        // Where limits hold, the last target was not what the counts reach, and its certificate not theirs.
        let of_reached = solver.solve(reached, &mut solver.first_multipliers(reached));
        found.unreachable_pixels = of_reached.unreachable_pixels;
        found.lower_bound = of_reached.lower_bound;
        found.gap = (found.cost / found.lower_bound - 1.0).max(0.0);
    }
    found.visibility = reached;
    Ok(found)
}

#[cfg(test)]
mod tests;
