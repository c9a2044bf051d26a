//! The dual updates on a grid of blocks, and the certificate at full resolution.

use rayon::prelude::*;

use super::block_grid::BlockGrid;
use super::{Allocation, AllocationProblem};
use crate::error::{Error, check_range};
use crate::filter::{dilate_xy, gaussian_blur_xy};
use crate::plane::Plane;
use crate::threshold::POOLING_SIGMA_DEG;

/// Updates after which the multipliers are taken as they are; on a small grid, where they cost nothing, ten times more.
const MAX_ITERATIONS: usize = 100;
/// Multipliers of a small grid.
const SMALL_GRID: usize = 4096;
/// Gap at which to stop on any but a small grid, where updates are dear, whatever was asked for.
const MIN_GAP_OF_LARGE_GRIDS: f64 = 5e-3;
/// How often the gap is looked at.
const CHECK_EVERY: usize = 5;
/// Rounds that raise counts to what constraints need after the last update.
const MAX_REPAIRS: usize = 12;
/// Slack given to constraints that cannot be met.
const UNREACHABLE_SLACK: f32 = 1.01;

/// Above every v² that counts within their limits can leave: weights are at most 1e18, samples at least 1e-6.
const MAX_BOUND: f64 = 1e25;

/// One problem, prepared.
pub(super) struct Solver<'a> {
    problem: &'a AllocationProblem<'a>,
    /// w = 2 N σ² per pixel: what v² would be for one sample.
    weight: Vec<f32>,
    /// √(w / c): counts are this times √μ.
    root: Vec<f32>,
    /// Standard deviation of the pooling window along x and y.
    sigma_px: [f64; 2],
    /// The blocks that share a multiplier.
    grid: BlockGrid,
    /// What the pixels of each block come to.
    blocks: Vec<BlockStatistics>,
    /// Share of its block's constraint that each pixel has, over that of an even one; `None` is 1 everywhere.
    shares: Option<Vec<f32>>,
    /// v² reached with `max_samples` everywhere, over v*² = 1.
    floor: Plane,
    /// Σ cᵢ times `min_samples`.
    pub(super) cheapest: f64,
}

impl<'a> Solver<'a> {
    pub(super) fn new(problem: &'a AllocationProblem<'a>) -> Result<Self, Error> {
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
        check_range("enough_gap", problem.enough_gap, 0.0, 1.0, "a share between 0 and 1")?;
        for (what, plane) in [("cost", Some(problem.cost)), ("tolerance", problem.tolerance)] {
            if let Some(least) = plane.and_then(|plane| plane.values().iter().copied().reduce(f32::min)) {
                check_range(what, f64::from(least), 1e-12, f64::MAX, "at least 1e-12 at every pixel")?;
            }
        }
        // Bounded so that squares stay within f32; beyond it no count would do.
        let weight: Vec<f32> = gain
            .values()
            .par_iter()
            .zip(problem.variance_per_sample.values())
            .map(|(gain, variance)| (2.0 * gain * variance).min(1e18))
            .collect();
        let root = weight.par_iter().zip(problem.cost.values()).map(|(weight, cost)| (weight / cost).sqrt()).collect();
        let density = problem.thresholds.viewing().display.pixel_density();
        let sigma_px = density.pixels(POOLING_SIGMA_DEG);
        let block = ((POOLING_SIGMA_DEG * density.coarsest() / 4.0) as usize).clamp(1, 8);
        let most = problem.max_samples as f32;
        let at_most: Vec<f32> = weight.par_iter().map(|weight| weight / most).collect();
        let floor = gaussian_blur_xy(&Plane::from_values(width, height, at_most)?, sigma_px);
        let total_cost: f64 = problem.cost.values().iter().map(|&cost| f64::from(cost)).sum();
        let mut solver = Self {
            problem,
            weight,
            root,
            sigma_px,
            grid: BlockGrid { width, height, side: block },
            floor,
            cheapest: total_cost * problem.min_samples,
            blocks: Vec::new(),
            shares: None,
        };
        solver.blocks = solver.block_statistics();
        solver.shares = problem.tolerance.map(|tolerance| solver.shares_by(tolerance.values()));
        Ok(solver)
    }

    fn width(&self) -> usize {
        self.floor.width()
    }

    fn height(&self) -> usize {
        self.floor.height()
    }

    /// Largest v² allowed at each pixel, and how many had to be relaxed.
    fn bounds(&self, visibility: f64) -> (Plane, usize) {
        let target = visibility * visibility;
        let mut unreachable = 0;
        let mut bounds = self.floor.clone();
        let tolerance = self.problem.tolerance.map(Plane::values);
        for (index, bound) in bounds.values_mut().iter_mut().enumerate() {
            let tolerated = tolerance.map_or(1.0, |tolerance| f64::from(tolerance[index]));
            let wanted = (target * tolerated * tolerated).min(MAX_BOUND) as f32;
            // Rounding alone must not call a constraint unreachable.
            if *bound > wanted * 1.000_01 {
                unreachable += 1;
            }
            *bound = wanted.max(*bound * UNREACHABLE_SLACK).max(f32::MIN_POSITIVE);
        }
        (bounds, unreachable)
    }

    /// The greatest visibility that these counts leave, over what is tolerated at its pixel.
    pub(super) fn reached(&self, samples: &Plane) -> f64 {
        let tolerance = self.problem.tolerance.map(Plane::values);
        let squared = self.pooled_noise(samples);
        let over_tolerance = squared.values().iter().enumerate().map(|(index, &squared)| {
            f64::from(squared).max(0.0).sqrt() / tolerance.map_or(1.0, |tolerance| f64::from(tolerance[index]))
        });
        over_tolerance.fold(0.0, f64::max)
    }

    /// Multipliers that would be right if every pixel were alone: n = w / b, so μ = c w / b², with b the bound of v².
    ///
    /// The relaxed bound, not what is wanted: where counts stand at `max_samples` noise is 1 / 1.01 of it, so that
    /// updates lower a multiplier by 3 % only, and one that began too high stays so (half of a picture out of reach
    /// by 60 times: gap 3.0 after 100 updates).
    pub(super) fn first_multipliers(&self, visibility: f64) -> Vec<f32> {
        let (bounds, _) = self.bounds(visibility);
        let alone: Vec<f32> = self
            .weight
            .par_iter()
            .zip(self.problem.cost.values())
            .zip(bounds.values())
            .map(|((&weight, &cost), &bound)| {
                let alone = f64::from(weight) * f64::from(cost) / f64::from(bound).powi(2);
                alone.clamp(1e-30, 1e30) as f32
            })
            .collect();
        self.constraint_means(&alone)
    }

    pub(super) fn solve(&self, visibility: f64, multipliers: &mut [f32]) -> Allocation {
        let (bounds, unreachable_pixels) = self.bounds(visibility);
        let coarse_bounds = self.constraint_means(bounds.values());
        let sigma_blocks = self.sigma_px.map(|sigma| sigma / self.grid.side as f64);
        let mut iterations = 0;
        let mut best_bound = f64::NEG_INFINITY;
        let mut best_multipliers = multipliers.to_vec();
        let (most_iterations, enough_gap) = if multipliers.len() <= SMALL_GRID {
            (10 * MAX_ITERATIONS, self.problem.enough_gap)
        } else {
            (MAX_ITERATIONS, self.problem.enough_gap.max(MIN_GAP_OF_LARGE_GRIDS))
        };
        for iteration in 1..=most_iterations {
            iterations = iteration;
            let price = self.grid.blurred(multipliers, sigma_blocks);
            let noise = self.grid.blurred(&self.block_noise(&price), sigma_blocks);
            if iteration % CHECK_EVERY == 0 {
                let dual = self.coarse_dual(&price, multipliers, &coarse_bounds);
                if dual.value > best_bound {
                    best_bound = dual.value;
                    best_multipliers.copy_from_slice(multipliers);
                }
                let worst = noise.iter().zip(&coarse_bounds).map(|(noise, bound)| noise / bound).fold(0.0, f32::max);
                let feasible_cost = dual.cost * f64::from(worst.max(1.0));
                if feasible_cost <= best_bound.max(self.cheapest) * (1.0 + enough_gap) {
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
        let price = gaussian_blur_xy(&lambda, self.sigma_px);
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

    /// Raises counts around violated constraints until none is left, for at most [`MAX_REPAIRS`] rounds.
    fn repair(&self, samples: &mut Plane, bounds: &Plane) {
        let most = self.problem.max_samples as f32;
        let least = self.problem.min_samples as f32;
        let reach = self.sigma_px.map(|sigma| (2.0 * sigma).ceil() as usize);
        for _ in 0..MAX_REPAIRS {
            let excess = self.excess(samples, bounds);
            let worst = excess.max();
            if worst <= 1.0 {
                return;
            }
            // The last per cent is cheaper paid by all than looked for.
            let factor = if worst < 1.001 {
                Plane::filled(self.width(), self.height(), worst * 1.000_01)
            } else {
                dilate_xy(&excess.map(|excess| excess.max(1.0)), reach[0], reach[1])
            };
            for (count, factor) in samples.values_mut().iter_mut().zip(factor.values()) {
                *count = (*count * factor).clamp(least, most);
            }
        }
    }

    /// v² at every pixel.
    fn pooled_noise(&self, samples: &Plane) -> Plane {
        let noise: Vec<f32> =
            self.weight.par_iter().zip(samples.values()).map(|(weight, count)| weight / count).collect();
        let noise = Plane::from_values(self.width(), self.height(), noise)
            .unwrap_or_else(|_| Plane::filled(self.width(), self.height(), f32::INFINITY));
        gaussian_blur_xy(&noise, self.sigma_px)
    }

    /// v² over its bound at every pixel.
    fn excess(&self, samples: &Plane, bounds: &Plane) -> Plane {
        let mut excess = self.pooled_noise(samples);
        excess.for_each_row_mut(|y, row| {
            row.iter_mut().zip(bounds.row(y)).for_each(|(value, bound)| *value /= bound);
        });
        excess
    }

    /// Mean of w/n over each block, with the counts that `price` asks for.
    fn block_noise(&self, price: &[f32]) -> Vec<f32> {
        self.grid.each(|block| {
            let root_price = price[block].sqrt();
            let statistics = &self.blocks[block];
            match self.limit_of(block, root_price) {
                Limits::None => statistics.root_weight_cost / root_price,
                Limits::All(count) => statistics.weight / count,
                Limits::Some => self.grid.mean(block, |index| self.weight[index] / self.count(index, root_price)),
            }
        })
    }

    fn coarse_dual(&self, price: &[f32], multipliers: &[f32], bounds: &[f32]) -> CoarseDual {
        // Cost and noise of each block, in the order of the blocks: the sum is the same on any number of threads.
        let noise = self.block_noise(price);
        let costs = self.grid.each(|block| {
            let root_price = price[block].sqrt();
            let statistics = &self.blocks[block];
            match self.limit_of(block, root_price) {
                Limits::None => statistics.root_weight_cost * root_price,
                Limits::All(count) => statistics.cost * count,
                Limits::Some => {
                    self.grid.mean(block, |index| self.problem.cost.values()[index] * self.count(index, root_price))
                }
            }
        });
        let mut dual = CoarseDual { value: 0.0, cost: 0.0 };
        for (block, (cost, noise)) in costs.iter().zip(&noise).enumerate() {
            let pixels = self.grid.pixels_in(block) as f64;
            let lagrangian = f64::from(*cost) + f64::from(price[block]) * f64::from(*noise)
                - f64::from(multipliers[block]) * f64::from(bounds[block]);
            dual.value += pixels * lagrangian;
            dual.cost += pixels * f64::from(*cost);
        }
        dual
    }

    /// Samples of a pixel where the square root of its price is `root_price`.
    fn count(&self, index: usize, root_price: f32) -> f32 {
        (self.root[index] * root_price).clamp(self.problem.min_samples as f32, self.problem.max_samples as f32)
    }

    /// Which pixels of a block a limit holds at `root_price`.
    fn limit_of(&self, block: usize, root_price: f32) -> Limits {
        let (least, most) = (self.problem.min_samples as f32, self.problem.max_samples as f32);
        let statistics = &self.blocks[block];
        let (fewest, greatest) = (statistics.least_root * root_price, statistics.greatest_root * root_price);
        if fewest >= least && greatest <= most {
            Limits::None
        } else if greatest <= least {
            Limits::All(least)
        } else if fewest >= most {
            Limits::All(most)
        } else {
            Limits::Some
        }
    }

    fn block_statistics(&self) -> Vec<BlockStatistics> {
        self.grid.each(|block| {
            let mut statistics = BlockStatistics {
                weight: self.grid.mean(block, |index| self.weight[index]),
                cost: self.grid.mean(block, |index| self.problem.cost.values()[index]),
                // √(w/c) · c
                root_weight_cost: self.grid.mean(block, |index| self.root[index] * self.problem.cost.values()[index]),
                least_root: f32::INFINITY,
                greatest_root: 0.0,
            };
            self.grid.for_each_in(block, |index| {
                statistics.least_root = statistics.least_root.min(self.root[index]);
                statistics.greatest_root = statistics.greatest_root.max(self.root[index]);
            });
            statistics
        })
    }

    /// A block is constrained at those of its pixels that tolerate least: with them the others are within their
    /// limits, since pooling hardly varies over a block. Measured on a chequerboard of 0.3 and 1, constrained by the
    /// mean of each block's tolerances instead: 8.5 % too dear, with a certified gap of 430 %.
    fn shares_by(&self, tolerance: &[f32]) -> Vec<f32> {
        const AS_TIGHT: f32 = 1.001;
        let mut shares = vec![0.0; tolerance.len()];
        for block in 0..self.grid.count() {
            let mut least = f32::INFINITY;
            self.grid.for_each_in(block, |index| least = least.min(tolerance[index]));
            let is_tight = |index: usize| tolerance[index] <= least * AS_TIGHT;
            let mut tight = 0;
            self.grid.for_each_in(block, |index| tight += usize::from(is_tight(index)));
            let share = self.grid.pixels_in(block) as f32 / tight as f32;
            self.grid.for_each_in(block, |index| shares[index] = if is_tight(index) { share } else { 0.0 });
        }
        shares
    }

    /// Mean of `values` over the constrained pixels of each block.
    fn constraint_means(&self, values: &[f32]) -> Vec<f32> {
        self.grid.each(|block| match &self.shares {
            None => self.grid.mean(block, |index| values[index]),
            // Not share times value, which may be infinite where the share is 0.
            Some(shares) => self.grid.mean(block, |index| match shares[index] {
                0.0 => 0.0,
                share => share * values[index],
            }),
        })
    }

    /// Each pixel's share of its block's value.
    fn spread_over_blocks(&self, values: &[f32]) -> Plane {
        Plane::from_fn(self.width(), self.height(), |x, y| {
            let value = values[self.grid.block_of(x, y)];
            self.shares.as_ref().map_or(value, |shares| value * shares[y * self.width() + x])
        })
    }
}

/// What the pixels of one block come to: as long as no count meets a limit, noise and cost need no more than this.
struct BlockStatistics {
    /// Mean of w.
    weight: f32,
    /// Mean of c.
    cost: f32,
    /// Mean of √(w c).
    root_weight_cost: f32,
    /// Least and greatest √(w / c).
    least_root: f32,
    greatest_root: f32,
}

/// Which of a block's counts stand at a limit.
enum Limits {
    None,
    /// All, at this count.
    All(f32),
    Some,
}

/// Value of the dual function on the reduced grid, and what its counts cost.
struct CoarseDual {
    value: f64,
    cost: f64,
}
