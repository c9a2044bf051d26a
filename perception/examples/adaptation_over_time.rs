//! Out of a theatre into sunlight, and from there into a cave: what the eye sees (grey), what cones (red) and rods (blue) are
//! adapted to, and what the display shows for a grey (black) and for a white (green) wall, over the time since the step from
//! 1 ms to 1000 s, both axes logarithmic.

mod support;

use fechner_perception::tone::{
    AdaptationScope, AdaptationState, Goal, Kinetics, Pattanaik00, SceneGuide, ToneOperator as _,
};
use fechner_perception::{Plane, Viewing};

/// A step of what is in view, cd/m².
struct Step {
    name: &'static str,
    before: f64,
    after: f64,
}

const STEPS: [Step; 2] = [
    Step { name: "theatre_to_sun", before: 0.05, after: 5000.0 },
    Step { name: "sun_to_cave", before: 5000.0, after: 0.005 },
];

impl Step {
    fn state(&self, seconds: f64) -> AdaptationState {
        let kinetics = Kinetics::PATTANAIK_2000;
        let before = AdaptationState::adapted_to(Goal::both(self.before), &kinetics);
        before.looking_at(Goal::both(self.after)).after(Goal::both(self.after), seconds, &kinetics)
    }

    /// Display luminance, cd/m², for a wall of `share` of the mean luminance.
    fn shown_cd_m2(&self, seconds: f64, share: f64) -> f64 {
        let viewing = Viewing::default();
        let guide = Plane::filled(1, 1, self.after as f32);
        let operator = Pattanaik00 { exposure: 1.0, scope: AdaptationScope::World };
        let fitted = operator.fit(&SceneGuide::of(&guide), &viewing, Some(&self.state(seconds)));
        viewing.display.luminance_cd_m2(f64::from(fitted.relative_luminance((share * self.after) as f32)))
    }
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    for step in &STEPS {
        let mut plot = support::LogPlot::new(-3.0..3.0, -3.0..4.0);
        plot.curve([170; 3], |_| step.after);
        plot.curve([220, 60, 60], |seconds| step.state(seconds).cones.neural_cd_m2);
        plot.curve([60, 60, 220], |seconds| step.state(seconds).rods.neural_cd_m2);
        plot.curve([0; 3], |seconds| step.shown_cd_m2(seconds, 0.5));
        plot.curve([40, 160, 60], |seconds| step.shown_cd_m2(seconds, 3.0));
        let path = std::env::temp_dir().join(format!("{}.png", step.name));
        plot.save(&path)?;
        println!("{}\n   seconds   cones cd/m²    rods cd/m²   rod pigment   grey shown   white shown", path.display());
        for seconds in [0.0, 0.02, 0.08, 0.2, 0.5, 1.0, 10.0, 60.0, 300.0, 1200.0] {
            let state = step.state(seconds);
            println!(
                "{seconds:10} {:13.4} {:13.4} {:13.6} {:12.3} {:13.3}",
                state.cones.neural_cd_m2,
                state.rods.neural_cd_m2,
                state.rods.pigment,
                step.shown_cd_m2(seconds, 0.5),
                step.shown_cd_m2(seconds, 3.0)
            );
        }
    }
    Ok(())
}
