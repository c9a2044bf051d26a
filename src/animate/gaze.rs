//! Where the viewers of a shot look, frame by frame, as an eye tracker says it.
//!
//! A table of lines `frame,x,y`: places in pixels of the rendered picture from its upper left corner. Several lines of one frame
//! are several viewers, or an eye on its way; what is nearest to any of them counts. In a frame without a line, or with one
//! outside the picture, nothing is known and everything may be looked at.

use fechner_perception::eccentricity::Gaze;
use std::collections::BTreeMap;

/// Where a shot is looked at.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct GazeTrack {
    frames: BTreeMap<u32, Vec<Gaze>>,
}

/// A line that is none of a gaze track's.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("line {line}: \"{text}\" is not a frame's number and a place in pixels, such as 12,640.5,360")]
pub struct GazeError {
    /// Its number, from 1.
    pub line: usize,
    /// What it says.
    pub text: String,
}

impl GazeTrack {
    /// Reads a table. Empty lines, what follows # and names in the first line that has anything else are passed over.
    ///
    /// # Errors
    /// [`GazeError`] for the first line that cannot be understood.
    pub fn parse(table: &str) -> Result<Self, GazeError> {
        let mut track = Self::default();
        // Spreadsheets begin UTF-8 with a mark of its byte order, which no trim takes for space.
        let table = table.strip_prefix('\u{feff}').unwrap_or(table);
        let mut may_be_head = true;
        for (index, whole) in table.lines().enumerate() {
            let text = whole.split('#').next().unwrap_or_default().trim();
            if text.is_empty() {
                continue;
            }
            let is_head = may_be_head && text.replace(' ', "").eq_ignore_ascii_case("frame,x,y");
            may_be_head = false;
            if is_head {
                continue;
            }
            let wrong = || GazeError { line: index + 1, text: whole.chars().take(80).collect() };
            let (frame, gaze) = parse_line(text).ok_or_else(wrong)?;
            track.frames.entry(frame).or_default().push(gaze);
        }
        Ok(track)
    }

    /// Where a frame of this size is looked at; none where that is not known.
    pub fn of_frame(&self, frame: u32, width: u32, height: u32) -> &[Gaze] {
        let gazes = self.frames.get(&frame).map_or(&[][..], Vec::as_slice);
        if gazes.iter().all(|gaze| gaze.is_within(width, height)) { gazes } else { &[] }
    }
}

fn parse_line(text: &str) -> Option<(u32, Gaze)> {
    let mut words = text.split(',').map(str::trim);
    let frame = words.next()?.parse().ok()?;
    let mut place = || words.next()?.parse::<f64>().ok().filter(|place| place.is_finite());
    let gaze = Gaze { x_px: place()?, y_px: place()? };
    words.next().is_none().then_some((frame, gaze))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_are_gazes_of_frames() {
        let track = GazeTrack::parse("Frame, x, y\n\n3, 10, 20.5 # left\n3,600,20\n4,700,20\n").expect("a table");
        let gaze = |x_px, y_px| Gaze { x_px, y_px };
        assert_eq!(track.of_frame(3, 640, 480), [gaze(10.0, 20.5), gaze(600.0, 20.0)]);
        assert!(track.of_frame(4, 640, 480).is_empty(), "who looks elsewhere may look back at any time");
        assert!(track.of_frame(5, 640, 480).is_empty());
        let commented =
            GazeTrack::parse("# tracker\n\nframe,x,y # in pixels\n3,10,20\n").expect("a table with a comment first");
        assert_eq!(commented.of_frame(3, 640, 480), [gaze(10.0, 20.0)]);
        assert!(GazeTrack::parse("3,10,20\nframe,x,y\n").is_err(), "names come first");
        let marked = GazeTrack::parse("\u{feff}frame,x,y\r\n3,10,20\r\n").expect("a table of a spreadsheet");
        assert_eq!(marked.of_frame(3, 640, 480), [gaze(10.0, 20.0)]);
    }

    #[test]
    fn what_is_no_gaze_is_refused_by_its_line() {
        for wrong in ["1,2", "1,2,3,4", "-1,2,3", "1.5,2,3", "1,nan,3", "1;2;3", "one,2,3", "1,2,inf"] {
            let error = GazeTrack::parse(&format!("0,1,1\n{wrong}\n")).expect_err(wrong);
            assert_eq!(error, GazeError { line: 2, text: wrong.to_owned() });
        }
    }
}
