//! Attributes of an EXR header in a fixed order.
//!
//! The `exr` crate keeps custom attributes in a hash map, so it writes them in another order in each run. Attributes
//! may stand in any order and each carries its length, so sorting them in place moves nothing else in the file.

use std::io::{self, Read, Seek, SeekFrom, Write};

/// Magic number and version.
const PREAMBLE: u64 = 8;

/// Sorts the attributes of a single-part EXR file by name.
pub(super) fn sort_attributes(file: &mut (impl Read + Write + Seek)) -> io::Result<()> {
    file.seek(SeekFrom::Start(PREAMBLE))?;
    let mut attributes = Vec::new();
    let mut reader = io::BufReader::new(&mut *file);
    loop {
        let name = read_name(&mut reader)?;
        if name.len() == 1 {
            break; // the empty name that ends a header
        }
        let mut bytes = name.clone();
        bytes.extend(read_name(&mut reader)?);
        let mut size = [0; 4];
        reader.read_exact(&mut size)?;
        bytes.extend(size);
        let value_at = bytes.len();
        bytes.resize(value_at + u32::from_le_bytes(size) as usize, 0);
        reader.read_exact(&mut bytes[value_at..])?;
        attributes.push((name, bytes));
    }
    attributes.sort();
    let sorted: Vec<u8> = attributes.into_iter().flat_map(|(_, bytes)| bytes).collect();
    file.seek(SeekFrom::Start(PREAMBLE))?;
    file.write_all(&sorted)
}

/// Reads a name with the zero byte that ends it.
fn read_name(reader: &mut impl io::BufRead) -> io::Result<Vec<u8>> {
    let mut name = Vec::new();
    reader.read_until(0, &mut name)?;
    if name.last() == Some(&0) { Ok(name) } else { Err(io::ErrorKind::UnexpectedEof.into()) }
}
