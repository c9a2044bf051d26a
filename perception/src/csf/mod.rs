//! Contrast sensitivity functions: how little contrast a grating may have and still be seen.
//!
//! S = 1 / (contrast amplitude at threshold), contrast = amplitude / mean luminance. The threshold *amplitude* of a
//! grating of ρ cycles per degree on L cd/m² is therefore L / S(ρ, L) cd/m².

mod castle;

pub use castle::CastleCsf;

/// A contrast sensitivity function for static, achromatic gratings seen foveally.
pub trait ContrastSensitivity: Send + Sync {
    /// What the command line calls it.
    fn name(&self) -> &'static str;

    /// Sensitivity (1 / threshold contrast) at `freq_cpd` cycles per degree on a mean luminance of `luminance_cd_m2`.
    ///
    /// Finite and not negative for every finite frequency ≥ 0 and luminance ≥ 0; a luminance outside the model's
    /// domain is moved to its edge.
    fn sensitivity(&self, freq_cpd: f64, luminance_cd_m2: f64) -> f64;
}
