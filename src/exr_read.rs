//! The only way in which this program opens an OpenEXR file: first the header, against a limit, then the pixels.
//!
//! A 2 kB file can promise a picture of 60 GB, and a failed allocation of that size ends the process; so nothing is
//! decoded before the promised size is known to fit.

use exr::meta::MetaData;
use exr::meta::header::{Header, ImageAttributes, LayerAttributes};
use exr::prelude::{FlatSamples, ReadChannels, ReadLayers};
use std::io::Cursor;

/// Why an OpenEXR file was not read.
#[derive(Debug, thiserror::Error)]
pub enum ExrError {
    /// The file is damaged or cut off.
    #[error("not a readable OpenEXR file: {0}")]
    Damaged(String),
    /// The file may be right, but uses something that is not read.
    #[error("{0}")]
    Unsupported(String),
    /// The picture is larger than the limit.
    #[error("{0}")]
    TooLarge(String),
}

/// How large a picture may be.
#[derive(Clone, Copy, Debug)]
pub struct Limits {
    /// Most pixels along a side.
    pub longest_side: usize,
    /// Most bytes of all decoded samples together, at 4 bytes a sample.
    pub most_bytes: usize,
}

impl Default for Limits {
    fn default() -> Self {
        Self {
            longest_side: 32_768,
            most_bytes: 1 << 30,
        }
    }
}

/// A whole OpenEXR file.
#[derive(Clone, Debug)]
pub struct ExrFile {
    /// Attributes of the file: display window, own attributes in `other`.
    pub attributes: ImageAttributes,
    /// Layers ("parts") in the file's order.
    pub layers: Vec<ExrLayer>,
}

/// One layer of an OpenEXR file.
#[derive(Clone, Debug)]
pub struct ExrLayer {
    /// Pixels in a row.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// Attributes of the layer: name, white luminance, own attributes in `other`.
    pub attributes: LayerAttributes,
    /// Channels, sorted by name as the format demands.
    pub channels: Vec<ExrChannel>,
}

/// One channel of a layer.
#[derive(Clone, Debug)]
pub struct ExrChannel {
    /// Name, for example `R` or `depth.Z`.
    pub name: String,
    /// Samples, row by row, top row first.
    pub samples: Samples,
}

/// Samples of a channel. Half floats are widened.
#[derive(Clone, Debug, PartialEq)]
pub enum Samples {
    /// Floating point values.
    Float(Vec<f32>),
    /// Whole numbers: sample counts, object ids.
    Uint(Vec<u32>),
}

/// A picture's colour and coverage.
#[derive(Clone, Debug)]
pub struct RgbaPicture {
    /// Pixels in a row.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// Linear red, green, blue and alpha, row by row from the top.
    pub texels: Vec<[f32; 4]>,
}

impl ExrLayer {
    /// A channel by its name.
    pub fn channel(&self, name: &str) -> Option<&ExrChannel> {
        self.channels.iter().find(|channel| channel.name == name)
    }
}

impl Samples {
    /// How many there are.
    pub fn len(&self) -> usize {
        match self {
            Self::Float(values) => values.len(),
            Self::Uint(values) => values.len(),
        }
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// The sample as a float.
    pub fn get(&self, index: usize) -> Option<f32> {
        match self {
            Self::Float(values) => values.get(index).copied(),
            Self::Uint(values) => values.get(index).map(|&value| value as f32),
        }
    }
}

/// Whether these are the first bytes of an OpenEXR file.
pub fn is_exr(bytes: &[u8]) -> bool {
    bytes.starts_with(&[0x76, 0x2f, 0x31, 0x01])
}

/// The headers alone, one a layer; no pixel is decoded.
pub fn read_headers(bytes: &[u8]) -> Result<Vec<Header>, ExrError> {
    let headers = MetaData::read_from_buffered(Cursor::new(bytes), false)
        .map_err(|error| damaged(&error))?
        .headers;
    Ok(headers.into_vec())
}

/// The whole file, if it fits the limits.
pub fn read(bytes: &[u8], limits: &Limits) -> Result<ExrFile, ExrError> {
    check(&read_headers(bytes)?, limits)?;
    let image = exr::prelude::read()
        .no_deep_data()
        .largest_resolution_level()
        .all_channels()
        .all_layers()
        .all_attributes()
        .from_buffered(Cursor::new(bytes))
        .map_err(|error| damaged(&error))?;
    let layers = image.layer_data.into_iter().map(|layer| ExrLayer {
        width: layer.size.width(),
        height: layer.size.height(),
        attributes: layer.attributes,
        channels: layer
            .channel_data
            .list
            .into_iter()
            .map(|channel| ExrChannel {
                name: channel.name.to_string(),
                samples: match channel.sample_data {
                    FlatSamples::F16(values) => {
                        Samples::Float(values.into_iter().map(|value| value.to_f32()).collect())
                    }
                    FlatSamples::F32(values) => Samples::Float(values),
                    FlatSamples::U32(values) => Samples::Uint(values),
                },
            })
            .collect(),
    });
    Ok(ExrFile {
        attributes: image.attributes,
        layers: layers.collect(),
    })
}

/// The first layer that has `R G B` (and perhaps `A`) or a grey `Y`.
pub fn read_rgba(bytes: &[u8], limits: &Limits) -> Result<RgbaPicture, ExrError> {
    let file = read(bytes, limits)?;
    let colour = |layer: &ExrLayer, [r, g, b]: [&str; 3]| {
        let channels = [layer.channel(r)?, layer.channel(g)?, layer.channel(b)?];
        let alpha = layer.channel("A");
        let pixel = |index| {
            let [r, g, b] = channels.map(|channel| channel.samples.get(index).unwrap_or(0.0));
            [
                r,
                g,
                b,
                alpha
                    .and_then(|alpha| alpha.samples.get(index))
                    .unwrap_or(1.0),
            ]
        };
        let texels = (0..layer.width * layer.height).map(pixel).collect();
        Some(RgbaPicture {
            width: layer.width,
            height: layer.height,
            texels,
        })
    };
    let find = |names| file.layers.iter().find_map(|layer| colour(layer, names));
    find(["R", "G", "B"])
        .or_else(|| find(["Y", "Y", "Y"]))
        .ok_or_else(|| {
            let names = file
                .layers
                .iter()
                .flat_map(|layer| &layer.channels)
                .map(|channel| channel.name.as_str());
            let names: Vec<&str> = names.take(12).collect();
            ExrError::Unsupported(format!(
                "needs the channels R, G, B or Y; the file has {}",
                names.join(", ")
            ))
        })
}

fn check(headers: &[Header], limits: &Limits) -> Result<(), ExrError> {
    let mut bytes: u128 = 0;
    for header in headers {
        let (width, height) = (header.layer_size.width(), header.layer_size.height());
        if width == 0 || height == 0 {
            return Err(ExrError::Damaged(format!(
                "a layer of {width} x {height} pixels"
            )));
        }
        if width > limits.longest_side || height > limits.longest_side {
            let limit = limits.longest_side;
            return Err(ExrError::TooLarge(format!(
                "{width} x {height} pixels; at most {limit} a side are read"
            )));
        }
        if header.deep {
            return Err(ExrError::Unsupported(
                "deep data is not read, only flat pictures".to_owned(),
            ));
        }
        if header
            .channels
            .list
            .iter()
            .any(|channel| channel.sampling.x() != 1 || channel.sampling.y() != 1)
        {
            return Err(ExrError::Unsupported(
                "channels of lower resolution (luminance-chroma) are not read".to_owned(),
            ));
        }
        bytes += width as u128 * height as u128 * header.channels.list.len() as u128 * 4;
    }
    if bytes > limits.most_bytes as u128 {
        let (promised, limit) = (bytes >> 20, limits.most_bytes >> 20);
        return Err(ExrError::TooLarge(format!(
            "the header promises {promised} MiB of pixels; at most {limit} are read"
        )));
    }
    Ok(())
}

fn damaged(error: &exr::error::Error) -> ExrError {
    match error {
        exr::error::Error::NotSupported(what) => {
            ExrError::Unsupported(format!("OpenEXR feature not read: {what}"))
        }
        other => ExrError::Damaged(
            other
                .to_string()
                .split_whitespace()
                .collect::<Vec<_>>()
                .join(" "),
        ),
    }
}
