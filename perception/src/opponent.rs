//! Opponent colour: what the eye makes of RGB behind the cones.
//!
//! castleCSF's mechanisms (Ashraf et al. 2024) on the cones of CIE 170-1:2006, for error over the adaptation luminance.
//! Not for how colours look: there is no hue or saturation in it, and no chromatic adaptation.

use crate::photometry::{REC709_WEIGHTS, luminance};

/// Luminance and the two chromatic signals of a colour, all in cd/m²; for grey of any level the chromatic ones are 0.
///
/// Error in them is judged as luminance error is: divided by the adaptation luminance, through the channel's own
/// contrast sensitivity function (see [`crate::threshold::chromatic_threshold_map`]).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Opponent {
    /// Luminance, cd/m².
    pub achromatic: f32,
    /// Red–green signal L − M, cd/m², positive towards red.
    pub red_green: f32,
    /// Yellow–violet signal S − (L + M), cd/m², positive towards violet.
    pub yellow_violet: f32,
}

/// Rows L, M, S of linear Rec. 709 RGB: XYZ of the primaries (ITU-R BT.709-6) through the cone fundamentals of
/// CIE 170-1:2006 expressed in XYZ, scaled so that L + M of white is 1.
const CONES: [[f64; 3]; 3] = cone_matrix();

/// Rows achromatic, red–green and yellow–violet of linear Rec. 709 RGB: [`opponent`] as a matrix, for sums in `f64`.
///
/// The chromatic mechanisms are castleCSF's (Ashraf et al. 2024): L − (L/M of white) M and (L+M)/S of white · S − (L
/// + M).
pub const OPPONENT_OF_RGB: [[f64; 3]; 3] = opponent_matrix();

const fn cone_matrix() -> [[f64; 3]; 3] {
    const XYZ: [[f64; 3]; 3] = [
        [0.412_390_8, 0.357_584_3, 0.180_480_8],
        [0.212_639, 0.715_168_7, 0.072_192_3],
        [0.019_330_8, 0.119_194_8, 0.950_532_2],
    ];
    const LMS: [[f64; 3]; 3] = [
        [0.187_596_268_6, 0.585_168_649_1, -0.026_384_263_3],
        [-0.133_397_430_7, 0.405_505_777_3, 0.034_502_127_7],
        [0.000_244_379_0, -0.000_542_995_9, 0.019_406_849_1],
    ];
    let mut cones = [[0.0; 3]; 3];
    let mut index = 0;
    while index < 9 {
        let (row, column) = (index / 3, index % 3);
        cones[row][column] = LMS[row][0] * XYZ[0][column] + LMS[row][1] * XYZ[1][column] + LMS[row][2] * XYZ[2][column];
        index += 1;
    }
    let white = sum(cones[0]) + sum(cones[1]);
    let mut index = 0;
    while index < 9 {
        cones[index / 3][index % 3] /= white;
        index += 1;
    }
    cones
}

const fn sum(row: [f64; 3]) -> f64 {
    row[0] + row[1] + row[2]
}

const fn opponent_matrix() -> [[f64; 3]; 3] {
    let [long, medium, short] = CONES;
    let medium_share = sum(long) / sum(medium);
    let short_share = (sum(long) + sum(medium)) / sum(short);
    let mut matrix = [[0.0; 3]; 3];
    let mut column = 0;
    while column < 3 {
        matrix[0][column] = REC709_WEIGHTS[column] as f64;
        matrix[1][column] = long[column] - medium_share * medium[column];
        matrix[2][column] = short_share * short[column] - (long[column] + medium[column]);
        column += 1;
    }
    matrix
}

/// Opponent signals of linear Rec. 709 RGB in cd/m².
///
/// ```
/// use fechner_perception::opponent::opponent;
/// let grey = opponent([50.0; 3]);
/// assert!((grey.achromatic - 50.0).abs() < 1e-3);
/// assert!(grey.red_green.abs() < 1e-3 && grey.yellow_violet.abs() < 1e-3);
/// assert!(opponent([50.0, 20.0, 20.0]).red_green > 0.0);
/// ```
#[must_use]
pub fn opponent(rgb_cd_m2: [f32; 3]) -> Opponent {
    let signal = |row: usize| -> f32 {
        OPPONENT_OF_RGB[row].iter().zip(rgb_cd_m2).map(|(&weight, value)| weight as f32 * value).sum()
    };
    Opponent { achromatic: luminance(rgb_cd_m2), red_green: signal(1), yellow_violet: signal(2) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cones_of_white_are_those_of_daylight() {
        let sums: Vec<f64> = CONES.iter().map(|row| row.iter().sum()).collect();
        // L/M of D65 is 2.311 and (L+M)/S 50.98 in castleCSF; the 1931 observer's white differs a little.
        assert!((sums[0] / sums[1] - 2.311).abs() < 0.03, "{sums:?}");
        assert!(((sums[0] + sums[1]) / sums[2] - 50.98).abs() < 1.0, "{sums:?}");
        assert!((sums[0] + sums[1] - 1.0).abs() < 1e-6);
    }

    #[test]
    fn colours_point_where_they_should() {
        assert!(opponent([1.0, 0.0, 0.0]).red_green > 0.0);
        assert!(opponent([0.0, 1.0, 0.0]).red_green < 0.0);
        assert!(opponent([0.0, 0.0, 1.0]).yellow_violet > 0.0);
        assert!(opponent([1.0, 1.0, 0.0]).yellow_violet < 0.0);
    }
}
