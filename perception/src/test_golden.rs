//! The specification's tables of reference values, for the tests beside what they are about and for `tests/golden.rs`.

/// The tables as text; every table has a test that asks for it by its name.
pub(crate) const TABLES: &str = include_str!("../tests/golden.json");

/// Rows of one table: inputs, then the value. A table of one number is a row without inputs.
pub(crate) fn rows(name: &str) -> Vec<Vec<f64>> {
    let tables: serde_json::Value = serde_json::from_str(TABLES).expect("the tables are JSON");
    let rows = match &tables[name] {
        serde_json::Value::Number(value) => vec![vec![value.as_f64().expect("a number")]],
        rows => serde_json::from_value(rows.clone()).expect("rows of numbers"),
    };
    assert!(!rows.is_empty(), "no rows in {name}");
    rows
}

/// Compares `value(inputs)` with every row of a table, relative to it.
pub(crate) fn check(name: &str, tolerance: f64, value: impl Fn(&[f64]) -> f64) {
    for row in rows(name) {
        let (expected, inputs) = row.split_last().expect("a row");
        let found = value(inputs);
        assert!((found / expected - 1.0).abs() < tolerance, "{name} {inputs:?}: {found}, not {expected}");
    }
}
