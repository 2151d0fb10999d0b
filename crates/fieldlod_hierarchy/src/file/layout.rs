//! Header and directory of a file.

use bytemuck::{Pod, Zeroable};
use xxhash_rust::xxh3::{xxh3_64, xxh3_64_with_seed};

use super::error::{FORMAT_VERSION, FileError};
use super::reader::Reader;
use crate::file::vertices::attributes::Attributes;
use crate::file::vertices::quantize::{Grids, Precision};
use crate::vertices::SourceHash;

const MAGIC: [u8; 8] = *b"FLDLOD\r\n";
const WHAT: &str = "the directory";
/// Flag of an entry: the index of the carrier joint follows.
const HAS_CARRIER_JOINT: u8 = 2;
/// Flag of a lossless entry: the position error follows, because the file was written from a quantized one.
const HAS_POSITION_ERROR: u8 = 4;

/// The directory entry of a primitive.
#[derive(Clone, Debug)]
pub(super) struct Entry {
    /// Index in the file that was read.
    pub(super) number: usize,
    pub(super) mesh_index: u32,
    pub(super) primitive_index: u32,
    pub(super) name: String,
    pub(super) source: SourceHash,
    pub(super) attributes: Attributes,
    pub(super) precision: Precision,
    pub(super) carrier_joint: Option<u16>,
    pub(super) grids: Grids,
    pub(super) position_error_in_local: f32,
    pub(super) counts: Counts,
    pub(super) sections: Vec<SectionEntry>,
}

/// Numbers of groups and vertices of a primitive.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C)]
pub(super) struct Counts {
    pub(super) groups: u32,
    pub(super) vertices: u32,
    pub(super) source_vertices: u32,
    /// Number of moved vertices with a source vertex. The last section holds them.
    pub(super) origins: u32,
    /// Number of vertices that no unit uses. The last section holds them.
    pub(super) unused_vertices: u32,
}

/// Length and checksum of a section.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Pod, Zeroable)]
#[repr(C)]
pub(super) struct SectionEntry {
    pub(super) length: u64,
    pub(super) checksum: u64,
}

impl SectionEntry {
    pub(super) fn of(section: &[u8]) -> Self {
        Self {
            length: section.len() as u64,
            checksum: xxh3_64(section),
        }
    }

    pub(super) fn check(self, section: &[u8]) -> Result<(), FileError> {
        if xxh3_64(section) == self.checksum {
            Ok(())
        } else {
            Err(FileError::Checksum)
        }
    }
}

impl Entry {
    pub(super) fn grids(&self) -> Option<&Grids> {
        (self.precision == Precision::Quantized16).then_some(&self.grids)
    }

    fn flags(&self) -> u8 {
        let carrier_joint = u8::from(self.carrier_joint.is_some()) * HAS_CARRIER_JOINT;
        let is_lossless_with_error = self.grids().is_none() && self.position_error_in_local != 0.0;
        carrier_joint | (u8::from(is_lossless_with_error) * HAS_POSITION_ERROR)
    }

    pub(super) fn write(&self, bytes: &mut Vec<u8>) {
        // Identity.
        bytes.extend_from_slice(&self.mesh_index.to_le_bytes());
        bytes.extend_from_slice(&self.primitive_index.to_le_bytes());
        bytes.extend_from_slice(&(self.name.len() as u32).to_le_bytes());
        bytes.extend_from_slice(self.name.as_bytes());
        bytes.extend_from_slice(&self.source.0.to_le_bytes());
        // Attributes and precision.
        bytes.push(self.attributes.bits);
        bytes.push(u8::from(self.precision == Precision::Quantized16));
        bytes.push(self.flags());
        if let Some(joint) = self.carrier_joint {
            bytes.extend_from_slice(&joint.to_le_bytes());
        }
        if let Some(grids) = self.grids() {
            bytes.extend_from_slice(bytemuck::bytes_of(grids));
        }
        if self.grids().is_some() || self.position_error_in_local != 0.0 {
            bytes.extend_from_slice(&self.position_error_in_local.to_le_bytes());
        }
        // Counts and sections.
        bytes.extend_from_slice(bytemuck::bytes_of(&self.counts));
        bytes.extend_from_slice(&(self.sections.len() as u32).to_le_bytes());
        bytes.extend_from_slice(bytemuck::cast_slice(&self.sections));
    }

    pub(super) fn read(reader: &mut Reader<'_>, primitive: usize) -> Result<Self, FileError> {
        // Identity.
        let mesh_index = reader.value(WHAT)?;
        let primitive_index = reader.value(WHAT)?;
        let length: u32 = reader.value("a name")?;
        let name = reader.take("a name", u64::from(length))?.to_vec();
        let name = String::from_utf8(name).map_err(|_| FileError::Name { primitive })?;
        let source = SourceHash(reader.value(WHAT)?);
        // Attributes and precision.
        let attributes = Attributes::from_bits(reader.value(WHAT)?);
        let is_quantized = read_flag(reader)?;
        let flags: u8 = reader.value(WHAT)?;
        if flags & !(HAS_CARRIER_JOINT | HAS_POSITION_ERROR) != 0 {
            return Err(FileError::Corrupt { what: WHAT });
        }
        let carrier_joint = match flags & HAS_CARRIER_JOINT {
            0 => None,
            _ => Some(reader.value(WHAT)?),
        };
        let (mut precision, mut grids) = (Precision::Lossless, Grids::default());
        let mut position_error_in_local = 0.0;
        if is_quantized {
            precision = Precision::Quantized16;
            grids = reader.value(WHAT)?;
        }
        if is_quantized || flags & HAS_POSITION_ERROR != 0 {
            position_error_in_local = reader.value(WHAT)?;
        }
        // Counts and sections.
        let entry = Self {
            number: primitive,
            mesh_index,
            primitive_index,
            name,
            source,
            attributes: attributes.ok_or(FileError::Corrupt { what: WHAT })?,
            precision,
            carrier_joint,
            grids,
            position_error_in_local,
            counts: reader.value(WHAT)?,
            sections: read_sections(reader)?,
        };
        if entry.grids.are_usable() && (0.0..f32::INFINITY).contains(&position_error_in_local) {
            Ok(entry)
        } else {
            Err(FileError::Corrupt { what: WHAT })
        }
    }
}

fn read_flag(reader: &mut Reader<'_>) -> Result<bool, FileError> {
    match reader.value::<u8>(WHAT)? {
        0 => Ok(false),
        1 => Ok(true),
        _ => Err(FileError::Corrupt { what: WHAT }),
    }
}

fn read_sections(reader: &mut Reader<'_>) -> Result<Vec<SectionEntry>, FileError> {
    let count: u32 = reader.value(WHAT)?;
    Ok(reader.array(count as usize, WHAT)?.collect())
}

/// Encodes header and directory.
pub(super) fn write(entries: &[Entry]) -> Vec<u8> {
    let mut directory = Vec::new();
    for entry in entries {
        entry.write(&mut directory);
    }
    seal(MAGIC, entries.len() as u32, &directory)
}

/// Prepends a header with length and checksum to a directory.
pub(super) fn seal(magic: [u8; 8], count: u32, directory: &[u8]) -> Vec<u8> {
    let mut bytes = magic.to_vec();
    bytes.extend_from_slice(&FORMAT_VERSION.to_le_bytes());
    bytes.extend_from_slice(&count.to_le_bytes());
    bytes.extend_from_slice(&(directory.len() as u64).to_le_bytes());
    // The seed lets the checksum cover the count as well.
    let checksum = xxh3_64_with_seed(directory, u64::from(count));
    bytes.extend_from_slice(&checksum.to_le_bytes());
    bytes.extend_from_slice(directory);
    bytes
}

/// Length of the header.
pub(super) const HEADER_BYTES: usize = 32;

/// Header of a directory.
pub(super) struct Header {
    pub(super) count: u32,
    pub(super) length: u64,
    checksum: u64,
}

impl Header {
    /// Reads a header that starts with `magic`.
    pub(super) fn read(magic: [u8; 8], reader: &mut Reader<'_>) -> Result<Self, FileError> {
        let Some(rest) = reader.rest.strip_prefix(&magic) else {
            return Err(FileError::NotFieldlod);
        };
        reader.rest = rest;
        // The version comes before all that may change with it.
        let found: u32 = reader.value("the header")?;
        if found != FORMAT_VERSION {
            return Err(FileError::Version { found });
        }
        Ok(Self {
            count: reader.value("the header")?,
            length: reader.value("the header")?,
            checksum: reader.value("the header")?,
        })
    }

    /// Takes the directory and verifies its checksum.
    pub(super) fn directory<'a>(&self, reader: &mut Reader<'a>) -> Result<&'a [u8], FileError> {
        let directory = reader.take(WHAT, self.length)?;
        if xxh3_64_with_seed(directory, u64::from(self.count)) == self.checksum {
            Ok(directory)
        } else {
            Err(FileError::Checksum)
        }
    }
}

/// Reads header and directory. Also returns the bytes of the sections.
pub(super) fn read(bytes: &[u8]) -> Result<(Vec<Entry>, &[u8]), FileError> {
    let mut reader = Reader { rest: bytes };
    let header = Header::read(MAGIC, &mut reader)?;
    let directory = header.directory(&mut reader)?;
    let sections = reader.rest;
    let mut reader = Reader { rest: directory };
    // No capacity is reserved: the count of a malformed file may be huge.
    let mut entries = Vec::new();
    for primitive in 0..header.count as usize {
        entries.push(Entry::read(&mut reader, primitive)?);
    }
    match reader.rest.len() as u64 {
        0 => Ok((entries, sections)),
        extra => Err(FileError::TrailingBytes { extra }),
    }
}
