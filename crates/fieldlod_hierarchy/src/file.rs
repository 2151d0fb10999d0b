//! The `.fieldlod` file: hierarchies, compact, coarsest level first.
//!
//! ```text
//! magic "FLDLOD\r\n" | version u32 | primitive count u32 | directory bytes u64 | XXH3 of it u64
//! directory: per primitive  place, name, source hash, attributes, precision, counts,
//!            and length u64 and XXH3 u64 of each section
//! sections:  the first of every primitive, the second of every primitive, …
//! ```
//! Little-endian throughout. The magic's line end catches transfers that rewrite line ends. The
//! first section of a primitive holds the groups that nothing coarser replaces, each further one
//! the groups of the next finer level. The groups of any number of first sections are all that
//! some cut refines, so that a reader may stop there and has a whole, coarser hierarchy
//! ([`BakedFile::from_bytes_coarse`]).
//!
//! A vertex is stored once, in the first section that uses it, as the difference to what its
//! neighbours suggest (the parallelogram rule of C. Touma and C. Gotsman: Triangle Mesh
//! Compression, 1998); a triangle by the edge that it shares with one before it. What remains is
//! entropy-coded by the pco library.
//!
//! Deviation: meshoptimizer's vertex and index codecs are not used. Their only kept implementation
//! is C++, which whoever loads a file would have to link; they keep neither the order of vertices
//! nor the corner at which a triangle begins; and they rely on a general compressor after them.

mod attributes;
mod coded;
mod layout;
mod numbers;
mod octahedron;
mod planes;
mod predictor;
mod quantize;
mod reader;
mod records;
mod references;
mod section;
mod triangles;

use thiserror::Error;

use crate::{Hierarchy, InvalidHierarchy};
use attributes::Attributes;
use coded::{Coded, Frame};
use layout::{Entry, SectionEntry};
use quantize::Grids;
use reader::Reader;
use section::Section;

/// The version that this crate writes, and the only one that it reads.
pub const FORMAT_VERSION: u32 = 3;

// The arrays are written as they lie in memory.
const _: () = assert!(cfg!(target_endian = "little"));

/// The contents of a `.fieldlod` file: the hierarchies of one glTF file's mesh primitives.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct BakedFile {
    /// One entry per baked primitive.
    pub primitives: Vec<BakedPrimitive>,
}

/// The hierarchy of one primitive of a glTF mesh.
#[derive(Clone, Debug, PartialEq)]
pub struct BakedPrimitive {
    /// Index of the mesh in the glTF file.
    pub mesh_index: u32,
    /// Index of the primitive in that mesh.
    pub primitive_index: u32,
    /// The mesh's name, or an empty string.
    pub name: String,
    /// Its levels of detail.
    pub hierarchy: Hierarchy,
    /// How far the positions in `hierarchy` lie from those of the source at most, in local units:
    /// 0 unless the file was written with [`Precision::Quantized16`]. Whoever takes the vertices
    /// from the source mesh, by index, is not concerned.
    pub position_error_in_local: f32,
}

impl BakedPrimitive {
    /// Names a hierarchy by its place in the glTF file.
    #[must_use]
    pub fn new(
        mesh_index: u32,
        primitive_index: u32,
        name: impl Into<String>,
        hierarchy: Hierarchy,
    ) -> Self {
        Self {
            mesh_index,
            primitive_index,
            name: name.into(),
            hierarchy,
            position_error_in_local: 0.0,
        }
    }
}

/// How exactly a file keeps vertex attributes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Precision {
    /// Bit for bit.
    #[default]
    Lossless,
    /// Positions, texture coordinates and colours in 65536 steps of their extent along each axis;
    /// normals and tangents to 0.06°. Bounds grow to hold the moved triangles.
    Quantized16,
}

/// Why bytes are not a usable `.fieldlod` file.
#[derive(Clone, Debug, Error, PartialEq)]
#[non_exhaustive]
#[expect(
    missing_docs,
    reason = "the fields are named by each variant's message"
)]
pub enum FileError {
    /// The first bytes are not the magic.
    #[error("not a .fieldlod file")]
    NotFieldlod,
    /// Written by another version.
    #[error("format version {found}, but this program reads version {FORMAT_VERSION}: bake again")]
    Version { found: u32 },
    /// Fewer bytes than the header or an array announces.
    #[error("truncated: {what} ends after {available} of {needed} bytes")]
    Truncated {
        what: &'static str,
        needed: u64,
        available: u64,
    },
    /// More bytes than the header announces.
    #[error("{extra} bytes follow the end of the data")]
    TrailingBytes { extra: u64 },
    /// The checksum does not fit.
    #[error("corrupt: the checksum does not fit the data")]
    Checksum,
    /// The name is not UTF-8.
    #[error("corrupt: the name of primitive {primitive} is not UTF-8")]
    Name { primitive: usize },
    /// What cannot have been written, although the checksum fits.
    #[error("corrupt: {what} cannot be decoded")]
    Corrupt { what: &'static str },
    /// An invariant is broken although the checksum fits.
    #[error("primitive {primitive}: {fault}")]
    Invalid {
        primitive: usize,
        fault: InvalidHierarchy,
    },
}

impl BakedFile {
    /// The file's bytes, lossless: the same for the same contents.
    ///
    /// # Panics
    /// If a hierarchy is not valid.
    #[must_use]
    pub fn to_bytes(&self) -> Vec<u8> {
        self.to_bytes_with(Precision::Lossless)
    }

    /// The file's bytes: the same for the same contents.
    ///
    /// # Panics
    /// If a hierarchy is not valid.
    #[must_use]
    pub fn to_bytes_with(&self, precision: Precision) -> Vec<u8> {
        let primitives = self.primitives.iter();
        let (entries, sections): (Vec<Entry>, Vec<Vec<Vec<u8>>>) = primitives
            .map(|primitive| encode(primitive, precision))
            .unzip();
        let mut bytes = layout::write(&entries);
        let most = sections.iter().map(Vec::len).max().unwrap_or(0);
        for number in 0..most {
            for section in sections.iter().filter_map(|sections| sections.get(number)) {
                bytes.extend_from_slice(section);
            }
        }
        bytes
    }

    /// Reads and validates a file's bytes.
    ///
    /// # Errors
    /// A [`FileError`] that says what is wrong; never a panic, whatever the bytes.
    pub fn from_bytes(bytes: &[u8]) -> Result<Self, FileError> {
        read(bytes, None)
    }

    /// Reads only the coarsest `sections` sections of each primitive, which may be all that
    /// `bytes` hold: so many levels, and at every level whatever is as coarse as it gets there.
    /// The finest that was read then counts as source geometry, vertices are only those in use,
    /// in an order of their own, and levels are counted from the finest read.
    ///
    /// # Errors
    /// A [`FileError`] that says what is wrong; never a panic, whatever the bytes.
    pub fn from_bytes_coarse(bytes: &[u8], sections: usize) -> Result<Self, FileError> {
        read(bytes, Some(sections.max(1)))
    }

    /// The hierarchy of one primitive, by its place in the glTF file.
    #[must_use]
    pub fn find(&self, mesh_index: u32, primitive_index: u32) -> Option<&BakedPrimitive> {
        self.primitives
            .iter()
            .find(|p| p.mesh_index == mesh_index && p.primitive_index == primitive_index)
    }
}

fn encode(primitive: &BakedPrimitive, precision: Precision) -> (Entry, Vec<Vec<u8>>) {
    let valid = primitive.hierarchy.validate();
    assert_eq!(valid, Ok(()), "only valid hierarchies can be written");
    let mut hierarchy = &primitive.hierarchy;
    let attributes = Attributes::of(&hierarchy.vertices);
    let mut position_error_in_local = primitive.position_error_in_local;
    let grids = Grids::around(&hierarchy.vertices);
    let quantized = (precision == Precision::Quantized16).then_some(&grids);
    let rows = attributes::to_rows(&hierarchy.vertices, quantized);
    let moved;
    if quantized.is_some() {
        let places: Vec<u32> = (0..hierarchy.vertices.positions.len() as u32).collect();
        let vertices = attributes::from_rows(&rows, attributes, quantized, &places);
        let error_in_local;
        (moved, error_in_local) = quantize::moved(hierarchy, vertices);
        position_error_in_local += error_in_local;
        hierarchy = &moved;
    }
    let (sections, unused) = coded::encode(hierarchy, &rows, attributes, precision);
    let entry = Entry {
        mesh_index: primitive.mesh_index,
        primitive_index: primitive.primitive_index,
        name: primitive.name.clone(),
        source: hierarchy.source,
        attributes,
        precision,
        grids,
        position_error_in_local,
        group_count: hierarchy.groups.len() as u32,
        vertex_count: hierarchy.vertices.positions.len() as u32,
        unused_vertices: unused as u32,
        sections: sections.iter().map(|s| SectionEntry::of(s)).collect(),
    };
    (entry, sections)
}

/// Reads all sections, or the first `most` of each primitive.
fn read(bytes: &[u8], most: Option<usize>) -> Result<BakedFile, FileError> {
    let (entries, sections) = layout::read(bytes)?;
    let mut reader = Reader { rest: sections };
    if most.is_none() {
        check_length(&entries, sections.len() as u64)?;
    }
    let longest = entries.iter().map(|entry| entry.sections.len()).max();
    let rounds = most.unwrap_or(usize::MAX).min(longest.unwrap_or(0));
    let mut decoders: Vec<Decoder> = entries.into_iter().map(Decoder::new).collect();
    for number in 0..rounds {
        for decoder in &mut decoders {
            decoder.read_section(&mut reader, number)?;
        }
    }
    let primitives = decoders.into_iter().enumerate();
    let primitives = primitives.map(|(index, decoder)| decoder.finish(index, rounds));
    Ok(BakedFile {
        primitives: primitives.collect::<Result<_, _>>()?,
    })
}

fn check_length(entries: &[Entry], available: u64) -> Result<(), FileError> {
    let sections = entries.iter().flat_map(|entry| &entry.sections);
    let needed = sections.fold(0, |sum: u64, section| sum.saturating_add(section.length));
    if available < needed {
        return Err(FileError::Truncated {
            what: "the file",
            needed,
            available,
        });
    }
    if available > needed {
        let extra = available - needed;
        return Err(FileError::TrailingBytes { extra });
    }
    Ok(())
}

/// A primitive on its way in.
struct Decoder {
    entry: Entry,
    predictors: Vec<planes::Predict>,
    coded: Coded,
}

impl Decoder {
    fn new(entry: Entry) -> Self {
        let predictors = entry.attributes.predictors(entry.grids().is_some());
        let coded = Coded::with_planes(predictors.len());
        Self {
            entry,
            predictors,
            coded,
        }
    }

    fn read_section(&mut self, reader: &mut Reader<'_>, number: usize) -> Result<(), FileError> {
        let Some(section) = self.entry.sections.get(number) else {
            return Ok(());
        };
        let bytes = reader.take("a section", section.length)?;
        section.check(bytes)?;
        let is_last = number + 1 == self.entry.sections.len();
        let unused_vertices = if is_last {
            self.entry.unused_vertices as usize
        } else {
            0
        };
        let section = Section {
            predictors: &self.predictors,
            unused_vertices,
        };
        section.read(bytes, &mut self.coded)
    }

    fn finish(self, primitive: usize, sections: usize) -> Result<BakedPrimitive, FileError> {
        let entry = &self.entry;
        let counts = (entry.group_count as usize, entry.vertex_count as usize);
        let frame = Frame {
            source: entry.source,
            attributes: entry.attributes,
            grids: entry.grids(),
            whole: (sections >= entry.sections.len()).then_some(counts),
        };
        let hierarchy = coded::decode(&self.coded, frame)?;
        let valid = hierarchy.validate();
        valid.map_err(|fault| FileError::Invalid { primitive, fault })?;
        Ok(BakedPrimitive {
            mesh_index: entry.mesh_index,
            primitive_index: entry.primitive_index,
            name: entry.name.clone(),
            hierarchy,
            position_error_in_local: entry.position_error_in_local,
        })
    }
}
