//! Two models side by side, finer than the eye can see: rust on iron, dust on paint.
//!
//! Parameter: `amount` in [0, 1], the share of the second. The value is the weighted sum; a sample comes from one of
//! the two and is weighted by the whole mixture, so that value and pdf always agree.
//!
//! Source: the one-sample model of multiple importance sampling, E. Veach (1997), section 9.2.4. Not for layers, where
//! light passes through the upper one twice: see the coated models.

use super::{Bsdf, BsdfEvaluation, BsdfSample, warp};
use glam::Vec3;

/// A weighted sum of two models.
#[derive(Clone, Copy, Debug)]
pub struct Mix<'a> {
    first: &'a Bsdf<'a>,
    second: &'a Bsdf<'a>,
    amount: f32,
}

impl<'a> Mix<'a> {
    /// A mix of both models; `amount` is the second's share, held to [0, 1].
    pub fn new(first: &'a Bsdf<'a>, second: &'a Bsdf<'a>, amount: f32) -> Self {
        Self { first, second, amount: amount.clamp(0.0, 1.0) }
    }

    pub(super) fn has_smooth_lobe(&self) -> bool {
        self.amount < 1.0 && self.first.has_smooth_lobe() || self.amount > 0.0 && self.second.has_smooth_lobe()
    }

    pub(super) fn evaluate(&self, wo: Vec3, wi: Vec3) -> BsdfEvaluation {
        let first = self.first.evaluate(wo, wi);
        let second = self.second.evaluate(wo, wi);
        BsdfEvaluation {
            value: first.value * (1.0 - self.amount) + second.value * self.amount,
            pdf: first.pdf * (1.0 - self.amount) + second.pdf * self.amount,
        }
    }

    pub(super) fn sample(&self, wo: Vec3, u: [f32; 3]) -> Option<BsdfSample> {
        let warp::Choice { is_taken: takes_second, rest } = warp::choose(u[2], self.amount);
        let (model, share) = if takes_second { (self.second, self.amount) } else { (self.first, 1.0 - self.amount) };
        let sample = model.sample(wo, [u[0], u[1], rest])?;
        if sample.lobe.is_delta() {
            return Some(BsdfSample { pdf: share * sample.pdf, ..sample });
        }
        let evaluation = self.evaluate(wo, sample.wi);
        let weight = evaluation.value / evaluation.pdf;
        (evaluation.pdf > 0.0 && weight.is_finite()).then_some(BsdfSample { weight, pdf: evaluation.pdf, ..sample })
    }

    pub(super) fn straight_through(&self, wo: Vec3) -> Vec3 {
        self.first.straight_through(wo).lerp(self.second.straight_through(wo), self.amount)
    }

    pub(super) fn albedo(&self, wo: Vec3) -> Vec3 {
        self.first.albedo(wo).lerp(self.second.albedo(wo), self.amount)
    }
}
