//! fechner: a path tracer that stops sampling where the eye stops seeing.
//!
//! A scene is loaded ([`scene`]), prepared for rays ([`geometry`], [`light`], [`integrator`]) and rendered by
//! the loop in [`adaptive`]:
//!
//! 1. trace a pilot of 8 + 8 samples a pixel (2 + 2 of a picture that is denoised) into the two halves of a [`film`];
//! 2. make a guide (denoised, never output), see it on the display, and ask `fechner-perception` for a threshold map;
//! 3. weigh the film's remaining error against the thresholds: that is the visibility, 1 at threshold;
//! 4. find the fewest samples that bring every place below the target, plan them in doublings, trace them, and look
//!    again;
//! 5. stop when at most 0.1 % of the pixels are above the target, none above twice the target, and an audit by fresh
//!    samples agrees, and let a tone operator finish the picture ([`output`]).
//!
//! No formula of vision stands in this crate, and no ray in `fechner-perception`.

#![cfg_attr(not(test), deny(clippy::print_stdout, clippy::print_stderr))] // `say` instead: see there

pub mod adaptive;
pub mod animate;
pub mod benchmark;
pub mod bsdf;
pub mod checkpoint;
pub mod denoise;
pub mod digits;
pub mod exr_read;
pub mod farm;
pub mod film;
pub mod geometry;
pub mod hdr_read;
pub mod integrator;
pub mod jpeg_read;
pub mod json_file;
pub mod light;
pub mod lock;
pub mod output;
pub mod poison;
pub mod preview;
pub mod read_file;
pub mod sampler;
pub mod say;
pub mod scene;
pub mod sealed;
mod student;
