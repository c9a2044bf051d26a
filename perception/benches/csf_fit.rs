//! How well the contrast sensitivity functions fit what people saw.
//!
//! Reads the measurements that castleCSF was fitted to (`data_aggregated_merged.csv` of gfxdisp/castleCSF), whose path is
//! the environment variable `CASTLE_CSF_DATA`, and prints RMS errors in dB: as they are, and with each model's median
//! error taken out. Static foveal gratings of at least 1 cd/m² and at most 20 cpd.

use fechner_perception::Error;
use fechner_perception::csf::{
    Barten99, CastleChromatic, CastleCsf, ChromaticChannel, ContrastSensitivity, Daly93, Daly98, MannosSakrison,
};

struct Measurement {
    luminance_cd_m2: f64,
    freq_cpd: f64,
    area_deg2: f64,
    sensitivity: f64,
    background_lms: [f64; 3],
    direction_lms: [f64; 3],
}

fn main() {
    let Ok(path) = std::env::var("CASTLE_CSF_DATA") else {
        println!("set CASTLE_CSF_DATA to data_aggregated_merged.csv of gfxdisp/castleCSF to print fits");
        return;
    };
    let all = match std::fs::read_to_string(&path) {
        Ok(text) => measurements(&text),
        Err(error) => {
            println!("{path}: {error}");
            return;
        }
    };
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
    report("daly98", &achromatic, |m| Ok(Daly98::default().sensitivity(m.freq_cpd, m.luminance_cd_m2)));
    let coloured: Vec<&Measurement> = all.iter().filter(|m| !is_achromatic(m)).collect();
    println!("{} measurements in other colour directions", coloured.len());
    report("castle, three channels", &coloured, castle_in_colour);
}

fn measurements(text: &str) -> Vec<Measurement> {
    let mut lines = text.lines();
    let names: Vec<&str> = lines.next().unwrap_or_default().split(',').collect();
    lines
        .filter_map(|line| {
            let fields: Vec<&str> = line.split(',').collect();
            let field = |name: &str| names.iter().position(|n| *n == name).and_then(|index| fields.get(index).copied());
            let number = |name: &str| field(name)?.parse::<f64>().ok().filter(|value| value.is_finite());
            let is_wanted = field("stimulus")? == "grating"
                && number("t_frequency")? == 0.0
                && number("eccentricity")? == 0.0
                && number("luminance")? >= 1.0
                && number("s_frequency")? <= 20.0;
            is_wanted.then_some(())?;
            Some(Measurement {
                luminance_cd_m2: number("luminance")?,
                freq_cpd: number("s_frequency")?,
                area_deg2: number("area")?,
                sensitivity: number("sensitivity")?,
                background_lms: [number("L")?, number("M")?, number("S")?],
                direction_lms: [number("L_delta")?, number("M_delta")?, number("S_delta")?],
            })
        })
        .collect()
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
    let mut errors: Vec<f64> =
        data.iter().filter_map(|m| Some(20.0 * (model(m).ok()? / m.sensitivity).log10())).collect();
    if errors.is_empty() {
        return;
    }
    errors.sort_unstable_by(f64::total_cmp);
    let median = errors[errors.len() / 2];
    let rms = |offset: f64| (errors.iter().map(|e| (e - offset).powi(2)).sum::<f64>() / errors.len() as f64).sqrt();
    println!("  {name:24} {:5.1} {:5.1}", rms(0.0), rms(median));
}
