//! What castleCSF says of patches that operators are built to keep at threshold: one threshold step (L / peak
//! sensitivity, 1 deg²) on a uniform scene, as a multiple of the threshold of the patch that the display shows. The
//! operators keep the thresholds of their own laws; this table says how far those laws are from today's.

use fechner_perception::tone::{SceneGuide, operator};
use fechner_perception::tvi::{ThresholdBase, base_threshold_cd_m2};
use fechner_perception::{CastleCsf, Plane, Viewing};

const NAMES: [&str; 8] = [
    "constant",
    "tumblin-rushmeier",
    "ward94",
    "ferwerda96",
    "ward-larson97",
    "pattanaik00",
    "durand-dorsey00",
    "reinhard02",
];
const LEVELS_CD_M2: [f64; 5] = [0.001, 0.1, 1.0, 10.0, 1000.0];

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let castle = CastleCsf::default();
    let threshold = |luminance: f64| base_threshold_cd_m2(luminance, ThresholdBase::CsfPeak(&castle));
    let viewing = Viewing::default();
    println!("{:18} {:>10} {:>10} {:>10} {:>10} {:>10}", "scene cd/m²", 0.001, 0.1, 1, 10, 1000);
    for name in NAMES {
        let operator = operator(name, None).ok_or("an operator of the list")?;
        print!("{name:18}");
        for level in LEVELS_CD_M2 {
            let guide = Plane::filled(8, 8, level as f32);
            let fitted = operator.fit(&SceneGuide::of(&guide), &viewing, None);
            let shown =
                |scene: f64| viewing.display.luminance_cd_m2(f64::from(fitted.relative_luminance(scene as f32)));
            let half = 0.5 * threshold(level);
            let step = shown(level + half) - shown(level - half);
            print!(" {:10.3}", step / threshold(shown(level)));
        }
        println!();
    }
    Ok(())
}
