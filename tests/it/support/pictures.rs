//! Small pictures of light that tests make up, and what becomes of them.

use fechner::exr_read::read_exr;
use fechner::output::{Attribute, NITS_PER_UNIT, Picture, write_exr};
use std::path::Path;

/// Writes a picture of light in cd/m², `rgb` of each pixel's number.
pub(crate) fn write_light(path: &Path, [width, height]: [u32; 2], rgb: impl Fn(usize) -> [f32; 3]) {
    let pixels: Vec<[f32; 3]> = (0..(width * height) as usize).map(rgb).collect();
    let mut picture = Picture::new(width, height);
    for (channel, letter) in ["R", "G", "B"].into_iter().enumerate() {
        picture.push_f32(letter, pixels.iter().map(|rgb| rgb[channel]).collect::<Vec<_>>());
    }
    picture.push_attribute(NITS_PER_UNIT, Attribute::Float(1.0));
    write_exr(path, &picture).expect("written");
}

/// Mean of a channel of an EXR file.
pub(crate) fn mean(folder: &Path, name: &str, channel: &str) -> f32 {
    let exr = read_exr(&folder.join(name)).expect("an EXR file");
    let values = exr.channel(channel).expect("the channel");
    values.iter().sum::<f32>() / values.len() as f32
}
