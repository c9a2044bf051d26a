//! Bump maps of which only a look at the picture tells whether they hold heights or normals.
//!
//! MTL's `map_bump` is a picture of heights, but exporters (Blender's among them) write normal maps under the same
//! name.

use crate::scene::{HeightMap, Material, Relief, Texture};

/// What a material's relief is if it is one of heights, and the strength of its normals if not.
#[derive(Clone, Copy, Debug)]
pub(super) struct Bump {
    pub(super) heights: HeightMap,
    pub(super) strength: f32,
}

/// Makes normal maps of those whose pictures look like it, with a note for each picture.
pub(super) fn settle(bumps: &[Bump], materials: &mut [Material], textures: &[Texture], notes: &mut Vec<String>) {
    for bump in bumps {
        let Some((map, _)) = bump.heights.height.texture else { continue };
        let texture = &textures[map.texture.0 as usize];
        if !holds_normals(texture) {
            continue;
        }
        for material in materials.iter_mut().filter(|m| m.relief == Some(Relief::Heights(bump.heights))) {
            material.relief = Some(Relief::Normals { map, strength: bump.strength });
        }
        let note = format!("Bump map {}: by its colours a normal map, and rendered as one.", texture.name);
        if !notes.contains(&note) {
            notes.push(note);
        }
    }
}

/// Whether the mean colour is that of normals which mostly point along the surface's own. Heights are grey.
fn holds_normals(texture: &Texture) -> bool {
    let mean = texture.mean_color();
    (mean.truncate() - 0.5).abs().max_element() < 0.15 && mean.z - mean.x.max(mean.y) > 0.15
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{Encoding, Texels, Wrap};
    use std::sync::Arc;

    #[test]
    fn blue_pictures_hold_normals_and_grey_ones_heights() {
        for (texels, expected) in [
            ([[128, 128, 255, 255]; 2], true),
            ([[60, 140, 230, 255], [190, 130, 240, 255]], true),
            ([[128, 128, 128, 255], [255, 255, 255, 255]], false),
            ([[128, 128, 150, 255]; 2], false),
            ([[0, 0, 255, 255]; 2], false),
        ] {
            let texture = Texture {
                name: String::new(),
                width: 2,
                height: 1,
                texels: Texels::Bytes(Arc::new(texels.to_vec()), Encoding::Linear),
                wrap_u: Wrap::Repeat,
                wrap_v: Wrap::Repeat,
                nearest: false,
            };
            assert_eq!(holds_normals(&texture), expected, "{texels:?}");
        }
    }
}
