use super::*;

const DISPLAY: DisplayRange = DisplayRange { least: 0.0, greatest: 4.605_170_185_988_092 };

/// Quantile of the standard normal distribution (Acklam's rational approximation with one step of Newton's).
fn normal_quantile(p: f64) -> f64 {
    let (mut low, mut high) = (-10.0, 10.0);
    for _ in 0..80 {
        let middle = 0.5 * (low + high);
        if normal_share(middle) < p { low = middle } else { high = middle }
    }
    0.5 * (low + high)
}

/// Share of the normal distribution below x, by its series.
fn normal_share(x: f64) -> f64 {
    let (mut term, mut sum) = (x, x);
    for index in 1..400 {
        term *= x * x / f64::from(2 * index + 1);
        sum += term;
    }
    0.5 + sum * (-0.5 * x * x).exp() / std::f64::consts::TAU.sqrt()
}

fn log_normal(deviation: f64) -> Histogram {
    let samples =
        (0..20_000).map(|i| 10.0_f64.powf(1.0 + deviation * normal_quantile((f64::from(i) + 0.5) / 20_000.0)));
    Histogram::of(samples.collect()).unwrap()
}

fn check(adjustment: &Adjustment, golden: &[(f64, f64)]) {
    for (scene, expected) in golden {
        let found = adjustment.display_cd_m2(*scene);
        assert!((found / expected - 1.0).abs() < 1e-3, "{scene}: {found} for {expected}");
    }
}

#[test]
fn golden_curves() {
    let linear = log_normal(0.5).adjust(DISPLAY, Ceiling::Linear);
    check(
        &linear,
        &[
            (0.1, 1.000_28),
            (1.0, 1.203_54),
            (3.0, 2.922_57),
            (10.0, 10.0),
            (30.0, 30.724_46),
            (100.0, 83.088_46),
            (1000.0, 99.972_19),
        ],
    );
    assert!(matches!(linear, Adjustment::Curve(Curve { passes: 7, .. })), "{linear}");
    // Where the published passes stop; ours go on from there and leave a little of the display's range, which makes
    // it 5 % darker here at 100 cd/m².
    let mut histogram = log_normal(0.5);
    let stop = histogram.trim_as_published(DISPLAY, Ceiling::Human).unwrap();
    let human = Adjustment::Curve(histogram.curve(DISPLAY, stop.before - stop.trimmed, stop.passes));
    check(&human, &[(1.0, 1.206_19), (3.0, 2.964_73), (10.0, 10.119_64), (30.0, 30.721_15), (100.0, 82.905_67)]);
    let settled = log_normal(0.5).adjust(DISPLAY, Ceiling::Human);
    for scene in [1.0, 10.0, 100.0] {
        let ratio = settled.display_cd_m2(scene) / human.display_cd_m2(scene);
        assert!((0.95..1.01).contains(&ratio), "{scene}: {ratio}");
    }
    let wide = log_normal(0.7).adjust(DISPLAY, Ceiling::Linear);
    check(&wide, &[(1.0, 1.447_94), (3.0, 2.999_15), (10.0, 10.0), (30.0, 30.24), (100.0, 69.063_87)]);
    assert!(matches!(wide, Adjustment::Curve(Curve { passes: 2, .. })), "{wide}");
}

#[test]
fn an_even_spread_of_six_decades_is_shown_with_a_third_of_its_slope() {
    let samples = (0..60_000).map(|i| 10.0_f64.powf(-2.0 + (f64::from(i) + 0.5) / 10_000.0)).collect();
    let adjustment = Histogram::of(samples).unwrap().adjust(DISPLAY, Ceiling::Linear);
    check(&adjustment, &[(1.0, 4.6416)]);
}

/// In each bin the displayed contrast is at most what can be seen of the scene's.
#[test]
fn no_contrast_is_exaggerated() {
    let range = DisplayRange { least: 0.2_f64.ln(), greatest: 200.0_f64.ln() };
    for (shift, deviation) in [(1.0, 0.7), (0.01, 1.0), (100.0, 1.2), (1.0, 2.0), (10.0, 0.6), (300.0, 0.8), (0.3, 1.5)]
    {
        let samples: Vec<f64> = (0..5000)
            .map(|i| shift * 10.0_f64.powf(deviation * normal_quantile((f64::from(i) + 0.5) / 5000.0)))
            .collect();
        let adjustment = Histogram::of(samples).unwrap().adjust(range, Ceiling::Human);
        // The second is too dark for any contrast of the display: the published fallback.
        let Adjustment::Curve(curve) = &adjustment else {
            assert!(shift < 0.1, "{adjustment}");
            continue;
        };
        let mut worst: f64 = 0.0;
        for bin in 0..BINS {
            let middle = curve.least + (bin as f64 + 0.5) * curve.step;
            let shown = curve.display_cd_m2(middle.exp());
            let slope = curve.range * (curve.cumulative[bin + 1] - curve.cumulative[bin]) / curve.step;
            worst = worst.max(slope / Ceiling::Human.contrast(middle.exp(), shown));
        }
        println!("{shift} {deviation}: {adjustment}, {worst}, ends at {}", curve.cumulative[BINS]);
        // The threshold curve has a step of 0.1 % where two formulas meet.
        assert!(worst < 1.001, "{shift} {deviation}: {worst}");
        assert!(*curve.cumulative.last().unwrap() > 1.0 - TOLERANCE, "{shift} {deviation}");
    }
}

#[test]
fn what_fits_or_is_nearly_nothing_is_scaled() {
    let narrow = Histogram::of(vec![5.0, 6.0, 7.0]).unwrap().adjust(DISPLAY, Ceiling::Human);
    assert!(matches!(narrow, Adjustment::Linear { .. }));
    let expected = tvi::combined(10.0) / tvi::combined(210.0_f64.cbrt());
    assert!((narrow.display_cd_m2(1.0) / expected - 1.0).abs() < 1e-9);
    let spikes = Histogram::of(vec![0.001, 0.1, 1.0, 100.0, 1e5]).unwrap().adjust(DISPLAY, Ceiling::Human);
    assert!(matches!(spikes, Adjustment::Linear { .. }), "{spikes}");
    assert!(Histogram::of(vec![]).is_none());
    assert!(matches!(Histogram::of(vec![3.0]).unwrap().adjust(DISPLAY, Ceiling::Linear), Adjustment::Linear { .. }));
}
