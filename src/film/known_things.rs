//! Keeps what is known of small things in a film before the first sample. They are found by the integrator.

/// Things so small, or so blurred, that the first samples of a pixel may all pass them by: what the samples of each
/// pixel, row-major, would find of them.
#[derive(Clone, Debug, PartialEq)]
pub struct KnownThings {
    pixels: Vec<KnownThing>,
}

/// What is known of one pixel.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct KnownThing {
    /// Share of the pixel's samples that meets small things.
    share: f32,
    /// What these bring to its mean, or take from it: luminance in scene units.
    light: f32,
    /// Whether it is to have samples for them, whatever they look like.
    is_urgent: bool,
}

impl KnownThings {
    /// Knowledge of no small things, of so many pixels.
    pub fn new(pixels: usize) -> Self {
        Self { pixels: vec![KnownThing::default(); pixels] }
    }

    /// Adds a piece of something of this luminance, or that differs by as much from what is around it, scene units,
    /// that so much of a pixel's samples meets. `is_urgent`: the pixel is to have samples for it, whatever it looks
    /// like.
    pub fn add(&mut self, pixel: usize, share: f32, luminance: f32, is_urgent: bool) {
        let thing = &mut self.pixels[pixel];
        thing.share += share;
        thing.light += share * luminance;
        thing.is_urgent |= is_urgent;
    }

    /// Whether any pixel has one.
    pub fn has_any(&self) -> bool {
        self.pixels.iter().any(|thing| thing.share > 0.0)
    }

    /// The share of a pixel's samples that meets small things.
    pub fn share(&self, pixel: usize) -> f32 {
        self.pixels[pixel].share
    }

    /// Shares of each pixel's samples that meet small things, in pixels that are to have samples for them, whatever
    /// they look like; 0 in others.
    pub fn urgent_shares(&self) -> impl Iterator<Item = f32> {
        self.pixels.iter().map(|thing| if thing.is_urgent { thing.share } else { 0.0 })
    }

    /// What small things bring to a pixel's mean, or take from it: luminance in scene units.
    pub fn light(&self, pixel: usize) -> f32 {
        self.pixels[pixel].light
    }
}
