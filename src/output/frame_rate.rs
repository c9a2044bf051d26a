//! The frame rate that a frame's EXR file tells in OpenEXR's own `framesPerSecond`, a fraction.

use crate::animate::video::fraction;
use ::exr::meta::MetaData;
use std::path::Path;

/// Frames a second of the sequence that a picture is of: [`write_exr`](super::write_exr) puts this attribute where the format has it.
pub const FRAMES_PER_SECOND: &str = "framesPerSecond";

/// As the format has it.
pub(super) fn rational(frames_per_second: f32) -> Option<(i32, u32)> {
    let (frames, seconds) = fraction(f64::from(frames_per_second));
    Some((i32::try_from(frames).ok()?, u32::try_from(seconds).ok()?))
}

/// What an EXR file says of its rate, if anything.
pub fn frames_per_second_of(path: &Path) -> Option<f64> {
    let header = MetaData::read_from_file(path, false).ok()?.headers.into_iter().next()?;
    let (frames, seconds) = header.own_attributes.frames_per_second?;
    let rate = f64::from(frames) / f64::from(seconds);
    (rate.is_finite() && rate > 0.0).then_some(rate)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::output::{Attribute, Picture, write_exr};

    #[test]
    fn a_rate_comes_back_as_a_fraction() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("a.exr");
        for (rate, expected) in [(24.0, 24.0), (23.976, 24_000.0 / 1001.0), (12.5, 12.5)] {
            let mut picture = Picture::new(1, 1);
            picture.push_f32("Y", vec![1.0]);
            picture.push_attribute(FRAMES_PER_SECOND, Attribute::Float(rate));
            write_exr(&path, &picture).expect("written");
            assert_eq!(frames_per_second_of(&path), Some(expected), "{rate}");
            let bytes = std::fs::read(&path).expect("there");
            assert!(bytes.windows(24).any(|bytes| bytes == b"framesPerSecond\0rational"), "of another type");
        }
        let mut silent = Picture::new(1, 1);
        silent.push_f32("Y", vec![1.0]);
        write_exr(&path, &silent).expect("written");
        assert_eq!(frames_per_second_of(&path), None);
    }
}
