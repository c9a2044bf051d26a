//! Which frames of a shot are piloted for a budget: those where its light changes, and others at equal steps. What
//! pilots find is left to `budget`.

use super::track::{Track, goal_of};
use super::{SceneSource, ShotSettings};
use crate::adaptive::glimpse::brief_glimpse_for;
use crate::integrator::PILOT_SAMPLES_PER_PIXEL;
use crate::scene::load::LoadError;
use fechner_perception::tone::ToneOperator;

/// Frames that are piloted, if there are as many.
const PILOTED_FRAMES: usize = 9;
/// Most of them in a shot whose light changes often.
const MAX_PILOTED_FRAMES: usize = 32;
/// One in so many samples of a budget may be taken, and thrown away, by pilots beyond the first nine.
const SHARE_OF_PILOTS: u64 = 10;
/// Light within this ratio of what lies between piloted frames has not changed: noise of brief looks is below it.
const STEADY_RATIO: f64 = 1.25;
/// No stretch without a pilot is longer than one in so many of the shot, however much its light changes elsewhere.
const MIN_STRETCHES: usize = 4;

/// The frames of a shot to pilot, in order, counted from its first.
pub(super) fn piloted_frames(
    source: &dyn SceneSource,
    shot: &ShotSettings,
    operator: &dyn ToneOperator,
    track: &Track,
) -> Result<Vec<usize>, LoadError> {
    let frames = track.frames.len();
    if frames <= PILOTED_FRAMES {
        return Ok((0..frames).collect());
    }
    let ln_light: Vec<f64> =
        light_of_frames(source, shot, operator, track)?.iter().map(|light| light.max(f64::MIN_POSITIVE).ln()).collect();
    Ok(where_light_changes(&ln_light, most_for_light(frames, shot.limits.mean_samples)))
}

/// Mean luminance of every frame, cd/m²: from the track where it has all, else by brief looks at all, which can be
/// compared.
fn light_of_frames(
    source: &dyn SceneSource,
    shot: &ShotSettings,
    operator: &dyn ToneOperator,
    track: &Track,
) -> Result<Vec<f64>, LoadError> {
    let known: Option<Vec<f64>> = track.frames.iter().map(|frame| Some(frame.goal?.cones_cd_m2)).collect();
    match known {
        Some(known) => Ok(known),
        None => (shot.first..=shot.last).map(|frame| brief_light(source, shot, operator, frame)).collect(),
    }
}

fn brief_light(
    source: &dyn SceneSource,
    shot: &ShotSettings,
    operator: &dyn ToneOperator,
    frame: u32,
) -> Result<f64, LoadError> {
    let scene = source.at(shot.seconds(f64::from(frame)))?;
    let light = brief_glimpse_for(operator, scene, &shot.trace, shot.nits_per_unit);
    Ok(goal_of(&light, shot, operator).cones_cd_m2)
}

/// Pilots that light may ask for.
fn most_for_light(frames: usize, mean_samples: Option<u32>) -> usize {
    let budget = u64::from(mean_samples.unwrap_or(0)) * frames as u64;
    let afforded = budget / (SHARE_OF_PILOTS * u64::from(PILOT_SAMPLES_PER_PIXEL));
    afforded.clamp(PILOTED_FRAMES as u64, MAX_PILOTED_FRAMES as u64) as usize
}

/// Both ends; then, again and again, the frame whose light is farthest from what lies between piloted ones, up to
/// `most`; then the middles of the longest stretches without any.
fn where_light_changes(ln_light: &[f64], most: usize) -> Vec<usize> {
    let last = ln_light.len() - 1;
    let mut piloted = vec![0, last];
    while piloted.len() < most
        && let Some(frame) = farthest_light(ln_light, &piloted)
    {
        insert(&mut piloted, frame);
    }
    while let Some(stretch) = longest_stretch(&piloted)
        && (piloted.len() < PILOTED_FRAMES || stretch.frames() > last.div_ceil(MIN_STRETCHES))
    {
        insert(&mut piloted, stretch.middle());
    }
    piloted
}

fn insert(piloted: &mut Vec<usize>, frame: usize) {
    piloted.insert(piloted.partition_point(|&other| other < frame), frame);
}

/// The frame whose light is farthest from what lies between piloted ones, if any has changed.
fn farthest_light(ln_light: &[f64], piloted: &[usize]) -> Option<usize> {
    let distance = |frame: usize| {
        let Neighbours { before, after, share } = Neighbours::of(frame, piloted);
        let [before, after] = [before, after].map(|place| ln_light[piloted[place]]);
        (ln_light[frame] - before - share * (after - before)).abs()
    };
    let distances = (0..ln_light.len()).map(|frame| (frame, distance(frame)));
    let (frame, distance) = distances.max_by(|(_, a), (_, b)| a.total_cmp(b))?;
    (distance > STEADY_RATIO.ln()).then_some(frame)
}

/// Two piloted frames with others between them.
#[derive(Clone, Copy)]
struct Stretch {
    before: usize,
    after: usize,
}

impl Stretch {
    fn frames(self) -> usize {
        self.after - self.before
    }

    fn middle(self) -> usize {
        self.before + self.frames() / 2
    }
}

fn longest_stretch(piloted: &[usize]) -> Option<Stretch> {
    let stretches = piloted.windows(2).map(|pair| Stretch { before: pair[0], after: pair[1] });
    stretches.max_by_key(|stretch| stretch.frames()).filter(|stretch| stretch.frames() > 1)
}

/// The piloted frames between which a frame lies.
pub(super) struct Neighbours {
    /// Place of the one before among all piloted ones.
    pub(super) before: usize,
    /// Place of the one after.
    pub(super) after: usize,
    /// Share of the way between them.
    pub(super) share: f64,
}

impl Neighbours {
    pub(super) fn of(frame: usize, piloted: &[usize]) -> Self {
        let after = piloted.partition_point(|&other| other < frame);
        let before = after.saturating_sub(1);
        let way = piloted[after] - piloted[before];
        let share = if way > 0 { (frame - piloted[before]) as f64 / way as f64 } else { 0.0 };
        Self { before, after, share }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_steady_shot_is_piloted_at_equal_steps() {
        let expected = [0, 3, 6, 9, 12, 15, 18, 21, 24];
        assert_eq!(where_light_changes(&[0.0; 25], PILOTED_FRAMES), expected);
        // What is within the ratio is noise, and a way that light goes steadily lies between its ends.
        let flicker: Vec<f64> = (0..25).map(|frame| if frame % 2 == 0 { 0.0 } else { 0.2 }).collect();
        assert_eq!(where_light_changes(&flicker, PILOTED_FRAMES), expected);
        let sunset: Vec<f64> = (0..25).map(|frame| -0.3 * f64::from(frame)).collect();
        assert_eq!(where_light_changes(&sunset, PILOTED_FRAMES), expected);
    }

    #[test]
    fn a_flash_is_piloted_with_both_its_neighbours() {
        let mut light = [0.0; 25];
        light[10] = 3.0;
        let piloted = where_light_changes(&light, PILOTED_FRAMES);
        assert!([9, 10, 11].iter().all(|frame| piloted.contains(frame)), "{piloted:?}");
        assert_eq!(piloted.len(), PILOTED_FRAMES);
    }

    /// A lamp that goes on takes two pilots, wherever it does.
    #[test]
    fn a_lamp_that_goes_on_is_piloted_on_both_sides() {
        for on in 1..60 {
            let light: Vec<f64> = (0..60).map(|frame| if frame < on { 0.0 } else { 2.0 }).collect();
            let piloted = where_light_changes(&light, PILOTED_FRAMES);
            assert!(piloted.contains(&(on - 1)) && piloted.contains(&on), "{on}: {piloted:?}");
        }
    }

    /// Flicker in a part of a shot leaves no long stretch elsewhere without a pilot.
    #[test]
    fn flicker_leaves_pilots_for_the_rest() {
        let light: Vec<f64> = (0..101).map(|frame| if frame < 30 && frame % 2 == 1 { 2.0 } else { 0.0 }).collect();
        let piloted = where_light_changes(&light, PILOTED_FRAMES);
        assert!(piloted.windows(2).all(|pair| pair[1] - pair[0] <= 25), "{piloted:?}");
        assert!(piloted.len() <= PILOTED_FRAMES + MIN_STRETCHES, "{piloted:?}");
        assert_eq!(where_light_changes(&light, MAX_PILOTED_FRAMES)[..30], (0..30).collect::<Vec<_>>());
    }

    #[test]
    fn more_pilots_take_no_more_than_a_tenth_of_the_budget() {
        assert_eq!(most_for_light(25, None), 9);
        assert_eq!(most_for_light(25, Some(48)), 9);
        assert_eq!(most_for_light(48, Some(64)), 19);
        assert_eq!(most_for_light(1000, Some(u32::MAX)), 32);
    }
}
