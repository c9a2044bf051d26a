//! What is known of a film's lamps before the first sample.

/// Lamps so small, or so blurred, that the first samples of a pixel may all pass them by: what the samples of each pixel, row-major, would find
/// of them.
#[derive(Clone, Debug, PartialEq)]
pub struct KnownLamps {
    pixels: Vec<KnownLamp>,
}

/// Of one pixel.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct KnownLamp {
    /// Of its samples, what meets such lamps.
    share: f32,
    /// What these bring to its mean: luminance in scene units.
    light: f32,
    /// Whether it is one of those that have much of one of them: at least half as much as the pixel that has the lamp's middle, or that a lens
    /// blurs it over.
    is_main: bool,
}

impl KnownLamps {
    /// None, of so many pixels.
    pub fn new(pixels: usize) -> Self {
        Self { pixels: vec![KnownLamp::default(); pixels] }
    }

    /// Adds a piece of a lamp of this luminance, scene units, that so much of a pixel's samples meets. `is_main`: it is one of those that
    /// have much of the lamp.
    pub fn add(&mut self, pixel: usize, share: f32, luminance: f32, is_main: bool) {
        let lamp = &mut self.pixels[pixel];
        lamp.share += share;
        lamp.light += share * luminance;
        lamp.is_main |= is_main;
    }

    /// Whether any pixel has much of a lamp.
    pub fn has_any(&self) -> bool {
        self.pixels.iter().any(|lamp| lamp.is_main && lamp.share > 0.0)
    }

    /// The share of a pixel's samples that meets lamps.
    pub fn share(&self, pixel: usize) -> f32 {
        self.pixels[pixel].share
    }

    /// The same in pixels that have much of a lamp; 0 in others.
    pub fn main_shares(&self) -> impl Iterator<Item = f32> {
        self.pixels.iter().map(|lamp| if lamp.is_main { lamp.share } else { 0.0 })
    }

    /// What lamps bring to a pixel's mean: luminance in scene units.
    pub fn light(&self, pixel: usize) -> f32 {
        self.pixels[pixel].light
    }
}
