//! The specification's table of reference values, computed by an independent program from the published formulas.

use fechner_perception::csf::{Barten99, CastleCsf, ContrastSensitivity, Daly93, Daly98, MannosSakrison};
use fechner_perception::{masking, motion, psychometric, tvi};

const TABLE: &str = include_str!("golden.json");

/// Rows of one table: inputs, then the value.
fn rows(name: &str) -> Vec<Vec<f64>> {
    let table: serde_json::Value = serde_json::from_str(TABLE).expect("the table is JSON");
    let rows: Vec<Vec<f64>> = serde_json::from_value(table[name].clone()).expect("rows of numbers");
    assert!(!rows.is_empty(), "no table {name}");
    rows
}

fn check(name: &str, tolerance: f64, value: impl Fn(&[f64]) -> f64) {
    for row in rows(name) {
        let (expected, inputs) = row.split_last().expect("a row");
        let found = value(inputs);
        assert!((found / expected - 1.0).abs() < tolerance, "{name} {inputs:?}: {found}, not {expected}");
    }
}

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
    check("csf_castle_ach_sustained_area1", 1e-6, |row| CastleCsf::default().sensitivity(row[1], row[0]));
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
