//! fechner: a path tracer that stops sampling where the eye stops seeing.
pub mod bsdf;
pub mod exr_read;
pub mod output;
pub mod scene;
