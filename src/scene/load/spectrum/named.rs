//! Spectra that scene files call by name.
//!
//! Metals: gold, silver, copper: P. B. Johnson and R. W. Christy, Phys. Rev. B 6, 4370 (1972); chromium, iron: the
//! same, Phys. Rev. B 9, 5056 (1974); aluminium: A. D. Rakić, Appl. Opt. 34, 4755 (1995); brass (Cu 70 %, Zn 30 %): M.
//! R. Querry, CRDC-CR-85034 (1985); all read from refractiveindex.info (CC0). Glasses: n at 587.6 nm from Schott's
//! catalogue. Illuminants: chromaticities of CIE 15:2004, tables T.3 and T.8, and of ACES's D60.

use super::{Spectrum, within_rec709, xyz_to_rgb};
use crate::scene::load::metals::Metal;
use glam::{DVec3, Vec3};

/// Wavelength in nm, n, k.
type Row = [f64; 3];

const SILVER: &[Row] = &[
    [354.2, 0.10, 1.419],
    [381.5, 0.05, 1.864],
    [397.4, 0.05, 2.070],
    [413.3, 0.05, 2.275],
    [430.5, 0.04, 2.462],
    [450.9, 0.04, 2.657],
    [471.4, 0.05, 2.869],
    [495.9, 0.05, 3.093],
    [520.9, 0.05, 3.324],
    [548.6, 0.06, 3.586],
    [582.1, 0.05, 3.858],
    [616.8, 0.06, 4.152],
    [659.5, 0.05, 4.483],
    [704.5, 0.04, 4.838],
    [756.0, 0.03, 5.242],
];
const GOLD: &[Row] = &[
    [354.2, 1.50, 1.866],
    [381.5, 1.46, 1.933],
    [397.4, 1.47, 1.952],
    [413.3, 1.46, 1.958],
    [430.5, 1.45, 1.948],
    [450.9, 1.38, 1.914],
    [471.4, 1.31, 1.849],
    [495.9, 1.04, 1.833],
    [520.9, 0.62, 2.081],
    [548.6, 0.43, 2.455],
    [582.1, 0.29, 2.863],
    [616.8, 0.21, 3.272],
    [659.5, 0.14, 3.697],
    [704.5, 0.13, 4.103],
    [756.0, 0.14, 4.542],
];
const COPPER: &[Row] = &[
    [354.2, 1.37, 1.916],
    [381.5, 1.33, 2.045],
    [397.4, 1.32, 2.116],
    [413.3, 1.28, 2.207],
    [430.5, 1.25, 2.305],
    [450.9, 1.24, 2.397],
    [471.4, 1.25, 2.483],
    [495.9, 1.22, 2.564],
    [520.9, 1.18, 2.608],
    [548.6, 1.02, 2.577],
    [582.1, 0.70, 2.704],
    [616.8, 0.30, 3.205],
    [659.5, 0.22, 3.747],
    [704.5, 0.21, 4.205],
    [756.0, 0.24, 4.665],
];
const ALUMINIUM: &[Row] = &[
    [364.66, 0.39877, 4.3957],
    [413.28, 0.52135, 5.0008],
    [442.80, 0.60790, 5.3676],
    [476.87, 0.72780, 5.7781],
    [516.60, 0.87340, 6.2418],
    [563.57, 1.0728, 6.7839],
    [619.93, 1.3660, 7.4052],
    [652.25, 1.5724, 7.7354],
    [688.81, 1.8301, 8.0601],
    [729.32, 2.1606, 8.3565],
];
#[allow(clippy::approx_constant, reason = "an absorption index that happens to be near π")]
const CHROMIUM: &[Row] = &[
    [354.0, 1.84, 2.64],
    [381.0, 1.92, 2.74],
    [397.0, 2.00, 2.83],
    [413.0, 2.08, 2.93],
    [431.0, 2.19, 3.04],
    [451.0, 2.33, 3.14],
    [471.0, 2.51, 3.24],
    [496.0, 2.75, 3.30],
    [521.0, 2.94, 3.33],
    [549.0, 3.18, 3.33],
    [582.0, 3.22, 3.30],
    [617.0, 3.17, 3.30],
    [659.0, 3.09, 3.34],
    [704.0, 3.05, 3.39],
    [756.0, 3.08, 3.42],
];
const IRON: &[Row] = &[
    [354.0, 1.93, 2.35],
    [381.0, 2.12, 2.50],
    [397.0, 2.24, 2.58],
    [413.0, 2.35, 2.65],
    [431.0, 2.48, 2.71],
    [451.0, 2.59, 2.77],
    [471.0, 2.67, 2.82],
    [496.0, 2.74, 2.88],
    [521.0, 2.86, 2.91],
    [549.0, 2.95, 2.93],
    [582.0, 2.94, 2.99],
    [617.0, 2.88, 3.05],
    [659.0, 2.92, 3.10],
    [704.0, 2.86, 3.19],
    [756.0, 2.87, 3.28],
];
const BRASS: &[Row] = &[
    [360.0, 1.503, 1.815],
    [380.0, 1.487, 1.818],
    [400.0, 1.445, 1.805],
    [420.0, 1.350, 1.786],
    [440.0, 1.191, 1.797],
    [460.0, 0.994, 1.883],
    [480.0, 0.816, 2.046],
    [500.0, 0.686, 2.250],
    [520.0, 0.602, 2.464],
    [540.0, 0.549, 2.668],
    [560.0, 0.505, 2.860],
    [580.0, 0.468, 3.059],
    [600.0, 0.450, 3.253],
    [620.0, 0.449, 3.434],
    [640.0, 0.444, 3.609],
    [660.0, 0.445, 3.778],
    [680.0, 0.444, 3.943],
    [700.0, 0.446, 4.106],
    [740.0, 0.455, 4.424],
    [780.0, 0.464, 4.737],
];

/// By chemical symbol, as pbrt and Mitsuba name them.
const METALS: &[(&str, &[Row])] =
    &[("Ag", SILVER), ("Au", GOLD), ("Cu", COPPER), ("Al", ALUMINIUM), ("Cr", CHROMIUM), ("Fe", IRON), ("CuZn", BRASS)];

/// Index of refraction at the yellow helium line, by pbrt's names: its F5, F10 and F11 are Schott's SF5, SF10 and SF11.
const GLASSES: &[(&str, f32)] = &[
    ("BK7", 1.5168),
    ("BAF10", 1.6700),
    ("FK51A", 1.4866),
    ("LASF9", 1.8503),
    ("F5", 1.6727),
    ("F10", 1.7283),
    ("F11", 1.7847),
    ("SF5", 1.6727),
    ("SF10", 1.7283),
    ("SF11", 1.7847),
];

const ILLUMINANTS: &[(&str, [f64; 2])] = &[
    ("A", [0.44758, 0.40745]),
    ("D50", [0.34567, 0.35850]),
    ("D55", [0.33243, 0.34744]),
    ("D65", [0.31271, 0.32902]),
    ("D75", [0.29903, 0.31488]),
    ("F1", [0.3131, 0.3371]),
    ("F2", [0.3721, 0.3751]),
    ("F3", [0.4091, 0.3941]),
    ("F4", [0.4402, 0.4031]),
    ("F5", [0.3138, 0.3452]),
    ("F6", [0.3779, 0.3882]),
    ("F7", [0.3129, 0.3292]),
    ("F8", [0.3458, 0.3586]),
    ("F9", [0.3741, 0.3727]),
    ("F10", [0.3458, 0.3588]),
    ("F11", [0.3805, 0.3769]),
    ("F12", [0.4370, 0.4042]),
    ("acesD60", [0.32168, 0.33767]),
];

fn find<T: Copy>(table: &[(&str, T)], name: &str) -> Option<T> {
    table.iter().find(|(known, _)| *known == name).map(|&(_, value)| value)
}

/// A metal by its chemical symbol, per RGB channel.
pub(in crate::scene::load) fn metal(symbol: &str) -> Option<Metal> {
    let rows = find(METALS, symbol)?;
    let column = |place: usize| {
        let spectrum = Spectrum { samples: rows.iter().map(|row| [row[0], row[place]]).collect(), holds_beyond: true };
        spectrum.reflectance()
    };
    Some(Metal { eta: column(1), k: column(2) })
}

/// Symbols of the metals, for messages.
pub(in crate::scene::load) fn metal_symbols() -> Vec<&'static str> {
    METALS.iter().map(|&(symbol, _)| symbol).collect()
}

/// Index of refraction of a glass by pbrt's name for it.
pub(in crate::scene::load) fn glass(name: &str) -> Option<f32> {
    find(GLASSES, name)
}

/// Colour of luminance 1 of a CIE illuminant.
pub(in crate::scene::load) fn illuminant(name: &str) -> Option<Vec3> {
    let [x, y] = find(ILLUMINANTS, name)?;
    Some(within_rec709(xyz_to_rgb(DVec3::new(x / y, 1.0, (1.0 - x - y) / y))))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn metals_have_their_colours() {
        let at_normal = |symbol: &str| {
            let Metal { eta, k } = metal(symbol).unwrap();
            let (minus, plus) = (eta - 1.0, eta + 1.0);
            (minus * minus + k * k) / (plus * plus + k * k)
        };
        let gold = at_normal("Au");
        assert!(gold.x > 0.9 && gold.y > 0.7 && gold.z < 0.5, "{gold}");
        let silver = at_normal("Ag");
        assert!(silver.min_element() > 0.94, "{silver}");
        let copper = at_normal("Cu");
        assert!(copper.x > 0.85 && copper.z < 0.6, "{copper}");
        // The values in wide use for aluminium: η 1.66, 0.88, 0.52 and k 9.22, 6.27, 4.84 (without the light's weight).
        let aluminium = metal("Al").unwrap();
        assert!(aluminium.eta.x > aluminium.eta.y && aluminium.eta.y > aluminium.eta.z);
        assert!(metal("Unobtainium").is_none());
    }

    #[test]
    fn white_light_is_white() {
        assert!(illuminant("D65").unwrap().abs_diff_eq(Vec3::ONE, 1e-3));
        assert!(illuminant("A").unwrap().x > 1.5);
    }
}
