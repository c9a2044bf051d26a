//! Frame rates as fractions, as videos and OpenEXR's own `framesPerSecond` tell them.

/// Frames a second of the sequence that a picture is of: [`write_exr`](super::write_exr) puts this attribute where the
/// format has it.
pub const FRAMES_PER_SECOND: &str = "framesPerSecond";

/// A frame rate as the format has it, numerator and denominator; `None` where it cannot be one.
pub(super) fn rational(frames_per_second: f32) -> Option<(i32, u32)> {
    let (frames, seconds) = fraction(f64::from(frames_per_second));
    Some((i32::try_from(frames).ok()?, u32::try_from(seconds).ok()?))
}

/// Frames a second as a fraction: 24000/1001 and its kin, else thousandths.
pub(crate) fn fraction(frames_per_second: f64) -> (u64, u64) {
    let ntsc = (frames_per_second * 1.001).round();
    if (frames_per_second - ntsc / 1.001).abs() < 1e-3 && frames_per_second.fract() > 1e-6 {
        return ((ntsc * 1000.0) as u64, 1001);
    }
    if frames_per_second.fract() < 1e-9 {
        return (frames_per_second as u64, 1);
    }
    ((frames_per_second * 1000.0).round() as u64, 1000)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::exr_read::read_exr;
    use crate::output::{Attribute, Picture, write_exr};

    #[test]
    fn rates_are_those_of_films_and_broadcasts() {
        for (rate, expected) in [(24.0, (24, 1)), (29.97, (30_000, 1001)), (12.5, (12_500, 1000))] {
            assert_eq!(fraction(rate), expected);
        }
    }

    #[test]
    fn a_rate_comes_back_as_a_fraction() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("a.exr");
        for (rate, expected) in [(24.0, 24.0_f64), (23.976, 24_000.0 / 1001.0), (12.5, 12.5)] {
            let mut picture = Picture::new(1, 1);
            picture.push_f32("Y", vec![1.0]);
            picture.push_attribute(FRAMES_PER_SECOND, Attribute::Float(rate));
            write_exr(&path, &picture).expect("written");
            let found = read_exr(&path).expect("an EXR file").frames_per_second();
            assert!(found.is_some_and(|found| (found / expected - 1.0).abs() < 1e-6), "{rate}: {found:?}");
            let bytes = std::fs::read(&path).expect("there");
            assert!(bytes.windows(24).any(|bytes| bytes == b"framesPerSecond\0rational"), "of another type");
        }
        let mut silent = Picture::new(1, 1);
        silent.push_f32("Y", vec![1.0]);
        write_exr(&path, &silent).expect("written");
        assert_eq!(read_exr(&path).expect("an EXR file").frames_per_second(), None);
    }
}
