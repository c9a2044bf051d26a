//! The specification's table of reference values, computed by an independent program from the published formulas.

use fechner_perception::csf::{
    Barten89, Barten99, CastleCsf, ContrastSensitivity, Daly93, Daly98, HdrVdp2, Laird06, MannosSakrison, StelaCsf,
    peak_sensitivity,
};
use fechner_perception::{masking, motion, psychometric, tvi};

#[path = "../src/test_golden.rs"]
mod test_golden;
use test_golden::{TABLES, check, rows};

#[test]
fn threshold_versus_intensity() {
    check("tvi_ward97", 1e-6, |row| tvi::combined(row[0]));
    check("tvi_photopic", 1e-6, |row| tvi::photopic(row[0]));
    check("tvi_scotopic", 1e-6, |row| tvi::scotopic(row[0]));
    check("acuity_cpd", 1e-6, |row| tvi::acuity_cpd(row[0]));
}

#[test]
fn contrast_sensitivity() {
    check("csf_daly98", 1e-6, |row| Daly98 { retinal_velocity_deg_s: row[0] }.sensitivity(row[1], 100.0));
    check("csf_daly93_i2_1_d0.5_theta0", 1e-6, |row| Daly93::default().sensitivity(row[1], row[0]));
    check("csf_barten99_X0_1", 1e-6, |row| Barten99::default().sensitivity(row[1], row[0]));
    check("csf_mannos", 1e-6, |row| MannosSakrison { gain: 1.0 }.sensitivity(row[0], 100.0));
    check("csf_laird06", 1e-6, |row| Laird06 { retinal_velocity_deg_s: row[0] }.sensitivity(row[1], 100.0));
    check("csf_barten89_440", 1e-6, |row| Barten89.sensitivity(row[1], row[0]));
    check("csf_hdrvdp2_x1", 1e-6, |row| HdrVdp2 { gain: 1.0 }.sensitivity(row[1], row[0]));
    // The specification prints stela's constants to six digits and one of them as "about 0".
    check("csf_stela_area1_static", 2e-5, |row| StelaCsf::default().sensitivity(row[1], row[0]));
    check("csf_castle_ach_sustained_area1", 1e-6, |row| CastleCsf::default().sensitivity(row[1], row[0]));
}

#[test]
fn peaks() {
    for row in rows("csf_daly98_peak") {
        let csf = Daly98 { retinal_velocity_deg_s: row[0] };
        assert!(
            (csf.peak_cpd() / row[1] - 1.0).abs() < 1e-6 && (peak_sensitivity(&csf, 100.0) / row[2] - 1.0).abs() < 1e-6
        );
    }
    // Section 3.3, 3.5 and 3.7: (luminance, peak) of Daly 1993, Barten 1999, castle and stela, to the digits printed
    // there.
    type Peaks<'a> = (&'a dyn ContrastSensitivity, &'a [(f64, f64)], f64);
    let peaks: [Peaks<'_>; 4] = [
        (
            &Daly93::default(),
            &[(0.1, 27.667_19), (1.0, 64.532_33), (10.0, 117.1547), (30.0, 145.0632), (1000.0, 195.1269)],
            1e-5,
        ),
        (&Barten99::default(), &[(0.1, 21.396_68), (1.0, 61.605_36), (10.0, 147.7587), (100.0, 238.1931)], 1e-6),
        (&CastleCsf::default(), &[(0.01, 6.570_88), (1.0, 40.160_55), (100.0, 134.2963), (1000.0, 151.8814)], 1e-6),
        (&StelaCsf::default(), &[(1.0, 34.968), (10.0, 68.035), (100.0, 102.457), (1000.0, 117.005)], 2e-5),
    ];
    for (csf, values, tolerance) in peaks {
        for (luminance, expected) in values {
            let found = peak_sensitivity(csf, *luminance);
            assert!((found / expected - 1.0).abs() < tolerance, "{} at {luminance}: {found}", csf.name());
        }
    }
}

#[test]
fn masking_detection_and_pursuit() {
    check("mask_daly_s0.7", 1e-6, |row| masking::threshold_elevation(row[0]));
    check("psychometric_1mexp_beta3.5", 1e-6, |row| psychometric::detection_probability(row[0]));
    for row in rows("eye_tracking_vI_vR_mag") {
        let expected = row[1].max(0.15);
        assert!((motion::retinal_velocity_deg_s(row[0], 1.0) - expected).abs() < 1e-6, "{row:?}");
    }
}

/// Where tables are asked for: here, and beside what is not public or needs a picture.
const ASKING: [&str; 9] = [
    include_str!("golden.rs"),
    include_str!("../src/csf/barten99.rs"),
    include_str!("../src/threshold/tests.rs"),
    include_str!("../src/tone/ferwerda96.rs"),
    include_str!("../src/tone/pattanaik00/tests.rs"),
    include_str!("../src/tone/seed_tests.rs"),
    include_str!("../src/tone/tumblin_rushmeier.rs"),
    include_str!("../src/tone/ward94.rs"),
    include_str!("../src/visibility.rs"),
];

/// No table of the specification is forgotten.
#[test]
fn every_table_is_asked_for() {
    let tables: serde_json::Map<String, serde_json::Value> = serde_json::from_str(TABLES).expect("the tables are JSON");
    for name in tables.keys() {
        let call = format!("(\"{name}\"");
        assert!(ASKING.iter().any(|text| text.contains(&call)), "{name} has no test");
    }
}
