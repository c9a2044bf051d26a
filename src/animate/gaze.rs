//! Where the viewers of a shot look, frame by frame, as an eye tracker says it.
//!
//! A table of lines `frame,x,y`: places in pixels of the rendered picture from its upper left corner. Several lines of
//! one frame are several viewers, or an eye on its way; what is nearest to any of them counts. In a frame without a
//! line nothing is known and everything may be looked at. A place outside the picture is refused: it is most often of
//! a picture of another size.

use fechner_perception::eccentricity::Gaze;
use std::collections::BTreeMap;

/// Where a shot is looked at.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct GazeTrack {
    frames: BTreeMap<u32, Vec<Gaze>>,
}

/// A line that is none of a gaze track's.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum GazeError {
    /// The line cannot be understood.
    #[error("line {line}: \"{text}\" is not a frame's number and a place in pixels, such as 12,640.5,360")]
    NoGaze {
        /// Its number, from 1.
        line: usize,
        /// What it says.
        text: String,
    },
    /// The gaze looks past the picture.
    #[error(
        "line {line}: {},{} is outside {width}x{height}: give places in pixels of the rendered picture, and no line at all for a frame \
         in which a viewer looks elsewhere", .gaze.x_px, .gaze.y_px
    )]
    Outside {
        /// Its number, from 1.
        line: usize,
        /// Where it looks.
        gaze: Gaze,
        /// Width of the picture in pixels.
        width: u32,
        /// Height of the picture in pixels.
        height: u32,
    },
}

impl GazeTrack {
    /// Reads a table for pictures of this size. Empty lines, what follows # and names in the first line that has
    /// anything else are passed over.
    ///
    /// # Errors
    /// [`GazeError`] for the first line that cannot be understood or is of no place in the picture.
    pub fn parse(table: &str, (width, height): (u32, u32)) -> Result<Self, GazeError> {
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
            let line = index + 1;
            let wrong = || GazeError::NoGaze { line, text: whole.chars().take(80).collect() };
            let (frame, gaze) = parse_line(text).ok_or_else(wrong)?;
            if !gaze.is_within(width, height) {
                return Err(GazeError::Outside { line, gaze, width, height });
            }
            track.frames.entry(frame).or_default().push(gaze);
        }
        Ok(track)
    }

    /// Where a frame is looked at; none where that is not known.
    pub fn of_frame(&self, frame: u32) -> &[Gaze] {
        self.frames.get(&frame).map_or(&[], Vec::as_slice)
    }

    /// The first and the last frame that it has a line of.
    pub fn frames(&self) -> Option<(u32, u32)> {
        Some((*self.frames.first_key_value()?.0, *self.frames.last_key_value()?.0))
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

    const SIZE: (u32, u32) = (640, 480);

    #[test]
    fn lines_are_gazes_of_frames() {
        let track = GazeTrack::parse("Frame, x, y\n\n3, 10, 20.5 # left\n3,600,20\n", SIZE).expect("a table");
        let gaze = |x_px, y_px| Gaze { x_px, y_px };
        assert_eq!(track.of_frame(3), [gaze(10.0, 20.5), gaze(600.0, 20.0)]);
        assert!(track.of_frame(5).is_empty());
        assert_eq!(track.frames(), Some((3, 3)));
        let commented = GazeTrack::parse("# tracker\n\nframe,x,y # in pixels\n3,10,20\n", SIZE)
            .expect("a table with a comment first");
        assert_eq!(commented.of_frame(3), [gaze(10.0, 20.0)]);
        assert!(GazeTrack::parse("3,10,20\nframe,x,y\n", SIZE).is_err(), "names come first");
        let marked = GazeTrack::parse("\u{feff}frame,x,y\r\n3,10,20\r\n", SIZE).expect("a table of a spreadsheet");
        assert_eq!(marked.of_frame(3), [gaze(10.0, 20.0)]);
    }

    #[test]
    fn what_is_no_gaze_is_refused_by_its_line() {
        for wrong in ["1,2", "1,2,3,4", "-1,2,3", "1.5,2,3", "1,nan,3", "1;2;3", "one,2,3", "1,2,inf"] {
            let error = GazeTrack::parse(&format!("0,1,1\n{wrong}\n"), SIZE).expect_err(wrong);
            assert_eq!(error, GazeError::NoGaze { line: 2, text: wrong.to_owned() });
        }
    }

    /// Regression: such a frame was rendered as if nothing were known of it, without a word.
    #[test]
    fn places_outside_the_picture_are_refused_by_their_line() {
        for outside in ["4,640.5,20", "4,20,481", "4,-1,20"] {
            let error = GazeTrack::parse(&format!("3,640,480\n{outside}\n"), SIZE).expect_err(outside).to_string();
            assert!(error.contains("line 2") && error.contains("is outside 640x480"), "{error}");
        }
    }
}
