//! Reads what `tobj` makes of a text, and finds where its errors are.

use super::super::error::{LoadError, Place};
use super::libraries::Libraries;
use std::cell::{Cell, RefCell};
use std::io::{BufRead, Read};
use std::path::Path;

/// The objects of a text; the materials that it names are added to the libraries, if there are any.
pub(super) fn parse(
    path: &Path,
    text: &str,
    added_lines: usize,
    libraries: Option<&RefCell<Libraries>>,
) -> Result<Vec<tobj::Model>, LoadError> {
    let mut reader = CountingReader { rest: text.as_bytes(), lines: 0 };
    let options = tobj::LoadOptions { single_index: true, triangulate: false, ..tobj::LoadOptions::default() };
    let statements = Cell::new(0);
    let parsed = tobj::load_obj_buf(&mut reader, &options, |named| {
        let Some(libraries) = libraries else { return Ok(Default::default()) };
        libraries.borrow_mut().of_statement(statements.replace(statements.get() + 1), path, &named.to_string_lossy())
    });
    let line = reader.lines.saturating_sub(added_lines);
    let (models, _) = parsed.map_err(|error| explain(error, text, path, line, added_lines))?;
    match libraries.and_then(|libraries| libraries.borrow_mut().error.take()) {
        Some(error) => Err(error),
        None => Ok(models),
    }
}

/// Hands out text and counts the lines, because `tobj`'s errors have none.
struct CountingReader<'a> {
    rest: &'a [u8],
    lines: usize,
}

impl Read for CountingReader<'_> {
    fn read(&mut self, buffer: &mut [u8]) -> std::io::Result<usize> {
        let count = self.rest.len().min(buffer.len());
        buffer[..count].copy_from_slice(&self.rest[..count]);
        self.consume(count);
        Ok(count)
    }
}

impl BufRead for CountingReader<'_> {
    fn fill_buf(&mut self) -> std::io::Result<&[u8]> {
        Ok(self.rest)
    }

    fn consume(&mut self, count: usize) {
        self.lines += self.rest[..count].iter().filter(|&&byte| byte == b'\n').count();
        self.rest = &self.rest[count..];
    }
}

/// Our error for one of `tobj`'s; `line` is the last line that it has read.
fn explain(error: tobj::LoadError, text: &str, path: &Path, line: usize, added_lines: usize) -> LoadError {
    use tobj::LoadError as Cause;
    let find_bad_index =
        |text: &str| find_bad_index(text).map(|(line, problem)| (line.saturating_sub(added_lines), problem));
    let (line, problem) = match error {
        Cause::FaceVertexOutOfBounds | Cause::FaceTexCoordOutOfBounds | Cause::FaceNormalOutOfBounds => {
            // These are only noticed when the object ends: find the face.
            match find_bad_index(text) {
                Some((line, problem)) => (line, problem),
                None => (line, error.to_string()),
            }
        }
        Cause::PositionParseError => (line, "expected \"v x y z\" with three numbers".to_owned()),
        Cause::NormalParseError => (line, "expected \"vn x y z\" with three numbers".to_owned()),
        Cause::TexcoordParseError => (line, "expected \"vt u v\" with two numbers".to_owned()),
        Cause::FaceParseError => match find_bad_index(text) {
            Some((line, problem)) => (line, problem),
            None => (line, "expected a face as \"f v/vt/vn ...\", indices counted from 1".to_owned()),
        },
        Cause::InvalidPolygon => (line, "expected a face with at least three corners".to_owned()),
        other => (line, other.to_string()),
    };
    LoadError::invalid_at(Place::line(path, line.max(1)), problem)
}

/// The first face whose index names nothing, and how.
fn find_bad_index(text: &str) -> Option<(usize, String)> {
    let kind_of = |line: &str| match line.split_whitespace().next() {
        Some("v") => Some(0),
        Some("vt") => Some(1),
        Some("vn") => Some(2),
        _ => None,
    };
    let mut totals = [0_i64; 3];
    text.lines().filter_map(kind_of).for_each(|kind| totals[kind] += 1);
    let mut so_far = [0_i64; 3];
    for (number, line) in text.lines().enumerate() {
        if let Some(kind) = kind_of(line) {
            so_far[kind] += 1;
        }
        let Some(corners) = line.strip_prefix("f ") else {
            continue;
        };
        for corner in corners.split_whitespace() {
            for (kind, index) in corner.split('/').enumerate().take(3).filter(|(_, index)| !index.is_empty()) {
                let what = ["vertices", "texture coordinates", "normals"][kind];
                let Ok(value) = index.parse::<i64>() else {
                    return Some((number + 1, format!("\"{corner}\" is not a corner like v/vt/vn")));
                };
                if value == 0 || value > totals[kind] || value < -so_far[kind] {
                    return Some((number + 1, format!("face index {value}, but the file has {} {what}", totals[kind])));
                }
            }
        }
    }
    None
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_bad_index_is_found_with_its_line() {
        let text = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\nf 1 2 7\n";
        assert_eq!(find_bad_index(text), Some((5, "face index 7, but the file has 3 vertices".to_owned())));
        assert_eq!(find_bad_index("v 0 0 0\nf -1 -1 -2\n").unwrap().0, 2);
        assert_eq!(find_bad_index("v 0 0 0\nf 1 1 0\n").unwrap().0, 2);
    }
}
