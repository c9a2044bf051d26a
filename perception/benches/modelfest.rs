//! How visible this crate calls what people could only just see: the 43 stimuli of ModelFest.
//!
//! Made again from their published definitions (Carney et al., "Development of an image/threshold database for
//! designing and testing human vision models", 1999; Watson and Ahumada, "A standard model for foveal detection of
//! spatial contrast", 2005): 256×256 pixels, 120 pixels a degree, 30 cd/m², at the mean threshold contrast of 16
//! observers. Thresholds, the noise sample and the natural scene are data: the environment variable `MODELFEST_DATA`
//! names the folder that has `modelfest_data.csv`, `modelfest_noise.tif` and `modelfest_natural_scene.tif`, as the
//! Python package stimupy installs it (`pip install stimupy`, then `site-packages/stimupy/papers`).
//!
//! A perfect model would call every stimulus v = 1.04: thresholds are for 84 % correct of two, v = 1 is 82 %. Stimuli
//! faded in and out over half a second, which is not modelled here.

mod stimuli;
mod support;

use fechner_perception::{CastleCsf, Display, Plane, ThresholdInputs, Viewing, threshold_map};
use std::path::Path;
use stimuli::{BACKGROUND_CD_M2, PIXELS_PER_DEGREE, SIDE, Stimulus};

/// Place of the noise among the stimuli: the one that is nearest to what a renderer leaves.
const NOISE: usize = 34;

fn main() {
    let Ok(folder) = std::env::var("MODELFEST_DATA") else {
        println!("set MODELFEST_DATA to stimupy's folder `papers` (pip install stimupy) to print ModelFest's stimuli");
        return;
    };
    if let Err(error) = run(Path::new(&folder)) {
        println!("{folder}: {error}");
    }
}

fn run(folder: &Path) -> Result<(), Box<dyn std::error::Error>> {
    let thresholds = mean_log_sensitivities(&std::fs::read_to_string(folder.join("modelfest_data.csv"))?)?;
    let stimuli = stimuli::all(folder)?;
    let display = Display { pixels_per_degree: PIXELS_PER_DEGREE, ..Display::default() };
    let grey = Plane::filled(SIDE, SIDE, BACKGROUND_CD_M2);
    let inputs = ThresholdInputs::clean(&grey);
    let map = threshold_map(&inputs, &Viewing::of(display), &CastleCsf::default())?;
    let mut decibels = Vec::new();
    for (index, (stimulus, log_sensitivity)) in stimuli.iter().zip(&thresholds).enumerate() {
        let Stimulus { name, contrast } = stimulus;
        let scale = 10.0_f64.powf(-log_sensitivity) as f32 * BACKGROUND_CD_M2;
        let seen = map.measured_visibility(&contrast.map(|value| value * scale));
        let v = f64::from(seen.values().iter().copied().fold(0.0, f32::max));
        println!(
            "{:2} {name:34} threshold {:5.1} dB: v {v:5.2}, {:+5.1} dB",
            index + 1,
            -20.0 * log_sensitivity,
            20.0 * v.log10()
        );
        decibels.push(20.0 * v.log10());
    }
    let rms = |errors: &[f64], bias: f64| support::rms(errors, bias);
    println!(
        "{} stimuli: RMS {:.1} dB, {:.1} dB without the median",
        decibels.len(),
        rms(&decibels, 0.0),
        rms(&decibels, support::median(&decibels))
    );
    println!(
        "noise alone {:+.1} dB; RMS {:.1} dB if its threshold fixes the scale",
        decibels[NOISE],
        rms(&decibels, decibels[NOISE])
    );
    println!("the first 14 (Gabor patches): RMS {:.1} dB", rms(&decibels[..14], 0.0));
    Ok(())
}

/// Mean over observers and their four runs, log10 of 1/contrast, of each stimulus.
fn mean_log_sensitivities(text: &str) -> Result<Vec<f64>, Box<dyn std::error::Error>> {
    const RUNS: usize = 4;
    const STIMULI: usize = 43;
    let mut sums = vec![0.0; STIMULI];
    let mut observers = 0.0;
    for (line, row) in text.lines().enumerate() {
        let values: Result<Vec<f64>, _> = row.split(',').skip(1).map(str::parse).collect();
        let values = values.map_err(|error| format!("modelfest_data.csv, line {}: {error}", line + 1))?;
        if values.len() != RUNS * STIMULI {
            return Err(format!("modelfest_data.csv, line {}: {} values, not 172", line + 1, values.len()).into());
        }
        for (sum, runs) in sums.iter_mut().zip(values.chunks(RUNS)) {
            *sum += runs.iter().sum::<f64>() / RUNS as f64;
        }
        observers += 1.0;
    }
    Ok(sums.into_iter().map(|sum| sum / observers).collect())
}
