//! What the benches share: errors in decibels.

/// Root mean square of errors, less `bias`.
pub(crate) fn rms(errors_db: &[f64], bias_db: f64) -> f64 {
    (errors_db.iter().map(|error| (error - bias_db).powi(2)).sum::<f64>() / errors_db.len() as f64).sqrt()
}

/// The middle one; 0 if there is none.
pub(crate) fn median(errors_db: &[f64]) -> f64 {
    let mut sorted = errors_db.to_vec();
    sorted.sort_by(f64::total_cmp);
    sorted.get(sorted.len() / 2).copied().unwrap_or(0.0)
}
