//! Curves over logarithmic axes, as an SVG.

use std::error::Error;
use std::ops::Range;
use std::path::Path;

use plotters::prelude::*;

/// An axis: what stands at it, and its ends.
pub(crate) struct Axis {
    pub(crate) label: &'static str,
    pub(crate) range: Range<f64>,
}

/// A curve with its name in the legend; points where it is not above 0 are left out.
pub(crate) struct Curve<'a> {
    pub(crate) label: &'static str,
    pub(crate) colour: RGBColor,
    pub(crate) value_at: Box<dyn Fn(f64) -> f64 + 'a>,
}

/// Draws curves with labelled axes, a line at every decade and a legend.
pub(crate) fn log_plot(
    path: &Path,
    title: &str,
    x: &Axis,
    y: &Axis,
    legend_at: SeriesLabelPosition,
    curves: &[Curve<'_>],
) -> Result<(), Box<dyn Error>> {
    const STEPS: i32 = 600;
    let root = SVGBackend::new(path, (900, 600)).into_drawing_area();
    root.fill(&WHITE)?;
    let mut chart = ChartBuilder::on(&root)
        .caption(title, ("sans-serif", 22))
        .margin(16)
        .margin_right(40)
        .x_label_area_size(50)
        .y_label_area_size(75)
        .build_cartesian_2d(x.range.clone().log_scale(), y.range.clone().log_scale())?;
    chart
        .configure_mesh()
        .light_line_style(RGBColor(240, 240, 240))
        .bold_line_style(RGBColor(205, 205, 205))
        .x_desc(x.label)
        .y_desc(y.label)
        .x_label_formatter(&|value| in_words(*value))
        .y_label_formatter(&|value| in_words(*value))
        .label_style(("sans-serif", 15))
        .axis_desc_style(("sans-serif", 17))
        .draw()?;
    for Curve { label, colour, value_at } in curves {
        let decades = (x.range.end / x.range.start).log10();
        let points = (0..=STEPS)
            .map(|step| x.range.start * 10.0_f64.powf(decades * f64::from(step) / f64::from(STEPS)))
            .map(|at| (at, value_at(at)))
            .filter(|(_, value)| y.range.contains(value));
        let style = colour.stroke_width(2);
        chart
            .draw_series(LineSeries::new(points, style))?
            .label(*label)
            .legend(move |(x, y)| PathElement::new([(x, y), (x + 24, y)], style));
    }
    chart
        .configure_series_labels()
        .position(legend_at)
        .legend_area_size(30)
        .margin(14)
        .label_font(("sans-serif", 15))
        .background_style(WHITE.mix(0.9))
        .border_style(RGBColor(205, 205, 205))
        .draw()?;
    root.present()?;
    Ok(())
}

/// 0.001, 10 or 10⁵: no more digits than needed.
fn in_words(value: f64) -> String {
    if (1e-3..1e5).contains(&value) { format!("{}", (value * 1e6).round() / 1e6) } else { format!("{value:.0e}") }
}
