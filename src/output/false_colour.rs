//! Values of a picture as colours, for people to look at: maps of samples, thresholds and visibility.

use fechner_perception::Plane;

/// A layer in colours: 8 bits, RGB after RGB, and what the colours mean.
pub struct Colours {
    /// Row-major.
    pub rgb8: Vec<u8>,
    /// In words.
    pub legend: String,
}

/// Positive values by their logarithm, dark to bright, between the 0.5th and the 99.5th percentile.
pub fn logarithmic(values: &Plane, unit: &str) -> Colours {
    let (low, high) = range(values);
    let scale = 1.0 / (high / low).ln().max(1e-3);
    let rgb8 = values.values().iter().flat_map(|&v| heat8((f64::from(v).max(low) / low).ln() * scale)).collect();
    Colours { rgb8, legend: format!("dark {} to bright {} {unit}, logarithmic", figure(low), figure(high)) }
}

/// Visibility against a target: blue to black below it, black through red to pale yellow at four times it.
pub fn visibility(values: &Plane, target: f64) -> Colours {
    let rgb8 = values
        .values()
        .iter()
        .flat_map(|&v| {
            let ratio = f64::from(v) / target;
            if ratio <= 1.0 {
                [0, (40.0 * ratio) as u8, (40.0 + 60.0 * ratio) as u8]
            } else {
                heat8(0.3 + 0.35 * ratio.log2())
            }
        })
        .collect();
    Colours {
        rgb8,
        legend: format!(
            "blue: at most the target, {}; red to yellow: up to {} and above",
            figure(target),
            figure(4.0 * target)
        ),
    }
}

/// Signed values: grey is 0, white and black are four times the root mean square.
pub fn signed(values: &Plane, unit: &str) -> Colours {
    let square = |v: &f32| f64::from(*v) * f64::from(*v);
    let rms = (values.values().iter().map(square).sum::<f64>() / values.values().len().max(1) as f64).sqrt();
    let most = (4.0 * rms).max(f64::MIN_POSITIVE);
    let grey = |v: &f32| [(127.5 + 127.5 * (f64::from(*v) / most).clamp(-1.0, 1.0)) as u8; 3];
    let rgb8 = values.values().iter().flat_map(grey).collect();
    Colours { rgb8, legend: format!("black −{0} to white +{0} {unit}", figure(most)) }
}

/// The 0.5th and 99.5th percentile of what is above 0.
pub(crate) fn range(values: &Plane) -> (f64, f64) {
    let mut above: Vec<f32> = values.values().iter().copied().filter(|v| *v > 0.0 && v.is_finite()).collect();
    if above.is_empty() {
        return (1.0, 2.0);
    }
    above.sort_unstable_by(f32::total_cmp);
    let at = |share: f64| f64::from(above[(share * (above.len() - 1) as f64) as usize]);
    (at(0.005), at(0.995))
}

/// Codes of sRGB, 0 to 1, for a share of 0 to 1: black, purple, red, orange, pale yellow (magma, in the steps that FLIP has).
pub(crate) fn heat(share: f64) -> [f32; 3] {
    // NaN becomes 0.
    flip_rs::MAGMA[(share.clamp(0.0, 1.0) * 255.0) as usize]
}

fn heat8(share: f64) -> [u8; 3] {
    heat(share).map(|code| (255.0 * code).round() as u8)
}

/// Three significant digits.
pub(crate) fn figure(value: f64) -> String {
    match value.abs() {
        v if (100.0..1e6).contains(&v) => format!("{value:.0}"),
        v if (1.0..100.0).contains(&v) => format!("{}", (value * 100.0).round() / 100.0),
        v if (0.001..1.0).contains(&v) => format!("{}", (value * 1e4).round() / 1e4),
        _ => format!("{value:.2e}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_of_any_kind_become_colours() {
        let plane = Plane::from_values(5, 1, vec![f32::NAN, 0.0, -1.0, f32::INFINITY, 3.0]).expect("a plane");
        for colours in [logarithmic(&plane, "x"), visibility(&plane, 1.0), signed(&plane, "x")] {
            assert_eq!(colours.rgb8.len(), 15, "{}", colours.legend);
        }
        assert_eq!((heat8(0.0), heat8(2.0)), ([0, 0, 4], [252, 253, 191]));
    }

    /// What is above the target never looks like what is below it.
    #[test]
    fn the_target_is_a_border_of_colours() {
        let plane = Plane::from_values(4, 1, vec![0.0, 1.99, 2.01, 8.0]).expect("a plane");
        let colours = visibility(&plane, 2.0).rgb8;
        let is_blue = |i: usize| colours[3 * i] == 0;
        assert!(is_blue(0) && is_blue(1) && !is_blue(2) && !is_blue(3), "{colours:?}");
    }
}
