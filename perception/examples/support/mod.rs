//! Pictures for the examples: a log–log plot and a place to put it.

use std::path::PathBuf;

use image::{Rgb, RgbImage};

/// Where the example's picture goes: the first argument, or `name` in the system's folder for temporary files.
#[allow(dead_code, reason = "each example uses what it needs")]
pub(crate) fn target(name: &str) -> PathBuf {
    std::env::args().nth(1).map_or_else(|| std::env::temp_dir().join(name), PathBuf::from)
}

/// A plot of curves over decades of both axes, a line at every decade.
#[allow(dead_code, reason = "each example uses what it needs")]
pub(crate) struct LogPlot {
    image: RgbImage,
    /// Decades of x and of y.
    x: std::ops::Range<f64>,
    y: std::ops::Range<f64>,
}

#[allow(dead_code, reason = "each example uses what it needs")]
impl LogPlot {
    pub(crate) fn new(x: std::ops::Range<f64>, y: std::ops::Range<f64>) -> Self {
        let mut plot = Self { image: RgbImage::from_pixel(800, 600, Rgb([255; 3])), x, y };
        for decade in plot.x.start.ceil() as i32..=plot.x.end as i32 {
            let column = plot.column(f64::from(decade));
            (0..600).for_each(|row| plot.dot(column, f64::from(row), [215; 3]));
        }
        for decade in plot.y.start.ceil() as i32..=plot.y.end as i32 {
            let row = plot.row(f64::from(decade));
            (0..800).for_each(|column| plot.dot(f64::from(column), row, [215; 3]));
        }
        plot
    }

    pub(crate) fn curve(&mut self, colour: [u8; 3], value_at: impl Fn(f64) -> f64) {
        for step in 0..8000 {
            let decade = self.x.start + (self.x.end - self.x.start) * f64::from(step) / 8000.0;
            let value = value_at(10.0_f64.powf(decade));
            if value > 0.0 {
                let (column, row) = (self.column(decade), self.row(value.log10()));
                self.dot(column, row, colour);
                self.dot(column, row + 1.0, colour);
            }
        }
    }

    pub(crate) fn save(&self, path: &std::path::Path) -> image::ImageResult<()> {
        self.image.save(path)
    }

    fn column(&self, decade: f64) -> f64 {
        (decade - self.x.start) / (self.x.end - self.x.start) * 799.0
    }

    fn row(&self, decade: f64) -> f64 {
        599.0 - (decade - self.y.start) / (self.y.end - self.y.start) * 599.0
    }

    fn dot(&mut self, column: f64, row: f64, colour: [u8; 3]) {
        if (0.0..800.0).contains(&column) && (0.0..600.0).contains(&row) {
            self.image.put_pixel(column as u32, row as u32, Rgb(colour));
        }
    }
}
