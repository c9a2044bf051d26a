//! Student's t, of any number of degrees of freedom: half widths of intervals.

/// More degrees of freedom than this are taken for this many: the quantile of 95 % is 1.962 there and 1.960 at
/// infinity.
const MAX_DEGREES: f64 = 1000.0;

/// The half width, in standard errors, of a two-sided interval of this level (0 to 1, without them): 12.7 for 95 % and
/// one degree of freedom, 1.96 for many. Degrees of freedom may be fractions, of one at least.
pub(crate) fn t_half_width(level: f64, degrees_of_freedom: f64) -> f64 {
    // What is not a number goes by the widest, too.
    let degrees = if degrees_of_freedom >= 1.0 { degrees_of_freedom.min(MAX_DEGREES) } else { 1.0 };
    let outside = 1.0 - level;
    let mut high = 1.0;
    while share_outside(high, degrees) > outside && high < 1e12 {
        high *= 2.0;
    }
    let mut low = 0.0;
    // As many halvings as a double has bits.
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        if share_outside(middle, degrees) > outside {
            low = middle;
        } else {
            high = middle;
        }
    }
    0.5 * (low + high)
}

/// Probability of |T| > t: the regularised incomplete beta function I(ν/2, ½) at ν / (ν + t²), by its series of
/// positive terms (Abramowitz and Stegun 1964, 26.5.4).
fn share_outside(t: f64, degrees: f64) -> f64 {
    let x = degrees / (degrees + t * t);
    if x >= 1.0 {
        return 1.0;
    }
    let a = 0.5 * degrees;
    let logarithm_of_beta = libm::lgamma(a) + libm::lgamma(0.5) - libm::lgamma(a + 0.5);
    let (mut sum, mut term, mut n) = (1.0, 1.0, 0.0);
    // A term is less than x times the one before, so that those left out come to less than term / (1 − x).
    while term > 1e-14 * sum * (1.0 - x) {
        term *= x * (a + 0.5 + n) / (a + 1.0 + n);
        sum += term;
        n += 1.0;
    }
    (a * x.ln() + 0.5 * (1.0 - x).ln() - logarithm_of_beta).exp() * sum / a
}

#[cfg(test)]
mod tests {
    use super::*;
    use statrs::distribution::{ContinuousCDF as _, StudentsT};

    #[test]
    fn half_widths_are_quantiles() {
        for degrees in [1.0, 1.3, 2.0, 2.7, 4.0, 9.5, 36.0, 250.0, 1000.0] {
            let truth = StudentsT::new(0.0, 1.0, degrees).expect("a distribution");
            for level in [0.5, 0.9, 0.95, 0.99] {
                let (found, wanted) = (t_half_width(level, degrees), truth.inverse_cdf(0.5 + 0.5 * level));
                assert!((found / wanted - 1.0).abs() < 1e-6, "{degrees}, {level}: {found}, not {wanted}");
            }
        }
    }

    #[test]
    fn it_ends_whatever_the_degrees() {
        let widest = t_half_width(0.95, 1.0);
        assert_eq!((t_half_width(0.95, f64::NAN), t_half_width(0.95, -3.0)), (widest, widest));
        assert!((t_half_width(0.95, f64::INFINITY) - 1.96).abs() < 0.003);
    }
}
