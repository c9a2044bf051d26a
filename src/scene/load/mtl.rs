//! MTL files: materials of OBJ meshes, with the PBR extension (Pr, Pm, Pc, Pcr, Ps, aniso, anisor, Ke, their
//! maps, norm) and bump maps.
//!
//! Read by ourselves because `tobj`'s reader panics on a colour with fewer than three numbers and leaves texture
//! options (`map_Kd -s 2 2 1 -o .5 0 0 my wood.png`) unparsed. What files of the wild get wrong is skipped with a note.

mod surface;

use super::builder::Builder;
use super::bump::Bump;
use super::error::{LoadError, Place};
use super::files;
use super::share;
use super::texture::{Adjust, IfMissing, Picture, Request};
use crate::scene::{
    Alpha, ColorInput, Encoding, HeightMap, HeightUnit, Material, MaterialId, Relief, ScalarInput, Surface,
    TextureLookup, Wrap,
};
use glam::{Vec2, Vec3};
use std::collections::HashMap;
use std::path::{Path, PathBuf};

/// Diffuse albedo of a material that tells none, and of faces without a material.
const DEFAULT_KD: f32 = 0.7;

/// One `newmtl` as it was written.
#[derive(Clone, Debug, Default)]
pub(super) struct Written {
    pub(super) name: String,
    numbers: HashMap<String, Vec<f32>>,
    maps: HashMap<String, Map>,
    /// The file that it stands in.
    file: PathBuf,
}

/// A texture statement.
#[derive(Clone, Debug, PartialEq)]
struct Map {
    file: String,
    /// Where it stands.
    line: usize,
    offset: Vec2,
    scale: Vec2,
    bump: f32,
    clamp: bool,
    channel: Option<u8>,
    /// Added to the picture's values, which is not done.
    base: f32,
    /// Multiplies them.
    gain: f32,
}

impl Map {
    /// A file as it stands.
    fn plain(file: String) -> Self {
        let (offset, scale) = (Vec2::ZERO, Vec2::ONE);
        Self { file, line: 1, offset, scale, bump: 1.0, clamp: false, channel: None, base: 0.0, gain: 1.0 }
    }
}

/// Statements that [`Written::convert`] reads.
const READ: &[&str] = &[
    "kd", "ks", "ke", "ns", "ni", "d", "tr", "tf", "illum", "pr", "pm", "pc", "pcr", "ps", "aniso", "anisor", "map_kd",
    "map_ks", "map_ke", "map_d", "map_pr", "map_pm", "map_pc", "map_pcr", "map_ps", "norm", "bump", "map_bump", "disp",
    "map_disp",
];
/// Statements that mean nothing to a path tracer: ambient light, and how pictures are to be filtered.
const MEANINGLESS: &[&str] = &["ka", "map_ka", "map_aat", "sharpness"];

/// The materials of a file, in its order.
pub(super) fn read(path: &Path, notes: &mut Vec<String>) -> Result<Vec<Written>, LoadError> {
    let bytes = match files::read(path) {
        Err(LoadError::Invalid { .. }) => return Ok(Vec::new()), // an empty file has no materials
        other => other?,
    };
    let text = files::decode_loosely(path, bytes)?;
    let mut materials: Vec<Written> = Vec::new();
    for (number, line) in text.lines().enumerate() {
        let line = line.trim();
        let (key, rest) = line.split_once(char::is_whitespace).unwrap_or((line, ""));
        let rest = rest.trim();
        if key.is_empty() || key.starts_with('#') {
            continue;
        }
        let key = key.to_ascii_lowercase();
        if key == "newmtl" {
            materials.push(Written { name: rest.to_owned(), file: path.to_owned(), ..Written::default() });
            continue;
        }
        let Some(material) = materials.last_mut() else {
            continue;
        };
        if key.starts_with("map_") || ["norm", "bump", "disp", "refl", "decal"].contains(&key.as_str()) {
            let map = Map { line: number + 1, ..parse_map(rest) };
            if !map.file.is_empty() {
                material.maps.insert(key, map);
            }
            continue;
        }
        // Comments may follow the numbers; "Kd spectral file.rfl" and "Kd xyz ..." have none we could use.
        // "d -halo" is an opacity that edges add to, which is not done.
        let is_option = |word: &str| key == "d" && word == "-halo";
        let words = rest.split_whitespace().take_while(|word| !word.starts_with('#')).filter(|word| !is_option(word));
        let numbers: Result<Vec<f32>, _> = words.map(str::parse).collect();
        match numbers {
            Ok(numbers) if !numbers.is_empty() && numbers.iter().all(|number| number.is_finite()) => {
                material.numbers.insert(key, numbers);
            }
            _ => notes.push(format!("{}:{}: \"{key}\" skipped: expected numbers.", path.display(), number + 1)),
        }
    }
    Ok(materials)
}

/// Options, then a file name that may hold spaces; some writers put options behind it.
fn parse_map(text: &str) -> Map {
    let mut map = Map::plain(String::new());
    let words: Vec<(usize, &str)> =
        text.split_whitespace().map(|word| (word.as_ptr() as usize - text.as_ptr() as usize, word)).collect();
    let mut name: Option<(usize, usize)> = None;
    let mut next = 0;
    while let Some(&(start, word)) = words.get(next) {
        next += 1;
        let most = match word {
            "-o" | "-s" | "-t" => 3,
            "-mm" => 2,
            "-bm" | "-boost" | "-texres" | "-clamp" | "-blendu" | "-blendv" | "-cc" | "-imfchan" | "-type"
            | "-colorspace" => 1,
            _ => {
                // From the first word of the name to its last one, with the spaces between as they are.
                name = Some((name.map_or(start, |(first, _)| first), start + word.len()));
                continue;
            }
        };
        let is_word =
            matches!(word, "-clamp" | "-blendu" | "-blendv" | "-cc" | "-imfchan" | "-type" | "-texres" | "-colorspace");
        let mut arguments: Vec<&str> = Vec::new();
        while arguments.len() < most
            && let Some(&(_, argument)) = words.get(next)
            && (is_word || argument.parse::<f32>().is_ok())
        {
            arguments.push(argument);
            next += 1;
        }
        let number = |place: usize, default: f32| {
            arguments
                .get(place)
                .and_then(|argument| argument.parse().ok())
                .filter(|n: &f32| n.is_finite())
                .unwrap_or(default)
        };
        match word {
            "-o" => map.offset = Vec2::new(number(0, 0.0), number(1, 0.0)),
            "-s" => map.scale = Vec2::new(number(0, 1.0), number(1, 1.0)),
            "-bm" => map.bump = number(0, 1.0),
            "-mm" => (map.base, map.gain) = (number(0, 0.0), number(1, 1.0)),
            "-clamp" => map.clamp = arguments.first() == Some(&"on"),
            "-imfchan" => map.channel = arguments.first().and_then(|channel| "rgbm".find(*channel)).map(|c| c as u8),
            _ => {}
        }
    }
    if let Some((start, end)) = name {
        map.file = text[start..end].trim_matches('"').replace('\\', "/");
    }
    map
}

/// The material of faces that name none, or one that no file defines.
pub(super) fn default_material(builder: &mut Builder) -> MaterialId {
    let surface = Surface::Diffuse { reflectance: ColorInput::constant(Vec3::splat(DEFAULT_KD)) };
    builder.add_material(Material::plain("default", surface))
}

impl Written {
    fn number(&self, key: &str) -> Option<f32> {
        self.numbers.get(key).map(|numbers| numbers[0])
    }

    /// A colour; one number stands for all three.
    fn color(&self, key: &str) -> Option<Vec3> {
        let numbers = self.numbers.get(key)?;
        let color = if numbers.len() >= 3 { Vec3::from_slice(numbers) } else { Vec3::splat(numbers[0]) };
        Some(color.max(Vec3::ZERO))
    }

    fn map(&self, keys: &[&str]) -> Option<&Map> {
        keys.iter().find_map(|key| self.maps.get(*key))
    }

    fn lookup(&self, builder: &mut Builder, map: &Map, encoding: Encoding, if_missing: [u8; 4]) -> TextureLookup {
        let wrap = if map.clamp { Wrap::Clamp } else { Wrap::Repeat };
        let texture = builder.textures.add(Request {
            picture: Picture::File(find_file(self.file.parent().unwrap_or(Path::new("")), &map.file)),
            encoding,
            wrap_u: wrap,
            wrap_v: wrap,
            nearest: false,
            if_missing: IfMissing::Replace(if_missing, Place::line(&self.file, map.line)),
            adjust: Adjust::NONE,
        });
        // MTL's offset and scale are meant for v up; the mesh's coordinates were turned to v down.
        TextureLookup {
            texture,
            offset: Vec2::new(map.offset.x, 1.0 - map.scale.y - map.offset.y),
            rotation: 0.0,
            scale: map.scale,
        }
    }

    fn color_input(&self, builder: &mut Builder, key: &str, default: Vec3) -> ColorInput {
        let factor = self.color(key);
        match self.map(&[&format!("map_{key}")]) {
            None => ColorInput::constant(factor.unwrap_or(default)),
            // Several exporters write a black factor beside a map, and mean the map.
            Some(map) => ColorInput {
                factor: factor.filter(|factor| factor.max_element() > 0.0).unwrap_or(Vec3::ONE) * map.gain.max(0.0),
                texture: Some(self.lookup(builder, map, Encoding::Srgb, [180, 180, 180, 255])),
            },
        }
    }

    /// A share of light in [0, 1], at which a picture ends once its factor has multiplied it.
    fn share_input(&self, builder: &mut Builder, key: &str) -> ColorInput {
        let input = self.color_input(builder, key, Vec3::splat(DEFAULT_KD));
        match input.texture {
            None => ColorInput::constant(input.factor.min(Vec3::ONE)),
            Some(_) => input,
        }
    }

    fn scalar_input(&self, builder: &mut Builder, key: &str, default: f32) -> ScalarInput {
        let factor = self.number(key);
        share(match self.map(&[&format!("map_{key}")]) {
            None => ScalarInput::constant(factor.unwrap_or(default)),
            Some(map) => {
                let channel = map.channel.unwrap_or(0).min(2);
                let lookup = self.lookup(builder, map, Encoding::Linear, [255; 4]);
                let factor = factor.filter(|&factor| factor > 0.0).unwrap_or(1.0);
                ScalarInput { factor: factor * map.gain.max(0.0), texture: Some((lookup, channel)) }
            }
        })
    }

    /// Our material for it.
    pub(super) fn convert(&self, builder: &mut Builder) -> Material {
        let surface = self.surface(builder);
        let mut material = Material::plain(&self.name, surface);
        if self.color("ke").is_some_and(|emission| emission.max_element() > 0.0) || self.maps.contains_key("map_ke") {
            material.emission = self.color_input(builder, "ke", Vec3::ZERO);
        }
        material.relief = self.relief(builder);
        material.stretch = self.stretch();
        if !matches!(material.surface, Surface::Dielectric { .. }) {
            material.alpha = self.alpha(builder);
        }
        self.note_zeros_beside_maps(builder);
        self.note_unread(builder);
        material
    }

    /// Names factors of 0 that stand for 1.
    fn note_zeros_beside_maps(&self, builder: &mut Builder) {
        let is_idle = |key: &&str| {
            let key = key.to_ascii_lowercase();
            let is_zero = self.numbers.get(&key).is_some_and(|numbers| numbers.iter().all(|&number| number <= 0.0));
            is_zero && self.maps.contains_key(&format!("map_{key}"))
        };
        let factors = ["Kd", "Ks", "Ke", "Pr", "Pm", "Pc", "Pcr", "Ps"].into_iter();
        let idle: Vec<String> = factors.filter(is_idle).map(|key| format!("{key} 0")).collect();
        if !idle.is_empty() {
            self.note_zero_beside_map(builder, &idle.join(", "));
        }
    }

    fn note_zero_beside_map(&self, builder: &mut Builder, factor: &str) {
        builder.note(format!("Material \"{}\": {factor} beside a picture is taken as 1.", self.name));
    }

    /// Names what was left out in one sentence.
    fn note_unread(&self, builder: &mut Builder) {
        let keys = self.numbers.keys().chain(self.maps.keys()).map(String::as_str);
        let mut unread: Vec<String> =
            keys.filter(|key| !READ.contains(key) && !MEANINGLESS.contains(key)).map(str::to_owned).collect();
        let raised = self.maps.iter().filter(|(_, map)| map.base != 0.0);
        unread.extend(raised.map(|(key, map)| format!("the first number of {key} -mm ({})", map.base)));
        unread.sort_unstable();
        if !unread.is_empty() {
            builder.note(format!("Material \"{}\": not used: {}.", self.name, unread.join(", ")));
        }
    }

    /// `norm` holds normals, `bump` heights unless it looks like normals, `disp` heights. Neither the format
    /// nor its readers agree on the unit of heights: at a multiplier of 1, white is here a fiftieth of the
    /// picture's width above black.
    fn relief(&self, builder: &mut Builder) -> Option<Relief> {
        const MAX_HEIGHT: f32 = 0.02;
        if let Some(map) = self.map(&["norm"]) {
            let lookup = self.lookup(builder, map, Encoding::Linear, [128, 128, 255, 255]);
            return Some(Relief::Normals { map: lookup, strength: map.bump * map.gain });
        }
        let bump = self.map(&["bump", "map_bump"]);
        let map = bump.or_else(|| self.map(&["disp", "map_disp"]))?;
        if bump.is_none() {
            builder.note(format!("Material \"{}\": displacement turns normals, the surface stays.", self.name));
        }
        let lookup = self.lookup(builder, map, Encoding::Linear, [128; 4]);
        let heights = HeightMap {
            height: ScalarInput {
                factor: MAX_HEIGHT * map.bump * map.gain,
                texture: Some((lookup, map.channel.unwrap_or(0).min(2))),
            },
            unit: HeightUnit::PictureWidth,
        };
        if bump.is_some() {
            builder.bumps.push(Bump { heights, strength: map.bump * map.gain });
        }
        Some(Relief::Heights(heights))
    }

    fn alpha(&self, builder: &mut Builder) -> Alpha {
        let opacity = self.opacity();
        let Some(map) = self.map(&["map_d"]) else {
            if opacity == 0.0 && self.number("d").is_none() {
                // A common slip about the meaning of Tr; that of d is known to all.
                builder.note(format!("Material \"{}\": Tr 1 is taken for opaque; d 0 is transparent.", self.name));
                return Alpha::Opaque;
            }
            return match opacity < 1.0 {
                true => Alpha::Blend { value: ScalarInput::constant(opacity) },
                false => Alpha::Opaque,
            };
        };
        // The colour's own file named again means its alpha channel; any other file is a grey picture.
        let same_file = self.map(&["map_kd"]).is_some_and(|color| color.file == map.file);
        let channel = map.channel.unwrap_or(if same_file { 3 } else { 0 });
        let lookup = self.lookup(builder, map, Encoding::Linear, [255; 4]);
        let factor = if opacity > 0.0 {
            opacity
        } else {
            self.note_zero_beside_map(builder, self.transparency());
            1.0
        };
        Alpha::Blend { value: ScalarInput { factor: factor * map.gain.max(0.0), texture: Some((lookup, channel)) } }
    }

    /// How the file says that nothing is there.
    fn transparency(&self) -> &'static str {
        if self.number("d").is_some() { "d 0" } else { "Tr 1" }
    }

    /// `d`, or 1 − `Tr`.
    fn opacity(&self) -> f32 {
        self.number("d").or(self.number("tr").map(|transparency| 1.0 - transparency)).unwrap_or(1.0).clamp(0.0, 1.0)
    }
}

/// The file as named, else a file of that name beside the material file (paths of another machine).
pub(super) fn find_file(folder: &Path, name: &str) -> PathBuf {
    let named = folder.join(name);
    if named.is_file() {
        return named;
    }
    let beside = name.rsplit('/').next().map(|last| folder.join(last));
    beside.filter(|path| path.is_file()).unwrap_or(named)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn texture_options_stand_before_and_after_names_with_spaces() {
        let map = parse_map("-bm 0.5 -o .1 .2 -s 2 3 1 -clamp on my  wood.png");
        assert_eq!(map.file, "my  wood.png");
        assert_eq!((map.offset, map.scale, map.bump, map.clamp), (Vec2::new(0.1, 0.2), Vec2::new(2.0, 3.0), 0.5, true));
        let map = parse_map("-mm 0.1 0.5 wood.png");
        assert_eq!((map.file.as_str(), map.base, map.gain), ("wood.png", 0.1, 0.5));
        let map = parse_map("-imfchan g dir\\bump 2.jpg -bm 1.5");
        assert_eq!((map.file.as_str(), map.bump, map.channel), ("dir/bump 2.jpg", 1.5, Some(1)));
        // A name that starts with a digit after an option that takes up to three numbers.
        assert_eq!(parse_map("-o 0.1 diffuse.jpg").file, "diffuse.jpg");
        assert_eq!(parse_map("-colorspace sRGB -o 0.1 diffuse.jpg").file, "diffuse.jpg");
        assert_eq!(parse_map("").file, "");
    }
}
