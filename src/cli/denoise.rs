//! The option `--denoise`, and the pilot that it asks for. Whether the library is there is not known here.

use clap::ValueEnum;
use fechner::adaptive::settings::DENOISED_PILOT_SAMPLES_PER_PIXEL;
use fechner::denoise::DenoiserKind;
use fechner::integrator::PILOT_SAMPLES_PER_PIXEL;

/// What makes the output picture out of the mean.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
pub(super) enum DenoiseChoice {
    /// Nothing: the mean is the picture.
    #[default]
    None,
    /// A joint filter of our own, always there.
    Builtin,
    /// Intel's Open Image Denoise 2, where it is installed (OIDN_DIR, the system's, or the Python package pyoidn's).
    Oidn,
}

impl DenoiseChoice {
    /// Which denoiser, if any.
    pub(super) fn kind(self) -> Option<DenoiserKind> {
        match self {
            Self::None => None,
            Self::Builtin => Some(DenoiserKind::Builtin),
            Self::Oidn => Some(DenoiserKind::Oidn),
        }
    }

    /// Samples of every pixel before the first look.
    pub(super) fn pilot_samples(self) -> u32 {
        if self == Self::None { PILOT_SAMPLES_PER_PIXEL } else { DENOISED_PILOT_SAMPLES_PER_PIXEL }
    }
}
