//! End-to-end and statistical tests, one binary.
//!
//! - `support`: scenes made in code, and rendering them
//! - `furnace`: energy: closed and open white furnaces with known answers
//! - `direct_light`: irradiance from a rectangle, a sphere, a point and an environment against closed forms
//! - `adaptive_render`: adaptive and uniform renders against a reference: bias, calibration, determinism
//! - `bad_input`: bad scene files, and our own ones
//! - `load_assets`: scenes that others made, sound and damaged
//! - `command_line`: the program as a user runs it
//! - `checkpoint`: renders stopped, continued and merged against renders in one go
//! - `kill`: the program, killed and resumed

mod adaptive_render;
mod bad_input;
mod checkpoint;
mod command_line;
mod direct_light;
mod furnace;
mod kill;
mod load_assets;
mod support;
