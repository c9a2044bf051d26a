//! Normals for faces of smoothing groups, which `tobj` does not know: they are written into the text before it.
//!
//! Only for files without any normals of their own: one that has some means the rest to be flat.

use glam::Vec3;
use std::collections::HashMap;

/// The text with normals, and how many lines they take at its start.
pub(super) struct Smoothed {
    pub(super) text: String,
    pub(super) added_lines: usize,
}

/// A vertex as a smoothing group shades it: its number (from 1) and the group's.
type Corner = (usize, u32);

/// Adds normals to the faces of smoothing groups: at each vertex the mean over the group's faces there, by area.
/// `None` where nothing is to do, or where a line is not as it should be: its reader says so better.
pub(super) fn add_normals(text: &str) -> Option<Smoothed> {
    // Cheap for the many files that have normals or no groups.
    if text.starts_with("vn ")
        || text.contains("\nvn ")
        || !text.lines().any(|line| group_of(line).is_some_and(|g| g > 0))
    {
        return None;
    }
    let mut positions: Vec<Vec3> = Vec::new();
    let mut numbers: HashMap<Corner, usize> = HashMap::new();
    let mut normals: Vec<Vec3> = Vec::new();
    let mut body = String::with_capacity(text.len());
    let mut group = 0;
    for line in text.lines() {
        if let Some(numbers) = line.strip_prefix("v ") {
            positions.push(position(numbers)?);
        } else if let Some(number) = group_of(line) {
            group = number;
        } else if group > 0
            && let Some(corners) = line.strip_prefix("f ")
        {
            write_face(corners, group, &positions, &mut numbers, &mut normals, &mut body)?;
            body.push('\n');
            continue;
        }
        body.push_str(line);
        body.push('\n');
    }
    let head: String =
        normals.iter().map(|n| n.normalize_or(Vec3::Y)).map(|n| format!("vn {} {} {}\n", n.x, n.y, n.z)).collect();
    (!normals.is_empty()).then(|| Smoothed { text: head + &body, added_lines: normals.len() })
}

/// The group that an `s` statement begins; 0 for none.
fn group_of(line: &str) -> Option<u32> {
    let name = line.strip_prefix("s ")?.trim();
    Some(if name == "off" { 0 } else { name.parse().unwrap_or(0) })
}

fn position(numbers: &str) -> Option<Vec3> {
    let mut words = numbers.split_whitespace().map(|word| word.parse::<f32>().ok());
    Some(Vec3::new(words.next()??, words.next()??, words.next()??))
}

/// Adds the face's normal at its corners and writes it with their numbers.
fn write_face(
    corners: &str,
    group: u32,
    positions: &[Vec3],
    numbers: &mut HashMap<Corner, usize>,
    normals: &mut Vec<Vec3>,
    body: &mut String,
) -> Option<()> {
    let vertex = |corner: &str| -> Option<usize> {
        let index: i64 = corner.split('/').next()?.parse().ok()?;
        let number = if index < 0 { positions.len() as i64 + index + 1 } else { index };
        usize::try_from(number).ok().filter(|&number| number >= 1 && number <= positions.len())
    };
    let vertices: Vec<usize> = corners.split_whitespace().map(vertex).collect::<Option<_>>()?;
    // Newell's sum: the polygon's normal, as long as twice its area.
    let at = |place: usize| positions[vertices[place % vertices.len()] - 1];
    let first = vertices.first().map(|&v| positions[v - 1])?;
    let normal: Vec3 = (0..vertices.len()).map(|i| (at(i) - first).cross(at(i + 1) - first)).sum();
    body.push('f');
    for (corner, vertex) in corners.split_whitespace().zip(vertices) {
        let number = *numbers.entry((vertex, group)).or_insert_with(|| {
            normals.push(Vec3::ZERO);
            normals.len()
        });
        normals[number - 1] += normal;
        let mut parts = corner.split('/');
        let (v, vt) = (parts.next()?, parts.next().unwrap_or(""));
        body.push_str(&format!(" {v}/{vt}/{number}"));
    }
    Some(())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two squares at a right angle along an edge, and a third one in no group.
    const TEXT: &str =
        "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 0 0 1\nv 0 1 1\ns 1\nf 1 2 3 4\nf -2/7 1 4 6\ns off\nf 1 2 5\n";

    #[test]
    fn edges_within_a_group_are_smooth() {
        let smoothed = add_normals(TEXT).unwrap();
        let lines: Vec<&str> = smoothed.text.lines().skip(smoothed.added_lines).collect();
        assert_eq!(smoothed.added_lines, 6);
        assert_eq!(lines[7..], ["f 1//1 2//2 3//3 4//4", "f -2/7/5 1//1 4//4 6//6", "s off", "f 1 2 5"]);
        let normal = position(smoothed.text.lines().next().unwrap().strip_prefix("vn ").unwrap()).unwrap();
        assert!(normal.abs_diff_eq(Vec3::new(1.0, 0.0, 1.0).normalize(), 1e-6), "{normal}");
    }

    #[test]
    fn other_files_are_left_alone() {
        assert!(add_normals(&TEXT.replace("s 1", "s off")).is_none());
        assert!(add_normals(&format!("vn 0 0 1\n{TEXT}")).is_none());
        assert!(add_normals(&TEXT.replace("1 2 3 4", "1 2 3 9")).is_none());
    }
}
