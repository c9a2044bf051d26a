//! Repeatable noise for tests.

use crate::photometry::REC709_WEIGHTS;

/// A standard normal number from SplitMix64 and Box–Muller.
pub(crate) fn normal(state: &mut u64) -> f32 {
    let (a, b) = (uniform(state), uniform(state));
    ((-2.0 * (1.0 - a).ln()).sqrt() * (std::f64::consts::TAU * b).cos()) as f32
}

/// This much red, and as much less green as keeps the luminance.
pub(crate) fn red_for_green(red: f32) -> [f32; 3] {
    [red, -red * REC709_WEIGHTS[0] / REC709_WEIGHTS[1], 0.0]
}

/// A number in [0, 1).
pub(crate) fn uniform(state: &mut u64) -> f64 {
    *state = state.wrapping_add(0x9e37_79b9_7f4a_7c15);
    let mut z = *state;
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    ((z ^ (z >> 31)) >> 11) as f64 / (1_u64 << 53) as f64
}
