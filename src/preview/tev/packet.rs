//! What tev understands: packets of its inter-process protocol (github.com/Tom94/tev, `include/tev/Ipc.h`).
//!
//! Every packet begins with its length in bytes, these four included, and a byte for its kind. Numbers are
//! little-endian, text ends with a zero byte, truth is a byte of 0 or 1.

const UPDATE_IMAGE_V3: u8 = 6;
const CREATE_IMAGE: u8 = 4;

/// Channels with one value for each pixel, row-major.
pub(super) struct Layer {
    pub(super) names: Vec<&'static str>,
    /// One after the other.
    pub(super) values: Vec<f32>,
}

/// An empty picture of these channels, in place of one of the same name.
pub(super) fn create(name: &str, width: u32, height: u32, channels: &[&str]) -> Vec<u8> {
    let mut packet = begin(CREATE_IMAGE, name);
    for number in [width, height, channels.len() as u32] {
        packet.extend(number.to_le_bytes());
    }
    channels.iter().for_each(|channel| push_text(&mut packet, channel));
    finish(packet)
}

/// A packet with all values of a layer of such a picture.
pub(super) fn update(name: &str, width: u32, height: u32, layer: &Layer) -> Vec<u8> {
    let mut packet = begin(UPDATE_IMAGE_V3, name);
    packet.extend((layer.names.len() as u32).to_le_bytes());
    layer.names.iter().for_each(|channel| push_text(&mut packet, channel));
    for number in [0, 0, width, height] {
        packet.extend(number.to_le_bytes());
    }
    let pixels = u64::from(width) * u64::from(height);
    let offsets = (0..layer.names.len() as u64).map(|channel| channel * pixels);
    offsets.for_each(|offset| packet.extend(offset.to_le_bytes()));
    layer.names.iter().for_each(|_| packet.extend(1_u64.to_le_bytes()));
    packet.reserve(4 * layer.values.len());
    layer.values.iter().for_each(|value| packet.extend(value.to_le_bytes()));
    finish(packet)
}

/// A packet that leaves the picture that is looked at alone.
fn begin(kind: u8, name: &str) -> Vec<u8> {
    let mut packet = vec![0, 0, 0, 0, kind, 0];
    push_text(&mut packet, name);
    packet
}

fn push_text(packet: &mut Vec<u8>, text: &str) {
    packet.extend(text.bytes().filter(|&byte| byte != 0));
    packet.push(0);
}

fn finish(mut packet: Vec<u8>) -> Vec<u8> {
    let length = packet.len() as u32;
    packet[..4].copy_from_slice(&length.to_le_bytes());
    packet
}
