//! Threshold against intensity from starlight to sunlight: rods (blue), cones (red), both (black), the shifted curve (grey) and
//! the luminance over castleCSF's peak sensitivity (green). Also acuity, printed.

mod support;

use fechner_perception::CastleCsf;
use fechner_perception::tvi::{ThresholdBase, acuity_cpd, base_threshold_cd_m2, photopic, scotopic};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let castle = CastleCsf::default();
    let mut plot = support::LogPlot::new(-5.0..4.0, -5.0..3.0);
    plot.curve([60, 60, 220], scotopic);
    plot.curve([220, 60, 60], photopic);
    plot.curve([0; 3], |luminance| base_threshold_cd_m2(luminance, ThresholdBase::TviRaw));
    plot.curve([140; 3], |luminance| base_threshold_cd_m2(luminance, ThresholdBase::TviShifted));
    plot.curve([40, 160, 60], |luminance| base_threshold_cd_m2(luminance, ThresholdBase::CsfPeak(&castle)));
    let path = support::target("tvi_curves.png");
    plot.save(&path)?;
    println!("{}\n  cd/m²   threshold   acuity (cpd)", path.display());
    for decade in -3..=3 {
        let luminance = 10.0_f64.powi(decade);
        let threshold = base_threshold_cd_m2(luminance, ThresholdBase::TviRaw);
        println!("{luminance:7}   {threshold:9.4}   {:12.1}", acuity_cpd(luminance));
    }
    Ok(())
}
