//! Colour spaces by their primaries.
//!
//! For colours that are to stay the same. Not for bringing them into what a display can show: what another space does
//! not hold gets negative channels ([`crate::tone::gamut`]).

/// A 3×3 matrix, row by row.
pub type Matrix = [[f64; 3]; 3];

/// The identity matrix, which leaves colours as they are.
pub const IDENTITY: Matrix = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];

/// CIE 1931 chromaticities of an additive colour space.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Primaries {
    /// x and y of red.
    pub red: [f64; 2],
    /// x and y of green.
    pub green: [f64; 2],
    /// x and y of blue.
    pub blue: [f64; 2],
    /// x and y of white.
    pub white: [f64; 2],
}

impl Primaries {
    /// ITU-R BT.709, which sRGB shares.
    pub const REC709: Self =
        Self { red: [0.64, 0.33], green: [0.30, 0.60], blue: [0.15, 0.06], white: [0.3127, 0.3290] };
    /// ITU-R BT.2020.
    pub const REC2020: Self =
        Self { red: [0.708, 0.292], green: [0.170, 0.797], blue: [0.131, 0.046], white: [0.3127, 0.3290] };

    /// Display P3: DCI-P3 with the white of Rec.709.
    pub const DISPLAY_P3: Self =
        Self { red: [0.680, 0.320], green: [0.265, 0.690], blue: [0.150, 0.060], white: [0.3127, 0.3290] };
    /// AP0 of SMPTE ST 2065-1, ACES 2065-1.
    pub const ACES_AP0: Self =
        Self { red: [0.7347, 0.2653], green: [0.0, 1.0], blue: [0.0001, -0.077], white: [0.32168, 0.33767] };
    /// AP1 of ACEScg (S-2014-004).
    pub const ACES_AP1: Self =
        Self { red: [0.713, 0.293], green: [0.165, 0.830], blue: [0.128, 0.044], white: [0.32168, 0.33767] };
    /// Adobe RGB (1998).
    pub const ADOBE_RGB: Self =
        Self { red: [0.64, 0.33], green: [0.21, 0.71], blue: [0.15, 0.06], white: [0.3127, 0.3290] };
    /// CIE XYZ itself, whose white is that of equal energy.
    pub const XYZ: Self = Self { red: [1.0, 0.0], green: [0.0, 1.0], blue: [0.0, 0.0], white: [1.0 / 3.0, 1.0 / 3.0] };

    /// Matrix from this space's linear RGB to XYZ with the white at Y = 1; `None` where the three primaries span no
    /// colours.
    #[must_use]
    pub fn to_xyz(&self) -> Option<Matrix> {
        let column = |[x, y]: [f64; 2]| [x, y, 1.0 - x - y];
        let chromaticities = transposed([column(self.red), column(self.green), column(self.blue)]);
        let [x, y] = self.white;
        let white = [x / y, 1.0, (1.0 - x - y) / y];
        let scale = apply(&inverse(&chromaticities)?, white);
        let matrix = chromaticities.map(|row| [row[0] * scale[0], row[1] * scale[1], row[2] * scale[2]]);
        matrix.iter().flatten().all(|value| value.is_finite()).then_some(matrix)
    }

    /// Matrix from this space's linear RGB to another's, colours kept as they are: a white of another colour stays of
    /// that colour.
    #[must_use]
    pub fn to(&self, other: &Self) -> Option<Matrix> {
        Some(product(&inverse(&other.to_xyz()?)?, &self.to_xyz()?))
    }

    /// [`Primaries::to`], where the two differ by more than the digits that files write.
    #[must_use]
    pub fn to_other(&self, other: &Self) -> Option<Matrix> {
        if self.is_like(other) { None } else { self.to(other) }
    }

    /// Whether all chromaticities agree with another space's to 0.001.
    #[must_use]
    pub fn is_like(&self, other: &Self) -> bool {
        let points = |p: &Self| [p.red, p.green, p.blue, p.white];
        points(self).iter().flatten().zip(points(other).iter().flatten()).all(|(a, b)| (a - b).abs() < 1e-3)
    }

    /// [`Primaries::to`] with this space's white becoming the other's (Bradford's adaptation, linear).
    #[must_use]
    pub fn to_adapted(&self, other: &Self) -> Option<Matrix> {
        const BRADFORD: Matrix = [[0.8951, 0.2664, -0.1614], [-0.7502, 1.7135, 0.0367], [0.0389, -0.0685, 1.0296]];
        let cones = |[x, y]: [f64; 2]| apply(&BRADFORD, [x / y, 1.0, (1.0 - x - y) / y]);
        let (from, into) = (cones(self.white), cones(other.white));
        let mut scaled = BRADFORD;
        for (row, (from, into)) in scaled.iter_mut().zip(from.into_iter().zip(into)) {
            row.iter_mut().for_each(|value| *value *= into / from);
        }
        let adaptation = product(&inverse(&BRADFORD)?, &scaled);
        let matrix = product(&inverse(&other.to_xyz()?)?, &product(&adaptation, &self.to_xyz()?));
        matrix.iter().flatten().all(|value| value.is_finite()).then_some(matrix)
    }
}

/// The product of `matrix` and a column vector.
#[must_use]
pub fn apply(matrix: &Matrix, column: [f64; 3]) -> [f64; 3] {
    matrix.map(|row| row[0] * column[0] + row[1] * column[1] + row[2] * column[2])
}

/// The product of two matrices, `left` times `right`.
#[must_use]
pub fn product(left: &Matrix, right: &Matrix) -> Matrix {
    transposed(transposed(*right).map(|column| apply(left, column)))
}

/// The inverse of `matrix`, by cofactors; `None` where it has none.
#[must_use]
pub fn inverse(matrix: &Matrix) -> Option<Matrix> {
    let [a, b, c] = *matrix;
    let cross =
        |u: [f64; 3], v: [f64; 3]| [u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]];
    let columns = [cross(b, c), cross(c, a), cross(a, b)];
    let determinant = a[0] * columns[0][0] + a[1] * columns[0][1] + a[2] * columns[0][2];
    if !determinant.is_normal() {
        return None;
    }
    Some(transposed(columns.map(|column| column.map(|value| value / determinant))))
}

fn transposed(matrix: Matrix) -> Matrix {
    let mut result = matrix;
    for (row, values) in matrix.iter().enumerate() {
        for (column, value) in values.iter().enumerate() {
            result[column][row] = *value;
        }
    }
    result
}

#[cfg(test)]
mod tests {
    use super::*;

    fn close(found: &Matrix, expected: &Matrix) {
        for (found, expected) in found.iter().flatten().zip(expected.iter().flatten()) {
            assert!((found - expected).abs() < 2e-4, "{found} for {expected}");
        }
    }

    #[test]
    fn known_matrices() {
        let xyz = Primaries::REC709.to_xyz().unwrap();
        close(&xyz, &[[0.412_39, 0.357_58, 0.180_48], [0.212_64, 0.715_17, 0.072_19], [0.019_33, 0.119_19, 0.950_53]]);
        // ITU-R BT.2087.
        let wide = Primaries::REC709.to(&Primaries::REC2020).unwrap();
        close(&wide, &[[0.6274, 0.3293, 0.0433], [0.0691, 0.9195, 0.0114], [0.0164, 0.0880, 0.8956]]);
        let back = product(&Primaries::REC2020.to(&Primaries::REC709).unwrap(), &wide);
        close(&back, &IDENTITY);
    }

    #[test]
    fn an_adapted_white_is_white() {
        let equal_energy = Primaries { white: [1.0 / 3.0, 1.0 / 3.0], ..Primaries::REC709 };
        let white = apply(&equal_energy.to_adapted(&Primaries::REC709).unwrap(), [1.0; 3]);
        assert!(white.iter().all(|value| (value - 1.0).abs() < 1e-9), "{white:?}");
        let kept = apply(&equal_energy.to(&Primaries::REC709).unwrap(), [1.0; 3]);
        assert!((kept[0] - 1.2048).abs() < 1e-3, "{kept:?}");
    }

    #[test]
    fn primaries_that_span_nothing_have_no_matrix() {
        let flat = Primaries { blue: [0.64, 0.33], ..Primaries::REC709 };
        assert!(flat.to_xyz().is_none() && flat.to(&Primaries::REC709).is_none());
        let dark = Primaries { white: [0.3, 0.0], ..Primaries::REC709 };
        assert!(dark.to_xyz().is_none());
    }
}
