//! Sobol points in four dimensions with hashed Owen scrambling.
//!
//! Sobol 1967 with the direction numbers of Joe and Kuo 2008; scrambling and index shuffling by a hash on reversed bits
//! (Laine and Karras 2011, Burley 2020, with the stronger hash that Vegdahl published in 2021).

use super::STEP_OF_24_BITS;
use std::array::from_fn;

/// Mixes 32 bits (the finaliser of MurmurHash3 with better constants, found by search: Wellons 2018).
pub(super) const fn mix32(mut x: u32) -> u32 {
    x ^= x >> 16;
    x = x.wrapping_mul(0x7feb_352d);
    x ^= x >> 15;
    x = x.wrapping_mul(0x846c_a68b);
    x ^ (x >> 16)
}

/// Mixes 64 bits (the finaliser of SplitMix64: Steele, Lea and Flood 2014).
pub(super) const fn mix64(mut x: u64) -> u64 {
    x = (x ^ (x >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    x = (x ^ (x >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    x ^ (x >> 31)
}

/// A random-looking permutation of 32-bit numbers in which every bit depends on lower bits only: on bit-reversed
/// numbers it is a nested uniform (Owen) scramble.
const fn hash_low_to_high(mut x: u32, seed: u32) -> u32 {
    x ^= x.wrapping_mul(0x3d20_adea);
    x = x.wrapping_add(seed);
    x = x.wrapping_mul((seed >> 16) | 1);
    x ^= x.wrapping_mul(0x0552_6c56);
    x ^ x.wrapping_mul(0x53a2_2864)
}

/// Direction numbers of one dimension, bit-reversed so that the result comes out reversed too.
const fn reversed_directions(degree: usize, coefficients: u32, first: [u32; 3]) -> [u32; 32] {
    let mut m = [0u32; 32];
    let mut i = 0;
    while i < 32 {
        m[i] = if i < degree {
            first[i]
        } else {
            let mut value = m[i - degree] ^ (m[i - degree] << degree);
            let mut k = 1;
            while k < degree {
                if (coefficients >> (degree - 1 - k)) & 1 == 1 {
                    value ^= m[i - k] << k;
                }
                k += 1;
            }
            value
        };
        i += 1;
    }
    let mut reversed = [0u32; 32];
    let mut i = 0;
    while i < 32 {
        reversed[i] = (m[i] << (31 - i)).reverse_bits();
        i += 1;
    }
    reversed
}

/// Direction numbers of the third and the fourth dimension.
static DIRECTIONS: [[u32; 32]; 2] = [reversed_directions(2, 1, [1, 3, 0]), reversed_directions(3, 1, [1, 3, 1])];

/// Four numbers of each of `N` samples, by dimension.
pub(super) type Points<T, const N: usize> = [[T; N]; 4];

/// The points with these bit-reversed indices, their digits reversed too.
///
/// Without tables, whose 16 KiB would take half of a core's fastest cache and whose rows do not go in vectors.
#[inline(always)]
fn reversed_points<const N: usize>(reversed_indices: [u32; N]) -> Points<u32, N> {
    let indices = reversed_indices.map(u32::reverse_bits);
    // Pascal's triangle modulo 2: digit i is the sum of the index's bits j of which i is a subset, a factor for each
    // bit of j.
    let mut second = indices;
    for (shift, having) in [(1, 0xaaaa_aaaa), (2, 0xcccc_cccc), (4, 0xf0f0_f0f0), (8, 0xff00_ff00), (16, 0xffff_0000)] {
        second = second.map(|digits| digits ^ (digits & having) >> shift);
    }
    let (mut third, mut fourth, mut bits) = ([0; N], [0; N], reversed_indices);
    for (third_direction, fourth_direction) in DIRECTIONS[0].iter().zip(&DIRECTIONS[1]) {
        for lane in 0..N {
            let all_if_set = (bits[lane].cast_signed() >> 31).cast_unsigned();
            third[lane] ^= all_if_set & third_direction;
            fourth[lane] ^= all_if_set & fourth_direction;
            bits[lane] <<= 1;
        }
    }
    [indices, second, third, fourth]
}

/// To [0, 1) with the 24 bits that f32 holds.
#[inline(always)]
fn to_unit(reversed: u32) -> f32 {
    (reversed.reverse_bits() >> 8) as i32 as f32 * STEP_OF_24_BITS
}

/// The four numbers in [0, 1) of each of `N` samples, at bit-reversed indices of the Sobol sequence, its order and
/// digits scrambled by a seed of each.
#[inline(always)]
pub(super) fn scrambled_points<const N: usize>(reversed_indices: [u32; N], seeds: [u32; N]) -> Points<f32, N> {
    let order: [u32; N] = from_fn(|lane| hash_low_to_high(reversed_indices[lane], seeds[lane]));
    let digits = reversed_points(order);
    let mut numbers = [[0.0; N]; 4];
    // Loops: `from_fn` of as much is a function of its own, and not compiled for vectors.
    for (dimension, (numbers, digits)) in numbers.iter_mut().zip(&digits).enumerate() {
        let step = (dimension as u32 + 1).wrapping_mul(0x9e37_79b9);
        for lane in 0..N {
            numbers[lane] = to_unit(hash_low_to_high(digits[lane], mix32(seeds[lane] ^ step)));
        }
    }
    numbers
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The unscrambled sequence begins with the published points (Joe and Kuo 2008, in binary order, not Gray code).
    #[test]
    fn directions_give_the_published_points() {
        let point = |i: u32| reversed_points([i.reverse_bits()]).map(|[digits]| to_unit(digits));
        assert_eq!(point(0), [0.0, 0.0, 0.0, 0.0]);
        assert_eq!(point(1), [0.5, 0.5, 0.5, 0.5]);
        assert_eq!(point(2), [0.25, 0.75, 0.75, 0.75]);
        assert_eq!(point(3), [0.75, 0.25, 0.25, 0.25]);
        assert_eq!(point(4)[0], 0.125);
        assert_eq!(point(4)[1], 0.625);
        assert_eq!(point(4)[3], 0.125);
    }
}
