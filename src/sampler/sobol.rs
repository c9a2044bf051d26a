//! Sobol points in four dimensions with hashed Owen scrambling.
//!
//! Sobol 1967 with the direction numbers of Joe and Kuo 2008; scrambling and index shuffling by a hash on reversed bits
//! (Laine and Karras 2011, Burley 2020, with the stronger hash that Vegdahl published in 2021).

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

/// XOR of direction numbers by byte of the index: 4 look-ups instead of 32 tests.
const fn byte_tables(directions: [u32; 32]) -> [[u32; 256]; 4] {
    let mut tables = [[0u32; 256]; 4];
    let mut byte = 0;
    while byte < 4 {
        let mut value = 0;
        while value < 256 {
            let mut bit = 0;
            while bit < 8 {
                if (value >> bit) & 1 == 1 {
                    tables[byte][value] ^= directions[byte * 8 + bit];
                }
                bit += 1;
            }
            value += 1;
        }
        byte += 1;
    }
    tables
}

static DIMENSION_1: [[u32; 256]; 4] = byte_tables(reversed_directions(1, 0, [1, 0, 0]));
static DIMENSION_2: [[u32; 256]; 4] = byte_tables(reversed_directions(2, 1, [1, 3, 0]));
static DIMENSION_3: [[u32; 256]; 4] = byte_tables(reversed_directions(3, 1, [1, 3, 1]));

fn reversed_point(tables: &[[u32; 256]; 4], index: u32) -> u32 {
    let b = index.to_le_bytes();
    tables[0][b[0] as usize] ^ tables[1][b[1] as usize] ^ tables[2][b[2] as usize] ^ tables[3][b[3] as usize]
}

/// To [0, 1) with the 24 bits that f32 holds.
fn to_unit(reversed: u32) -> f32 {
    (reversed.reverse_bits() >> 8) as f32 * (1.0 / 16_777_216.0)
}

/// A point of the four-dimensional Sobol sequence whose order and digits are scrambled by a seed, one number at a time: who asks
/// for three does not pay for the fourth.
#[derive(Clone, Copy, Debug)]
pub(super) struct ScrambledPoint {
    shuffled_index: u32,
    seed: u32,
}

impl ScrambledPoint {
    #[inline(always)]
    pub(super) fn new(index: u32, seed: u32) -> Self {
        Self { shuffled_index: hash_low_to_high(index.reverse_bits(), seed).reverse_bits(), seed }
    }

    /// In [0, 1); `dimension` is below 4.
    #[inline(always)]
    pub(super) fn number(self, dimension: u32) -> f32 {
        let index = self.shuffled_index;
        let reversed = match dimension {
            // The first dimension is the radical inverse: its reversed digits are the index itself.
            0 => index,
            1 => reversed_point(&DIMENSION_1, index),
            2 => reversed_point(&DIMENSION_2, index),
            _ => reversed_point(&DIMENSION_3, index),
        };
        let digit_seed = mix32(self.seed ^ (dimension + 1).wrapping_mul(0x9e37_79b9));
        to_unit(hash_low_to_high(reversed, digit_seed))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The unscrambled sequence begins with the published points (Joe and Kuo 2008, in binary order, not Gray code).
    #[test]
    fn directions_give_the_published_points() {
        let point =
            |i: u32| [to_unit(i), to_unit(reversed_point(&DIMENSION_1, i)), to_unit(reversed_point(&DIMENSION_2, i))];
        assert_eq!(point(0), [0.0, 0.0, 0.0]);
        assert_eq!(point(1), [0.5, 0.5, 0.5]);
        assert_eq!(point(2), [0.25, 0.75, 0.75]);
        assert_eq!(point(3), [0.75, 0.25, 0.25]);
        assert_eq!(point(4)[0], 0.125);
        assert_eq!(point(4)[1], 0.625);
    }
}
