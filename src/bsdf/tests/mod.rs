//! Statistical tests of every model, each model a row of [`cases`].
//!
//! Seeds are fixed, so a test that passes once passes always. Significance is stated per test function, for all of its
//! comparisons together (Šidák).

mod cases;
mod chi_square;
mod conventions;
mod energy_balance;
mod layers;
mod reciprocity;
mod robustness;
mod sphere;
mod statistics;
