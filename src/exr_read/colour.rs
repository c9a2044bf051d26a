//! The colours that an EXR file means: its own primaries, luminance and chroma, the window that is to be shown.

use super::attributes::{COLOR_INTEROP_ID, linear_primaries};
use super::layers::luminance_layer;
use super::{ExrImage, Window};
use crate::output::Attribute;
use fechner_perception::photometry::{REC709_WEIGHTS, luminance};
use fechner_perception::primaries::{Primaries, apply};
use std::fmt;

/// The picture that a file is meant to show.
#[derive(Clone, Debug, PartialEq)]
pub struct ScenePicture {
    /// Width of the display window in pixels.
    pub width: u32,
    /// Height of the display window in pixels.
    pub height: u32,
    /// Linear Rec.709 RGB in the file's unit, finite, row-major; may be negative for colours outside Rec.709. Black
    /// where the file has no pixels.
    pub rgb: Vec<[f32; 3]>,
    /// What was done to it, a line each, for whoever should know.
    pub notes: Vec<String>,
}

impl ExrImage {
    /// The picture in linear Rec.709 RGB over the display window; `None` where there is neither R, G and B nor
    /// luminance.
    ///
    /// `find` finds a channel R, G or B by its last name (renderers prefix layers). Without them X, Y and Z of the
    /// layer that has luminance ([`luminance_layer`]) are CIE XYZ. Chromaticities are honoured: colours stay what they
    /// are, white included. Not finite values become 0 (NaN, −∞) or (∞) the largest finite value of the picture, at
    /// least 65504: what overflows a half is a lamp or the sun, brighter than all else.
    pub fn scene_picture<'a>(&'a self, find: impl Fn(&'a Self, &str) -> Option<&'a [f32]>) -> Option<ScenePicture> {
        let mut notes = Vec::new();
        let mut primaries = self.chromaticities.unwrap_or(Primaries::REC709);
        let of_three = |[red, green, blue]: [&[f32]; 3]| -> Vec<[f32; 3]> {
            red.iter().zip(green).zip(blue).map(|((&r, &g), &b)| [r, g, b]).collect()
        };
        let luminance = luminance_layer(&self.names()).map(|layer| layer.name);
        let own = |part: &str| self.part(luminance?, part);
        let mut rgb: Vec<[f32; 3]> = if let Some(channels) = all(["R", "G", "B"].map(|name| find(self, name))) {
            of_three(channels)
        } else if let Some(channels) = all(["X", "Y", "Z"].map(own)) {
            notes.push("channels X, Y and Z taken for CIE XYZ".to_owned());
            primaries = Primaries::XYZ;
            of_three(channels)
        } else if let Some([luminance, red, blue]) = all(["Y", "RY", "BY"].map(own)) {
            notes.push("luminance and chroma made RGB again".to_owned());
            from_chroma(luminance, red, blue, &primaries)
        } else {
            own("Y")?.iter().map(|&y| [y; 3]).collect()
        };
        notes.extend(make_finite(&mut [rgb.as_flattened_mut()]).map(|replaced| replaced.to_string()));
        if let Some(matrix) = primaries.to_other(&Primaries::REC709) {
            rgb.iter_mut().for_each(|pixel| *pixel = apply(&matrix, pixel.map(f64::from)).map(|c| c as f32));
            if self.chromaticities == Some(primaries) {
                notes.push("colours brought from the file's chromaticities to Rec.709".to_owned());
            }
            make_finite(&mut [rgb.as_flattened_mut()]);
        }
        if self.chromaticities.is_some_and(|own| own.to(&Primaries::REC709).is_none()) {
            notes.push("its chromaticities span no colours, and are not looked at".to_owned());
        }
        notes.extend(self.colour_space_not_heeded());
        if self.lines_left_out > 0 {
            notes.push(format!("the last {} lines could not be read", self.lines_left_out));
        }
        let Window { width, height, .. } = self.display_window;
        if self.data_window() != self.display_window {
            let (w, h, (x, y)) = (self.width, self.height, self.data_window_origin);
            notes.push(format!("data of {w}x{h} pixels at ({x}, {y}) put into a window of {width}x{height}"));
            rgb = self.data_window().put_into(&self.display_window, rgb, [0.0; 3]);
        }
        if self.is_display_window_left_out {
            notes.push("its display window cannot be shown: all of the data is".to_owned());
        }
        Some(ScenePicture { width, height, rgb, notes })
    }

    /// What to say of a named colour space that is not linear light of known primaries. Data has no colours, and other
    /// parts of a file may be some.
    fn colour_space_not_heeded(&self) -> Option<String> {
        let Some(Attribute::Text(id)) = self.attribute(COLOR_INTEROP_ID) else { return None };
        let is_heeded = linear_primaries(id).is_some() || ["data", "unknown"].contains(&id.as_str());
        let taken_for = if self.chromaticities.is_some() { "its chromaticities" } else { "Rec.709" };
        (!is_heeded).then(|| {
            format!(
                "its {COLOR_INTEROP_ID} \"{id}\" is not heeded: its colours are taken for linear light of {taken_for}"
            )
        })
    }

    pub(super) fn data_window(&self) -> Window {
        // Lines that could not be read leave a black border, which is said.
        Window { origin: self.data_window_origin, width: self.width, height: self.height }
    }

    /// A channel's values over the display window; 0 where the file has no pixels.
    pub fn in_display_window(&self, channel: Vec<f32>) -> Vec<f32> {
        self.data_window().put_into(&self.display_window, channel, 0.0)
    }
}

fn all<T>([first, second, third]: [Option<T>; 3]) -> Option<[T; 3]> {
    Some([first?, second?, third?])
}

/// RY = (R − Y) / Y and BY = (B − Y) / Y, with Y the luminance by the file's own primaries.
fn from_chroma(luminance: &[f32], red: &[f32], blue: &[f32], primaries: &Primaries) -> Vec<[f32; 3]> {
    let weights = primaries.to_xyz().map_or(REC709_WEIGHTS.map(f64::from), |matrix| matrix[1]);
    let [wr, wg, wb] = weights.map(|weight| weight as f32);
    let pixels = luminance.iter().zip(red.iter().zip(blue));
    pixels
        .map(|(&y, (&ry, &by))| {
            let (r, b) = ((ry + 1.0) * y, (by + 1.0) * y);
            [r, (y - r * wr - b * wb) / wg, b]
        })
        .collect()
}

/// Largest finite half float: light that a half could not hold is at least that bright, in the file's unit.
const LARGEST_HALF: f32 = 65504.0;

/// Values that were not finite.
pub(crate) struct Replaced {
    count: usize,
    /// What stands for infinity: the largest value of the picture or of a half. NaN and −∞ are no light at all, and
    /// become 0.
    infinity: f32,
}

impl fmt::Display for Replaced {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { count, infinity } = self;
        write!(f, "{count} values that are not finite were replaced: infinity by {infinity}, others by 0")
    }
}

/// Replaces what would poison all that it meets; `None` where there is nothing to replace.
pub(crate) fn make_finite(channels: &mut [&mut [f32]]) -> Option<Replaced> {
    let values = || channels.iter().flat_map(|channel| channel.iter().copied());
    let count = values().filter(|value| !value.is_finite()).count();
    if count == 0 {
        return None;
    }
    let infinity = values().filter(|value| value.is_finite()).fold(LARGEST_HALF, f32::max);
    for value in channels.iter_mut().flat_map(|channel| channel.iter_mut()).filter(|value| !value.is_finite()) {
        *value = if *value == f32::INFINITY { infinity } else { 0.0 };
    }
    Some(Replaced { count, infinity })
}

/// What to say of pixels that take light away, which none is seen to do: black is shown. Not of colours outside
/// Rec.709, which have negative channels and a luminance above 0.
pub fn negative_light<'a>(rgb: impl IntoIterator<Item = &'a [f32; 3]>) -> Option<String> {
    // What other primaries than the file's make of black and of colours at the edge of what is seen.
    const ROUNDING: f32 = 1e-5;
    let is_negative = |rgb: &&[f32; 3]| {
        let largest = rgb.iter().fold(0.0_f32, |largest, value| largest.max(value.abs()));
        luminance(**rgb) < -ROUNDING * largest
    };
    let count = rgb.into_iter().filter(is_negative).count();
    (count > 0).then(|| format!("luminance below 0 in {count} pixels was replaced by black"))
}

#[cfg(test)]
mod tests {
    use super::super::tests::asset;
    use super::super::{decode_exr, read_exr};
    use super::*;
    use std::path::Path;

    fn picture(path: &Path) -> ScenePicture {
        read_exr(path).unwrap().scene_picture(|image, name| image.channel(name)).unwrap()
    }

    /// Root mean square of the relative difference of pixels, over those that are not dark.
    fn difference(a: &ScenePicture, b: &ScenePicture) -> f64 {
        let (mut sum, mut count) = (0.0, 0.0);
        for (a, b) in a.rgb.iter().zip(&b.rgb) {
            let scale = f64::from(a[0] + a[1] + a[2]) / 3.0;
            if scale > 0.02 {
                sum += a.iter().zip(b).map(|(a, b)| (f64::from(a - b) / scale).powi(2)).sum::<f64>() / 3.0;
                count += 1.0;
            }
        }
        (sum / count).sqrt()
    }

    /// One photograph as Rec.709, XYZ, and both as luminance and chroma.
    #[test]
    fn one_picture_in_four_forms_is_one_picture() {
        let Some(path) = asset("hdr/openexr-images/Chromaticities/Rec709.exr") else { return };
        let reference = picture(&path);
        for (name, tolerance) in [("XYZ", 0.01), ("Rec709_YC", 0.06), ("XYZ_YC", 0.06)] {
            let other = picture(&path.with_file_name(format!("{name}.exr")));
            assert_eq!((other.width, other.height), (610, 406), "{name}");
            let found = difference(&reference, &other);
            println!("{name}: {found:.4} of the luminance, {:?}", other.notes);
            assert!(found < tolerance, "{name}: {found}");
        }
    }

    #[test]
    fn luminance_alone_is_a_grey_picture() {
        let Some(path) = asset("hdr/openexr-images/LuminanceChroma/Garden.exr") else { return };
        let garden = picture(&path);
        assert_eq!((garden.width, garden.height), (874, 493));
        assert!(garden.rgb.iter().all(|[r, g, b]| r == g && g == b));
    }

    #[test]
    fn what_is_not_finite_is_replaced_and_said() {
        let Some(path) = asset("hdr/openexr-images/TestImages/BrightRingsNanInf.exr") else { return };
        let rings = picture(&path);
        assert!(rings.rgb.iter().flatten().all(|value| value.is_finite()));
        assert!(rings.notes.iter().any(|note| note.contains("not finite")), "{:?}", rings.notes);
    }

    /// The sun of a sky in half floats.
    #[test]
    fn what_overflowed_is_brighter_than_all_else() {
        let replaced = |values: [f32; 3]| {
            let mut rgb = [values];
            make_finite(&mut [rgb.as_flattened_mut()]);
            rgb[0]
        };
        assert_eq!(replaced([10.0, f32::INFINITY, f32::NAN]), [10.0, 65504.0, 0.0]);
        assert_eq!(replaced([f32::INFINITY; 3]), [65504.0; 3]);
        assert_eq!(replaced([1e6, f32::INFINITY, f32::NEG_INFINITY]), [1e6, 1e6, 0.0]);
    }

    #[test]
    fn light_below_zero_is_told_and_wide_colours_are_not() {
        // The green of Rec.2020 and a blue at the edge of what is seen, in Rec.709.
        let wide = [[-0.59, 1.13, -0.1], [0.3, -0.09, 0.1], [0.0; 3], [1.0; 3]];
        assert_eq!(negative_light(&wide), None);
        let told = negative_light(wide.iter().chain(&[[-0.5; 3], [0.1, -0.1, 0.1]])).unwrap();
        assert!(told.contains("2 pixels"), "{told}");
    }

    /// A file of ours with its windows and chromaticities changed by hand.
    #[test]
    fn the_data_is_put_into_the_display_window() {
        use crate::output::{Picture, write_exr};
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.exr");
        let mut file = Picture::new(4, 2);
        for name in ["R", "G", "B"] {
            file.push_f32(name, (0..8).map(|i| i as f32).collect::<Vec<_>>());
        }
        write_exr(&path, &file).unwrap();
        let mut bytes = std::fs::read(&path).unwrap();
        let name = b"displayWindow\0box2i\0";
        let at = bytes.windows(name.len()).position(|window| window == name).unwrap() + name.len() + 4;
        for (index, value) in [-1_i32, 1, 2, 2].into_iter().enumerate() {
            bytes[at + 4 * index..at + 4 * index + 4].copy_from_slice(&value.to_le_bytes());
        }
        let shown = decode_exr(&path, &bytes).unwrap().scene_picture(|image, name| image.channel(name)).unwrap();
        assert_eq!((shown.width, shown.height), (4, 2));
        let reds: Vec<f32> = shown.rgb.iter().map(|pixel| pixel[0]).collect();
        assert_eq!(reds, [0.0, 4.0, 5.0, 6.0, 0.0, 0.0, 0.0, 0.0]);
    }
}
