//! Puts the text of an OBJ file as `tobj` can read it.

use std::borrow::Cow;

/// An OBJ file's text as `tobj` can read it.
pub(super) struct Cleaned {
    pub(super) text: String,
    pub(super) colors: VertexColors,
    /// Statements of points and of lines, which are left out.
    pub(super) points_and_lines: usize,
}

/// Which vertices have colours behind their positions.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum VertexColors {
    None,
    Some,
    All,
}

/// The text with spaces for tabs, continued lines joined (blank lines keep the count), comments behind numbers and
/// opacities behind colours cut off, a 0 behind texture coordinates of one number, and empty `usemtl` statements left
/// out: all of these stop `tobj`. Points and lines are left out too: `tobj` takes a line for a face, and one without
/// texture coordinates would take them from its whole object.
pub(super) fn clean(text: &str) -> Cleaned {
    let text = &*with_spaces_for_tabs(text);
    let is_vertex = |line: &&str| line.starts_with("v ");
    // Three numbers more than a position has, and perhaps an opacity.
    let has_color = |line: &&str| matches!(line.split('#').next().unwrap_or(line).split_whitespace().count(), 7 | 8);
    let vertices = || text.lines().map(str::trim_start).filter(is_vertex);
    // Most files have no colours: their first vertex says so.
    let colors = if !vertices().take(1).any(|line| has_color(&line)) && !vertices().any(|line| has_color(&line)) {
        VertexColors::None
    } else if vertices().all(|line| has_color(&line)) {
        VertexColors::All
    } else {
        VertexColors::Some
    };
    let mut cleaned = String::with_capacity(text.len() + 1);
    let mut joined = 0;
    let mut is_numeric = false;
    let mut is_left_out = false;
    let mut points_and_lines = 0;
    for line in text.lines() {
        let is_start = joined == 0;
        let line = if is_start { line.trim_start() } else { line };
        // A name may hold '#', numbers may not.
        is_numeric = if is_start { line.starts_with(['v', 'f']) } else { is_numeric };
        let line = if is_numeric { line.split('#').next().unwrap_or(line) } else { line };
        let continued = line.trim_end().strip_suffix('\\');
        let part = continued.unwrap_or(line);
        if is_start {
            is_left_out = part.starts_with(['l', 'p']) && matches!(part.split_whitespace().next(), Some("l" | "p"));
            points_and_lines += usize::from(is_left_out);
        }
        let part = if is_left_out { "" } else { part };
        // Colours behind positions: tobj refuses files that give them to some vertices only.
        let words = if is_start && part.starts_with("v ") { part.split_whitespace().count() } else { 0 };
        let part = match colors {
            VertexColors::Some if words > 6 => before_word(part, 4),
            _ if words == 8 => before_word(part, 7),
            _ => part,
        };
        cleaned.push_str(if is_start && part.trim() == "usemtl" { "" } else { part });
        if is_start && continued.is_none() && part.starts_with("vt ") && part.split_whitespace().count() == 2 {
            cleaned.push_str(" 0");
        }
        if continued.is_some() {
            cleaned.push(' ');
            joined += 1;
        } else {
            cleaned.extend(std::iter::repeat_n('\n', joined + 1));
            joined = 0;
        }
    }
    Cleaned { text: cleaned, colors, points_and_lines }
}

fn with_spaces_for_tabs(text: &str) -> Cow<'_, str> {
    if text.contains('\t') { Cow::Owned(text.replace('\t', " ")) } else { Cow::Borrowed(text) }
}

/// The text with empty lines for those that part its faces.
pub(super) fn undivided(text: &str) -> String {
    let parts = |line: &&str| matches!(line.split_whitespace().next(), Some("o" | "g" | "s" | "usemtl" | "mtllib"));
    text.lines().flat_map(|line| [if parts(&line) { "" } else { line }, "\n"]).collect()
}

/// The line up to its word of this number, from 0.
fn before_word(line: &str, number: usize) -> &str {
    let word = line.split_whitespace().nth(number).unwrap_or_default();
    &line[..word.as_ptr() as usize - line.as_ptr() as usize]
}

/// Puts the names of material files before everything else where some come after a use of a material, which `tobj`
/// would not know yet. Returns by how many lines the text grows.
pub(super) fn hoist_libraries(text: &mut String) -> usize {
    let is_library = |line: &&str| line.starts_with("mtllib ");
    let first_use = text.lines().position(|line| line.starts_with("usemtl ")).unwrap_or(usize::MAX);
    if !text.lines().skip(first_use).any(|line| is_library(&line)) {
        return 0;
    }
    let mut hoisted: Vec<&str> = text.lines().filter(is_library).collect();
    let added = hoisted.len();
    hoisted.extend(text.lines().map(|line| if is_library(&line) { "" } else { line }));
    *text = hoisted.join("\n") + "\n";
    added
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cleaning_keeps_line_numbers() {
        let text = clean("v 1 2 \\\n 3 # here\nusemtl \n\tf 1\t2 3\ng a#b\n").text;
        assert_eq!(text.lines().collect::<Vec<_>>(), ["v 1 2   3 ", "", "", "f 1 2 3", "g a#b"]);
    }

    #[test]
    fn numbers_that_tobj_does_not_expect_are_mended() {
        let text = clean("v 1 2 3 0.5 0.5 0.5 1\nvt 0.5 # u\nvt 0 1\n").text;
        assert_eq!(text, "v 1 2 3 0.5 0.5 0.5 \nvt 0.5  0\nvt 0 1\n");
    }

    /// Regression: "v" and "vt" were known by the space behind them alone: such files were refused, or lost
    /// their colours without a word.
    #[test]
    fn tabs_part_words_as_spaces_do() {
        for spaced in [
            "v 1 2 3 0.5 0.5 0.5 1\n",
            "v 1 2 3 0.5 0.5 0.5\n",
            "v 1 2 3 0.5 0.5 0.5\nv 1 2 3\n",
            "vt 0.5\n",
            "usemtl \n",
        ] {
            let (tabbed, spaced) = (clean(&spaced.replace(' ', "\t")), clean(spaced));
            assert_eq!((tabbed.text, tabbed.colors), (spaced.text, spaced.colors));
        }
    }

    #[test]
    fn points_and_lines_are_left_out_and_counted() {
        let cleaned = clean("f 1 2 3\n l 1 2 \\\n 3\nl\t1 2\np 1\nlod 1\n");
        assert_eq!(cleaned.text.lines().map(str::trim_end).collect::<Vec<_>>(), ["f 1 2 3", "", "", "", "", "lod 1"]);
        assert_eq!(cleaned.points_and_lines, 3);
    }

    #[test]
    fn undivided_text_keeps_its_lines() {
        assert_eq!(undivided("g\nv 0 0 0\nusemtl a\ng a b\nf 1 1 1"), "\nv 0 0 0\n\n\nf 1 1 1\n");
    }

    #[test]
    fn libraries_come_before_what_uses_them() {
        let mut text = "usemtl a\nmtllib a.mtl\nf 1 2 3\n".to_owned();
        assert_eq!((hoist_libraries(&mut text), text.as_str()), (1, "mtllib a.mtl\nusemtl a\n\nf 1 2 3\n"));
        assert_eq!(hoist_libraries(&mut text), 0);
    }
}
