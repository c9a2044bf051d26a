//! Sizes, crops and choices by name, as they are typed. What goes together is left to `rules`.

use anyhow::bail;
use clap::ValueEnum;
use fechner::integrator::Crop;
use fechner::sampler::{PixelFilter, Sequence};

#[derive(Clone, Copy, Debug)]
pub(in crate::cli) struct Size {
    pub(in crate::cli) width: u32,
    pub(in crate::cli) height: u32,
}

#[derive(Clone, Copy, Debug, ValueEnum)]
pub(in crate::cli) enum Quality {
    /// Visibility 4.
    Draft,
    /// Visibility 2.
    Preview,
    /// Visibility 1.
    Good,
    /// Visibility 0.5.
    Final,
    /// Visibility 0.25.
    Critical,
}

#[derive(Clone, Copy, Debug, ValueEnum)]
pub(super) enum SamplingChoice {
    /// Where the remaining error can be seen.
    Adaptive,
    /// The same everywhere. Where --time or --plans end it on the way from one count to the next, some pixels have
    /// the next already.
    Uniform,
    /// Another renderer's rule, for comparison: difference of two estimates over the square root of brightness
    /// (Cycles).
    Relative,
    /// For comparison: relative standard error of each pixel.
    Variance,
    /// For comparison: a budget (--spp) spread by relative variance of 4×4 pixels (Tungsten).
    Budget,
}

/// How the adaptive mode finds counts.
#[derive(Clone, Copy, Debug, ValueEnum)]
pub(super) enum AllocationChoice {
    /// The cheapest counts for the visibility pooled over the eye's window.
    Convex,
    /// Each pixel by its own threshold.
    Local,
}

#[derive(Clone, Copy, Debug, ValueEnum)]
pub(super) enum FilterChoice {
    /// One pixel wide.
    Box,
    /// Gaussian of σ 0.45 pixels.
    Gaussian,
    /// Window 3 pixels wide: a little sharper.
    BlackmanHarris,
    /// Cubic with negative lobes: sharpest, with --sampling uniform only.
    Mitchell,
}

#[derive(Clone, Copy, Debug, ValueEnum)]
pub(super) enum SequenceChoice {
    /// Neighbouring pixels are independent.
    PerPixel,
    /// Samples are spread over neighbouring pixels as well, in Z-order.
    ZOrder,
}

#[derive(Clone, Copy, Debug, ValueEnum)]
pub(super) enum PruneChoice {
    /// The eye's threshold at the luminance found so far (threshold versus intensity).
    Tvi,
}

impl Quality {
    pub(in crate::cli) fn visibility(self) -> f64 {
        match self {
            Quality::Draft => 4.0,
            Quality::Preview => 2.0,
            Quality::Good => 1.0,
            Quality::Final => 0.5,
            Quality::Critical => 0.25,
        }
    }
}

pub(in crate::cli) fn parse_size(text: &str) -> Result<Size, String> {
    let wrong = || format!("\"{text}\" is not a size; expected WIDTHxHEIGHT in pixels, such as 640x360");
    let (width, height) = text.split_once(['x', 'X', '×']).ok_or_else(wrong)?;
    let (width, height) = (width.parse().map_err(|_| wrong())?, height.parse().map_err(|_| wrong())?);
    if width == 0 || height == 0 { Err(wrong()) } else { Ok(Size { width, height }) }
}

/// X,Y,W,H in pixels of the full picture.
pub(super) fn parse_crop(text: &str) -> Result<Crop, String> {
    let wrong = || format!("\"{text}\" is not a crop; expected X,Y,WIDTH,HEIGHT in pixels, such as 100,50,64,64");
    let numbers: Vec<u32> = text.split(',').map(|n| n.trim().parse().map_err(|_| wrong())).collect::<Result<_, _>>()?;
    match numbers[..] {
        [x, y, width, height] if width > 0 && height > 0 => Ok(Crop { x, y, width, height }),
        _ => Err(wrong()),
    }
}

/// A crop must lie within the picture.
pub(super) fn check_crop(crop: Crop, size: Size) -> anyhow::Result<Crop> {
    let inside = |start: u32, extent: u32, whole: u32| u64::from(start) + u64::from(extent) <= u64::from(whole);
    if inside(crop.x, crop.width, size.width) && inside(crop.y, crop.height, size.height) {
        return Ok(crop);
    }
    let Crop { x, y, width, height } = crop;
    bail!("--crop {x},{y},{width},{height} reaches beyond the picture of {}x{} pixels", size.width, size.height)
}

impl FilterChoice {
    pub(super) fn filter(self) -> PixelFilter {
        match self {
            FilterChoice::Box => PixelFilter::Box,
            FilterChoice::Gaussian => PixelFilter::Gaussian,
            FilterChoice::BlackmanHarris => PixelFilter::BlackmanHarris,
            FilterChoice::Mitchell => PixelFilter::Mitchell,
        }
    }
}

impl SequenceChoice {
    pub(super) fn sequence(self) -> Sequence {
        match self {
            SequenceChoice::PerPixel => Sequence::PerPixel,
            SequenceChoice::ZOrder => Sequence::ZOrder,
        }
    }
}
