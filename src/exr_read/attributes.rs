//! Reads what headers say besides the pixels' layout.

use crate::output::{Attribute, FRAMES_PER_SECOND, PartOf};
use ::exr::meta::attribute::{AttributeValue, Text};
use ::exr::meta::header::Header;
use ::exr::prelude::Vec2;
use fechner_perception::primaries::Primaries;

/// The attribute that names a colour space (OpenEXR's standard attributes, by the registry of the Color Interop Forum).
pub(super) const COLOR_INTEROP_ID: &str = "colorInteropID";
/// The flag of SMPTE ST 2065-4, whose files hold ACES 2065-1.
const ACES_CONTAINER: &str = "acesImageContainerFlag";

/// Primaries and white of R, G and B: as chromaticities, else by the name of a linear colour space, else as
/// those of an ACES container.
pub(super) fn primaries(header: &Header) -> Option<Primaries> {
    let point = |Vec2(x, y): Vec2<f32>| [f64::from(x), f64::from(y)];
    let said = header.shared_attributes.chromaticities.map(|c| Primaries {
        red: point(c.red),
        green: point(c.green),
        blue: point(c.blue),
        white: point(c.white),
    });
    let all = attributes(header);
    let of = |name: &str| all.iter().find(|(own, _)| own == name).map(|(_, value)| value);
    let named = || match of(COLOR_INTEROP_ID) {
        Some(Attribute::Text(id)) => linear_primaries(id),
        _ => None,
    };
    let of_container = || (of(ACES_CONTAINER) == Some(&Attribute::Integer(1))).then_some(Primaries::ACES_AP0);
    said.or_else(named).or_else(of_container)
}

/// Primaries of a linear colour space by its ID; `None` for curves, displays, data, and what is not known.
pub(super) fn linear_primaries(id: &str) -> Option<Primaries> {
    match id {
        "lin_ap0_scene" => Some(Primaries::ACES_AP0),
        "lin_ap1_scene" => Some(Primaries::ACES_AP1),
        "lin_rec709_scene" => Some(Primaries::REC709),
        "lin_p3d65_scene" => Some(Primaries::DISPLAY_P3),
        "lin_rec2020_scene" => Some(Primaries::REC2020),
        "lin_adobergb_scene" => Some(Primaries::ADOBE_RGB),
        "lin_ciexyzd65_scene" => Some(Primaries::XYZ),
        _ => None,
    }
}

/// What the header says besides the pixels' layout, sorted by name.
pub(super) fn attributes(header: &Header) -> Vec<(String, Attribute)> {
    let own = &header.own_attributes;
    let mut list: Vec<(String, Attribute)> = own
        .other
        .iter()
        .chain(&header.shared_attributes.other)
        .map(|(name, value)| (name.to_string(), attribute(value)))
        .collect();
    let mut text = |name: &str, value: &Option<Text>| {
        if let Some(value) = value {
            list.push((name.to_owned(), Attribute::Text(value.to_string())));
        }
    };
    text("name", &own.layer_name);
    text("owner", &own.owner);
    text("comments", &own.comments);
    text("capDate", &own.capture_date);
    text("software", &own.software_name);
    if let Some((frames, seconds)) = own.frames_per_second {
        list.push((FRAMES_PER_SECOND.to_owned(), Attribute::Float(frames as f32 / seconds as f32)));
    }
    if let Some(nits) = own.white_luminance {
        list.push(("whiteLuminance".to_owned(), Attribute::Float(nits)));
    }
    if let Some(c) = header.shared_attributes.chromaticities {
        let [r, g, b, w] = [c.red, c.green, c.blue, c.white].map(|Vec2(x, y)| format!("{x} {y}"));
        let text = format!("red {r}, green {g}, blue {b}, white {w}");
        list.push(("chromaticities".to_owned(), Attribute::Text(text)));
    }
    list.sort_by(|a, b| a.0.cmp(&b.0));
    list
}

fn attribute(value: &AttributeValue) -> Attribute {
    match value {
        AttributeValue::Text(text) => Attribute::Text(text.to_string()),
        AttributeValue::F32(number) => Attribute::Float(*number),
        AttributeValue::F64(number) => Attribute::Text(number.to_string()),
        AttributeValue::I32(number) => Attribute::Integer(*number),
        AttributeValue::Bytes { type_hint, bytes } => Attribute::Text(format!("{} bytes of {type_hint}", bytes.len())),
        other => Attribute::Text(format!("{other:?}")),
    }
}

/// Adds the attributes that other parts have and the picture's has not, such as a unit.
pub(super) fn add_missing(list: &mut Vec<(String, Attribute)>, headers: &[Header]) {
    for (name, value) in headers.iter().flat_map(attributes) {
        if list.iter().all(|(own, _)| *own != name) {
            list.push((name, value));
        }
    }
    list.sort_by(|a, b| a.0.cmp(&b.0));
}

/// The place of a part in a whole that begins at (0, 0); `None` where it does not lie within it.
pub(super) fn part_of(header: &Header) -> Option<PartOf> {
    let window = header.shared_attributes.display_window;
    let Vec2(x, y) = header.own_attributes.layer_position;
    let origin = [u32::try_from(x).ok()?, u32::try_from(y).ok()?];
    let whole = [u32::try_from(window.size.0).ok()?, u32::try_from(window.size.1).ok()?];
    let size = [header.layer_size.0, header.layer_size.1];
    let is_within = (0..2).all(|side| origin[side] as usize + size[side] <= whole[side] as usize);
    (window.position == Vec2(0, 0) && is_within).then_some(PartOf { origin, whole })
}
