//! Out of a theatre into sunlight, and from there into a cave: what is in view, what cones and rods are adapted to,
//! and what the display shows for a grey and for a white wall, over the time since the step from 1 ms to 1000 s. Two
//! pictures, named in what is printed; the first argument is the folder for them.

#[path = "support/log_plot.rs"]
mod log_plot;

use fechner_perception::tone::{
    AdaptationScope, AdaptationState, Goal, Kinetics, Pattanaik00, SceneGuide, ToneOperator as _,
};
use fechner_perception::{Plane, Viewing};
use log_plot::{Axis, Curve, log_plot};
use plotters::prelude::{RGBColor, SeriesLabelPosition};

/// A step of what is in view, cd/m².
struct Step {
    name: &'static str,
    title: &'static str,
    before: f64,
    after: f64,
    legend_at: SeriesLabelPosition,
}

const STEPS: [Step; 2] = [
    Step {
        name: "theatre_to_sun",
        title: "Out of a theatre (0.05 cd/m²) into sunlight (5000)",
        before: 0.05,
        after: 5000.0,
        legend_at: SeriesLabelPosition::LowerLeft,
    },
    Step {
        name: "sun_to_cave",
        title: "Out of sunlight (5000 cd/m²) into a cave (0.005)",
        before: 5000.0,
        after: 0.005,
        legend_at: SeriesLabelPosition::UpperRight,
    },
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
    let folder = std::env::args().nth(1).map_or_else(std::env::temp_dir, std::path::PathBuf::from);
    for step in &STEPS {
        let path = folder.join(format!("{}.svg", step.name));
        let curve = |label, colour: [u8; 3], value_at: Box<dyn Fn(f64) -> f64>| Curve {
            label,
            colour: RGBColor(colour[0], colour[1], colour[2]),
            value_at,
        };
        log_plot(
            &path,
            step.title,
            &Axis { label: "Seconds since the step", range: 1e-3..1e3 },
            &Axis { label: "cd/m²", range: 1e-3..1e4 },
            step.legend_at.clone(),
            &[
                curve("in view", [170; 3], Box::new(|_| step.after)),
                curve("cones are adapted to", [220, 60, 60], Box::new(|t| step.state(t).cones.neural_cd_m2)),
                curve("rods are adapted to", [60, 60, 220], Box::new(|t| step.state(t).rods.neural_cd_m2)),
                curve("display, white wall", [40, 160, 60], Box::new(|t| step.shown_cd_m2(t, 3.0))),
                curve("display, grey wall", [0; 3], Box::new(|t| step.shown_cd_m2(t, 0.5))),
            ],
        )?;
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
