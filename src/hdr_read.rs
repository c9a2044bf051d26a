//! What the header of a Radiance picture (.hdr) does to its values.
//!
//! Tools of Radiance leave the pixels of a picture that they brighten as bright as they made them, and say so in its header:
//! the light that was there is the value divided by all factors (Radiance's file formats, `EXPOSURE=` and `COLORCORR=`).

use image::codecs::hdr::{HdrDecoder, HdrMetadata};

/// The factors of a header, those of its lines multiplied.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HdrHeader {
    /// What red, green and blue are to be multiplied by.
    to_light: [f32; 3],
    /// Width of a pixel over its height; 1 where the file's is none that a pixel can have (0.01 to 100).
    pub pixel_aspect_ratio: f64,
}

impl HdrHeader {
    /// The header of a file's bytes; one that changes nothing where they are no Radiance picture.
    pub fn of(bytes: &[u8]) -> Self {
        HdrDecoder::new(bytes).map_or(Self { to_light: [1.0; 3], pixel_aspect_ratio: 1.0 }, |decoder| {
            Self::from_metadata(&decoder.metadata())
        })
    }

    fn from_metadata(metadata: &HdrMetadata) -> Self {
        let exposure = metadata.exposure.unwrap_or(1.0);
        let (red, green, blue) = metadata.color_correction.unwrap_or((1.0, 1.0, 1.0));
        let divisor = |factor: f32| if factor.is_finite() && factor > 0.0 { factor } else { 1.0 };
        // PIXASPECT is height over width.
        let height_over_width = f64::from(metadata.pixel_aspect_ratio.unwrap_or(1.0));
        Self {
            to_light: [red, green, blue].map(|correction| (divisor(exposure) * divisor(correction)).recip()),
            pixel_aspect_ratio: if (0.01..=100.0).contains(&height_over_width) {
                height_over_width.recip()
            } else {
                1.0
            },
        }
    }

    /// The light that a pixel's value stands for.
    pub fn light(&self, [red, green, blue]: [f32; 3]) -> [f32; 3] {
        [red * self.to_light[0], green * self.to_light[1], blue * self.to_light[2]]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn factors_of_all_lines_are_divided_by() {
        let picture = |lines: &str| {
            let mut bytes = format!("#?RADIANCE\n{lines}FORMAT=32-bit_rle_rgbe\n\n-Y 1 +X 1\n").into_bytes();
            bytes.extend([128, 128, 128, 128]);
            HdrHeader::of(&bytes)
        };
        assert_eq!(picture("EXPOSURE=8\n").light([0.5; 3]), [0.0625; 3]);
        let twice = picture("EXPOSURE=2\nEXPOSURE= 4\nCOLORCORR=1 0.5 2\nPIXASPECT=0.5\n");
        assert_eq!(twice.light([1.0; 3]), [0.125, 0.25, 0.0625]);
        assert_eq!(twice.pixel_aspect_ratio, 2.0);
        for useless in ["", "EXPOSURE=0\n", "EXPOSURE=-3\nPIXASPECT=0\n"] {
            assert_eq!(picture(useless).light([1.0; 3]), [1.0; 3], "{useless}");
            assert_eq!(picture(useless).pixel_aspect_ratio, 1.0, "{useless}");
        }
        assert_eq!(HdrHeader::of(b"words").light([3.0; 3]), [3.0; 3]);
    }
}
