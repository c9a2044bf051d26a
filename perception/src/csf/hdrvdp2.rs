//! The contrast sensitivity inside HDR-VDP 2 (Mantiuk et al. 2011), by frequency and luminance.
//!
//! For comparison with that metric. Not for absolute thresholds, of which it has no scale, and not where area, motion
//! or colour matter: it knows none.

use super::ContrastSensitivity;

/// Mantiuk, Kim, Rempel and Heidrich, "HDR-VDP-2: a calibrated visual metric for visibility and quality predictions
/// in all luminance conditions", 2011: neural sensitivity, the eye's optics and the sensitivity of rods and cones
/// together, with the constants of its release 2.2 (`csf_params`, `csf_lums`, `csf_sa` and `mtf_params_a` and `_b` of
/// `hdrvdp_parse_options.m`). It has no absolute scale (31 at best at 20 cd/m²) and knows no area.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HdrVdp2 {
    /// Factor on the published function, which has no absolute scale.
    pub gain: f64,
}

impl Default for HdrVdp2 {
    /// 8.6 times: not the metric's own scale, but the `sensitivity` that a published script has beside `csf_hdrvdp`
    /// (`generate_G_threshold.m` of aidensryu/SmartLocalDimming).
    fn default() -> Self {
        Self { gain: 8.6 }
    }
}

/// `csf_lums`.
const LUMINANCES_CD_M2: [f64; 6] = [0.002, 0.02, 0.2, 2.0, 20.0, 150.0];
/// p₁ to p₄, the last four columns of `csf_params`, at each of those luminances; between them straight in log
/// luminance.
const PARAMETERS: [[f64; 4]; 6] = [
    [0.991_265, 3.740_38, 0.507_22, 4.460_44],
    [0.800_889, 3.541_04, 0.682_505, 4.949_58],
    [0.476_505, 4.374_53, 0.750_315, 5.286_78],
    [0.405_782, 4.406_02, 0.935_314, 5.614_25],
    [0.334_278, 3.795_42, 1.073_27, 6.4635],
    [0.394_533, 2.7755, 1.165_77, 7.456_65],
];

impl ContrastSensitivity for HdrVdp2 {
    fn name(&self) -> &'static str {
        "hdrvdp2"
    }

    fn sensitivity(&self, freq_cpd: f64, luminance_cd_m2: f64) -> f64 {
        if freq_cpd <= 0.0 {
            return 0.0;
        }
        let [p1, p2, p3, p4] = parameters(luminance_cd_m2);
        let low_cut = -(-(freq_cpd / 7.0).powi(2)).exp_m1();
        let neural = p4 / ((1.0 + (p1 * freq_cpd).powf(p2)) / low_cut.powf(p3)).sqrt();
        // `csf_sa`.
        let receptors = 30.162 * ((4.0627 / luminance_cd_m2.max(1e-6)).powf(1.6596) + 1.0).powf(-0.2712);
        self.gain * neural * optics(freq_cpd) * receptors
    }
}

fn parameters(luminance_cd_m2: f64) -> [f64; 4] {
    let luminance = luminance_cd_m2.clamp(LUMINANCES_CD_M2[0], LUMINANCES_CD_M2[5]);
    let above = LUMINANCES_CD_M2[1..5].partition_point(|entry| *entry <= luminance) + 1;
    let (low, high) = (LUMINANCES_CD_M2[above - 1].log10(), LUMINANCES_CD_M2[above].log10());
    let fraction = (luminance.log10() - low) / (high - low);
    let at = |index: usize| {
        PARAMETERS[above - 1][index] + fraction * (PARAMETERS[above][index] - PARAMETERS[above - 1][index])
    };
    [at(0), at(1), at(2), at(3)]
}

/// Modulation transfer of the eye's media: a sum of four exponentials, `mtf_params_a` their weights and
/// `mtf_params_b` their decays.
fn optics(freq_cpd: f64) -> f64 {
    const SHARP: f64 = 0.997_273_700_237_770_7;
    const MIDDLE: f64 = 0.061_466_549_455_263;
    [
        (SHARP * 0.426, 0.028),
        (SHARP * 0.574, 0.37),
        ((1.0 - SHARP) * MIDDLE, 37.0),
        ((1.0 - SHARP) * (1.0 - MIDDLE), 360.0),
    ]
    .iter()
    .map(|(weight, decay): &(f64, f64)| weight * (-decay * freq_cpd).exp())
    .sum()
}
