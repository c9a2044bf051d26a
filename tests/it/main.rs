//! End-to-end and statistical tests, one binary.
//!
//! - `support`: scenes made in code, and rendering them
//! - `furnace`: energy: closed and open white furnaces with known answers
//! - `direct_light`: irradiance from a rectangle, a sphere, a point and an environment against closed forms
//! - `adaptive_render`: adaptive and uniform renders against a reference: bias, calibration, determinism
//! - `command_line`: the program as a user runs it

mod adaptive_render;
mod command_line;
mod direct_light;
mod furnace;
mod support;
