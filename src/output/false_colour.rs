//! Values of a picture as colours, for people to look at: maps of samples, thresholds and visibility.

use crate::digits::significant;
use fechner_perception::Plane;

/// A layer in colours: 8 bits, RGB after RGB, and what the colours mean.
pub struct Colours {
    /// Row-major.
    pub rgb8: Vec<u8>,
    /// What the colours mean, in words.
    pub legend: String,
}

/// What is not known: of all greys the one that is farthest from every other colour here, also to eyes that lack red,
/// green or blue (a ΔE*ab of 20 by Machado and others 2009).
const UNKNOWN: [u8; 3] = [175; 3];
const UNKNOWN_IN_WORDS: &str = "grey: not known";

/// Positive values by their logarithm, dark to bright, between the 0.5th and the 99.5th percentile; grey what is not
/// finite.
pub fn logarithmic(values: &Plane, unit: &str) -> Colours {
    let range = range(values);
    let share = |v: f32| range.map_or(0.0, |Range { low, high, .. }| share_of(f64::from(v).max(low), low, high));
    let rgb8 = colours_of_known(values, |v| heat8(share(v)));
    let scale = match range {
        Some(Range { low, high, has_below, has_above }) => {
            let and = |has_more: bool, words: &'static str| if has_more { words } else { "" };
            format!(
                "dark {}{} to bright {} {unit}{}, logarithmic",
                figure(low),
                and(has_below, " and below"),
                figure(high),
                and(has_above, " and above")
            )
        }
        None => format!("dark 0 {unit}"),
    };
    Colours { rgb8, legend: legend(values, scale) }
}

/// Logarithm of a value between two, 0 to 1.
pub(crate) fn share_of(value: f64, low: f64, high: f64) -> f64 {
    let scale = 1.0 / (high / low).ln().max(1e-3);
    (value / low).ln() * scale
}

/// Heat of what is just above a target: red, by a ΔE*ab of 88 from the blue at the target, 59 to eyes that lack red;
/// the purple that is halfway to black is at 35 and 11.
const HEAT_AT_TARGET: f64 = 0.65;

/// Visibility against a target: blue to black below it, red through orange to pale yellow at four times it; grey what
/// is not known.
pub fn visibility(values: &Plane, target: f64) -> Colours {
    let rgb8 = colours_of_known(values, |v| {
        let ratio = f64::from(v) / target;
        if ratio <= 1.0 {
            [0, (40.0 * ratio) as u8, (40.0 + 60.0 * ratio) as u8]
        } else {
            heat8(HEAT_AT_TARGET + (1.0 - HEAT_AT_TARGET) * ratio.log2() / 2.0)
        }
    });
    let (at_most, most) = (figure(target), figure(4.0 * target));
    let scale = format!("blue: at most {at_most}; above it red through orange to pale yellow at {most} and above");
    Colours { rgb8, legend: legend(values, scale) }
}

fn colours_of_known(values: &Plane, colour: impl Fn(f32) -> [u8; 3]) -> Vec<u8> {
    values.values().iter().flat_map(|&v| if v.is_finite() { colour(v) } else { UNKNOWN }).collect()
}

/// A scale in words, as far as anything is on it, and what is on none.
fn legend(values: &Plane, scale: String) -> String {
    let unknown = values.values().iter().filter(|v| !v.is_finite()).count();
    match unknown {
        0 => scale,
        _ if unknown == values.values().len() => UNKNOWN_IN_WORDS.to_owned(),
        _ => format!("{scale}; {UNKNOWN_IN_WORDS}"),
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

/// The values that a scale tells apart.
#[derive(Clone, Copy)]
pub(crate) struct Range {
    /// The 0.5th percentile of what is above 0.
    pub(crate) low: f64,
    /// The 99.5th.
    pub(crate) high: f64,
    has_below: bool,
    has_above: bool,
}

/// Range of the finite values above 0; `None` where there are none.
pub(crate) fn range(values: &Plane) -> Option<Range> {
    let finite = || values.values().iter().copied().filter(|v| v.is_finite());
    let mut above: Vec<f32> = finite().filter(|v| *v > 0.0).collect();
    above.sort_unstable_by(f32::total_cmp);
    let (least, greatest) = (finite().fold(f32::INFINITY, f32::min), *above.last()?);
    let at = |share: f64| above[(share * (above.len() - 1) as f64) as usize];
    let (low, high) = (at(0.005), at(0.995));
    Some(Range { low: low.into(), high: high.into(), has_below: least < low, has_above: greatest > high })
}

/// Codes of sRGB, 0 to 1, for a share of 0 to 1: black, purple, red, orange, pale yellow (magma, in the steps that FLIP
/// has).
pub(crate) fn heat(share: f64) -> [f32; 3] {
    // NaN becomes 0.
    flip_rs::MAGMA[(share.clamp(0.0, 1.0) * 255.0) as usize]
}

fn heat8(share: f64) -> [u8; 3] {
    heat(share).map(|code| (255.0 * code).round() as u8)
}

/// A number of a legend.
pub(crate) fn figure(value: f64) -> String {
    significant(value, 3)
}

#[cfg(test)]
mod tests {
    use super::*;
    use fechner_perception::display::Eotf;
    use fechner_perception::photometry::luminance;

    #[test]
    fn values_of_any_kind_become_colours() {
        let plane = Plane::from_values(5, 1, vec![f32::NAN, 0.0, -1.0, f32::INFINITY, 3.0]).expect("a plane");
        for colours in [logarithmic(&plane, "x"), visibility(&plane, 1.0), signed(&plane, "x")] {
            assert_eq!(colours.rgb8.len(), 15, "{}", colours.legend);
        }
        assert_eq!((heat8(0.0), heat8(2.0)), ([0, 0, 4], [252, 253, 191]));
    }

    /// What is above the target never looks like what is below it: it is brighter by 40 L* at once, which all eyes see.
    #[test]
    fn the_target_is_a_border_of_colours() {
        let plane = Plane::from_values(4, 1, vec![0.0, 2.0, 2.01, 8.0]).expect("a plane");
        let Colours { rgb8, legend } = visibility(&plane, 2.0);
        let is_blue = |i: usize| rgb8[3 * i] == 0;
        assert!(is_blue(0) && is_blue(1) && !is_blue(2) && !is_blue(3), "{rgb8:?}");
        let lightness = |i: usize| {
            let rgb = [0, 1, 2].map(|c| Eotf::Srgb.decode(f64::from(rgb8[3 * i + c]) / 255.0, 1.0) as f32);
            116.0 * luminance(rgb).cbrt() - 16.0
        };
        assert!(lightness(2) - lightness(1) > 38.0, "{} over {}", lightness(2), lightness(1));
        assert_eq!(legend, "blue: at most 2; above it red through orange to pale yellow at 8 and above");
    }

    /// Neither the most nor the least of what is known.
    #[test]
    fn what_is_not_known_has_a_colour_of_its_own() {
        let known_in_part = Plane::from_values(3, 1, vec![f32::INFINITY, 1.0, 9.0]).expect("a plane");
        let unknown = Plane::filled(3, 1, f32::INFINITY);
        for of in [|plane: &Plane| visibility(plane, 1.0), |plane: &Plane| logarithmic(plane, "x")] {
            let colours = of(&known_in_part);
            let [first, others @ ..] = colours.rgb8.as_chunks::<3>().0 else { panic!("three pixels") };
            assert!(*first == UNKNOWN && !others.contains(&UNKNOWN), "{:?}", colours.rgb8);
            assert!(colours.legend.ends_with("; grey: not known"), "{}", colours.legend);
            assert_eq!(of(&unknown).legend, "grey: not known");
        }
    }

    /// One pixel in a thousand is beyond the scale, and is said to be.
    #[test]
    fn a_legend_says_what_a_scale_leaves_out() {
        let counts = |i: usize| if i == 0 { 576.0 } else { 16.0 + (i % 100) as f32 };
        let plane = Plane::from_fn(1000, 1, |x, _| counts(x));
        assert_eq!(logarithmic(&plane, "samples").legend, "dark 16 to bright 115 samples and above, logarithmic");
        let even = Plane::filled(2, 2, 16.0);
        assert_eq!(logarithmic(&even, "samples").legend, "dark 16 to bright 16 samples, logarithmic");
        assert_eq!(logarithmic(&Plane::filled(2, 2, 0.0), "x").legend, "dark 0 x");
    }
}
