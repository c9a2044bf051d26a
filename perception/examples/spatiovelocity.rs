//! Daly's spatiovelocity contrast sensitivity as a surface: darker is more sensitive, with contours at sensitivities
//! 1, 3, 10, 30, 100 and 200, and the frequency of the peak at each velocity. What moves fast over the retina is seen
//! only where it is coarse.

#[path = "support/target.rs"]
mod target;

use fechner_perception::csf::Daly98;
use plotters::prelude::*;

const FREQ_CPD: std::ops::Range<f64> = 0.1..60.0;
const VELOCITY_DEG_S: std::ops::Range<f64> = 0.15..80.0;
const LEVELS: [f64; 6] = [1.0, 3.0, 10.0, 30.0, 100.0, 200.0];

fn ln_sensitivity(freq_cpd: f64, retinal_velocity_deg_s: f64) -> f64 {
    Daly98 { retinal_velocity_deg_s }.ln_sensitivity(freq_cpd)
}

/// The value at a share of the way over a range, in its logarithm.
fn between(range: &std::ops::Range<f64>, share: f64) -> f64 {
    range.start * (range.end / range.start).powf(share)
}

/// Frequency at which the sensitivity is `level`, between the peak and `end`; `None` where there is none.
fn contour_cpd(level: f64, velocity_deg_s: f64, end_cpd: f64) -> Option<f64> {
    let is_seen = |freq: f64| ln_sensitivity(freq, velocity_deg_s) >= level.ln();
    let mut seen = Daly98 { retinal_velocity_deg_s: velocity_deg_s }.peak_cpd();
    let mut unseen = end_cpd;
    if !is_seen(seen) || is_seen(unseen) {
        return None;
    }
    for _ in 0..50 {
        let middle = (seen * unseen).sqrt();
        if is_seen(middle) { seen = middle } else { unseen = middle }
    }
    Some(seen).filter(|freq| FREQ_CPD.contains(freq))
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let path = target::target("spatiovelocity.svg");
    let root = SVGBackend::new(&path, (900, 650)).into_drawing_area();
    root.fill(&WHITE)?;
    let mut chart = ChartBuilder::on(&root)
        .caption("Spatiovelocity contrast sensitivity (Daly 1998)", ("sans-serif", 22))
        .margin(16)
        .margin_right(40)
        .x_label_area_size(50)
        .y_label_area_size(75)
        .build_cartesian_2d(
            FREQ_CPD.log_scale().with_key_points(vec![0.1, 0.3, 1.0, 3.0, 10.0, 30.0, 60.0]),
            VELOCITY_DEG_S.log_scale().with_key_points(vec![0.15, 0.5, 1.0, 3.0, 10.0, 30.0, 80.0]),
        )?;
    chart.draw_series(surface())?;
    chart
        .configure_mesh()
        .disable_mesh()
        .x_label_formatter(&f64::to_string)
        .y_label_formatter(&f64::to_string)
        .x_desc("Spatial frequency, cpd")
        .y_desc("Velocity over the retina, deg/s")
        .label_style(("sans-serif", 15))
        .axis_desc_style(("sans-serif", 17))
        .draw()?;
    let velocities =
        |steps: i32| (0..=steps).map(move |step| between(&VELOCITY_DEG_S, f64::from(step) / f64::from(steps)));
    for level in LEVELS {
        for end_cpd in [1e-4, 1e4] {
            let points = velocities(3000).filter_map(|v| Some((contour_cpd(level, v, end_cpd)?, v)));
            chart.draw_series(LineSeries::new(points, RGBColor(20, 20, 20).stroke_width(1)))?;
        }
        let labelled = [0.3, 1.0].into_iter().find_map(|v| Some((contour_cpd(level, v, 1e-4)?, v)));
        if let Some(at) = labelled {
            chart.draw_series([Text::new(format!("{level}"), at, ("sans-serif", 15))])?;
        }
    }
    let peak = |velocity| Daly98 { retinal_velocity_deg_s: velocity }.peak_cpd();
    let peaks = velocities(200).map(|v| (peak(v), v)).filter(|(freq, _)| FREQ_CPD.contains(freq));
    chart.draw_series(DashedLineSeries::new(peaks, 6, 4, RGBColor(200, 40, 40).stroke_width(2)))?;
    root.present()?;
    println!("{}\n  deg/s   peak (cpd)   sensitivity there   finest at sensitivity 1 (cpd)", path.display());
    for velocity in [0.15_f64, 0.5, 1.0, 3.0, 10.0, 30.0, 80.0] {
        let freq = peak(velocity);
        let finest = contour_cpd(1.0, velocity, 1e4).unwrap_or(f64::NAN);
        println!("{velocity:7}   {freq:10.2}   {:17.1}   {finest:10.1}", ln_sensitivity(freq, velocity).exp());
    }
    Ok(())
}

/// The sensitivity as cells, white at 1 and below.
fn surface() -> impl Iterator<Item = Rectangle<(f64, f64)>> {
    const COLUMNS: i32 = 150;
    const ROWS: i32 = 100;
    // Cells overlap a little: viewers draw a seam between those that only touch.
    const OVERLAP: f64 = 0.3;
    let place = |cell: i32, shift: f64, of: i32| ((f64::from(cell) + shift) / f64::from(of)).min(1.0);
    (0..ROWS).flat_map(move |row| {
        let velocity = move |shift: f64| between(&VELOCITY_DEG_S, place(row, shift, ROWS));
        (0..COLUMNS).map(move |column| {
            let freq = |shift: f64| between(&FREQ_CPD, place(column, shift, COLUMNS));
            let share = (ln_sensitivity(freq(0.5), velocity(0.5)) / 250.0_f64.ln()).clamp(0.0, 1.0);
            let shade = |most: f64| (255.0 - most * share) as u8;
            let colour = RGBColor(shade(190.0), shade(110.0), shade(45.0));
            let corners = [(freq(0.0), velocity(0.0)), (freq(1.0 + OVERLAP), velocity(1.0 + OVERLAP))];
            Rectangle::new(corners, colour.filled())
        })
    })
}
