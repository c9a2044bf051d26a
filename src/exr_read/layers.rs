//! Finds which layer of another program's EXR file is its picture, by names alone.

use super::{ExrImage, layer_and_part};
use std::collections::BTreeSet;

/// Channels of a colour.
const RGB: [&str; 3] = ["R", "G", "B"];

/// Words in the names of layers that hold colour, but not the picture's.
const NOT_THE_PICTURE: [&str; 17] = [
    "albedo",
    "normal",
    "depth",
    "position",
    "variance",
    "velocity",
    "vector",
    "motion",
    "motionvector",
    "forward",
    "backward",
    "crypto",
    "cryptomatte",
    "shadow",
    "shadowing",
    "mask",
    "diffuse",
];
/// What renderers call the finished picture; R, G and B without a layer come first.
const THE_PICTURE: [&str; 5] = ["combined", "beauty", "rgba", "color", "image"];

/// What Blender calls passes of light and of colour.
const BLENDER_PASSES: [&str; 14] = [
    "diffcol",
    "diffdir",
    "diffind",
    "glosscol",
    "glossdir",
    "glossind",
    "transcol",
    "transdir",
    "transind",
    "volumedir",
    "volumeind",
    "emit",
    "env",
    "ao",
];

/// The layer that is taken for the picture.
pub struct PictureLayer<'a> {
    /// Name of the layer; empty for the root.
    pub name: &'a str,
    /// Those that could be meant as well, it among them; empty where its name alone says that it is the
    /// picture, or no other is one.
    of: Vec<&'a str>,
}

impl<'a> PictureLayer<'a> {
    /// The first of those that could be meant.
    fn among(of: Vec<&'a str>) -> Option<Self> {
        let name = *of.first()?;
        Some(Self { name, of: if of.len() > 1 { of } else { Vec::new() } })
    }

    /// The root, if it is among these layers, else those that have the likeliest of a finished picture's names.
    fn named(layers: &[&'a str]) -> Option<Self> {
        let called =
            |name: &&str| PictureLayer::among(layers.iter().copied().filter(|layer| is_called(layer, name)).collect());
        if layers.contains(&"") { Self::among(vec![""]) } else { THE_PICTURE.iter().find_map(called) }
    }

    /// What to say of one that had to be guessed.
    #[must_use]
    pub fn guess(&self) -> Option<String> {
        let of = self.of.join(", ");
        (!of.is_empty()).then(|| format!("the layer {} is taken for the picture, of {of}", self.name))
    }
}

impl ExrImage {
    /// Names of all channels of the file, in its order but those last that were not asked for.
    #[must_use]
    pub fn names(&self) -> Vec<&str> {
        self.channels.iter().map(|(name, _)| name).chain(&self.unread).map(String::as_str).collect()
    }

    /// The values of a layer's channel by its last name, whatever its case.
    #[must_use]
    pub fn part(&self, layer: &str, part: &str) -> Option<&[f32]> {
        let is_it = |name: &str| {
            let (own_layer, own_part) = layer_and_part(name);
            own_layer == layer && own_part.eq_ignore_ascii_case(part)
        };
        self.channels.iter().find(|(name, _)| is_it(name)).map(|(_, values)| values.as_slice())
    }
}

/// The root if it has `R`, `G` and `B`, else a layer a part of whose name, between dots, is what a finished picture is
/// called (`RenderLayer.Combined.R`), else the first layer; auxiliaries only where a part of their name says picture
/// and nothing else is there.
#[must_use]
pub fn picture_layer<'a>(names: &[&'a str]) -> Option<PictureLayer<'a>> {
    let (auxiliary, others): (Vec<&str>, Vec<&str>) =
        layers_with(names, &RGB).into_iter().partition(|layer| is_auxiliary(layer));
    PictureLayer::named(&others).or_else(|| PictureLayer::among(others)).or_else(|| PictureLayer::named(&auxiliary))
}

/// The layer of a picture of luminance, with chroma or as CIE XYZ or alone: the root if it has `Y`, else a layer that
/// is called as a finished picture is. Any other layer may have a `Y` that is no light, as a direction's is.
#[must_use]
pub fn luminance_layer<'a>(names: &[&'a str]) -> Option<PictureLayer<'a>> {
    let layers: Vec<&str> = layers_with(names, &["Y"]).into_iter().filter(|layer| !is_auxiliary(layer)).collect();
    PictureLayer::named(&layers)
}

fn is_auxiliary(layer: &str) -> bool {
    words(layer).iter().any(|word| is_not_the_pictures(word))
        || BLENDER_PASSES.iter().any(|name| is_called(layer, name))
}

/// Words of a name, which dots, underscores, spaces, digits and capitals part: `VRayDiffuse_filter2` has `V`,
/// `Ray`, `Diffuse`, `filter`.
fn words(name: &str) -> Vec<&str> {
    let bytes = name.as_bytes();
    let begins = |i: usize| {
        let is_lower = |at: usize| bytes.get(at).is_some_and(u8::is_ascii_lowercase);
        i > 0 && bytes[i].is_ascii_uppercase() && (is_lower(i - 1) || is_lower(i + 1))
    };
    let mut words = Vec::new();
    let mut start = 0;
    for (i, byte) in bytes.iter().enumerate() {
        let parts = byte.is_ascii() && !byte.is_ascii_alphabetic();
        if parts || begins(i) {
            words.push(&name[start..i]);
            start = if parts { i + 1 } else { i };
        }
    }
    words.push(&name[start..]);
    words
}

/// Whether a word, or what it is the plural of, is of layers that are not the picture.
fn is_not_the_pictures(word: &str) -> bool {
    let word = word.to_ascii_lowercase();
    NOT_THE_PICTURE.iter().any(|name| word.strip_prefix(name).is_some_and(|rest| rest.is_empty() || rest == "s"))
}

/// The layer of a file's colours, for files that may have auxiliaries alone, as of a texture or of a painted
/// mask: the first of them then.
#[must_use]
pub fn colour_layer<'a>(names: &[&'a str]) -> Option<PictureLayer<'a>> {
    picture_layer(names).or_else(|| PictureLayer::among(layers_with(names, &RGB)))
}

/// Whether a part of the layer's name, between dots, is this.
#[must_use]
pub fn is_called(layer: &str, name: &str) -> bool {
    layer.split('.').any(|part| part.eq_ignore_ascii_case(name))
}

/// Layers (what stands before the last dot, perhaps nothing) that have all of `parts`, in the order of `names`.
#[must_use]
pub fn layers_with<'a>(names: &[&'a str], parts: &[&str]) -> Vec<&'a str> {
    let all: BTreeSet<(&str, String)> =
        names.iter().map(|name| layer_and_part(name)).map(|(layer, part)| (layer, part.to_ascii_lowercase())).collect();
    let has_all = |layer: &str| parts.iter().all(|part| all.contains(&(layer, part.to_ascii_lowercase())));
    let mut known = BTreeSet::new();
    names
        .iter()
        .map(|name| layer_and_part(name))
        .filter(|(_, part)| parts.first().is_some_and(|first| part.eq_ignore_ascii_case(first)))
        .map(|(layer, _)| layer)
        .filter(|layer| has_all(layer) && known.insert(*layer))
        .collect()
}
