//! The finest grating that can be seen, against luminance: Shlaer's data as the tone operators use them, and where
//! the contrast sensitivity functions that know luminance fall to 1 (a grating of full contrast).

#[path = "support/log_plot.rs"]
mod log_plot;
#[path = "support/target.rs"]
mod target;

use fechner_perception::csf::ContrastSensitivity;
use fechner_perception::tvi::acuity_cpd;
use fechner_perception::{Viewing, csf};
use log_plot::{Axis, Curve, log_plot};
use plotters::prelude::{RGBColor, SeriesLabelPosition};

/// Frequency above the peak at which the sensitivity falls to 1, cpd; 0 where nothing is seen at all.
fn limit_cpd(csf: &dyn ContrastSensitivity, luminance_cd_m2: f64) -> f64 {
    let frequencies = |step: i32| 0.1 * 10.0_f64.powf(f64::from(step) / 100.0);
    let finest = (0..=300).rev().find(|&step| csf.sensitivity(frequencies(step), luminance_cd_m2) >= 1.0);
    let Some(step) = finest else { return 0.0 };
    let (mut below, mut above) = (frequencies(step), frequencies(step + 1));
    for _ in 0..40 {
        let middle = (below * above).sqrt();
        if csf.sensitivity(middle, luminance_cd_m2) >= 1.0 { below = middle } else { above = middle }
    }
    below
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let viewing = Viewing::default();
    let [castle, barten, daly] =
        [csf::by_name("castle", &viewing)?, csf::by_name("barten99", &viewing)?, csf::by_name("daly93", &viewing)?];
    let path = target::target("acuity.svg");
    log_plot(
        &path,
        "Acuity against luminance",
        &Axis { label: "Luminance, cd/m²", range: 1e-4..1e4 },
        &Axis { label: "Finest grating seen, cpd", range: 1.0..100.0 },
        SeriesLabelPosition::LowerRight,
        &[
            Curve {
                label: "Shlaer 1937, as fitted by Ward Larson et al. 1997",
                colour: RGBColor(0, 0, 0),
                value_at: Box::new(acuity_cpd),
            },
            Curve {
                label: "castleCSF at sensitivity 1",
                colour: RGBColor(40, 150, 60),
                value_at: Box::new(|l| limit_cpd(&*castle, l)),
            },
            Curve {
                label: "Barten 1999 at sensitivity 1",
                colour: RGBColor(220, 60, 60),
                value_at: Box::new(|l| limit_cpd(&*barten, l)),
            },
            Curve {
                label: "Daly 1993 at sensitivity 1",
                colour: RGBColor(60, 60, 220),
                value_at: Box::new(|l| limit_cpd(&*daly, l)),
            },
        ],
    )?;
    println!("{}\n  cd/m²   Shlaer   castleCSF   Barten 1999   Daly 1993 (cpd)", path.display());
    for decade in -3..=3 {
        let luminance = 10.0_f64.powi(decade);
        let [castle, barten, daly] = [&castle, &barten, &daly].map(|csf| limit_cpd(&**csf, luminance));
        println!("{luminance:7}   {:6.1}   {castle:9.1}   {barten:11.1}   {daly:9.1}", acuity_cpd(luminance));
    }
    Ok(())
}
