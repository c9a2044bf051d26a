//! Threshold against intensity from starlight to sunlight: rods, cones, both, the curve shifted to complex pictures,
//! and the luminance over castleCSF's peak sensitivity. Every value is the smallest luminance difference that is
//! seen, cd/m².

#[path = "support/log_plot.rs"]
mod log_plot;
#[path = "support/target.rs"]
mod target;

use fechner_perception::CastleCsf;
use fechner_perception::tvi::{ThresholdBase, base_threshold_cd_m2, photopic, scotopic};
use log_plot::{Axis, Curve, log_plot};
use plotters::prelude::{RGBColor, SeriesLabelPosition};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let castle = CastleCsf::default();
    let base = |base| move |luminance: f64| base_threshold_cd_m2(luminance, base);
    let path = target::target("tvi_curves.svg");
    log_plot(
        &path,
        "Threshold versus intensity",
        &Axis { label: "Adaptation luminance, cd/m²", range: 1e-5..1e4 },
        &Axis { label: "Threshold, cd/m²", range: 1e-5..1e3 },
        SeriesLabelPosition::UpperLeft,
        &[
            Curve { label: "rods", colour: RGBColor(60, 60, 220), value_at: Box::new(scotopic) },
            Curve { label: "cones", colour: RGBColor(220, 60, 60), value_at: Box::new(photopic) },
            Curve {
                label: "both (Ward Larson et al. 1997)",
                colour: RGBColor(0, 0, 0),
                value_at: Box::new(base(ThresholdBase::TviRaw)),
            },
            Curve {
                label: "both, shifted to complex pictures",
                colour: RGBColor(150, 150, 150),
                value_at: Box::new(base(ThresholdBase::TviShifted)),
            },
            Curve {
                label: "luminance over castleCSF's peak",
                colour: RGBColor(40, 150, 60),
                value_at: Box::new(base(ThresholdBase::CsfPeak(&castle))),
            },
        ],
    )?;
    println!("{}\n  cd/m²   threshold   shifted   castleCSF", path.display());
    for decade in -3..=3 {
        let luminance = 10.0_f64.powi(decade);
        let [raw, shifted, peak] =
            [ThresholdBase::TviRaw, ThresholdBase::TviShifted, ThresholdBase::CsfPeak(&castle)].map(base);
        println!("{luminance:7}   {:9.4}   {:7.4}   {:9.4}", raw(luminance), shifted(luminance), peak(luminance));
    }
    Ok(())
}
