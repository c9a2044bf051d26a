//! How many samples each pixel needs: the cheapest counts that bring visibility down to a target everywhere.
//!
//! Minimise Σ cᵢ nᵢ subject to 2 g ⊗ (N σ²/n) ≤ v\*² at every pixel and `min_samples` ≤ n ≤ `max_samples`. The problem is
//! convex in 1/n. With a multiplier λ(x) ≥ 0 for each constraint and μ = g ⊗ λ (g is symmetric), the best counts are
//! nᵢ = √(wᵢ μᵢ / cᵢ), w = 2 N σ², clamped: Neyman's allocation, weighted by what the eye pools. Multipliers grow where the
//! constraint is violated and fade where it is slack; by weak duality any of them bounds the cheapest cost from below,
//! which is the certificate every [`Allocation`] carries.

use rayon::prelude::*;

use crate::error::{Error, check_range};
use crate::filter::{dilate, gaussian_blur};
use crate::plane::Plane;
use crate::threshold::{POOLING_SIGMA_DEG, ThresholdMap};

/// What is to be sampled, how visible it may stay and what sampling costs.
#[derive(Clone, Copy, Debug)]
pub struct AllocationProblem<'a> {
    /// Variance of one sample, (cd/m²)² on the display.
    pub variance_per_sample: &'a Plane,
    /// What can be seen.
    pub thresholds: &'a ThresholdMap,
    /// Cost of one sample, in any unit (rays and node visits, not seconds); positive.
    pub cost: &'a Plane,
    /// Multiplies the visibility allowed at each pixel (a user's importance map: below 1 where it matters more);
    /// `None` is 1 everywhere.
    pub tolerance: Option<&'a Plane>,
    /// Visibility v\* that may remain.
    pub visibility: f64,
    /// Fewest samples a pixel gets; at least 1e-6.
    pub min_samples: f64,
    /// Most samples a pixel gets.
    pub max_samples: f64,
}

/// Sample counts, and how far from the best they can at most be.
#[derive(Clone, Debug, PartialEq)]
pub struct Allocation {
    /// Total samples of each pixel, real-valued.
    pub samples: Plane,
    /// Σ cᵢ nᵢ.
    pub cost: f64,
    /// No counts within the limits that meet the constraints cost less than this.
    pub lower_bound: f64,
    /// `cost / lower_bound − 1`.
    pub gap: f64,
    /// The visibility that was asked for or, for a fixed budget, found.
    pub visibility: f64,
    /// Pixels whose visibility stays above what was asked for even with `max_samples` everywhere. Their constraints are
    /// relaxed to what can be reached (plus 1 % of v²).
    pub unreachable_pixels: usize,
    /// Updates of the multipliers.
    pub iterations: usize,
}

/// Updates after which the multipliers are taken as they are; on a small grid, where they cost nothing, ten times more.
const MOST_ITERATIONS: usize = 100;
/// Multipliers of a small grid.
const SMALL_GRID: usize = 4096;
/// Gap on the reduced grid at which to stop.
const SMALL_GAP: f64 = 3e-3;
/// How often the gap is looked at.
const CHECK_EVERY: usize = 5;
/// Slack given to constraints that cannot be met.
const UNREACHABLE_SLACK: f32 = 1.01;

/// Finds the cheapest counts that bring visibility to the target.
///
/// # Errors
/// [`Error::SizeMismatch`], [`Error::BadPixel`] and [`Error::OutOfRange`] for planes that do not fit the threshold map, values
/// that are negative or not finite, costs of 0 and impossible limits.
///
/// ```
/// use fechner_perception::{CastleCsf, Plane, ThresholdInputs, Viewing, threshold_map};
/// use fechner_perception::allocation::{AllocationProblem, allocate};
/// let grey = Plane::filled(64, 64, 50.0);
/// let inputs = ThresholdInputs { display_luminance_cd_m2: &grey, guide_variance: None };
/// let thresholds = threshold_map(&inputs, &Viewing::default(), &CastleCsf::default())?;
/// let allocation = allocate(&AllocationProblem {
///     variance_per_sample: &Plane::from_fn(64, 64, |x, _| if x < 32 { 400.0 } else { 25.0 }),
///     thresholds: &thresholds,
///     cost: &Plane::filled(64, 64, 1.0),
///     tolerance: None,
///     visibility: 1.0,
///     min_samples: 1.0,
///     max_samples: 1e6,
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

/// Finds the lowest visibility that `budget` (Σ cᵢ nᵢ) can pay for, and the counts for it; `problem.visibility` is where
/// the search begins.
///
/// The cost stays within 1 % below the budget, unless `min_samples` everywhere costs more or `max_samples` less.
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
    for _ in 0..40 {
        let found = solver.solve(visibility, &mut multipliers);
        let excess = found.cost / budget;
        if excess <= 1.0 {
            affordable = visibility.ln();
            let enough = excess > 0.99;
            if best.as_ref().is_none_or(|best| best.visibility > visibility) {
                best = Some(found);
            }
            if enough {
                break;
            }
        } else {
            too_dear = visibility.ln();
            if best.is_none() && found.cost <= solver.cheapest * (1.0 + 1e-9) {
                // Not even the fewest samples are affordable: they are the answer.
                best = Some(found);
                break;
            }
        }
        // Without limits cost goes as v⁻²; aim a little below the budget.
        let aimed = visibility.ln() + 0.5 * (excess / 0.995).ln();
        let next = if too_dear.is_finite() && affordable.is_finite() {
            if affordable - too_dear < 1e-4 {
                break;
            }
            let margin = 0.1 * (affordable - too_dear);
            aimed.clamp(too_dear + margin, affordable - margin)
        } else {
            // Limits make the cost respond less than the law says: go at least a quarter further.
            visibility.ln() + (aimed - visibility.ln()).signum() * (aimed - visibility.ln()).abs().max(0.25)
        };
        if !(-30.0..=30.0).contains(&next) {
            break;
        }
        let factor = (visibility.ln() - next).exp().powi(4) as f32;
        multipliers.iter_mut().for_each(|multiplier| *multiplier *= factor);
        visibility = next.exp();
    }
    match best {
        Some(best) => Ok(best),
        None => Ok(solver.solve(visibility, &mut multipliers)),
    }
}

struct Solver<'a> {
    problem: &'a AllocationProblem<'a>,
    /// w = 2 N σ² per pixel: what v² would be for one sample.
    weight: Vec<f32>,
    /// √(w / c): counts are this times √μ.
    root: Vec<f32>,
    sigma_px: f64,
    /// Side of the blocks that share a multiplier.
    block: usize,
    blocks_x: usize,
    blocks_y: usize,
    /// v² reached with `max_samples` everywhere, over v*² = 1.
    floor: Plane,
    /// Σ cᵢ times `min_samples`.
    cheapest: f64,
}

impl<'a> Solver<'a> {
    fn new(problem: &'a AllocationProblem<'a>) -> Result<Self, Error> {
        let gain = problem.thresholds.noise_gain();
        let (width, height) = (gain.width(), gain.height());
        for (what, plane) in [
            ("variance per sample", Some(problem.variance_per_sample)),
            ("cost", Some(problem.cost)),
            ("tolerance", problem.tolerance),
        ] {
            if let Some(plane) = plane {
                plane.check_size(what, width, height)?;
                plane.check_non_negative(what)?;
            }
        }
        const LIMITS: &str = "at least 1e-6, and min_samples at most max_samples, which is at most 1e12";
        check_range("visibility", problem.visibility, 1e-9, 1e9, "between 1e-9 and 1e9")?;
        check_range("min_samples", problem.min_samples, 1e-6, problem.max_samples, LIMITS)?;
        check_range("max_samples", problem.max_samples, problem.min_samples, 1e12, LIMITS)?;
        for (what, plane) in [("cost", Some(problem.cost)), ("tolerance", problem.tolerance)] {
            if let Some(least) = plane.and_then(|plane| plane.values().iter().copied().reduce(f32::min)) {
                check_range(what, f64::from(least), 1e-12, f64::MAX, "at least 1e-12 at every pixel")?;
            }
        }
        // Bounded so that squares stay within f32; beyond it no count would do.
        let weight: Vec<f32> = gain
            .values()
            .iter()
            .zip(problem.variance_per_sample.values())
            .map(|(gain, variance)| (2.0 * gain * variance).min(1e18))
            .collect();
        let root = weight.iter().zip(problem.cost.values()).map(|(weight, cost)| (weight / cost).sqrt()).collect();
        let sigma_px = POOLING_SIGMA_DEG * problem.thresholds.viewing().display.pixels_per_degree;
        let block = ((sigma_px / 4.0) as usize).clamp(1, 8);
        let most = problem.max_samples as f32;
        let at_most: Vec<f32> = weight.iter().map(|weight| weight / most).collect();
        let floor = gaussian_blur(&Plane::from_values(width, height, at_most)?, sigma_px);
        let total_cost: f64 = problem.cost.values().iter().map(|&cost| f64::from(cost)).sum();
        Ok(Self {
            problem,
            weight,
            root,
            sigma_px,
            block,
            blocks_x: width.div_ceil(block),
            blocks_y: height.div_ceil(block),
            floor,
            cheapest: total_cost * problem.min_samples,
        })
    }

    fn width(&self) -> usize {
        self.floor.width()
    }

    fn height(&self) -> usize {
        self.floor.height()
    }

    /// Largest v² allowed at each pixel, and how many had to be relaxed.
    fn bounds(&self, visibility: f64) -> (Plane, usize) {
        let target = (visibility * visibility) as f32;
        let mut unreachable = 0;
        let mut bounds = self.floor.clone();
        let tolerance = self.problem.tolerance.map(Plane::values);
        for (index, bound) in bounds.values_mut().iter_mut().enumerate() {
            let wanted = tolerance.map_or(target, |tolerance| target * tolerance[index] * tolerance[index]);
            // Rounding alone must not call a constraint unreachable.
            if *bound > wanted * 1.000_01 {
                unreachable += 1;
            }
            *bound = wanted.max(*bound * UNREACHABLE_SLACK).max(f32::MIN_POSITIVE);
        }
        (bounds, unreachable)
    }

    /// Multipliers that would be right if every pixel were alone: n = w / v*², so μ = c w / v*⁴.
    fn first_multipliers(&self, visibility: f64) -> Vec<f32> {
        let scale = (visibility.powi(4)).recip() as f32;
        let alone: Vec<f32> = self
            .weight
            .iter()
            .zip(self.problem.cost.values())
            .map(|(weight, cost)| (weight * cost * scale).clamp(1e-30, 1e30))
            .collect();
        self.block_means(&alone)
    }

    fn solve(&self, visibility: f64, multipliers: &mut [f32]) -> Allocation {
        let (bounds, unreachable_pixels) = self.bounds(visibility);
        let coarse_bounds = self.block_means(bounds.values());
        let sigma_blocks = self.sigma_px / self.block as f64;
        let mut iterations = 0;
        let mut best_bound = f64::NEG_INFINITY;
        let mut best_multipliers = multipliers.to_vec();
        let most_iterations = if multipliers.len() <= SMALL_GRID { 10 * MOST_ITERATIONS } else { MOST_ITERATIONS };
        for iteration in 1..=most_iterations {
            iterations = iteration;
            let price = self.blur_blocks(multipliers, sigma_blocks);
            let noise = self.blur_blocks(&self.block_noise(&price), sigma_blocks);
            if iteration % CHECK_EVERY == 0 {
                let dual = self.coarse_dual(&price, multipliers, &coarse_bounds);
                if dual.value > best_bound {
                    best_bound = dual.value;
                    best_multipliers.copy_from_slice(multipliers);
                }
                let worst = noise.iter().zip(&coarse_bounds).map(|(noise, bound)| noise / bound).fold(0.0, f32::max);
                let feasible_cost = dual.cost * f64::from(worst.max(1.0));
                if feasible_cost <= best_bound.max(self.cheapest) * (1.0 + SMALL_GAP) {
                    break;
                }
            }
            for (multiplier, (noise, bound)) in multipliers.iter_mut().zip(noise.iter().zip(&coarse_bounds)) {
                // λ ← λ · (v²/bound)³. Counts go as √μ and v² as 1/√μ, so the square would be Newton's step for a
                // uniform picture and the fourth power the edge of stability; details, which pooling weakens, want
                // more than the square.
                let excess = noise / bound;
                let step = (excess * excess * excess).clamp(1e-3, 1e3);
                *multiplier = (*multiplier * step).clamp(1e-30, 1e30);
            }
        }
        multipliers.copy_from_slice(&best_multipliers);
        let mut allocation = self.certified(multipliers, &bounds, iterations);
        allocation.visibility = visibility;
        allocation.unreachable_pixels = unreachable_pixels;
        allocation
    }

    /// Counts at full resolution that meet every constraint, and the lower bound that the multipliers prove there.
    fn certified(&self, multipliers: &[f32], bounds: &Plane, iterations: usize) -> Allocation {
        let lambda = self.spread_over_blocks(multipliers);
        let price = gaussian_blur(&lambda, self.sigma_px);
        let (least, most) = (self.problem.min_samples as f32, self.problem.max_samples as f32);
        let mut samples = Plane::from_fn(self.width(), self.height(), |x, y| {
            let index = y * self.width() + x;
            (self.root[index] * price.values()[index].sqrt()).clamp(least, most)
        });
        let mut lower_bound = 0.0;
        for (index, &count) in samples.values().iter().enumerate() {
            let cost = f64::from(self.problem.cost.values()[index]);
            lower_bound += cost * f64::from(count)
                + f64::from(self.weight[index]) * f64::from(price.values()[index]) / f64::from(count)
                - f64::from(lambda.values()[index]) * f64::from(bounds.values()[index]);
        }
        self.repair(&mut samples, bounds);
        let cost = samples
            .values()
            .iter()
            .zip(self.problem.cost.values())
            .map(|(count, cost)| f64::from(*count) * f64::from(*cost))
            .sum::<f64>();
        // The fewest samples everywhere are a bound too.
        let lower_bound = lower_bound.max(self.cheapest);
        let gap = (cost / lower_bound - 1.0).max(0.0);
        Allocation { samples, cost, lower_bound, gap, visibility: 0.0, unreachable_pixels: 0, iterations }
    }

    /// Raises counts around violated constraints until none is left.
    fn repair(&self, samples: &mut Plane, bounds: &Plane) {
        let most = self.problem.max_samples as f32;
        let least = self.problem.min_samples as f32;
        let reach = (2.0 * self.sigma_px).ceil() as usize;
        for _ in 0..12 {
            let excess = self.excess(samples, bounds);
            let worst = excess.values().iter().copied().fold(0.0, f32::max);
            if worst <= 1.0 {
                return;
            }
            // The last per cent is cheaper paid by all than looked for.
            let factor = if worst < 1.001 {
                Plane::filled(self.width(), self.height(), worst * 1.000_01)
            } else {
                dilate(&excess.map(|excess| excess.max(1.0)), reach)
            };
            for (count, factor) in samples.values_mut().iter_mut().zip(factor.values()) {
                *count = (*count * factor).clamp(least, most);
            }
        }
    }

    /// v² over its bound at every pixel.
    fn excess(&self, samples: &Plane, bounds: &Plane) -> Plane {
        let noise: Vec<f32> = self.weight.iter().zip(samples.values()).map(|(weight, count)| weight / count).collect();
        let noise = Plane::from_values(self.width(), self.height(), noise)
            .unwrap_or_else(|_| Plane::filled(self.width(), self.height(), f32::INFINITY));
        let mut excess = gaussian_blur(&noise, self.sigma_px);
        excess.for_each_row_mut(|y, row| {
            row.iter_mut().zip(bounds.row(y)).for_each(|(value, bound)| *value /= bound);
        });
        excess
    }

    /// Mean of w/n over each block, with the counts that `price` asks for.
    fn block_noise(&self, price: &[f32]) -> Vec<f32> {
        let root_price: Vec<f32> = price.iter().map(|price| price.sqrt()).collect();
        let (least, most) = (self.problem.min_samples as f32, self.problem.max_samples as f32);
        self.reduce_blocks(|index, block| {
            self.weight[index] / (self.root[index] * root_price[block]).clamp(least, most)
        })
    }

    fn coarse_dual(&self, price: &[f32], multipliers: &[f32], bounds: &[f32]) -> CoarseDual {
        let root_price: Vec<f32> = price.iter().map(|price| price.sqrt()).collect();
        let (least, most) = (self.problem.min_samples as f32, self.problem.max_samples as f32);
        let cost_of = |index: usize, block: usize| {
            let count = (self.root[index] * root_price[block]).clamp(least, most);
            self.problem.cost.values()[index] * count
        };
        let costs = self.reduce_blocks(cost_of);
        let lagrangians = self.reduce_blocks(|index, block| {
            let count = (self.root[index] * root_price[block]).clamp(least, most);
            cost_of(index, block) + self.weight[index] * price[block] / count - multipliers[block] * bounds[block]
        });
        let sum = |means: &[f32]| {
            means.iter().enumerate().map(|(block, mean)| f64::from(*mean) * self.pixels_in(block) as f64).sum()
        };
        CoarseDual { value: sum(&lagrangians), cost: sum(&costs) }
    }

    fn pixels_in(&self, block: usize) -> usize {
        let (bx, by) = (block % self.blocks_x, block / self.blocks_x);
        (self.width() - bx * self.block).min(self.block) * (self.height() - by * self.block).min(self.block)
    }

    /// Mean of `value_at(pixel index, block index)` over each block.
    fn reduce_blocks(&self, value_at: impl Fn(usize, usize) -> f32 + Sync) -> Vec<f32> {
        let (width, height) = (self.width(), self.height());
        let mut means = vec![0.0; self.blocks_x * self.blocks_y];
        means.par_chunks_mut(self.blocks_x).with_min_len((4096 / width).max(1)).enumerate().for_each(|(by, row)| {
            for (bx, mean) in row.iter_mut().enumerate() {
                let block = by * self.blocks_x + bx;
                let columns = bx * self.block..((bx + 1) * self.block).min(width);
                let rows = by * self.block..((by + 1) * self.block).min(height);
                let count = columns.len() * rows.len();
                let mut sum = 0.0;
                for y in rows {
                    for x in columns.clone() {
                        sum += value_at(y * width + x, block);
                    }
                }
                *mean = sum / count as f32;
            }
        });
        means
    }

    fn block_means(&self, values: &[f32]) -> Vec<f32> {
        self.reduce_blocks(|index, _| values[index])
    }

    fn blur_blocks(&self, values: &[f32], sigma_blocks: f64) -> Vec<f32> {
        match Plane::from_values(self.blocks_x, self.blocks_y, values.to_vec()) {
            Ok(plane) => gaussian_blur(&plane, sigma_blocks).into_values(),
            Err(_) => values.to_vec(),
        }
    }

    fn spread_over_blocks(&self, values: &[f32]) -> Plane {
        Plane::from_fn(self.width(), self.height(), |x, y| values[(y / self.block) * self.blocks_x + x / self.block])
    }
}

/// Value of the dual function on the reduced grid, and what its counts cost.
struct CoarseDual {
    value: f64,
    cost: f64,
}

#[cfg(test)]
#[path = "allocation_tests.rs"]
mod tests;
