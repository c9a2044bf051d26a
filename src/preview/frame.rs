//! From colours to the bytes that viewers are sent, beside the render where it has threads for that.

use super::layer::Layer;
use super::shared::{Encoded, Shared};
use super::spectator::Stage;
use crate::output::false_colour::Colours;
use image::codecs::png::{CompressionType, FilterType, PngEncoder};
use image::{ExtendedColorType, ImageEncoder};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, AtomicUsize, Ordering};
use std::time::{Duration, Instant};

/// Quality of frames of a picture that changes, 1 to 100.
const JPEG_QUALITY: u8 = 92;

/// A layer's picture, to be encoded.
pub(super) struct Frame {
    pub(super) layer: Layer,
    pub(super) colours: Colours,
    pub(super) width: u32,
    pub(super) height: u32,
    /// Whether it is on its way or at rest; at rest it is exact.
    pub(super) stage: Stage,
}

/// What frames on their way cost the render.
#[derive(Default)]
pub(super) struct Encoding {
    under_way: AtomicUsize,
    /// Nanoseconds, of all threads, for the last frames that were encoded beside the render.
    cost_ns: AtomicU64,
}

impl Encoding {
    pub(super) fn is_under_way(&self) -> bool {
        self.under_way.load(Ordering::SeqCst) > 0
    }

    /// How much later samples are for the last frames that were encoded beside them.
    pub(super) fn cost(&self) -> Duration {
        Duration::from_nanos(self.cost_ns.load(Ordering::SeqCst))
    }

    /// Encodes the frames of one moment and publishes them: at once on a single thread, and at rest, as the last ones
    /// must not be late; else on the first of the pool's threads that is free, while the others go on.
    pub(super) fn publish(self: &Arc<Self>, frames: Vec<Frame>, shared: &Arc<Shared>) {
        let number = shared.number_a_frame();
        let threads = rayon::current_num_threads() as u64;
        if threads == 1 || frames.iter().all(|frame| frame.stage == Stage::AtRest) {
            self.cost_ns.store(0, Ordering::SeqCst);
            frames.iter().for_each(|frame| frame.publish(number, shared));
            return;
        }
        self.under_way.fetch_add(1, Ordering::SeqCst);
        let (encoding, shared) = (Arc::clone(self), Arc::clone(shared));
        rayon::spawn(move || {
            let begun = Instant::now();
            // Here a panic would end the program.
            let publish_all = AssertUnwindSafe(|| frames.iter().for_each(|frame| frame.publish(number, &shared)));
            let _ = catch_unwind(publish_all);
            encoding.cost_ns.store(begun.elapsed().as_nanos() as u64 / threads, Ordering::SeqCst);
            encoding.under_way.fetch_sub(1, Ordering::SeqCst);
        });
    }
}

impl Frame {
    /// A frame that cannot be encoded is left out; the next may be.
    fn publish(&self, number: u64, shared: &Shared) {
        if let Some(bytes) = self.encode() {
            shared.publish_frame(self.layer, Encoded { number, bytes: bytes.into() });
        }
    }

    /// The layer's number, the length of its legend, the legend in UTF-8, the picture. JPEG while it changes, PNG at
    /// rest; `None` if it cannot be encoded.
    fn encode(&self) -> Option<Vec<u8>> {
        let Self { layer, ref colours, width, height, stage } = *self;
        let legend = &colours.legend.as_bytes()[..colours.legend.floor_char_boundary(255)];
        let mut frame = vec![layer.index() as u8, legend.len() as u8];
        frame.extend_from_slice(legend);
        if stage == Stage::AtRest {
            let encoder = PngEncoder::new_with_quality(&mut frame, CompressionType::Fast, FilterType::Adaptive);
            encoder.write_image(&colours.rgb8, width, height, ExtendedColorType::Rgb8).ok()?;
        } else {
            let mut encoder = jpeg_encoder::Encoder::new(&mut frame, JPEG_QUALITY);
            // Noise has colours too, and is to be seen pixel by pixel.
            encoder.set_sampling_factor(jpeg_encoder::SamplingFactor::R_4_4_4);
            let [width, height] = [width, height].map(u16::try_from);
            encoder.encode(&colours.rgb8, width.ok()?, height.ok()?, jpeg_encoder::ColorType::Rgb).ok()?;
        }
        Some(frame)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::preview::shared::Seat;

    /// What changes is sent as JPEG of every pixel's own colour, what rests as the picture itself.
    #[test]
    fn frames_show_the_picture() {
        let pixel = |i: u32| if (i % 40 + i / 40).is_multiple_of(2) { [200, 40, 40] } else { [40, 40, 200] };
        let rgb8: Vec<u8> = (0..40 * 24).flat_map(pixel).collect();
        for (stage, tolerance) in [(Stage::AtRest, 0.0), (Stage::UnderWay, 8.0)] {
            let colours = Colours { rgb8: rgb8.clone(), legend: "legend".to_owned() };
            let frame = Frame { layer: Layer::Albedo, colours, width: 40, height: 24, stage };
            let frame = frame.encode().expect("a frame");
            assert_eq!((frame[0], &frame[1..8]), (Layer::Albedo.index() as u8, &b"\x06legend"[..]));
            let shown = image::load_from_memory(&frame[8..]).expect("a picture").to_rgb8();
            assert_eq!(shown.dimensions(), (40, 24));
            let square = |(a, b): (&u8, &u8)| (f64::from(*a) - f64::from(*b)).powi(2);
            let sum: f64 = shown.as_raw().iter().zip(&rgb8).map(square).sum();
            let rms = (sum / rgb8.len() as f64).sqrt();
            assert!(rms <= tolerance, "{rms} of 255 off, {stage:?}");
        }
    }

    /// JPEG has 16 bits for a side.
    #[test]
    fn a_picture_too_wide_for_a_frame_has_none() {
        let colours = || Colours { rgb8: vec![0; 3 * 65_536], legend: String::new() };
        let frame = |stage| Frame { layer: Layer::Picture, colours: colours(), width: 65_536, height: 1, stage };
        assert!(frame(Stage::UnderWay).encode().is_none());
        assert!(frame(Stage::AtRest).encode().is_some());
    }

    /// Also from threads of a pool, and none is shown after one that was made later.
    #[test]
    fn the_latest_frame_is_the_one_shown() {
        let shared = Arc::new(Shared::new());
        let encoding = Arc::new(Encoding::default());
        let seat = Seat::take(&shared, Layer::Picture);
        let frames = seat.frames();
        let frame = |grey: u8, stage| Frame {
            layer: Layer::Picture,
            colours: Colours { rgb8: vec![grey; 3 * 64], legend: String::new() },
            width: 8,
            height: 8,
            stage,
        };
        let pool = rayon::ThreadPoolBuilder::new().num_threads(2).build().expect("a pool");
        pool.install(|| {
            (0..50).for_each(|grey| encoding.publish(vec![frame(grey, Stage::UnderWay)], &shared));
            encoding.publish(vec![frame(200, Stage::AtRest)], &shared);
        });
        while encoding.is_under_way() {
            std::thread::yield_now();
        }
        let shown = image::load_from_memory(&frames.borrow().bytes[2..]).expect("a picture").to_rgb8();
        assert_eq!(shown.get_pixel(0, 0).0, [200; 3]);
    }
}
