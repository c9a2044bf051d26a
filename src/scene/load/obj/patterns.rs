//! Faces by what their corners have: positions alone, or texture coordinates or normals beside them.
//!
//! `tobj` keeps one array of each for an object, which belong together only where all of its faces have the same. So a
//! file of several kinds of faces is read once for each, with the lines of all the others left empty.

use std::borrow::Cow;

/// Whether all corners of a face have texture coordinates and normals.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Pattern {
    has_uvs: bool,
    has_normals: bool,
}

/// A face's corners: what all of them have, and whether some have more.
struct Corners {
    pattern: Pattern,
    are_ragged: bool,
}

impl Corners {
    fn of(corners: &str) -> Self {
        let mut of_all = [true; 2];
        let mut of_any = [false; 2];
        for corner in corners.split_whitespace() {
            let mut numbers = corner.split('/').skip(1);
            let has = [(); 2].map(|()| numbers.next().is_some_and(|number| !number.is_empty()));
            of_all = [of_all[0] && has[0], of_all[1] && has[1]];
            of_any = [of_any[0] || has[0], of_any[1] || has[1]];
        }
        let [has_uvs, has_normals] = of_all;
        Self { pattern: Pattern { has_uvs, has_normals }, are_ragged: of_all != of_any }
    }
}

/// Separates, for each pattern of a file's faces, the text whose faces all have it, line for line that of the file.
/// Each is made when it is asked for: together they may take four times the file.
pub(super) fn separate(text: &str) -> impl Iterator<Item = Cow<'_, str>> {
    let mut patterns: Vec<Pattern> = Vec::new();
    let mut are_ragged = false;
    for corners in text.lines().filter_map(|line| line.strip_prefix("f ")).map(Corners::of) {
        if !patterns.contains(&corners.pattern) {
            patterns.push(corners.pattern);
        }
        are_ragged |= corners.are_ragged;
    }
    let is_one = patterns.len() < 2 && !are_ragged;
    let whole = is_one.then_some(Cow::Borrowed(text));
    let parts = if is_one { Vec::new() } else { patterns };
    whole.into_iter().chain(parts.into_iter().map(move |pattern| Cow::Owned(only(text, pattern))))
}

/// The text without the faces of other patterns.
fn only(text: &str, pattern: Pattern) -> String {
    let mut kept = String::with_capacity(text.len());
    for line in text.lines() {
        match line.strip_prefix("f ").map(|corners| (corners, Corners::of(corners))) {
            None => kept.push_str(line),
            Some((_, face)) if face.pattern != pattern => {}
            Some((corners, face)) if face.are_ragged => {
                kept.push('f');
                kept.extend(corners.split_whitespace().map(|corner| pare(corner, pattern)));
            }
            Some(_) => kept.push_str(line),
        }
        kept.push('\n');
    }
    kept
}

/// The corner without what not all of its face's corners have.
fn pare(corner: &str, pattern: Pattern) -> String {
    let mut numbers = corner.split('/');
    let mut next = |has: bool| numbers.next().filter(|_| has).unwrap_or("");
    let pared = format!(" {}/{}/{}", next(true), next(pattern.has_uvs), next(pattern.has_normals));
    pared.trim_end_matches('/').to_owned()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn faces_part_by_what_they_have() {
        let alike = "v 0 0 0\nf 1/1 2/2 3/3\nf 3/1 2/2 1/3\n";
        assert_eq!(separate(alike).collect::<Vec<_>>(), [alike]);
        let text = "f 1/1 2/2 3/3\ng a\nf 1 2 3\nf 1/1/1 2//2 3/3/3\nf 1//1 2//2 3//3\nf 1/1 2 3\n";
        let parts: Vec<_> = separate(text).collect();
        let lines: Vec<Vec<&str>> = parts.iter().map(|part| part.lines().collect()).collect();
        assert_eq!(lines[0], ["f 1/1 2/2 3/3", "g a", "", "", "", ""]);
        assert_eq!(lines[1], ["", "g a", "f 1 2 3", "", "", "f 1 2 3"]);
        assert_eq!(lines[2], ["", "g a", "", "f 1//1 2//2 3//3", "f 1//1 2//2 3//3", ""]);
        assert_eq!(lines.len(), 3);
    }
}
