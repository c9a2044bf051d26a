//! How well the contrast sensitivity functions fit what people saw.
//!
//! Reads the measurements that castleCSF was fitted to (`data_aggregated_merged.csv` of gfxdisp/castleCSF), whose
//! path is the environment variable `CASTLE_CSF_DATA`, and prints RMS errors in dB: as they are, and with each
//! model's median error taken out. Static foveal gratings of at least 1 cd/m² and at most 20 cpd.

mod support;
#[path = "support/table.rs"]
mod table;

use fechner_perception::Error;
use fechner_perception::csf::{
    Barten89, Barten99, CastleChromatic, CastleCsf, ChromaticChannel, ContrastSensitivity, Daly93, Daly98, HdrVdp2,
    Laird06, MannosSakrison, StelaCsf,
};
use table::{Row, Table};

struct Measurement {
    luminance_cd_m2: f64,
    freq_cpd: f64,
    area_deg2: f64,
    sensitivity: f64,
    background_lms: [f64; 3],
    direction_lms: [f64; 3],
}

fn main() {
    let what = "data_aggregated_merged.csv of gfxdisp/castleCSF to print fits";
    let Some(table) = Table::from_environment("CASTLE_CSF_DATA", what) else { return };
    let all: Vec<Measurement> = table.rows().filter_map(|row| measurement(&row)).collect();
    let achromatic: Vec<&Measurement> = all.iter().filter(|m| is_achromatic(m)).collect();
    println!("{} achromatic measurements: RMS dB, and without bias", achromatic.len());
    report("castle", &achromatic, |m| Ok(CastleCsf::new(m.area_deg2)?.sensitivity(m.freq_cpd, m.luminance_cd_m2)));
    report("barten99", &achromatic, |m| {
        Ok(Barten99 { field_deg: m.area_deg2.sqrt() }.sensitivity(m.freq_cpd, m.luminance_cd_m2))
    });
    report("daly93", &achromatic, |m| {
        Ok(Daly93 { area_deg2: m.area_deg2, ..Daly93::default() }.sensitivity(m.freq_cpd, m.luminance_cd_m2))
    });
    report(
        "mannos-sakrison",
        &achromatic,
        |m| Ok(MannosSakrison::default().sensitivity(m.freq_cpd, m.luminance_cd_m2)),
    );
    report(
        "stela",
        &achromatic,
        |m| Ok(StelaCsf { area_deg2: m.area_deg2 }.sensitivity(m.freq_cpd, m.luminance_cd_m2)),
    );
    report("barten89", &achromatic, |m| Ok(Barten89.sensitivity(m.freq_cpd, m.luminance_cd_m2)));
    report("hdrvdp2", &achromatic, |m| Ok(HdrVdp2::default().sensitivity(m.freq_cpd, m.luminance_cd_m2)));
    report("laird06", &achromatic, |m| Ok(Laird06::default().sensitivity(m.freq_cpd, m.luminance_cd_m2)));
    report("daly98", &achromatic, |m| Ok(Daly98::default().sensitivity(m.freq_cpd, m.luminance_cd_m2)));
    let coloured: Vec<&Measurement> = all.iter().filter(|m| !is_achromatic(m)).collect();
    println!("{} measurements in other colour directions", coloured.len());
    report("castle, three channels", &coloured, castle_in_colour);
}

/// A static foveal grating of at least 1 cd/m² and at most 20 cpd.
fn measurement(row: &Row<'_>) -> Option<Measurement> {
    let is_wanted = row.text("stimulus")? == "grating"
        && row.number("t_frequency")? == 0.0
        && row.number("eccentricity")? == 0.0
        && row.number("luminance")? >= 1.0
        && row.number("s_frequency")? <= 20.0;
    is_wanted.then_some(())?;
    Some(Measurement {
        luminance_cd_m2: row.number("luminance")?,
        freq_cpd: row.number("s_frequency")?,
        area_deg2: row.number("area")?,
        sensitivity: row.number("sensitivity")?,
        background_lms: [row.number("L")?, row.number("M")?, row.number("S")?],
        direction_lms: [row.number("L_delta")?, row.number("M_delta")?, row.number("S_delta")?],
    })
}

fn is_achromatic(m: &Measurement) -> bool {
    let ratios = [0, 1, 2].map(|cone| m.direction_lms[cone] / m.background_lms[cone]);
    ratios.iter().all(|ratio| (ratio / ratios[0] - 1.0).abs() < 0.05)
}

/// castleCSF's three mechanisms, added by energy; sensitivity is the inverse of the cone contrast over √3.
fn castle_in_colour(m: &Measurement) -> Result<f64, Error> {
    let mechanisms =
        |[long, medium, short]: [f64; 3]| [long + medium, long - 2.3112 * medium, 50.9875 * short - long - medium];
    let light = mechanisms(m.background_lms)[0];
    let signals = mechanisms(m.direction_lms);
    let channels: [Box<dyn ContrastSensitivity>; 3] = [
        Box::new(CastleCsf::new(m.area_deg2)?),
        Box::new(CastleChromatic::new(ChromaticChannel::RedGreen, m.area_deg2)?),
        Box::new(CastleChromatic::new(ChromaticChannel::YellowViolet, m.area_deg2)?),
    ];
    let response: f64 = signals
        .iter()
        .zip(&channels)
        .map(|(signal, channel)| (signal / light * channel.sensitivity(m.freq_cpd, m.luminance_cd_m2)).powi(2))
        .sum::<f64>()
        .sqrt();
    let contrast: f64 =
        [0, 1, 2].iter().map(|&cone| (m.direction_lms[cone] / m.background_lms[cone]).powi(2)).sum::<f64>().sqrt();
    Ok(response * 3.0_f64.sqrt() / contrast)
}

fn report(name: &str, data: &[&Measurement], model: impl Fn(&Measurement) -> Result<f64, Error>) {
    let errors: Vec<f64> = data.iter().filter_map(|m| Some(20.0 * (model(m).ok()? / m.sensitivity).log10())).collect();
    println!("  {name:24} {:5.1} {:5.1}", support::rms(&errors, 0.0), support::rms(&errors, support::median(&errors)));
}
