//! What the codes of a PNG file mean: their curve, primaries and pixels by its chunks, and the light of PQ codes.

use fechner_perception::display::{Display, Eotf};
use fechner_perception::primaries::{IDENTITY, Primaries, apply};
use fechner_perception::tone::gamut;
use rayon::prelude::*;

/// Transfer of sRGB (IEC 61966-2-1) in ITU-T H.273.
const SRGB_TRANSFER: u8 = 13;

/// Linear display RGB, 0 the display's black and 1 its white, of PQ codes (0 to 1) in these primaries;
/// [`write_png_for`](super::write_png_for) writes Rec.2020's. The display clips each channel at its black and its
/// white; a colour that Rec.709 does not reach is brought in at the luminance that it has.
pub fn decode_pq(codes: &[[f32; 3]], primaries: &Primaries, display: &Display) -> Vec<[f32; 3]> {
    let narrow = primaries.to(&Primaries::REC709).unwrap_or(IDENTITY);
    let relative = |code: f32| display.relative_of_emitted(Eotf::pq_cd_m2(f64::from(code)));
    let shown = |codes: &[f32; 3]| {
        let clipped = codes.map(|code| relative(code).clamp(0.0, 1.0));
        gamut::fit_into_display(apply(&narrow, clipped).map(|light| light as f32))
    };
    codes.par_iter().map(shown).collect()
}

/// What the codes of a PNG file mean by its chunks.
#[derive(Clone, Debug, PartialEq)]
pub struct PngColour {
    /// Curve of the codes.
    pub transfer: PngTransfer,
    /// Primaries of the codes; `None` where nothing says, or what is said is not known.
    pub primaries: Option<Primaries>,
    /// What it says and is not heeded, for whoever should know.
    pub notes: Vec<String>,
}

/// The curve of the codes of a PNG file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PngTransfer {
    /// PQ.
    Pq,
    /// Hybrid log-gamma.
    HybridLogGamma,
    /// sRGB, as anything else that is tagged is taken for.
    Srgb,
    /// Light itself.
    Linear,
    /// Nothing says.
    Untagged,
}

/// The colour of a file in memory, by its header; [`PngTransfer::Untagged`] for what is no PNG. Of what
/// contradicts itself the surest holds: cICP, then a colour profile, then sRGB, then a gamma and chromaticities
/// (PNG, third edition, 4.3).
pub fn png_colour(bytes: &[u8]) -> PngColour {
    let mut colour = PngColour { transfer: PngTransfer::Untagged, primaries: None, notes: Vec::new() };
    let Ok(reader) = png::Decoder::new(std::io::Cursor::new(bytes)).read_info() else { return colour };
    let info = reader.info();
    if let Some(tag) = info.coding_independent_code_points {
        read_code_points(tag, &mut colour);
    } else if let Some(profile) = &info.icc_profile {
        colour.transfer = PngTransfer::Srgb;
        if !names_srgb(profile) {
            colour.notes.push(PROFILE_NOT_READ.to_owned());
        }
    } else if info.srgb.is_some() {
        colour.transfer = PngTransfer::Srgb;
    } else {
        read_gamma(info, &mut colour);
    }
    colour
}

/// Of a cICP chunk.
fn read_code_points(tag: png::CodingIndependentCodePoints, colour: &mut PngColour) {
    let (primaries, transfer) = (tag.color_primaries, tag.transfer_function);
    colour.transfer = match transfer {
        8 => PngTransfer::Linear,
        16 => PngTransfer::Pq,
        18 => PngTransfer::HybridLogGamma,
        _ => PngTransfer::Srgb,
    };
    if colour.transfer == PngTransfer::Srgb && transfer != SRGB_TRANSFER {
        let note = format!("transfer {transfer} of its cICP chunk is not heeded: its codes are taken for sRGB");
        colour.notes.push(note);
    }
    if !tag.is_video_full_range_image {
        let note = "the narrow range that its cICP chunk says is not heeded: its codes are taken for the full range";
        colour.notes.push(note.to_owned());
    }
    colour.primaries = coded_primaries(primaries);
    if colour.primaries.is_none() {
        let note = format!("primaries {primaries} of its cICP chunk are not known, and taken for those of its curve");
        colour.notes.push(note);
    }
}

/// Gamma and chromaticities of files without a profile.
fn read_gamma(info: &png::Info<'_>, colour: &mut PngColour) {
    let point = |(x, y): (png::ScaledFloat, png::ScaledFloat)| [f64::from(x.into_value()), f64::from(y.into_value())];
    let chromaticities = info.chrm_chunk;
    colour.primaries = chromaticities
        .map(|c| Primaries { red: point(c.red), green: point(c.green), blue: point(c.blue), white: point(c.white) })
        .filter(|primaries| primaries.to_xyz().is_some());
    let Some(gamma) = info.gama_chunk.map(png::ScaledFloat::into_value) else { return };
    colour.transfer = if (gamma - 1.0).abs() < 0.02 { PngTransfer::Linear } else { PngTransfer::Srgb };
    if colour.transfer == PngTransfer::Srgb && (gamma * 2.2 - 1.0).abs() > 0.05 {
        colour.notes.push(format!("its gamma of {gamma} is not heeded: its codes are taken for sRGB"));
    }
}

/// What to say of a colour profile that does not call itself sRGB.
pub(crate) const PROFILE_NOT_READ: &str = "its colour profile is not read: its codes are taken for sRGB";

/// Whether a colour profile calls itself sRGB, in bytes or in words of two.
pub(crate) fn names_srgb(profile: &[u8]) -> bool {
    let has = |name: &[u8]| profile.windows(name.len()).any(|window| window == name);
    has(b"sRGB") || has(b"s\0R\0G\0B")
}

/// Primaries by their number in ITU-T H.273, table 2.
fn coded_primaries(number: u8) -> Option<Primaries> {
    match number {
        1 => Some(Primaries::REC709),
        9 => Some(Primaries::REC2020),
        12 => Some(Primaries::DISPLAY_P3),
        _ => None,
    }
}

/// Pixels that are square but for this are square: whole pixels a metre are rounded.
pub(super) const SQUARE_WITHIN: f64 = 1e-3;
/// Width over height that a pixel can have, as in an EXR file.
const PIXEL_ASPECT_RATIOS: std::ops::RangeInclusive<f64> = 0.01..=100.0;

/// Width of a pixel over its height by a PNG's chunk pHYs, in whatever unit; 1 for what says nothing or
/// nothing that a pixel can have.
pub fn png_pixel_aspect_ratio(bytes: &[u8]) -> f64 {
    let Ok(reader) = png::Decoder::new(std::io::Cursor::new(bytes)).read_info() else { return 1.0 };
    let Some(shape) = reader.info().pixel_dims else { return 1.0 };
    let ratio = f64::from(shape.yppu) / f64::from(shape.xppu);
    if PIXEL_ASPECT_RATIOS.contains(&ratio) && (ratio - 1.0).abs() >= SQUARE_WITHIN { ratio } else { 1.0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Each channel of the display clips for itself; then Rec.2020's colours keep the luminance that they have.
    /// Regression: green's was 20 % too much.
    #[test]
    fn pq_colours_outside_rec_709_keep_their_luminance() {
        let display = Display::preset("hdr-1000").unwrap();
        let code = |cd_m2: f64| Eotf::pq_code(cd_m2) as f32;
        let weights = Primaries::REC2020.to_xyz().unwrap()[1];
        for rgb in [[0.0, 300.0, 0.0], [900.0, 0.0, 20.0], [0.0, 0.0, 1000.0], [4000.0, 50.0, 0.0]] {
            let shown = decode_pq(&[rgb.map(code)], &Primaries::REC2020, &display)[0];
            let meant: f64 = rgb.iter().zip(weights).map(|(light, weight)| light.min(1000.0) * weight / 1000.0).sum();
            let found = f64::from(fechner_perception::photometry::luminance(shown));
            assert!((found / meant - 1.0).abs() < 2e-3, "{rgb:?}: {found} for {meant}");
            assert!(shown.iter().all(|light| (0.0..=1.0).contains(light)), "{shown:?}");
        }
    }

    #[test]
    fn what_a_tag_says_and_is_not_heeded_is_said() {
        let notes_of = |code_points: [u8; 4]| {
            let mut bytes = Vec::new();
            let mut writer = png::Encoder::new(&mut bytes, 1, 1).write_header().unwrap();
            writer.write_chunk(png::chunk::ChunkType(*b"cICP"), &code_points).unwrap();
            writer.write_image_data(&[7]).unwrap();
            writer.finish().unwrap();
            png_colour(&bytes).notes
        };
        for known in [[1, 13, 0, 1], [9, 16, 0, 1], [12, 8, 0, 1]] {
            assert!(notes_of(known).is_empty(), "{known:?}: {:?}", notes_of(known));
        }
        for transfer in [1, 4, 5, 17, 99] {
            let notes = notes_of([1, transfer, 0, 1]);
            assert!(notes.len() == 1 && notes[0].contains(&format!("transfer {transfer} ")), "{notes:?}");
        }
        assert!(notes_of([1, 13, 0, 0])[0].contains("narrow range"));
        assert!(notes_of([77, 13, 0, 1])[0].contains("primaries 77"));
    }
}
