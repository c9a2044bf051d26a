//! Writes `results.csv`: a line for each record.

use super::quote::csv_field;
use super::record::Record;

/// What a column holds.
type Cell = fn(&Record) -> String;

const COLUMNS: [(&str, Cell); 19] = [
    ("scene", |r| csv_field(&r.scene).into_owned()),
    ("arm", |r| r.arm.name().to_owned()),
    ("seed", |r| r.seed.map_or_else(|| "all".to_owned(), |seed| seed.to_string())),
    ("coverage", |r| r.coverage.to_string()),
    ("samples", |r| r.samples.to_string()),
    ("seconds", |r| r.seconds.to_string()),
    ("reached", |r| r.reached.to_string()),
    ("speedup_samples", |r| if_known(r.speedup_samples)),
    ("speedup_seconds", |r| if_known(r.speedup_seconds)),
    ("efficiency", |r| if_known(r.efficiency)),
    ("energy_bias", |r| if_known(r.energy_bias)),
    ("energy_bias_ci", |r| if_known(r.energy_bias_ci)),
    ("overshoot_fraction", |r| r.overshoot_fraction.to_string()),
    ("overhead", |r| r.overhead.to_string()),
    ("last_look", |r| r.last_look.to_string()),
    ("flip_mean", |r| r.flip_mean.to_string()),
    ("flip_p99", |r| r.flip_p99.to_string()),
    ("jod", |r| r.jod.to_string()),
    ("relmse", |r| r.relmse.to_string()),
];

/// A line a record below the columns' names; what is not known is empty.
pub(super) fn csv(records: &[Record]) -> String {
    let names = COLUMNS.map(|(name, _)| name.to_owned());
    let rows = records.iter().map(|record| COLUMNS.map(|(_, cell)| cell(record)));
    std::iter::once(names).chain(rows).map(|row| row.join(",") + "\n").collect()
}

fn if_known(value: Option<f64>) -> String {
    value.map_or_else(String::new, |value| value.to_string())
}
