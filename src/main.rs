//! The command line of fechner.
fn main() {}
