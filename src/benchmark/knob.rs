//! Search for the setting of an arm's knob with which its picture ends at v\*. What is rendered at a setting is left to
//! the caller.

use anyhow::Result;

/// Most renders of one search.
const TRIES: usize = 4;
/// True v over v\* that ends a search: what is left is scaled away.
const NEAR_ENOUGH: std::ops::Range<f64> = 0.89..1.12;
/// Most that a knob is turned at once.
const MAX_STEP: f64 = 10.0;

/// Renders with ever better settings, and returns the render that came nearest to v\* by ratio. Knobs are like errors:
/// what is left scales with them. `render` returns a render and its true v over v\*.
///
/// # Errors
/// Those of `render`.
pub(super) fn nearest<T>(first: f64, mut render: impl FnMut(f64) -> Result<(T, f64)>) -> Result<T> {
    let (mut best, mut reached) = render(first)?;
    let mut least_distance = reached.ln().abs();
    let mut knob = first;
    for _ in 1..TRIES {
        if NEAR_ENOUGH.contains(&reached) {
            break;
        }
        knob /= reached.clamp(MAX_STEP.recip(), MAX_STEP);
        let rendered;
        (rendered, reached) = render(knob)?;
        // Of renders without any visible error the last, which took the fewest samples.
        if reached.ln().abs() <= least_distance {
            least_distance = reached.ln().abs();
            best = rendered;
        }
    }
    Ok(best)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The knobs that were tried and the one that was kept, for renders that reach these multiples of v\*.
    fn search(reached: &[f64]) -> (Vec<f64>, f64) {
        let mut tried = Vec::new();
        let kept = nearest(1.0, |knob| {
            tried.push(knob);
            Ok((knob, reached[tried.len() - 1]))
        });
        (tried, kept.expect("a render"))
    }

    #[test]
    fn the_best_try_is_kept_and_not_the_last() {
        assert_eq!(search(&[2.0, 1.2, 0.5, 3.0]), (vec![1.0, 0.5, 0.5 / 1.2, 0.5 / 1.2 / 0.5], 0.5));
        assert_eq!(search(&[2.0, 1.05]), (vec![1.0, 0.5], 0.5));
    }

    #[test]
    fn pictures_without_error_turn_the_knob_on() {
        assert_eq!(search(&[0.0; 4]).1, 1000.0);
        assert_eq!(search(&[0.0, 20.0, 1.5, 0.0]).1, 1.0);
    }
}
