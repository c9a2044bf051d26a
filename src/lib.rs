//! fechner: a path tracer that stops sampling where the eye stops seeing.
pub mod scene;
pub mod bsdf;
