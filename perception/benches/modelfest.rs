//! How visible this crate calls what people could only just see: the Gabor patches of ModelFest.
//!
//! Reads the mean thresholds of Watson, "Visual detection of spatial contrast patterns: evaluation of five simple models",
//! 2000, from `data_aggregated_merged.csv` of gfxdisp/castleCSF, whose path is the environment variable
//! `CASTLE_CSF_DATA`. Each patch is made again (256×256 pixels, 120 pixels a degree, 30 cd/m²) at people's threshold
//! contrast; a perfect model would call every one v = 1. Prints v in dB, and the RMS with and without the median.

use fechner_perception::{CastleCsf, Display, Observer, Plane, ThresholdInputs, Viewing, threshold_map};

const SIDE: usize = 256;
const PIXELS_PER_DEGREE: f64 = 120.0;
const BACKGROUND_CD_M2: f32 = 30.0;

/// A vertical grating in cosine phase under a Gaussian.
struct Gabor {
    freq_cpd: f64,
    sigma_deg: f64,
    threshold_contrast: f64,
}

impl Gabor {
    fn picture_cd_m2(&self) -> Plane {
        let degrees = |pixel: usize| (pixel as f64 + 0.5 - SIDE as f64 / 2.0) / PIXELS_PER_DEGREE;
        Plane::from_fn(SIDE, SIDE, |x, y| {
            let (x, y) = (degrees(x), degrees(y));
            let window = (-(x * x + y * y) / (2.0 * self.sigma_deg * self.sigma_deg)).exp();
            let wave = (std::f64::consts::TAU * self.freq_cpd * x).cos();
            (self.threshold_contrast * window * wave) as f32 * BACKGROUND_CD_M2
        })
    }
}

fn main() {
    let Ok(path) = std::env::var("CASTLE_CSF_DATA") else {
        println!("set CASTLE_CSF_DATA to data_aggregated_merged.csv of gfxdisp/castleCSF to print ModelFest's patches");
        return;
    };
    let patches = match std::fs::read_to_string(&path) {
        Ok(text) => gabors(&text),
        Err(error) => {
            println!("{path}: {error}");
            return;
        }
    };
    let display = Display { pixels_per_degree: PIXELS_PER_DEGREE, ..Display::default() };
    let viewing = Viewing { display, observer: Observer::default() };
    let grey = Plane::filled(SIDE, SIDE, BACKGROUND_CD_M2);
    let inputs = ThresholdInputs { display_luminance_cd_m2: &grey, guide_variance: None };
    let map = match threshold_map(&inputs, &viewing, &CastleCsf::default()) {
        Ok(map) => map,
        Err(error) => {
            println!("{error}");
            return;
        }
    };
    let mut decibels: Vec<f64> = Vec::new();
    for patch in &patches {
        let seen = map.measured_visibility(&patch.picture_cd_m2());
        let v = f64::from(seen.values().iter().copied().fold(0.0, f32::max));
        decibels.push(20.0 * v.log10());
        println!("{:5.2} cpd, σ {:.3}°: v {v:5.2}, {:+.1} dB", patch.freq_cpd, patch.sigma_deg, 20.0 * v.log10());
    }
    let mut sorted = decibels.clone();
    sorted.sort_by(f64::total_cmp);
    let Some(median) = sorted.get(sorted.len() / 2) else {
        println!("no ModelFest patches in {path}");
        return;
    };
    let rms = |bias: f64| (decibels.iter().map(|d| (d - bias).powi(2)).sum::<f64>() / decibels.len() as f64).sqrt();
    println!("{} patches: RMS {:.1} dB, {:.1} dB without the median", decibels.len(), rms(0.0), rms(*median));
}

fn gabors(text: &str) -> Vec<Gabor> {
    let mut lines = text.lines();
    let names: Vec<&str> = lines.next().unwrap_or_default().split(',').collect();
    lines
        .filter_map(|line| {
            let fields: Vec<&str> = line.split(',').collect();
            let field = |name: &str| names.iter().position(|n| *n == name).and_then(|index| fields.get(index).copied());
            let number = |name: &str| field(name)?.parse::<f64>().ok().filter(|value| value.is_finite());
            (field("dataset")? == "modelfest" && field("stimulus")? == "gabor").then_some(())?;
            Some(Gabor {
                freq_cpd: number("s_frequency")?,
                sigma_deg: number("ge_sigma")?,
                threshold_contrast: 10.0_f64.powf(number("log_cone_contrast")?),
            })
        })
        .collect()
}
