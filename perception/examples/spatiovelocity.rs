//! Daly's spatiovelocity contrast sensitivity as a surface (brightness is log sensitivity, a contour at every factor of 10;
//! frequency 0.1 to 60 cpd to the right, velocity 0.15 to 80 deg/s upwards) and, below it, acuity against luminance.

mod support;

use fechner_perception::csf::Daly98;
use fechner_perception::tvi::acuity_cpd;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let path = support::target("spatiovelocity.png");
    let sensitivity = |column: u32, row: u32| {
        let retinal_velocity_deg_s = 0.15 * (80.0_f64 / 0.15).powf(1.0 - f64::from(row) / 511.0);
        let freq_cpd = 0.1 * 600.0_f64.powf(f64::from(column) / 511.0);
        Daly98 { retinal_velocity_deg_s }.ln_sensitivity(freq_cpd) / std::f64::consts::LN_10
    };
    image::GrayImage::from_fn(512, 512, |column, row| {
        let log = sensitivity(column, row);
        let is_contour = log > -1.0
            && (log.floor() != sensitivity(column + 1, row).floor()
                || log.floor() != sensitivity(column, row + 1).floor());
        image::Luma([if is_contour { 255 } else { ((log + 1.0) / 3.5 * 230.0).clamp(0.0, 230.0) as u8 }])
    })
    .save(&path)?;
    println!("{}", path.display());
    let acuity = path.with_file_name("acuity.png");
    let mut plot = support::LogPlot::new(-4.0..4.0, 0.0..2.0);
    plot.curve([0; 3], acuity_cpd);
    plot.save(&acuity)?;
    println!("{}", acuity.display());
    Ok(())
}
