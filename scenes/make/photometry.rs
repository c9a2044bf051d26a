//! A lamp as an IES file: a downlight with a bright middle and, to two sides, a ring that draws arcs on a wall nearby.

use std::fmt::Write as _;
use std::path::Path;

/// Writes the files into the folder.
pub(crate) fn write_all(folder: &Path) -> anyhow::Result<()> {
    Ok(std::fs::write(folder.join("downlight.ies"), downlight())?)
}

/// Intensity in cd at a vertical and a horizontal angle in degrees.
fn intensity_cd(vertical_deg: f64, horizontal_deg: f64) -> f64 {
    let middle = 900.0 * vertical_deg.to_radians().cos().powi(6);
    let sides = 0.4 + 0.6 * horizontal_deg.to_radians().cos().powi(2);
    let ring = 400.0 * (-((vertical_deg - 48.0) / 9.0).powi(2)).exp() * sides;
    if vertical_deg < 88.0 { middle + ring } else { 0.0 }
}

/// IES LM-63-2002, type C, of a quarter turn, which both symmetries repeat.
fn downlight() -> String {
    let vertical: Vec<f64> = (0..=18).map(|step| 5.0 * f64::from(step)).collect();
    let horizontal: Vec<f64> = (0..=4).map(|step| 22.5 * f64::from(step)).collect();
    let row = |numbers: &mut dyn Iterator<Item = f64>| {
        numbers.map(|number| format!("{}", (10.0 * number).round() / 10.0)).collect::<Vec<_>>().join(" ")
    };
    let mut file = String::from("IESNA:LM-63-2002\n[TEST] computed, not measured\n[MANUFAC] fechner\nTILT=NONE\n");
    let _ = writeln!(file, "1 -1 1 {} {} 1 2 0 0 0\n1 1 12", vertical.len(), horizontal.len());
    let _ = writeln!(file, "{}\n{}", row(&mut vertical.iter().copied()), row(&mut horizontal.iter().copied()));
    for &c in &horizontal {
        let _ = writeln!(file, "{}", row(&mut vertical.iter().map(|&gamma| intensity_cd(gamma, c))));
    }
    file
}
