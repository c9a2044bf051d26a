//! Spectra of scene files as linear Rec.709 RGB: tables, blackbodies, named illuminants, metals and glasses.
//!
//! A spectrum is integrated against the CIE 1931 observer. What reflects or refracts is seen under D65, so that a flat
//! spectrum is grey; what emits is seen as it is. Three numbers are not a spectral render: dispersion and metamerism
//! are lost, and colours outside Rec.709 are brought into it at the luminance that they have.

mod cie;
pub(in crate::scene::load) mod named;

use super::luminance;
use cie::{D65, FIRST_NM, OBSERVER, ROWS, STEP_NM};
use glam::{DMat3, DVec3, Vec3};

/// Parts that a step of the observer's tables is integrated in: those of files may be finer.
const SUBSTEPS: usize = 5;
/// 1 nm.
const INTEGRATION_NM: f64 = STEP_NM / SUBSTEPS as f64;

/// A spectrum given at some wavelengths, linear between them.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Spectrum {
    /// Wavelength in nanometres and value, by wavelength.
    samples: Vec<[f64; 2]>,
    /// Whether the first and last value hold beyond their wavelengths; else the spectrum is 0 there.
    holds_beyond: bool,
}

impl Spectrum {
    /// A spectrum of pairs of nanometres and values, in any order; `None` without a pair or with one that is not
    /// finite.
    pub(super) fn from_pairs(pairs: impl IntoIterator<Item = [f64; 2]>) -> Option<Self> {
        let mut samples: Vec<[f64; 2]> = pairs.into_iter().collect();
        if samples.is_empty() || !samples.iter().flatten().all(|value| value.is_finite()) {
            return None;
        }
        samples.sort_by(|a, b| a[0].total_cmp(&b[0]));
        // One value stands for all wavelengths.
        let holds_beyond = samples.len() == 1;
        Some(Self { samples, holds_beyond })
    }

    /// A spectrum of a list λ₀ v₀ λ₁ v₁ ...
    pub(super) fn from_list(list: &[f64]) -> Option<Self> {
        let (pairs, rest) = list.as_chunks::<2>();
        if rest.is_empty() { Self::from_pairs(pairs.iter().copied()) } else { None }
    }

    /// A spectrum of a text file of one pair a line, comments behind `#`.
    pub(super) fn from_text(text: &str) -> Option<Self> {
        let mut pairs = Vec::new();
        for line in text.lines() {
            let line = line.split('#').next().unwrap_or("");
            let mut numbers = line.split([' ', '\t', ',', ':']).filter(|word| !word.is_empty()).map(str::parse::<f64>);
            match (numbers.next(), numbers.next()) {
                (None, _) => {}
                (Some(Ok(wavelength)), Some(Ok(value))) => pairs.push([wavelength, value]),
                _ => return None,
            }
        }
        Self::from_pairs(pairs)
    }

    /// Planck's law at a temperature in kelvin, 1 at its peak; `None` unless the temperature is finite and above 0.
    pub(super) fn blackbody(kelvin: f64) -> Option<Self> {
        if !(kelvin > 0.0 && kelvin.is_finite()) {
            return None;
        }
        // Second radiation constant hc/k in nm·K (CODATA 2018), and Wien's displacement constant.
        const C2: f64 = 1.438_776_877e7;
        const WIEN_NM_K: f64 = 2.897_771_955e6;
        let planck = |nm: f64| 1.0 / (nm.powi(5) * ((C2 / (nm * kelvin)).exp_m1()));
        let peak = planck(WIEN_NM_K / kelvin);
        Self::from_pairs(rows().map(|nm| [nm, planck(nm) / peak]))
    }

    /// This spectrum between two wavelengths in nanometres, 0 beyond them. Its ends are ramps of one step of the
    /// integration, so that no more and no less than what lies between counts wherever they fall: with steep ones 5000
    /// K from 500 to 600 nm has 3.5 % too much red.
    pub(super) fn within(&self, from_nm: f64, to_nm: f64) -> Self {
        let half_nm = (0.5 * INTEGRATION_NM).min(0.5 * (to_nm - from_nm));
        let outer_nm = (from_nm - half_nm)..=(to_nm + half_nm);
        let inner_nm = (from_nm + half_nm)..=(to_nm - half_nm);
        let inner = self.samples.iter().copied().filter(|[nm, _]| inner_nm.contains(nm));
        let edges = [inner_nm.start(), inner_nm.end()].map(|&nm| [nm, self.at(nm)]);
        let dark = [outer_nm.start(), outer_nm.end()].map(|&nm| [nm, 0.0]);
        let mut samples: Vec<[f64; 2]> = inner.chain(edges).chain(dark).filter(|[nm, _]| nm.is_finite()).collect();
        samples.sort_by(|a, b| a[0].total_cmp(&b[0]));
        Self { samples, holds_beyond: false }
    }

    fn at(&self, nm: f64) -> f64 {
        let after = self.samples.partition_point(|sample| sample[0] <= nm);
        let (before, next) = (after.checked_sub(1).map(|i| self.samples[i]), self.samples.get(after));
        match (before, next) {
            (Some([x0, y0]), Some(&[x1, y1])) => y0 + (y1 - y0) * (nm - x0) / (x1 - x0),
            (Some([x, y]), None) if self.holds_beyond || x == nm => y,
            (None, Some(&[_, y])) if self.holds_beyond => y,
            _ => 0.0,
        }
    }

    /// Σ spectrum · weight · observer over Σ weight · ȳ.
    fn xyz(&self, weight: impl Fn(f64) -> f64) -> DVec3 {
        let (mut sum, mut norm) = (DVec3::ZERO, 0.0);
        for step in 0..=(ROWS - 1) * SUBSTEPS {
            let row = step as f64 / SUBSTEPS as f64;
            let nm = FIRST_NM + row * STEP_NM;
            let observer = observer(row) * weight(row);
            sum += observer * self.at(nm);
            norm += observer.y;
        }
        sum / norm
    }

    /// The colour of light of this spectrum; its luminance is the mean of the spectrum over the eye's sensitivity.
    pub(super) fn emission(&self) -> Vec3 {
        within_rec709(xyz_to_rgb(self.xyz(|_| 1.0)))
    }

    /// The colour of light of this spectrum with luminance 1; `None` for light that cannot be seen.
    pub(super) fn emission_of_luminance_1(&self) -> Option<Vec3> {
        let color = self.emission();
        let luminance = luminance(color);
        (luminance > 0.0).then(|| color / luminance)
    }

    /// The colour of a surface of this reflectance under D65; the same for indices of refraction and coefficients.
    pub(super) fn reflectance(&self) -> Vec3 {
        within_rec709(xyz_to_rgb(self.xyz(|row| between(row, |i| D65[i]))))
    }
}

/// Wavelengths of the tables' rows.
fn rows() -> impl Iterator<Item = f64> {
    (0..ROWS).map(|row| FIRST_NM + row as f64 * STEP_NM)
}

/// x̄, ȳ, z̄ of the 1931 standard observer at a wavelength of the tables, 360 to 830 nm.
pub(super) fn observer_at(nm: f64) -> DVec3 {
    observer((nm - FIRST_NM) / STEP_NM)
}

/// The same at a row of the tables.
fn observer(row: f64) -> DVec3 {
    DVec3::from_array([0, 1, 2].map(|coordinate| between(row, |i| OBSERVER[i][coordinate])))
}

fn between(row: f64, value: impl Fn(usize) -> f64) -> f64 {
    let first = (row as usize).min(ROWS - 1);
    let second = (first + 1).min(ROWS - 1);
    value(first) + (value(second) - value(first)) * (row - first as f64)
}

/// Linear Rec.709 of CIE XYZ (IEC 61966-2-1's primaries and white).
pub(super) fn xyz_to_rgb(xyz: DVec3) -> DVec3 {
    const FROM_XYZ: DMat3 = DMat3::from_cols(
        DVec3::new(3.240_969_942, -0.969_243_636, 0.055_630_080),
        DVec3::new(-1.537_383_178, 1.875_967_502, -0.203_976_959),
        DVec3::new(-0.498_610_760, 0.041_555_057, 1.056_971_514),
    );
    FROM_XYZ * xyz
}

fn within_rec709(rgb: DVec3) -> Vec3 {
    super::within_rec709(rgb.as_vec3())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_flat_reflectance_is_grey_and_a_flat_light_is_the_equal_energy_white() {
        let flat = Spectrum::from_pairs([[300.0, 0.5], [900.0, 0.5]]).unwrap();
        assert!(flat.reflectance().abs_diff_eq(Vec3::splat(0.5), 5e-4), "{}", flat.reflectance());
        // Equal energy has x = y = 1/3; in Rec.709 with Y = 1 that is (1.2048, 0.9483, 0.9089).
        assert!((2.0 * flat.emission()).abs_diff_eq(Vec3::new(1.2048, 0.9483, 0.9089), 1e-3));
    }

    /// Values of an independent integration over the 1 nm tables of the `colour` package 0.4.7.
    #[test]
    fn tables_become_the_colours_that_others_compute() {
        let lamp = Spectrum::from_list(&[400.0, 0.0, 500.0, 8.0, 600.0, 15.6, 700.0, 18.4]).unwrap();
        let expected = Vec3::new(20.7201, 10.8543, 2.7701);
        assert!((lamp.emission() / expected - 1.0).abs().max_element() < 1e-2, "{}", lamp.emission());
        let red = Spectrum::from_list(&[400.0, 0.04, 550.0, 0.06, 580.0, 0.1, 620.0, 0.5, 700.0, 0.64]).unwrap();
        let expected = Vec3::new(0.46464, 0.05450, 0.03796);
        assert!((red.reflectance() / expected - 1.0).abs().max_element() < 1e-2, "{}", red.reflectance());
    }

    /// Sodium's light lies outside Rec.709. Regression: with its blue cut off it was too bright, and lasers' by a third
    /// and more.
    #[test]
    fn light_of_one_wavelength_keeps_its_luminance() {
        for nm in [460.0, 500.0, 520.0, 589.0, 640.0] {
            let line = Spectrum::from_pairs([[nm - 5.0, 0.0], [nm, 1.0], [nm + 5.0, 0.0]]).unwrap();
            let (found, meant) = (luminance(line.emission()), line.xyz(|_| 1.0).y as f32);
            assert!((found / meant - 1.0).abs() < 1e-3, "{nm} nm: {found} for {meant}");
        }
    }

    #[test]
    fn blackbodies_have_plancks_colours() {
        let warm = Spectrum::blackbody(2856.0).unwrap().emission_of_luminance_1().unwrap();
        assert!(warm.abs_diff_eq(named::illuminant("A").unwrap(), 0.02), "{warm}");
        let day = Spectrum::blackbody(6504.0).unwrap().emission_of_luminance_1().unwrap();
        assert!((0.9..1.1).contains(&day.x) && (0.9..1.1).contains(&day.z), "{day}");
        assert_eq!(Spectrum::blackbody(-1.0), None);
        assert_eq!(Spectrum::blackbody(1e-30).and_then(|s| s.emission_of_luminance_1()), None);
    }

    #[test]
    fn lists_and_texts_that_are_no_spectra_are_refused() {
        assert_eq!(Spectrum::from_list(&[400.0, 1.0, 500.0]), None);
        assert_eq!(Spectrum::from_list(&[]), None);
        assert_eq!(Spectrum::from_text("400 1\nfive\n"), None);
        assert_eq!(Spectrum::from_text("# nm, value\n500 2 # green\n400, 1\n").unwrap().at(450.0), 1.5);
    }
}
