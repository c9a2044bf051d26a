use super::super::guide::Pixel;
use super::*;
use crate::display::PixelDensity;
use crate::plane::Plane;

const EYE: Kinetics = Kinetics::PATTANAIK_2000;

fn step(from: f64, to: f64, seconds: f64, frames: usize) -> AdaptationState {
    let mut state = AdaptationState::adapted_to(Goal::both(from), &EYE).looking_at(Goal::both(to));
    for _ in 0..frames {
        state = state.after(Goal::both(to), seconds / frames as f64, &EYE);
    }
    state
}

fn close(found: f64, expected: f64, relative: f64) {
    assert!((found / expected - 1.0).abs() < relative, "{found} for {expected}");
}

#[test]
fn tabulated_times() {
    close(step(1e4, 1.0, 0.080, 1).cones.neural_cd_m2, 3679.43, 1e-6);
    close(step(1e4, 1.0, 0.5, 1).cones.neural_cd_m2, 20.3026, 1e-5);
    close(step(1e4, 1.0, 0.150, 1).rods.neural_cd_m2, 3679.43, 1e-6);
    close(step(1e4, 1.0, 10.0, 1).rods.pigment, 0.018_384_9, 1e-5);
    close(step(1e4, 1.0, 60.0, 1).rods.pigment, 0.037_683_1, 1e-5);
    for (seconds, expected) in [(60.0, 0.139_072), (400.0, 0.625_579), (1200.0, 0.930_549)] {
        close(step(1000.0, 0.001, seconds, 1).rods.pigment, expected, 1e-5);
    }
}

#[test]
fn a_step_gives_the_same_curve_at_any_frame_rate() {
    for (from, to) in [(0.01, 1e4), (1e4, 0.01), (25.0, 26.0)] {
        let whole = step(from, to, 2.0, 1);
        for frames in [16, 48, 60, 480, 5000] {
            let split = step(from, to, 2.0, frames);
            close(split.cones.neural_cd_m2, whole.cones.neural_cd_m2, 1e-9);
            close(split.rods.neural_cd_m2, whole.rods.neural_cd_m2, 1e-9);
            close(split.cones.pigment, whole.cones.pigment, 1e-9);
            close(split.rods.pigment, whole.rods.pigment, 1e-9);
        }
    }
}

/// The goal goes evenly from one luminance to another within two seconds, or evenly in its logarithm (two or three
/// decades: six in two seconds are 1.1 % apart); states of every twelfth of a second are compared.
#[test]
fn a_ramp_agrees_between_24_and_240_frames_a_second() {
    let even = [(0.01_f64, 1e4_f64), (1e4, 0.01), (10.0, 1000.0)].map(|(from, to)| (from, to, false));
    let logarithmic = [(1.0, 1000.0), (1000.0, 1.0), (0.1, 10.0)].map(|(from, to)| (from, to, true));
    for (from, to, geometric) in even.into_iter().chain(logarithmic) {
        {
            let goal = |seconds: f64| {
                let share = (seconds / 2.0).min(1.0);
                Goal::both(if geometric { from * (to / from).powf(share) } else { from + (to - from) * share })
            };
            let course = |fps: usize| {
                let mut state = AdaptationState::adapted_to(goal(0.0), &EYE);
                let mut states = Vec::new();
                for frame in 1..=3 * fps {
                    state = state.after(goal(frame as f64 / fps as f64), (fps as f64).recip(), &EYE);
                    if frame.is_multiple_of(fps / 12) {
                        states.push(state);
                    }
                }
                states
            };
            for (coarse, fine) in course(24).iter().zip(&course(240)) {
                close(coarse.cones.neural_cd_m2, fine.cones.neural_cd_m2, 0.01);
                close(coarse.rods.neural_cd_m2, fine.rods.neural_cd_m2, 0.01);
                close(coarse.cones.pigment, fine.cones.pigment, 0.01);
                close(coarse.rods.pigment, fine.rods.pigment, 0.01);
            }
        }
    }
}

#[test]
fn an_adapted_eye_stays_as_it_is_and_nonsense_changes_nothing() {
    let state = AdaptationState::adapted_to(Goal::both(40.0), &EYE);
    let later = state.after(Goal::both(40.0), 1000.0, &EYE);
    close(later.rods.pigment, state.rods.pigment, 1e-12);
    for seconds in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        assert_eq!(state.after(Goal::both(40.0), seconds, &EYE), state);
    }
    let text = serde_json::to_string(&later).unwrap();
    assert_eq!(serde_json::from_str::<AdaptationState>(&text).unwrap(), later);
}

#[test]
fn the_gaze_decides_what_is_adapted_to() {
    let view = Plane::from_fn(400, 40, |x, _| if x < 200 { 0.1 } else { 1000.0 });
    let guide = SceneGuide::of(&view);
    close(Goal::of(&guide, PixelDensity::square(10.0)).cones_cd_m2, 10.0, 1e-4);
    let dark = Goal::of(&guide.with_gaze(Some(Pixel { x: 20, y: 20 })), PixelDensity::square(10.0));
    let bright = Goal::of(&guide.with_gaze(Some(Pixel { x: 380, y: 20 })), PixelDensity::square(10.0));
    assert!(dark.cones_cd_m2 < 0.11 && bright.cones_cd_m2 > 990.0, "{dark:?} {bright:?}");
    let beside = Goal::of(&guide.with_gaze(Some(Pixel { x: 4000, y: 900 })), PixelDensity::square(10.0));
    assert!(beside.cones_cd_m2 > 990.0, "an eye that looks beside the bright half is not in the dark: {beside:?}");
    close(Goal::of(&SceneGuide::of(&Plane::filled(2, 2, 0.0)), PixelDensity::square(10.0)).rods_cd_m2, 1e-4, 1e-7);
}

/// However steep a ramp, an eye that has no time for it stays as it is.
#[test]
fn a_ramp_in_no_time_changes_nothing() {
    for seconds in [1e-15, 1e-12, 1e-9, 1e-6] {
        let state = AdaptationState::adapted_to(Goal::both(1.0), &EYE).looking_at(Goal::both(1e-4));
        let after = state.after(Goal::both(1e8), seconds, &EYE);
        let expected = 1.0 + (5e7 - 1.0) * seconds / 0.080;
        close(after.cones.neural_cd_m2, expected, 1e-4);
    }
}
