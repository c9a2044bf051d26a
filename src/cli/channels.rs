//! Which channels of another program's EXR file hold its colour and its motion.

use super::picture::note;
use anyhow::{Result, bail};
use fechner::exr_read::layers::{PictureLayer, colour_layer, is_called, layers_with, luminance_layer, picture_layer};
use fechner::exr_read::{ExrImage, layer_and_part, read_exr_channels};
use fechner_perception::Plane;
use fechner_perception::sequence::FrameMotion;
use std::path::Path;

/// Colour as it was found.
#[derive(Debug, PartialEq)]
pub(super) enum Colour<'a> {
    /// Red, green and blue.
    Rgb([&'a [f32]; 3]),
    /// Luminance alone: a grey picture.
    Grey(&'a [f32]),
}

impl<'a> Colour<'a> {
    /// Three, or one.
    pub(super) fn channels(&self) -> impl Iterator<Item = &'a [f32]> {
        match self {
            Self::Rgb(channels) => channels.iter(),
            Self::Grey(luminance) => std::slice::from_ref(luminance).iter(),
        }
        .copied()
    }
}

/// Reads the motion of a file that shows as many pixels as the picture it is for.
pub(super) fn read_motion(path: &Path, (width, height): (usize, usize)) -> Result<ExrImage> {
    let exr = read_exr_channels(path, |all| all.iter().filter(|name| is_of_motion(name)).cloned().collect())?;
    let shown = exr.display_window;
    if (shown.width as usize, shown.height as usize) != (width, height) {
        bail!("{} has {}x{} pixels, the picture {width}x{height}", path.display(), shown.width, shown.height);
    }
    Ok(exr)
}

/// Motion in pixels over the display window, under the names that renderers give it.
pub(super) fn motion_planes(path: &Path, exr: &ExrImage) -> Result<FrameMotion> {
    let Some(BothMotions { to_next, to_previous }) = both_motions(exr) else {
        bail!(
            "{}: no motion channels; {} of {} are known, and of {} to the frame before, with or without a layer before them",
            path.display(),
            VECTOR_PARTS.map(|parts| parts.join("/")).join(", "),
            MOTION_LAYERS.join(", "),
            BACKWARD_LAYERS.join(" and ")
        );
    };
    if motion(exr).is_none() {
        note(path, "it has motion to the frame before alone: to the next one things are taken to move on as they did");
    }
    let planes = |[x, y]: [Vec<f32>; 2]| -> Result<[Plane; 2]> {
        Ok([motion_plane(path, exr, x)?, motion_plane(path, exr, y)?])
    };
    Ok(FrameMotion { to_next: planes(to_next)?, to_previous: planes(to_previous)? })
}

/// One component of motion over the display window. What is not finite, which a note says, and what has no pixels,
/// rests.
fn motion_plane(path: &Path, exr: &ExrImage, values: Vec<f32>) -> Result<Plane> {
    if values.iter().any(|value| !value.is_finite()) {
        note(path, "motion that is not finite was replaced: it rests there");
    }
    let finite = values.into_iter().map(|value| if value.is_finite() { value } else { 0.0 }).collect();
    let shown = exr.display_window;
    Ok(Plane::from_values(shown.width as usize, shown.height as usize, exr.in_display_window(finite))?)
}

/// Reads the channels of a file that may be its picture, and passes over the others.
pub(super) fn read_picture(path: &Path) -> Result<ExrImage> {
    Ok(read_exr_channels(path, |all| {
        let names: Vec<&str> = all.iter().map(String::as_str).collect();
        let (picture, luminance) = (layer_of_colours(&names), luminance_layer(&names));
        let may_be = |name: &&String| {
            let (layer, part) = layer_and_part(name);
            let is_of = |of: &Option<PictureLayer<'_>>, parts: &[&str]| {
                of.as_ref().is_some_and(|of| of.name == layer) && parts.iter().any(|own| part.eq_ignore_ascii_case(own))
            };
            is_of(&picture, &["R", "G", "B", "A"]) || is_of(&luminance, &["X", "Y", "Z", "RY", "BY", "A"])
        };
        all.iter().filter(may_be).cloned().collect()
    })?)
}

/// The layer whose R, G and B are shown: a pass only where neither a picture nor luminance is there.
fn layer_of_colours<'a>(names: &[&'a str]) -> Option<PictureLayer<'a>> {
    if luminance_layer(names).is_some() { picture_layer(names) } else { colour_layer(names) }
}

/// The layer that is shown: of colours, else of luminance.
fn layer_of_picture<'a>(names: &[&'a str]) -> Option<PictureLayer<'a>> {
    layer_of_colours(names).or_else(|| luminance_layer(names))
}

/// What to say of a picture whose layer had to be guessed.
pub(super) fn guess(exr: &ExrImage) -> Option<String> {
    let names = exr.names();
    let layer = layer_of_picture(&names)?;
    let is_pass = picture_layer(&names).is_none() && luminance_layer(&names).is_none();
    let of_pass = || format!("the layer {} is taken for the picture: no other has R, G and B", layer.name);
    layer.guess().or_else(|| is_pass.then(of_pass))
}

/// The picture: `R`, `G` and `B` of one layer, else `Y`.
pub(super) fn colour<'a>(exr: &'a ExrImage) -> Option<Colour<'a>> {
    let names = exr.names();
    let Some(layer) = layer_of_colours(&names) else {
        return exr.part(luminance_layer(&names)?.name, "Y").map(Colour::Grey);
    };
    let [Some(r), Some(g), Some(b)] = ["R", "G", "B"].map(|part| exr.part(layer.name, part)) else {
        return None;
    };
    Some(Colour::Rgb([r, g, b]))
}

/// How much of each pixel the picture covers: `A` of its layer.
pub(super) fn alpha(exr: &ExrImage) -> Option<&[f32]> {
    let layer = layer_of_picture(&exr.names()).map_or("", |layer| layer.name);
    exr.part(layer, "A")
}

/// Names of layers that hold motion from this frame to the next, the surest first.
const MOTION_LAYERS: [&str; 7] = ["velocity", "vector", "motion", "motionvector", "motionvectors", "forward", "mv"];
/// What the two parts of a vector are called.
const VECTOR_PARTS: [[&str; 2]; 3] = [["X", "Y"], ["U", "V"], ["R", "G"]];

/// Layers whose y is upwards: Nuke's names, and those of renderers that write for it. All others are taken to have it
/// downwards, as their pixels are numbered.
const UPWARD_LAYERS: [&str; 2] = ["forward", "backward"];

/// Motion in pixels: the layer's name, and its channels along x and y as they stand in the file.
///
/// A layer counts if one part of its name, between dots, is one that renderers use (`velocity.X`, `ViewLayer.Vector.X`,
/// `forward.left.u`, `motion.x`); case does not matter.
fn motion(exr: &ExrImage) -> Option<(&str, [&[f32]; 2])> {
    let names = exr.names();
    for name in MOTION_LAYERS {
        for [across, down] in VECTOR_PARTS {
            let found = layers_with(&names, &[across, down]).into_iter().find(|layer| is_called(layer, name));
            if let Some(layer) = found {
                return Some((layer, [exr.part(layer, across)?, exr.part(layer, down)?]));
            }
        }
    }
    None
}

/// Motion of what a frame shows in both directions of time, pixels, x to the right and y down.
#[derive(Debug, PartialEq)]
struct BothMotions {
    to_next: [Vec<f32>; 2],
    to_previous: [Vec<f32>; 2],
}

/// What layers of motion to the previous frame are called.
const BACKWARD_LAYERS: [&str; 2] = ["velocity_previous", "backward"];

/// Both motions: ours, Blender's `Vector` of four, or any that [`motion`] and [`backward_motion`] find. Of one alone
/// things are taken to move as much the other way.
fn both_motions(exr: &ExrImage) -> Option<BothMotions> {
    let negated = |values: &[f32]| values.iter().map(|value| -value).collect::<Vec<f32>>();
    let names = exr.names();
    let of_four = layers_with(&names, &["X", "Y", "Z", "W"]).into_iter().find(|layer| is_called(layer, "vector"));
    if let Some(layer) = of_four {
        // Where it was less where it is, then where it is less where it will be; y upwards.
        let [Some(x), Some(y), Some(z), Some(w)] = ["X", "Y", "Z", "W"].map(|part| exr.part(layer, part)) else {
            return None;
        };
        return Some(BothMotions { to_next: [negated(z), w.to_vec()], to_previous: [x.to_vec(), negated(y)] });
    }
    let downwards = |(layer, [x, y]): (&str, [&[f32]; 2])| {
        let is_upward = UPWARD_LAYERS.iter().any(|name| is_called(layer, name));
        [x.to_vec(), if is_upward { negated(y) } else { y.to_vec() }]
    };
    let as_before = |[x, y]: &[Vec<f32>; 2]| [negated(x), negated(y)];
    let (to_next, to_previous) = (motion(exr).map(downwards), backward_motion(exr).map(downwards));
    let to_next = to_next.or_else(|| to_previous.as_ref().map(as_before))?;
    let to_previous = to_previous.unwrap_or_else(|| as_before(&to_next));
    Some(BothMotions { to_next, to_previous })
}

/// Motion to the previous frame as [`motion`] has it to the next one.
fn backward_motion(exr: &ExrImage) -> Option<(&str, [&[f32]; 2])> {
    let names = exr.names();
    VECTOR_PARTS.iter().find_map(|&[across, down]| {
        let is_backward = |layer: &&str| BACKWARD_LAYERS.iter().any(|name| is_called(layer, name));
        let layer = layers_with(&names, &[across, down]).into_iter().find(is_backward)?;
        Some((layer, [exr.part(layer, across)?, exr.part(layer, down)?]))
    })
}

/// The layer that motion is taken from: to the next frame, else to the previous one.
pub(super) fn motion_layer(exr: &ExrImage) -> Option<&str> {
    motion(exr).or_else(|| backward_motion(exr)).map(|(layer, _)| layer)
}

/// Whether a channel may be one of those that [`both_motions`] looks for.
fn is_of_motion(name: &str) -> bool {
    let (layer, part) = layer_and_part(name);
    let is_layer = MOTION_LAYERS.iter().chain(&BACKWARD_LAYERS).any(|name| is_called(layer, name));
    is_layer && VECTOR_PARTS.iter().flatten().chain(&["Z", "W"]).any(|own| part.eq_ignore_ascii_case(own))
}

#[cfg(test)]
mod tests {
    use super::*;
    use fechner::exr_read::Window;

    /// Channel i holds the value i.
    fn exr(names: &[&str]) -> ExrImage {
        ExrImage {
            width: 1,
            height: 1,
            data_window_origin: (0, 0),
            display_window: Window { origin: (0, 0), width: 1, height: 1 },
            part_of: None,
            is_display_window_left_out: false,
            chromaticities: None,
            pixel_aspect_ratio: 1.0,
            lines_left_out: 0,
            channels: names.iter().enumerate().map(|(i, name)| ((*name).to_owned(), vec![i as f32])).collect(),
            types: Vec::new(),
            unread: Vec::new(),
            attributes: Vec::new(),
            parts_left_out: Vec::new(),
        }
    }

    fn rgb_of(names: &[&str]) -> Option<[f32; 3]> {
        match colour(&exr(names))? {
            Colour::Rgb(planes) => Some(planes.map(|plane| plane[0])),
            Colour::Grey(_) => None,
        }
    }

    #[test]
    fn the_picture_is_found_and_its_channels_are_of_one_layer() {
        assert_eq!(rgb_of(&["A", "B", "G", "R"]), Some([3.0, 2.0, 1.0]));
        assert_eq!(rgb_of(&["albedo.R", "B", "G", "R", "left.B", "left.G", "left.R"]), Some([3.0, 2.0, 1.0]));
        let blender = [
            "RenderLayer.AO.B",
            "RenderLayer.AO.G",
            "RenderLayer.AO.R",
            "RenderLayer.Combined.A",
            "RenderLayer.Combined.B",
            "RenderLayer.Combined.G",
            "RenderLayer.Combined.R",
        ];
        assert_eq!(rgb_of(&blender), Some([6.0, 5.0, 4.0]));
        assert_eq!(rgb_of(&["albedo.B", "albedo.G", "albedo.R", "main.b", "main.g", "main.r"]), Some([5.0, 4.0, 3.0]));
        // A pass that has a picture's name in its own is still a pass.
        let passes = ["diffuse_color.B", "diffuse_color.G", "diffuse_color.R", "main.B", "main.G", "main.R"];
        assert_eq!(rgb_of(&passes), Some([5.0, 4.0, 3.0]));
        let passes = ["specular_color.B", "specular_color.G", "specular_color.R", "Beauty.B", "Beauty.G", "Beauty.R"];
        assert_eq!(rgb_of(&passes), Some([5.0, 4.0, 3.0]));
        assert_eq!(
            rgb_of(&["MaskedView.Combined.B", "MaskedView.Combined.G", "MaskedView.Combined.R"]),
            Some([2.0, 1.0, 0.0])
        );
        let blender = ["V.DiffCol.B", "V.DiffCol.G", "V.DiffCol.R", "V.Noisy.B", "V.Noisy.G", "V.Noisy.R"];
        assert_eq!((rgb_of(&blender), guess(&exr(&blender))), (Some([5.0, 4.0, 3.0]), None));
        let two = ["a.B", "a.G", "a.R", "b.B", "b.G", "b.R"];
        assert_eq!(rgb_of(&two), Some([2.0, 1.0, 0.0]));
        assert_eq!(guess(&exr(&two)).as_deref(), Some("the layer a is taken for the picture, of a, b"));
        assert_eq!(colour(&exr(&["Y"])), Some(Colour::Grey(&[0.0])));
        assert_eq!(colour(&exr(&["Z"])), None);
    }

    /// A painted map is called mask, and there is nothing else that could be meant.
    #[test]
    fn passes_are_shown_where_nothing_else_is_there() {
        let mask = ["mask.B", "mask.G", "mask.R"];
        assert_eq!(rgb_of(&mask), Some([2.0, 1.0, 0.0]));
        assert_eq!(
            guess(&exr(&mask)).as_deref(),
            Some("the layer mask is taken for the picture: no other has R, G and B")
        );
        let two = ["albedo.B", "albedo.G", "albedo.R", "mask.A", "mask.B", "mask.G", "mask.R"];
        assert_eq!((rgb_of(&two), alpha(&exr(&two))), (Some([2.0, 1.0, 0.0]), None));
        assert_eq!(guess(&exr(&two)).as_deref(), Some("the layer albedo is taken for the picture, of albedo, mask"));
        let beside_luminance = ["Y", "vector.B", "vector.G", "vector.R"];
        assert_eq!(colour(&exr(&beside_luminance)), Some(Colour::Grey(&[0.0])));
        assert_eq!(guess(&exr(&beside_luminance)), None);
    }

    /// Views and render layers of one file. Regression: pictures that differed in the second alone were the same to
    /// `compare`, without a word.
    #[test]
    fn of_several_pictures_all_are_named() {
        let of = |layers: [&str; 3]| {
            let names: Vec<String> =
                layers.iter().flat_map(|layer| ["B", "G", "R"].map(|part| format!("{layer}.{part}"))).collect();
            let names: Vec<&str> = names.iter().map(String::as_str).collect();
            (rgb_of(&names), guess(&exr(&names)))
        };
        let said = "the layer Back.Combined is taken for the picture, of Back.Combined, Front.Combined";
        let (rgb, note) = of(["Back.Combined", "Back.AO", "Front.Combined"]);
        assert_eq!((rgb, note.as_deref()), (Some([2.0, 1.0, 0.0]), Some(said)));
        let said = "the layer left.beauty is taken for the picture, of left.beauty, right.beauty";
        assert_eq!(of(["left.beauty", "right.beauty", "right.image"]).1.as_deref(), Some(said));
        assert_eq!(of(["a", "b", "b.beauty"]), (Some([8.0, 7.0, 6.0]), None));
    }

    /// Luminance of any case, at the root or in a layer or part that is called as pictures are.
    #[test]
    fn luminance_may_stand_in_a_layer() {
        let shown = |names: &[&str]| {
            let exr = exr(names);
            exr.scene_picture(|_, _| None).map(|picture| picture.rgb[0])
        };
        assert_eq!(shown(&["A", "y"]), Some([1.0; 3]));
        assert_eq!(shown(&["depth.Z", "image.Y"]), Some([1.0; 3]));
        assert_eq!(shown(&["beauty.A", "beauty.Y", "id.Y"]), Some([1.0; 3]));
        assert_eq!(shown(&["x", "y", "z"]), shown(&["X", "Y", "Z"]));
        assert_eq!(shown(&["image.X", "image.Y", "image.Z"]), shown(&["X", "Y", "Z"]));
        // A direction's, an identity's or a shadow's is no light.
        for no_light in [&["nn.X", "nn.Y", "nn.Z"][..], &["id.Y"], &["shadow.image.Y"]] {
            assert_eq!((shown(no_light), colour(&exr(no_light))), (None, None), "{no_light:?}");
        }
        let two = ["left.image.Y", "right.image.Y"];
        assert_eq!(colour(&exr(&two)), Some(Colour::Grey(&[0.0])));
        let said = "the layer left.image is taken for the picture, of left.image, right.image";
        assert_eq!(guess(&exr(&two)).as_deref(), Some(said));
        assert_eq!(alpha(&exr(&["beauty.A", "beauty.Y"])), Some(&[0.0][..]));
        assert_eq!(rgb_of(&["image.Y", "vector.B", "vector.G", "vector.R"]), None);
    }

    /// Passes are known by whole words.
    #[test]
    fn a_part_of_a_word_is_no_pass() {
        let beside = |pass: &str, picture: &str| {
            let names: Vec<String> = [pass, picture]
                .iter()
                .flat_map(|layer| ["B", "G", "R"].map(|part| format!("{layer}.{part}")))
                .collect();
            let names: Vec<&str> = names.iter().map(String::as_str).collect();
            assert_eq!((rgb_of(&names), guess(&exr(&names))), (Some([5.0, 4.0, 3.0]), None), "{pass} {picture}");
        };
        for pass in [
            "mask",
            "cut_mask",
            "Mask1",
            "cutMask",
            "AOVMask",
            "masks.left",
            "VRayDiffuseFilter",
            "CryptoAsset00",
            "cryptomatte",
            "motionvector",
            "MotionVectors",
            "Denoising Shadowing",
            "tiefe_é.Normals",
        ] {
            beside(pass, "Unmasked");
        }
        beside("diffuse", "Emotions");
    }

    #[test]
    fn alpha_is_of_the_pictures_layer() {
        let of = |names: &[&str]| alpha(&exr(names)).map(|values| values[0]);
        assert_eq!(of(&["A", "B", "G", "R"]), Some(0.0));
        assert_eq!(of(&["A", "Y"]), Some(0.0));
        assert_eq!(of(&["V.Combined.A", "V.Combined.B", "V.Combined.G", "V.Combined.R", "id.A"]), Some(0.0));
        assert_eq!(of(&["B", "G", "R", "id.A"]), None);
    }

    #[test]
    fn layers_that_were_passed_over_are_named_still() {
        let mut two = exr(&["a.B", "a.G", "a.R"]);
        two.unread = ["b.B", "b.G", "b.R"].map(str::to_owned).to_vec();
        assert_eq!(guess(&two).as_deref(), Some("the layer a is taken for the picture, of a, b"));
        assert!(["velocity.X", "A.Vector.w", "forward.left.u", "motionvector.R"].into_iter().all(is_of_motion));
        assert!(!["X", "R", "normal.X", "motion.A", "vector"].into_iter().any(is_of_motion));
    }

    #[test]
    fn motion_goes_by_many_names() {
        let motion_of = |names: &[&str]| motion(&exr(names)).map(|(layer, [x, y])| (layer.to_owned(), x[0], y[0]));
        let found = |layer: &str, x: f32, y: f32| Some((layer.to_owned(), x, y));
        assert_eq!(motion_of(&["R", "velocity.X", "velocity.Y"]), found("velocity", 1.0, 2.0));
        assert_eq!(
            motion_of(&["ViewLayer.Vector.W", "ViewLayer.Vector.X", "ViewLayer.Vector.Y"]),
            found("ViewLayer.Vector", 1.0, 2.0)
        );
        assert_eq!(motion_of(&["forward.u", "forward.v"]), found("forward", 0.0, 1.0));
        assert_eq!(
            motion_of(&["disparityL.x", "disparityL.y", "forward.left.u", "forward.left.v"]),
            found("forward.left", 2.0, 3.0)
        );
        assert_eq!(motion_of(&["motion.x", "motion.y", "motion.z"]), found("motion", 0.0, 1.0));
        assert_eq!(motion_of(&["motionvector.B", "motionvector.G", "motionvector.R"]), found("motionvector", 2.0, 1.0));
        // One half of a vector, or the wrong way in time, is none.
        assert_eq!(motion_of(&["velocity.X", "backward.u", "backward.v", "normal.X", "normal.Y"]), None);
    }

    #[test]
    fn motion_is_found_in_both_directions() {
        let of = |names: &[&str]| {
            let BothMotions { to_next: [a, b], to_previous: [c, d] } = both_motions(&exr(names))?;
            Some([a[0], b[0], c[0], d[0]])
        };
        let ours = ["velocity.X", "velocity.Y", "velocity_previous.X", "velocity_previous.Y"];
        assert_eq!(of(&ours), Some([0.0, 1.0, 2.0, 3.0]));
        assert_eq!(of(&["A.Vector.W", "A.Vector.X", "A.Vector.Y", "A.Vector.Z"]), Some([-3.0, 0.0, 1.0, -2.0]));
        assert_eq!(of(&["R", "motion.x", "motion.y"]), Some([1.0, 2.0, -1.0, -2.0]));
        // Nuke's y is upwards.
        assert_eq!(of(&["R", "forward.left.u", "forward.left.v"]), Some([1.0, -2.0, -1.0, 2.0]));
        let both = ["R", "backward.u", "backward.v", "forward.u", "forward.v"];
        assert_eq!(of(&both), Some([3.0, -4.0, 1.0, -2.0]));
        assert_eq!(of(&["R", "G", "B"]), None);
    }

    /// Regression: files of renderers that know only where things were before were refused.
    #[test]
    fn motion_to_the_previous_frame_alone_goes_on() {
        let of = |names: &[&str]| {
            let exr = exr(names);
            let BothMotions { to_next: [a, b], to_previous: [c, d] } = both_motions(&exr)?;
            Some((motion_layer(&exr)?.to_owned(), [a[0], b[0], c[0], d[0]]))
        };
        let found = |layer: &str, motion| Some((layer.to_owned(), motion));
        assert_eq!(of(&["R", "backward.u", "backward.v"]), found("backward", [-1.0, 2.0, 1.0, -2.0]));
        let ours = ["R", "velocity_previous.X", "velocity_previous.Y"];
        assert_eq!(of(&ours), found("velocity_previous", [-1.0, -2.0, 1.0, 2.0]));
        assert_eq!(of(&["backward.u", "backward.v", "mv.X", "mv.Y"]), found("mv", [2.0, 3.0, 0.0, -1.0]));
    }
}
