//! Moving pictures as YUV4MPEG2 (.y4m): raw frames that every encoder and player of free software reads.
//!
//! 8 bits, no chroma subsampling, ITU-R BT.709 in the limited range (16 to 235); of these the header says the range,
//! and has no word for the matrix. Not for keeping: three bytes a pixel and frame.

use crate::output::fraction;
use fechner_perception::photometry::luminance;
use std::io::{self, Write};

/// Writes frames of one size.
pub struct Y4mWriter<W> {
    to: W,
    width: u32,
    height: u32,
}

impl<W: Write> Y4mWriter<W> {
    /// Begins a video of so many frames a second.
    ///
    /// # Errors
    /// Of the writer.
    pub fn new(mut to: W, width: u32, height: u32, frames_per_second: f64) -> io::Result<Self> {
        let (rate, scale) = fraction(frames_per_second);
        writeln!(to, "YUV4MPEG2 W{width} H{height} F{rate}:{scale} Ip A1:1 C444 XCOLORRANGE=LIMITED")?;
        Ok(Self { to, width, height })
    }

    /// Adds a frame of R′G′B′ bytes as a display takes them, row by row.
    ///
    /// # Errors
    /// Of the writer, and [`io::ErrorKind::InvalidInput`] for a frame of another size.
    pub fn frame(&mut self, rgb8: &[u8]) -> io::Result<()> {
        if rgb8.len() != 3 * self.width as usize * self.height as usize {
            return Err(io::Error::new(io::ErrorKind::InvalidInput, "a frame of another size"));
        }
        self.to.write_all(b"FRAME\n")?;
        let ycc: Vec<[u8; 3]> = rgb8.chunks_exact(3).map(|rgb| ycbcr709([rgb[0], rgb[1], rgb[2]])).collect();
        for channel in 0..3 {
            let plane: Vec<u8> = ycc.iter().map(|pixel| pixel[channel]).collect();
            self.to.write_all(&plane)?;
        }
        Ok(())
    }

    /// The end: what it was written to, flushed.
    ///
    /// # Errors
    /// Of the writer.
    pub fn finish(mut self) -> io::Result<W> {
        self.to.flush()?;
        Ok(self.to)
    }
}

/// ITU-R BT.709, limited range.
fn ycbcr709(rgb: [u8; 3]) -> [u8; 3] {
    let [red, green, blue] = rgb.map(|value| f32::from(value) / 255.0);
    let luma = luminance([red, green, blue]);
    let (blue, red) = ((blue - luma) / 1.8556, (red - luma) / 1.5748);
    [16.0 + 219.0 * luma, 128.0 + 224.0 * blue, 128.0 + 224.0 * red].map(|value| value.round().clamp(0.0, 255.0) as u8)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn primaries_are_where_the_standard_has_them() {
        assert_eq!(ycbcr709([0, 0, 0]), [16, 128, 128]);
        assert_eq!(ycbcr709([255, 255, 255]), [235, 128, 128]);
        assert_eq!(ycbcr709([255, 0, 0]), [63, 102, 240]);
        assert_eq!(ycbcr709([0, 0, 255]), [32, 240, 118]);
    }

    #[test]
    fn a_video_is_header_and_planes() {
        let mut video = Y4mWriter::new(Vec::new(), 2, 1, 23.976).expect("written");
        video.frame(&[0, 0, 0, 255, 255, 255]).expect("written");
        assert!(video.frame(&[0; 3]).is_err(), "another size");
        let bytes = video.finish().expect("written");
        let header = b"YUV4MPEG2 W2 H1 F24000:1001 Ip A1:1 C444 XCOLORRANGE=LIMITED\nFRAME\n";
        assert_eq!(&bytes[..header.len()], header);
        assert_eq!(bytes[header.len()..], [16, 235, 128, 128, 128, 128]);
    }
}
