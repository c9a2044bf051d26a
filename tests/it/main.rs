//! End-to-end and statistical tests, one binary.
//!
//! - `load_assets`: scenes that others made, sound and damaged

mod load_assets;
