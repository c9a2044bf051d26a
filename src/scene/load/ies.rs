//! Photometric webs of lamps from IES LM-63 files (`.ies`), editions of 1986, 1991, 1995, 2002 and 2019.
//!
//! Read is what says where light goes: type C photometry with its symmetries, in cd with the candela multiplier and the
//! ballast factor in it. Dimensions are not: a lamp is a point here. `TILT`, the output of lamps that lean, is noted
//! and not applied; types A and B, whose angles count otherwise, are refused. Values may stand on any lines, between
//! blanks or commas.

use super::error::{LoadError, Place};
use super::files;
use crate::digits::significant;
use crate::scene::PhotometricWeb;
use std::path::Path;

/// Most angles in one direction: a hundredth of a degree around the lamp.
const MAX_ANGLES: usize = 36_001;
/// Most intensities of a file: a web in steps of a fifth of a degree. Symmetries make up to four times as many of them,
/// 32 MB.
const MAX_INTENSITIES: usize = 2_000_000;
/// Least difference of two angles in degrees: nearer ones may round to one where symmetry mirrors them.
const LEAST_STEP_DEG: f64 = 1e-4;

/// The web in a file; `notes` gets a sentence for whatever was not taken as it stands.
pub(super) fn read(path: &Path, notes: &mut Vec<String>) -> Result<PhotometricWeb, LoadError> {
    let text = files::decode_loosely(path, files::read(path)?)?;
    let (tilt_line, tilt) = tilt_of(path, &text)?;
    let mut numbers = Numbers::behind(path, &text, tilt_line);
    skip_tilt(&mut numbers, tilt, tilt_line, notes)?;

    numbers.next("the number of lamps")?;
    numbers.next("the lumens per lamp")?;
    let multiplier = numbers.factor("the candela multiplier")?;
    let vertical_count = numbers.count("the number of vertical angles", 2)?;
    let horizontal_count = numbers.count("the number of horizontal angles", 1)?;
    if vertical_count * horizontal_count > MAX_INTENSITIES {
        let problem = format_args!(
            "{vertical_count} vertical by {horizontal_count} horizontal angles (line {}): at most {MAX_INTENSITIES} \
             intensities are read",
            numbers.line
        );
        return Err(LoadError::too_large(path, problem));
    }
    check_photometric_type(&mut numbers)?;
    for what in ["the units type", "the width", "the length", "the height"] {
        numbers.next(what)?;
    }
    let ballast = numbers.factor("the ballast factor")?;
    let reserved = numbers.next("the value after the ballast factor")?;
    let scale = match has_lamp_factor(&text) {
        true => multiplier * ballast * reserved.above_0("the ballast-lamp photometric factor", &numbers)?,
        false => multiplier * ballast,
    };
    numbers.next("the input watts")?;

    let vertical_deg = numbers.angles("vertical", vertical_count, 180.0)?;
    let horizontal_deg = numbers.angles("horizontal", horizontal_count, 360.0)?;
    let end_of_angles = numbers.line;
    let intensity_cd = numbers.intensities(vertical_count, horizontal_count, scale, notes)?;
    if let Some((line, _)) = numbers.words.next() {
        notes.push(format!("{}: what follows the last intensity is not read.", Place::line(path, line)));
    }
    let planes = horizontal_deg.into_iter().zip(intensity_cd.chunks_exact(vertical_count).map(<[f32]>::to_vec));
    let planes = all_around(planes.collect(), &Place::line(path, end_of_angles), notes)?;
    let (horizontal_deg, intensity_cd): (Vec<f32>, Vec<Vec<f32>>) = planes.into_iter().unzip();
    Ok(PhotometricWeb::new(vertical_deg, horizontal_deg, intensity_cd.concat()))
}

/// The number of the line `TILT=…`, counted from 1, and what it says. Before it everything is for people.
fn tilt_of<'a>(path: &Path, text: &'a str) -> Result<(usize, &'a str), LoadError> {
    let says = |line: &'a str| {
        let (key, said) = line.split_once('=')?;
        key.trim().eq_ignore_ascii_case("TILT").then_some(said.trim())
    };
    (1..).zip(text.lines()).find_map(|(number, line)| says(line).map(|said| (number, said))).ok_or_else(|| {
        LoadError::invalid(path, "no line TILT=NONE, TILT=INCLUDE or TILT=FILE: this is not an IES LM-63 file")
    })
}

/// Reads over an included table of lamps that lean.
fn skip_tilt(numbers: &mut Numbers, tilt: &str, line: usize, notes: &mut Vec<String>) -> Result<(), LoadError> {
    if tilt.eq_ignore_ascii_case("NONE") {
        return Ok(());
    }
    if tilt.eq_ignore_ascii_case("INCLUDE") {
        numbers.next("the lamp-to-luminaire geometry")?;
        let pairs = numbers.count("the number of tilt angles", 1)?;
        for _ in 0..pairs {
            numbers.next("a tilt angle")?;
        }
        for _ in 0..pairs {
            numbers.next("a tilt factor")?;
        }
    }
    let place = Place::line(numbers.file, line);
    notes.push(format!("{place}: TILT is not applied: the lamp gives as much light leaning as upright."));
    Ok(())
}

/// Whether what follows the ballast factor multiplies intensities: the ballast-lamp photometric factor of the editions
/// of 1986, which has no first line of its own, and 1991. Since 1995 it is reserved, since 2019 a code of how the file
/// was made.
fn has_lamp_factor(text: &str) -> bool {
    let first = text.lines().map(str::trim).find(|line| !line.is_empty()).unwrap_or_default();
    // Writers spell it "IESNA:LM-63-2002", "IES:LM-63-2019", "IESNA LM63-1995".
    let edition = first.to_ascii_uppercase().replace('-', "");
    let is_named = edition.contains("LM63");
    !is_named || edition.ends_with("86") || edition.ends_with("91")
}

fn check_photometric_type(numbers: &mut Numbers) -> Result<(), LoadError> {
    let kind = numbers.next("the photometric type")?;
    let name = match kind.value {
        1.0 => return Ok(()),
        2.0 => "B",
        3.0 => "A",
        _ => return Err(kind.error(numbers, "the photometric type is 1 (C), 2 (B) or 3 (A)")),
    };
    let problem = format!("photometry of type {name} is not read; type C (1) is");
    Err(LoadError::Unsupported { place: Place::line(numbers.file, kind.line), problem })
}

/// A plane of intensities at its horizontal angle in degrees.
type Plane = (f32, Vec<f32>);

/// The planes of a whole turn, of those that a file gives of it (LM-63-2002, section 5.15; 90° to 270° since 1995).
fn all_around(planes: Vec<Plane>, place: &Place, notes: &mut Vec<String>) -> Result<Vec<Plane>, LoadError> {
    let (Some(&(first, _)), Some(&(last, _))) = (planes.first(), planes.last()) else { return Ok(planes) };
    if planes.len() == 1 {
        return Ok(planes);
    }
    match (first, last) {
        (0.0, 360.0) => Ok(planes),
        (0.0, 90.0) => Ok(mirrored(mirrored(planes))),
        (0.0, 180.0) | (90.0, 270.0) => Ok(mirrored(planes)),
        (0.0, 180.0..) => {
            notes.push(format!(
                "{place}: the horizontal angles end at {last}°; from there intensity goes on to that of 0°."
            ));
            let again = (360.0, planes[0].1.clone());
            Ok(planes.into_iter().chain([again]).collect())
        }
        _ => Err(LoadError::invalid_at(
            place.clone(),
            format_args!(
                "horizontal angles are one alone, or run from 0 to 90, 180 or 360, or from 90 to 270, not from {first} to {last}"
            ),
        )),
    }
}

/// The planes, and on the other side of the last one the same again.
fn mirrored(planes: Vec<Plane>) -> Vec<Plane> {
    let last = planes.last().map_or(0.0, |(angle, _)| *angle);
    // Rounded once: what lies apart by LEAST_STEP_DEG stays apart.
    let mirror = |c: f32| (2.0 * f64::from(last) - f64::from(c)) as f32;
    let others: Vec<Plane> = planes.iter().rev().skip(1).map(|(c, plane)| (mirror(*c), plane.clone())).collect();
    planes.into_iter().chain(others).collect()
}

/// A number of the file and its line.
#[derive(Clone, Copy)]
struct Number {
    line: usize,
    /// Finite.
    value: f64,
}

impl Number {
    /// An error about it; `rule` is what would be right.
    fn error(self, numbers: &Numbers, rule: &str) -> LoadError {
        LoadError::invalid_at(
            Place::line(numbers.file, self.line),
            format_args!("{rule}, not {}", significant(self.value, 6)),
        )
    }

    fn above_0(self, what: &str, numbers: &Numbers) -> Result<f64, LoadError> {
        if self.value > 0.0 { Ok(self.value) } else { Err(self.error(numbers, &format!("{what} must be above 0"))) }
    }
}

/// The numbers of a file, one after another.
struct Numbers<'a> {
    file: &'a Path,
    /// Each with its line.
    words: Box<dyn Iterator<Item = (usize, &'a str)> + 'a>,
    /// Of the number read last.
    line: usize,
}

impl<'a> Numbers<'a> {
    /// Those behind a line.
    fn behind(file: &'a Path, text: &'a str, line: usize) -> Self {
        // Old files end in the control character of DOS for an end.
        let is_between = |c: char| c.is_whitespace() || c.is_control() || c == ',';
        let words = (1..).zip(text.lines()).skip(line).flat_map(move |(number, line)| {
            line.split(is_between).filter(|word| !word.is_empty()).map(move |word| (number, word))
        });
        Self { file, words: Box::new(words), line }
    }

    /// The next one; `what` names it where it is missing or no number.
    fn next(&mut self, what: impl std::fmt::Display) -> Result<Number, LoadError> {
        let place = |line| Place::line(self.file, line);
        let Some((line, word)) = self.words.next() else {
            return Err(LoadError::invalid_at(place(self.line), format_args!("the file ends before {what}")));
        };
        self.line = line;
        match word.parse() {
            Ok(value) if f64::is_finite(value) => Ok(Number { line, value }),
            _ => {
                let word: String = word.chars().take(40).collect();
                Err(LoadError::invalid_at(place(line), format_args!("expected {what}, found \"{word}\"")))
            }
        }
    }

    /// One that multiplies all intensities.
    fn factor(&mut self, what: &str) -> Result<f64, LoadError> {
        let number = self.next(what)?;
        number.above_0(what, self)
    }

    /// A whole number from `least` to [`MAX_ANGLES`].
    fn count(&mut self, what: &str, least: usize) -> Result<usize, LoadError> {
        let number = self.next(what)?;
        if number.value.fract() == 0.0 && (least as f64..=MAX_ANGLES as f64).contains(&number.value) {
            return Ok(number.value as usize);
        }
        Err(number.error(self, &format!("{what} must be a whole number from {least} to {MAX_ANGLES}")))
    }

    /// Rising angles from 0 to `most` degrees.
    fn angles(&mut self, kind: &str, count: usize, most: f64) -> Result<Vec<f32>, LoadError> {
        let mut angles: Vec<f32> = Vec::new();
        for _ in 0..count {
            let number = self.next(format_args!("{count} {kind} angles"))?;
            if !(0.0..=most).contains(&number.value) {
                return Err(number.error(self, &format!("{kind} angles lie in [0, {most}]")));
            }
            if let Some(&before) = angles.last()
                && number.value < f64::from(before) + LEAST_STEP_DEG
            {
                let rule = format!("{kind} angles must rise, by {LEAST_STEP_DEG} at the least: above {before}");
                return Err(number.error(self, &rule));
            }
            angles.push(number.value as f32);
        }
        Ok(angles)
    }

    /// Intensities in cd, plane after plane. Below 0 there is none: goniophotometers have an offset.
    fn intensities(
        &mut self,
        per_plane: usize,
        planes: usize,
        scale: f64,
        notes: &mut Vec<String>,
    ) -> Result<Vec<f32>, LoadError> {
        let mut intensities = Vec::new();
        let mut first_negative = None;
        for _ in 0..per_plane * planes {
            let number = self.next(format_args!("{planes} times {per_plane} intensities"))?;
            let intensity = (number.value * scale) as f32;
            if !intensity.is_finite() {
                return Err(number
                    .error(self, &format!("an intensity (times {}) must be below 3e38 cd", significant(scale, 6))));
            }
            if intensity < 0.0 {
                first_negative.get_or_insert(number.line);
            }
            intensities.push(intensity.max(0.0));
        }
        if let Some(line) = first_negative {
            notes.push(format!("{}: intensities below 0 are taken as 0.", Place::line(self.file, line)));
        }
        Ok(intensities)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::Vec3;

    fn read_text(text: &str) -> (Result<PhotometricWeb, String>, Vec<String>) {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.ies");
        std::fs::write(&path, text).unwrap();
        let own = |text: String| text.replace(&path.display().to_string(), "a.ies");
        let mut notes = Vec::new();
        let web = read(&path, &mut notes).map_err(|error| own(error.to_string()));
        (web, notes.into_iter().map(own).collect())
    }

    /// A file of three vertical angles; `horizontal` are its horizontal angles, `planes` their intensities.
    fn file(horizontal: &str, planes: &str) -> String {
        let count = horizontal.split_whitespace().count();
        format!(
            "IESNA:LM-63-2002\n[TEST] none\n[MANUFAC] nobody\nTILT=NONE\n\
             1 1000 1 3 {count} 1 2 0 0 0\n1 1 50\n0 45 90\n{horizontal}\n{planes}\n"
        )
    }

    /// Intensity at angles in degrees.
    fn at(web: &PhotometricWeb, gamma_deg: f32, c_deg: f32) -> f32 {
        let (gamma, c) = (gamma_deg.to_radians(), c_deg.to_radians());
        web.intensity_cd(Vec3::new(gamma.sin() * c.cos(), gamma.sin() * c.sin(), -gamma.cos()))
    }

    /// What each symmetry says of eight directions around the lamp, at γ = 45°.
    #[test]
    fn planes_are_repeated_by_their_symmetry() {
        let cases: [(&str, &str, [f32; 8]); 7] = [
            ("0", "9 1 0", [1.0; 8]),
            ("0 90", "9 1 0 9 3 0", [1.0, 2.0, 3.0, 2.0, 1.0, 2.0, 3.0, 2.0]),
            ("0 90 180", "9 1 0 9 3 0 9 7 0", [1.0, 2.0, 3.0, 5.0, 7.0, 5.0, 3.0, 2.0]),
            ("90 180 270", "9 1 0 9 3 0 9 7 0", [3.0, 2.0, 1.0, 2.0, 3.0, 5.0, 7.0, 5.0]),
            ("0 90 180 270 360", "9 1 0 9 3 0 9 7 0 9 5 0 9 1 0", [1.0, 2.0, 3.0, 5.0, 7.0, 6.0, 5.0, 3.0]),
            ("0 90 180 270", "9 1 0 9 3 0 9 7 0 9 5 0", [1.0, 2.0, 3.0, 5.0, 7.0, 6.0, 5.0, 3.0]),
            ("90", "9 1 0", [1.0; 8]),
        ];
        for (horizontal, planes, expected) in cases {
            let (web, notes) = read_text(&file(horizontal, planes));
            let web = web.unwrap();
            for (step, expected) in (0..).zip(expected) {
                let found = at(&web, 45.0, 45.0 * step as f32);
                assert!((found - expected).abs() < 1e-3, "{horizontal}: {found} at {}°", 45 * step);
            }
            assert!((at(&web, 0.0, 0.0) - 9.0).abs() < 1e-3 && at(&web, 100.0, 10.0) == 0.0, "{horizontal}");
            assert_eq!(notes.len(), usize::from(horizontal.ends_with("180 270") && horizontal.starts_with('0')));
        }
    }

    /// One web in the layouts of five editions: where factors stand, and what they multiply.
    #[test]
    fn editions_and_layouts_say_the_same() {
        let expected = read_text(&file("0 90", "90 40 0 90 10 0")).0.unwrap();
        let tail = "0 45 90\n0 90\n90 40 0\n90 10 0\n";
        let layouts = [
            format!("a lamp, tested by nobody\nTILT=NONE\n1 100 2 3 2 1 1 0 0 0\n1 0.5 50\n{tail}"),
            format!("\niesna:lm63-1995\nTILT=NONE\n1 -1 1 3 2 1 2 0 0 0\n1 2 50\n{tail}"),
            format!("IESNA91\r\n[TEST] x\r\nTILT=NONE\r\n1,100,2,3,2,1,1,0,0,0\r\n0.25,2,50\r\n{tail}\u{1a}"),
            format!("IESNA:LM-63-1995\n[MORE] TILTED\n  tilt = none \n1 -1 0.5\n3 2 1\n2 0 0 0\n2 7 50\n{tail}"),
            format!("\u{feff}IESNA:LM-63-1991\nTILT=NONE\n1 -1 0.5 3 2 1 2 0 0 0\n1 2 50\n{tail}"),
            "IES:LM-63-2019\nTILT=NONE\n1 1e3 1E+0 +3 2 1 2 .1 -.1 0. 1 1.10001 5\n0 45\n\n90 0, 90 90 40\n0 90 10 0"
                .to_owned(),
            format!("IESNA:LM-63-2002\nTILT=INCLUDE\n1\n2\n0 90\n1\n0.8\n1 -1 1 3 2 1 2 0 0 0\n1 1 50\n{tail}"),
            format!("IESNA:LM-63-2002\nTILT=other.tlt\n1 -1 1 3 2 1 2 0 0 0\n1 1 50\n{tail}"),
        ];
        for text in layouts {
            let (web, notes) = read_text(&text);
            assert_eq!(web.as_ref(), Ok(&expected), "{text}");
            let tilts = !text.to_lowercase().replace(' ', "").contains("tilt=none");
            assert_eq!(notes.len(), usize::from(tilts), "{notes:?}");
            assert!(notes.iter().all(|note| note.starts_with("a.ies:2: TILT is not applied")), "{notes:?}");
        }
    }

    #[test]
    fn what_is_not_taken_as_it_stands_is_noted() {
        let (web, notes) = read_text(&file("0", "9 -1 0\n-2"));
        assert_eq!(at(&web.unwrap(), 45.0, 0.0), 0.0);
        let expected =
            ["a.ies:9: intensities below 0 are taken as 0.", "a.ies:10: what follows the last intensity is not read."];
        assert_eq!(notes, expected);
        let (_, notes) = read_text(&file("0 200", "9 1 0 9 2 0"));
        assert_eq!(notes, ["a.ies:8: the horizontal angles end at 200°; from there intensity goes on to that of 0°."]);
    }

    /// What is wrong and what would be right, with its line.
    #[test]
    fn wrong_files_are_told_what_is_wrong() {
        let good = file("0 90", "9 1 0 9 3 0");
        assert!(read_text(&good).0.is_ok());
        let cases = [
            ("TILT=NONE\n", "", "a.ies: no line TILT=NONE, TILT=INCLUDE or TILT=FILE"),
            ("NONE", "INCLUDE", "a.ies:9: the file ends before a tilt angle"),
            ("1 1000", "one 1000", "a.ies:5: expected the number of lamps, found \"one\""),
            ("1 1000 1", "1 1000 0", "a.ies:5: the candela multiplier must be above 0, not 0"),
            ("1 1000 1", "1 1000 1e999", "a.ies:5: expected the candela multiplier, found \"1e999\""),
            (
                " 3 2 1 2",
                " 1 2 1 2",
                "a.ies:5: the number of vertical angles must be a whole number from 2 to 36001, not 1",
            ),
            (
                " 3 2 1 2",
                " 3 1.5 1 2",
                "a.ies:5: the number of horizontal angles must be a whole number from 1 to 36001, not 1.5",
            ),
            (" 3 2 1 2", " 3 -2 1 2", "not -2"),
            (
                " 3 2 1 2",
                " 30000 30000 1 2",
                "30000 vertical by 30000 horizontal angles (line 5): at most 2000000 intensities are read",
            ),
            (" 3 2 1 2", " 3 2 2 2", "a.ies:5: photometry of type B is not read; type C (1) is"),
            (" 3 2 1 2", " 3 2 3 2", "a.ies:5: photometry of type A is not read; type C (1) is"),
            (" 3 2 1 2", " 3 2 4 2", "a.ies:5: the photometric type is 1 (C), 2 (B) or 3 (A), not 4"),
            ("1 1 50", "0 1 50", "a.ies:6: the ballast factor must be above 0, not 0"),
            ("0 45 90", "0 45 45", "a.ies:7: vertical angles must rise, by 0.0001 at the least: above 45, not 45"),
            ("0 45 90", "0 45 190", "a.ies:7: vertical angles lie in [0, 180], not 190"),
            ("0 45 90", "-90 0 90", "a.ies:7: vertical angles lie in [0, 180], not -90"),
            (
                "\n0 90\n",
                "\n0 120\n",
                "a.ies:8: horizontal angles are one alone, or run from 0 to 90, 180 or 360, or from 90 to 270, not from 0 to 120",
            ),
            ("\n0 90\n", "\n10 90\n", "not from 10 to 90"),
            // Their mirror images would round to one: a panic.
            ("\n0 90\n", "\n0 0.000001\n", "must rise, by 0.0001 at the least: above 0, not 1e-6"),
            ("\n0 90\n", "\n89.99999 90\n", "must rise, by 0.0001 at the least: above 89.99999, not 90"),
            ("\n0 90\n", "\n90 90.000005\n", "must rise, by 0.0001 at the least: above 90, not 90"),
            ("\n0 90\n", "\n90 0\n", "a.ies:8: horizontal angles must rise, by 0.0001 at the least: above 90, not 0"),
            ("9 3 0", "9 nan 0", "a.ies:9: expected 2 times 3 intensities, found \"nan\""),
            ("9 3 0", "9 1e39 0", "a.ies:9: an intensity (times 1) must be below 3e38 cd, not 1e39"),
            ("9 3 0", "9 3", "a.ies:9: the file ends before 2 times 3 intensities"),
            ("0 45 90\n0 90\n9 1 0 9 3 0", "", "a.ies:6: the file ends before 3 vertical angles"),
        ];
        for (good_part, bad_part, expected) in cases {
            assert!(good.contains(good_part), "{good_part}");
            let message = read_text(&good.replacen(good_part, bad_part, 1)).0.expect_err(expected);
            assert!(message.contains(expected) && !message.contains('\n'), "{message}\n{expected}");
        }
        let old = "a lamp\nTILT=NONE\n1 100 1 3 1 1 1 0 0 0\n1 0 50\n0 45 90 0 9 1 0";
        let expected = "a.ies:4: the ballast-lamp photometric factor must be above 0, not 0";
        assert_eq!(read_text(old).0, Err(expected.to_owned()));
    }
}
