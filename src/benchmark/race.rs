//! How denoised pictures get better with samples by three rules, and what each rule needs for a quality.

use super::reached::Reached;
use super::summary::mean_ratio;
use serde::{Deserialize, Serialize};

/// A rule that races.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(into = "&'static str")]
pub enum RaceRule {
    /// Uniform: the same count everywhere, which others are compared with.
    Uniform,
    /// Cycles' rule.
    Relative,
    /// Where noise can be seen.
    Visible,
}

impl RaceRule {
    pub(super) const ALL: [Self; 3] = [Self::Uniform, Self::Relative, Self::Visible];

    /// What files and tables call it.
    pub fn name(self) -> &'static str {
        match self {
            Self::Uniform => "uniform",
            Self::Relative => "relative",
            Self::Visible => "visible",
        }
    }
}

impl From<RaceRule> for &'static str {
    fn from(rule: RaceRule) -> Self {
        rule.name()
    }
}

/// What the race is to.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[serde(into = "String")]
pub enum Quality {
    /// Quality of at least so much by ColorVideoVDP, JOD.
    Jod(f64),
    /// Quality of at most the FLIP that uniform sampling first has from so many samples a pixel on.
    FlipOfUniformAt(f64),
}

impl Quality {
    /// The qualities in the order of files and tables.
    pub const ALL: [Self; 3] = [Self::Jod(9.8), Self::Jod(9.9), Self::FlipOfUniformAt(64.0)];

    /// What files and tables call it.
    pub fn name(self) -> String {
        match self {
            Self::Jod(jod) => format!("JOD {jod}"),
            Self::FlipOfUniformAt(samples) => format!("FLIP of uniform at {samples}"),
        }
    }

    /// Where a race first comes to it.
    fn need(self, race: &Race, uniform: &Race) -> Reached {
        match self {
            Self::Jod(jod) => race.to_jod(jod),
            Self::FlipOfUniformAt(samples) => {
                let point = uniform.points.iter().find(|point| point.samples >= samples);
                race.to_flip(point.map_or(0.0, |point| point.flip_mean))
            }
        }
    }
}

impl From<Quality> for String {
    fn from(quality: Quality) -> Self {
        quality.name()
    }
}

/// The denoised picture of a rule with a budget. Files have it as a list in this order.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(from = "[f64; 4]", into = "[f64; 4]")]
pub struct RacePoint {
    /// Mean samples a pixel.
    pub samples: f64,
    /// ColorVideoVDP.
    pub jod: f64,
    /// Mean LDR-FLIP.
    pub flip_mean: f64,
    /// Seconds of the whole render.
    pub seconds: f64,
}

impl RacePoint {
    /// Mean of several seeds with one budget.
    pub(super) fn mean(laps: &[Self]) -> Self {
        let mean = |of: fn(&Self) -> f64| laps.iter().map(of).sum::<f64>() / laps.len() as f64;
        Self {
            samples: mean(|lap| lap.samples),
            jod: mean(|lap| lap.jod),
            flip_mean: mean(|lap| lap.flip_mean),
            seconds: mean(|lap| lap.seconds),
        }
    }
}

impl From<[f64; 4]> for RacePoint {
    fn from([samples, jod, flip_mean, seconds]: [f64; 4]) -> Self {
        Self { samples, jod, flip_mean, seconds }
    }
}

impl From<RacePoint> for [f64; 4] {
    fn from(point: RacePoint) -> Self {
        [point.samples, point.jod, point.flip_mean, point.seconds]
    }
}

/// How one rule's pictures get better with samples.
#[derive(Clone, Debug, Serialize)]
pub struct Race {
    /// Scene.
    pub scene: String,
    /// Denoiser.
    pub denoiser: String,
    /// Rule.
    pub rule: RaceRule,
    /// Points, one a budget, ascending.
    pub points: Vec<RacePoint>,
    /// What it needs for each of [`Quality::ALL`].
    pub needs: Vec<Need>,
}

/// What a rule needs for a quality.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Need {
    /// The quality that is needed.
    pub quality: Quality,
    /// Mean samples a pixel.
    pub samples: Reached,
    /// Uniform sampling's over these; `None` where one of the two is a bound.
    pub uniform_over: Option<f64>,
}

/// Uniform sampling's need over a rule's, in geometric mean of scenes and denoisers.
#[derive(Clone, Debug, Serialize)]
pub struct RaceMean {
    /// The rule.
    pub rule: RaceRule,
    /// The quality that is needed.
    pub quality: Quality,
    /// The mean; `None` where no pair has a ratio.
    pub uniform_over: Option<f64>,
    /// Pairs of races that it is the mean of.
    pub pairs: usize,
    /// Pairs without a ratio, since one of the two is a bound.
    pub pairs_left_out: usize,
}

/// Fills in what each rule needs, of the races of one scene with one denoiser.
pub(super) fn compare_with_uniform(races: &mut [Race]) {
    let Some(uniform) = races.iter().find(|race| race.rule == RaceRule::Uniform).cloned() else { return };
    for race in races {
        let need = |quality: Quality| {
            let [samples, of_uniform] = [&*race, &uniform].map(|race| quality.need(race, &uniform));
            let uniform_over = of_uniform.known().zip(samples.known()).map(|(uniform, own)| uniform / own);
            Need { quality, samples, uniform_over }
        };
        race.needs = Quality::ALL.map(need).to_vec();
    }
}

/// Means of every rule but uniform sampling.
pub(super) fn means(races: &[Race]) -> Vec<RaceMean> {
    let rules = RaceRule::ALL.into_iter().filter(|&rule| rule != RaceRule::Uniform);
    let each = rules.flat_map(|rule| Quality::ALL.into_iter().map(move |quality| (rule, quality)));
    each.map(|(rule, quality)| {
        let of_rule = races.iter().filter(|race| race.rule == rule).flat_map(|race| &race.needs);
        let needs: Vec<&Need> = of_rule.filter(|need| need.quality == quality).collect();
        let ratios: Vec<f64> = needs.iter().filter_map(|need| need.uniform_over).collect();
        let (pairs, pairs_left_out) = (ratios.len(), needs.len() - ratios.len());
        RaceMean { rule, quality, uniform_over: mean_ratio(ratios), pairs, pairs_left_out }
    })
    .collect()
}

impl Race {
    /// Where the denoised picture first has this ColorVideoVDP.
    fn to_jod(&self, jod: f64) -> Reached {
        let curve: Vec<(f64, f64)> = self.points.iter().map(|point| (point.samples, point.jod)).collect();
        Reached::by(&curve, jod)
    }

    /// Where it first has a FLIP at most this large.
    fn to_flip(&self, flip: f64) -> Reached {
        let curve: Vec<(f64, f64)> = self.points.iter().map(|point| (point.samples, -point.flip_mean)).collect();
        Reached::by(&curve, -flip)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn race(scene: &str, rule: RaceRule, points: &[[f64; 3]]) -> Race {
        let points = points.iter().map(|&[samples, jod, flip]| [samples, jod, flip, 1.0].into()).collect();
        Race { scene: scene.to_owned(), denoiser: "none".to_owned(), rule, points, needs: Vec::new() }
    }

    #[test]
    fn qualities_have_their_names_in_files() {
        let text = serde_json::to_string(&Quality::ALL).expect("JSON");
        assert_eq!(text, r#"["JOD 9.8","JOD 9.9","FLIP of uniform at 64"]"#);
    }

    /// As runs that are kept have them.
    #[test]
    fn points_are_lists_in_files() {
        let point = RacePoint { samples: 16.5, jod: 9.75, flip_mean: 0.125, seconds: 2.0 };
        let text = serde_json::to_string(&point).expect("JSON");
        assert_eq!(text, "[16.5,9.75,0.125,2.0]");
        assert_eq!(serde_json::from_str::<RacePoint>(&text).expect("a point"), point);
    }

    /// A rule that begins beyond the goal has no ratio, and the mean says that it leaves the pair out.
    #[test]
    fn bounds_have_no_ratios() {
        let uniform = [[16.0, 9.7, 0.2], [32.0, 9.8, 0.1], [64.0, 9.85, 0.05]];
        let pair = |scene: &str, relative: &[[f64; 3]]| {
            [race(scene, RaceRule::Uniform, &uniform), race(scene, RaceRule::Relative, relative)]
        };
        let mut easy = pair("easy", &[[32.0, 9.82, 0.1], [64.0, 9.9, 0.02]]);
        let mut hard = pair("hard", &[[8.0, 9.6, 0.3], [16.0, 9.8, 0.05]]);
        compare_with_uniform(&mut easy);
        compare_with_uniform(&mut hard);
        let need = &easy[1].needs[0];
        assert_eq!((need.samples, need.uniform_over), (Reached::AtMost(32.0), None));
        // Uniform sampling does not come to JOD 9.9.
        assert_eq!((easy[0].needs[1].samples, easy[1].needs[1].uniform_over), (Reached::MoreThan(64.0), None));
        let means = means(&[easy, hard].concat());
        let of = |quality: Quality| {
            let mean =
                means.iter().find(|mean| mean.rule == RaceRule::Relative && mean.quality == quality).expect("there");
            (mean.uniform_over.map(|ratio| (100.0 * ratio).round()), mean.pairs, mean.pairs_left_out)
        };
        assert_eq!(of(Quality::Jod(9.8)), (Some(200.0), 1, 1));
        assert_eq!(of(Quality::Jod(9.9)), (None, 0, 2));
        assert_eq!(of(Quality::FlipOfUniformAt(64.0)).1, 2);
    }
}
