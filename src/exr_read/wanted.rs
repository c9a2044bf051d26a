//! Chooses which channels of a file are read; the others, which production files have by the dozen, are passed over.

use ::exr::block::chunk::TileCoordinates;
use ::exr::block::lines::LineRef;
use ::exr::error::{Result, UnitResult};
use ::exr::image::FlatSamples;
use ::exr::image::read::any_channels::{ReadSamples, SamplesReader};
use ::exr::image::read::samples::{FlatSamplesReader, ReadFlatSamples};
use ::exr::meta::attribute::{ChannelDescription, Text};
use ::exr::meta::header::Header;
use std::collections::HashSet;

/// Names of the channels that are to be read.
#[derive(Clone, Debug)]
pub(super) struct Wanted {
    names: HashSet<String>,
    /// Whether channels have the name of their part before their own.
    has_several_parts: bool,
}

impl Wanted {
    /// The channels of all parts that `choose` chooses among the names of all.
    pub(super) fn of(headers: &[Header], choose: impl FnOnce(&[String]) -> Vec<String>) -> Self {
        let mut wanted = Self { names: HashSet::new(), has_several_parts: headers.len() > 1 };
        let all: Vec<String> = headers.iter().flat_map(|header| wanted.names_of(header)).collect();
        wanted.names = choose(&all).into_iter().collect();
        wanted
    }

    /// How many channels of a part are read.
    pub(super) fn channels_of(&self, header: &Header) -> u64 {
        self.names_of(header).filter(|name| self.names.contains(name)).count() as u64
    }

    /// What a channel of a part is called in an [`ExrImage`](super::ExrImage).
    pub(super) fn full_name(&self, part: &str, channel: &str) -> String {
        if self.has_several_parts && !part.is_empty() { format!("{part}.{channel}") } else { channel.to_owned() }
    }

    fn names_of(&self, header: &Header) -> impl Iterator<Item = String> {
        header.channels.list.iter().map(|channel| self.name_of(header, channel))
    }

    fn name_of(&self, header: &Header, channel: &ChannelDescription) -> String {
        let part = header.own_attributes.layer_name.as_ref().map(Text::to_string).unwrap_or_default();
        self.full_name(&part, &channel.name.to_string())
    }
}

impl ReadSamples for Wanted {
    type Reader = SomeSamples;

    fn create_sample_reader(&self, header: &Header, channel: &ChannelDescription) -> Result<Self::Reader> {
        if !self.names.contains(&self.name_of(header, channel)) {
            return Ok(SomeSamples(None));
        }
        ReadFlatSamples.create_sample_reader(header, channel).map(Some).map(SomeSamples)
    }
}

/// The samples of a channel's largest level of resolution, or none where it is not wanted.
pub(super) struct SomeSamples(Option<FlatSamplesReader>);

impl SamplesReader for SomeSamples {
    type Samples = Option<FlatSamples>;

    fn filter_block(&self, tile: TileCoordinates) -> bool {
        self.0.as_ref().is_some_and(|reader| reader.filter_block(tile))
    }

    fn read_line(&mut self, line: LineRef<'_>) -> UnitResult {
        self.0.as_mut().map_or(Ok(()), |reader| reader.read_line(line))
    }

    fn into_samples(self) -> Self::Samples {
        self.0.map(SamplesReader::into_samples)
    }
}
