//! Notes that say the same of many lines, as one. Not for errors, which end the reading.

use std::collections::{HashMap, HashSet};

/// Which notes were made so far.
#[derive(Debug, Default)]
pub(super) struct AlikeNotes {
    made: HashSet<String>,
    /// By their text without the line: the first one's place among all notes, and how many followed.
    groups: HashMap<String, (usize, usize)>,
}

impl AlikeNotes {
    /// Appends a note unless it, or one that differs in its line alone, is there.
    pub(super) fn add(&mut self, note: String, notes: &mut Vec<String>) {
        if self.made.contains(&note) {
            return;
        }
        let place = notes.len();
        let (_, followers) =
            self.groups.entry(without_line(&note)).and_modify(|(_, followers)| *followers += 1).or_insert((place, 0));
        if *followers == 0 {
            notes.push(note.clone());
        }
        self.made.insert(note);
    }

    /// Says at each note how many it stands for.
    pub(super) fn count_into(self, notes: &mut [String]) {
        for (place, followers) in self.groups.into_values().filter(|(_, followers)| *followers > 0) {
            if let Some(note) = notes.get_mut(place) {
                *note = format!("{} (and {} more like it).", note.trim_end_matches('.'), grouped(followers));
            }
        }
    }
}

/// The text without the number of "FILE:NUMBER: ".
fn without_line(note: &str) -> String {
    let numbered = note.match_indices(": ").find_map(|(end, _)| {
        let start = note[..end].rfind(':')?;
        let line = &note[start + 1..end];
        (!line.is_empty() && line.bytes().all(|byte| byte.is_ascii_digit())).then_some((start, end))
    });
    numbered.map_or_else(|| note.to_owned(), |(start, end)| format!("{}{}", &note[..start], &note[end..]))
}

/// A number with a comma before each three digits.
fn grouped(number: usize) -> String {
    let digits = number.to_string();
    let mut text = String::new();
    for (index, digit) in digits.chars().enumerate() {
        if index > 0 && (digits.len() - index).is_multiple_of(3) {
            text.push(',');
        }
        text.push(digit);
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn notes_that_differ_in_their_line_are_one() {
        let (mut alike, mut notes) = (AlikeNotes::default(), Vec::new());
        for line in (1..=40_000).chain([7]) {
            alike.add(format!("a.pbrt:{line}: sphere: not used: \"x\"."), &mut notes);
        }
        alike.add("b.pbrt:3: sphere: not used: \"x\".".to_owned(), &mut notes);
        alike.add("no place".to_owned(), &mut notes);
        alike.count_into(&mut notes);
        let expected = [
            "a.pbrt:1: sphere: not used: \"x\" (and 39,999 more like it).",
            "b.pbrt:3: sphere: not used: \"x\".",
            "no place",
        ];
        assert_eq!(notes, expected);
    }
}
