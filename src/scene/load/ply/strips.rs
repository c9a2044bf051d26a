//! Reads strips of triangles, which some scanners' files have in place of faces.

use super::super::error::LoadError;
use super::body::Values;
use super::header::Element;
use super::{Polygons, all_but_corners, is_corners};

/// Adds the triangles of every strip; an index below 0 ends a strip, and what follows begins another. Returns the
/// names of what is not used.
pub(super) fn read<'h>(
    values: &mut Values,
    element: &'h Element,
    polygons: &mut Polygons,
) -> Result<Vec<&'h str>, LoadError> {
    let unused = all_but_corners(values, element)?;
    for _ in 0..element.count {
        for property in &element.properties {
            match property.list {
                None => _ = values.number(property.kind)?,
                Some(count) if !is_corners(property) => values.skip_list(count, property.kind)?,
                Some(count) => {
                    let mut strip: Vec<u32> = Vec::new();
                    for _ in 0..values.list_size(count, property.kind)? {
                        let index = values.number(property.kind)?;
                        if index.fract() != 0.0 || index > f64::from(u32::MAX) {
                            return Err(values.no_index(index));
                        }
                        if index >= 0.0 {
                            strip.push(index as u32);
                        } else {
                            add(&strip, polygons);
                            strip.clear();
                        }
                    }
                    add(&strip, polygons);
                }
            }
        }
    }
    Ok(unused)
}

/// Every other triangle is wound the other way around.
fn add(strip: &[u32], polygons: &mut Polygons) {
    for (place, three) in strip.windows(3).enumerate() {
        let [a, b, c] = [three[0], three[1], three[2]];
        polygons.indices.extend(if place % 2 == 0 { [a, b, c] } else { [b, a, c] });
        polygons.sizes.push(3);
    }
}
