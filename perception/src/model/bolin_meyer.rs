//! Bolin and Meyer's model of 1998, in its frame: Haar bands, each with its own sensitivity and its own masking.
//!
//! For comparison with adaptive sampling of its time. Not for guides with noise in them, which masks itself here, nor
//! beside edges, which mask what lies next to them; it ignores motion and colour.

use super::{ModelInputs, PerLuminance, ThresholdModel, finite_error, pooled};
use crate::adaptation::adapted;
use crate::error::Error;
use crate::filter::{gaussian_blur, reflect};
use crate::masking::threshold_elevation;
use crate::plane::Plane;

/// After "A perceptually based adaptive sampling algorithm", SIGGRAPH 1998: the picture in Haar bands, each with its
/// own contrast sensitivity and masked by its own contrast; samples go where the error of a band could be seen.
///
/// The paper's text was not at hand; this keeps its frame (Haar bands, per-band sensitivity, masking by what the band
/// holds) and judges the band energy of white pixel noise, of which level i of a Haar transform holds 3/4^i, by this
/// crate's definition of visibility. Its bounds are our standard errors; its colour channels are left to
/// [`crate::threshold::chromatic_threshold_map`]. Unlike [`super::CsfBands`] it trusts the guide's contrast as it
/// stands: no noise is taken out and no edge is kept from masking what lies beside it.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct BolinMeyer;

const LEVELS: u32 = 6;

impl ThresholdModel for BolinMeyer {
    fn name(&self) -> &'static str {
        "bolin-meyer"
    }

    fn allowed_standard_error_cd_m2(&self, inputs: &ModelInputs<'_>) -> Result<Plane, Error> {
        inputs.check()?;
        let mut noise_gain = nothing_of(inputs);
        visible_of_levels(inputs, |level, visible| {
            let share = 3.0 * 0.25_f32.powi(level as i32);
            add(&mut noise_gain, visible, |visible, _, _| share * visible * visible);
        });
        Ok(noise_gain.map(|gain| (2.0 * gain).sqrt().recip().min(f32::MAX)))
    }

    fn measured_visibility(&self, inputs: &ModelInputs<'_>, half_difference: &Plane) -> Result<Plane, Error> {
        inputs.check()?;
        let guide = inputs.display_luminance_cd_m2;
        half_difference.check_size("half difference", guide.width(), guide.height())?;
        let mut energy = nothing_of(inputs);
        let mut finer = half_difference.map(finite_error);
        visible_of_levels(inputs, |level, visible| {
            let blocks = HaarBlocks::of(&finer, level);
            let coarser = Plane::from_fn(guide.width(), guide.height(), |x, y| blocks.mean(x, y));
            add(&mut energy, visible, |visible, x, y| visible * visible * blocks.variance(x, y));
            finer = coarser;
        });
        Ok(pooled(&energy, inputs.viewing).map(|energy| (2.0 * energy).sqrt()))
    }
}

fn nothing_of(inputs: &ModelInputs<'_>) -> Plane {
    Plane::filled(inputs.display_luminance_cd_m2.width(), inputs.display_luminance_cd_m2.height(), 0.0)
}

fn add(sum: &mut Plane, visible: &Plane, energy: impl Fn(f32, usize, usize) -> f32 + Sync) {
    sum.for_each_row_mut(|y, row| {
        for (x, (value, visible)) in row.iter_mut().zip(visible.row(y)).enumerate() {
            *value += energy(*visible, x, y);
        }
    });
}

/// Calls `visit(level, what 1 cd/m² of each pixel's detail shows)` of every level, the finest first.
fn visible_of_levels(inputs: &ModelInputs<'_>, mut visit: impl FnMut(u32, &Plane)) {
    let ppd = inputs.viewing.display.pixel_density().mean();
    let gain = inputs.viewing.observer.sensitivity;
    let adaptation = adapted(inputs.display_luminance_cd_m2, inputs.viewing);
    let mut finer = inputs.display_luminance_cd_m2.clone();
    for level in 1..=LEVELS {
        let side = f64::from(1 << level);
        // A box of side s has the variance of a Gaussian of σ = √((s² − 1) / 12).
        let coarser = gaussian_blur(inputs.display_luminance_cd_m2, ((side * side - 1.0) / 12.0).sqrt());
        let detail = finer.combined(&coarser, |finer, coarser| (finer - coarser).powi(2));
        // √2 times the RMS over the block: the amplitude of a grating.
        let contrast = gaussian_blur(&detail, 0.5 * side)
            .combined(&adaptation, |energy, adaptation| (2.0 * energy.max(0.0)).sqrt() / adaptation);
        // A Haar detail of side s passes 1/(2s) to 1/s cycles a pixel; its middle is 0.75/s.
        let sensitivity = PerLuminance::new(|luminance| gain * inputs.csf.sensitivity(0.75 * ppd / side, luminance));
        let visible = contrast.combined(&adaptation, |contrast, adaptation| {
            let sensitivity = sensitivity.at(adaptation);
            sensitivity / threshold_elevation(f64::from(contrast * sensitivity)) as f32 / adaptation
        });
        visit(level, &visible);
        finer = coarser;
    }
}

/// Around every pixel the block of a Haar transform's level, of four means of the level below.
struct HaarBlocks<'a> {
    finer: &'a Plane,
    /// Where the four stand from the block's pixel, along each axis.
    offsets: [isize; 2],
}

impl<'a> HaarBlocks<'a> {
    fn of(finer: &'a Plane, level: u32) -> Self {
        let half = 1_isize << (level - 1);
        Self { finer, offsets: [-(half / 2), half - half / 2] }
    }

    fn means(&self, x: usize, y: usize) -> [f32; 4] {
        let along = |at: usize, len: usize| self.offsets.map(|offset| reflect(at as isize + offset, len));
        let (columns, rows) = (along(x, self.finer.width()), along(y, self.finer.height()));
        std::array::from_fn(|index| self.finer.get(columns[index % 2], rows[index / 2]))
    }

    fn mean(&self, x: usize, y: usize) -> f32 {
        0.25 * self.means(x, y).iter().sum::<f32>()
    }

    /// The energy of the level's three details: 3/4^level of white noise's variance.
    fn variance(&self, x: usize, y: usize) -> f32 {
        let mean = self.mean(x, y);
        0.25 * self.means(x, y).iter().map(|value| (value - mean).powi(2)).sum::<f32>()
    }
}
