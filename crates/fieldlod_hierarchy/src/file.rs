//! The `.fieldlod` file: a header, then one record per mesh primitive.
//!
//! ```text
//! magic "FLDLOD\r\n" | version u32 | primitive count u32 | payload bytes u64 | XXH3 of payload u64
//! payload: per primitive  mesh u32, primitive u32, name, source hash,
//!          then the arrays of the hierarchy, each: element count u64, elements
//! ```
//! Little-endian throughout. The magic's line end catches transfers that rewrite line ends.

use bytemuck::Pod;
use thiserror::Error;
use xxhash_rust::xxh3::xxh3_64;

use crate::{Hierarchy, InvalidHierarchy, SourceHash, Vertices};

const MAGIC: [u8; 8] = *b"FLDLOD\r\n";
const HEADER_BYTES: usize = 32;

/// The version that this crate writes, and the only one that it reads.
pub const FORMAT_VERSION: u32 = 2;

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
        }
    }
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
    /// An invariant is broken although the checksum fits.
    #[error("primitive {primitive}: {fault}")]
    Invalid {
        primitive: usize,
        fault: InvalidHierarchy,
    },
}

impl BakedFile {
    /// The file's bytes.
    #[must_use]
    pub fn to_bytes(&self) -> Vec<u8> {
        let mut bytes = vec![0; HEADER_BYTES];
        for primitive in &self.primitives {
            write_primitive(&mut bytes, primitive);
        }
        let payload_bytes = (bytes.len() - HEADER_BYTES) as u64;
        let checksum = xxh3_64(&bytes[HEADER_BYTES..]);
        bytes[..8].copy_from_slice(&MAGIC);
        bytes[8..12].copy_from_slice(&FORMAT_VERSION.to_le_bytes());
        bytes[12..16].copy_from_slice(&(self.primitives.len() as u32).to_le_bytes());
        bytes[16..24].copy_from_slice(&payload_bytes.to_le_bytes());
        bytes[24..32].copy_from_slice(&checksum.to_le_bytes());
        bytes
    }

    /// Reads and validates a file's bytes.
    ///
    /// # Errors
    /// A [`FileError`] that says what is wrong; never a panic, whatever the bytes.
    pub fn from_bytes(bytes: &[u8]) -> Result<Self, FileError> {
        let (primitive_count, payload) = read_header(bytes)?;
        let mut reader = Reader { rest: payload };
        let mut primitives = Vec::new();
        for index in 0..primitive_count {
            primitives.push(read_primitive(&mut reader, index)?);
        }
        match reader.rest.len() as u64 {
            0 => Ok(Self { primitives }),
            extra => Err(FileError::TrailingBytes { extra }),
        }
    }

    /// The hierarchy of one primitive, by its place in the glTF file.
    #[must_use]
    pub fn find(&self, mesh_index: u32, primitive_index: u32) -> Option<&BakedPrimitive> {
        self.primitives
            .iter()
            .find(|p| p.mesh_index == mesh_index && p.primitive_index == primitive_index)
    }
}

fn read_header(bytes: &[u8]) -> Result<(usize, &[u8]), FileError> {
    if !bytes.starts_with(&MAGIC) {
        return Err(FileError::NotFieldlod);
    }
    let mut reader = Reader {
        rest: &bytes[MAGIC.len()..],
    };
    let found: u32 = reader.value("the header")?;
    if found != FORMAT_VERSION {
        return Err(FileError::Version { found });
    }
    let primitive_count: u32 = reader.value("the header")?;
    let payload_bytes: u64 = reader.value("the header")?;
    let checksum: u64 = reader.value("the header")?;
    let available = reader.rest.len() as u64;
    if available < payload_bytes {
        return Err(FileError::Truncated {
            what: "the file",
            needed: payload_bytes,
            available,
        });
    }
    if available > payload_bytes {
        let extra = available - payload_bytes;
        return Err(FileError::TrailingBytes { extra });
    }
    if xxh3_64(reader.rest) != checksum {
        return Err(FileError::Checksum);
    }
    Ok((primitive_count as usize, reader.rest))
}

fn write_primitive(bytes: &mut Vec<u8>, primitive: &BakedPrimitive) {
    let hierarchy = &primitive.hierarchy;
    bytes.extend_from_slice(&primitive.mesh_index.to_le_bytes());
    bytes.extend_from_slice(&primitive.primitive_index.to_le_bytes());
    write_array(bytes, primitive.name.as_bytes());
    bytes.extend_from_slice(&hierarchy.source.0.to_le_bytes());
    write_array(bytes, &hierarchy.vertices.positions);
    write_array(bytes, &hierarchy.vertices.normals);
    write_array(bytes, &hierarchy.vertices.uvs);
    write_array(bytes, &hierarchy.vertices.tangents);
    write_array(bytes, &hierarchy.vertices.uvs_1);
    write_array(bytes, &hierarchy.vertices.colors);
    write_array(bytes, &hierarchy.groups);
    write_array(bytes, &hierarchy.finer);
    write_array(bytes, &hierarchy.units);
    write_array(bytes, &hierarchy.clusters);
    write_array(bytes, &hierarchy.unit_vertices);
    write_array(bytes, &hierarchy.indices);
}

fn read_primitive(reader: &mut Reader<'_>, index: usize) -> Result<BakedPrimitive, FileError> {
    let mesh_index = reader.value("a mesh index")?;
    let primitive_index = reader.value("a primitive index")?;
    let name = String::from_utf8(reader.array("a name")?)
        .map_err(|_| FileError::Name { primitive: index })?;
    let hierarchy = Hierarchy {
        source: SourceHash(reader.value("a source hash")?),
        vertices: Vertices {
            positions: reader.array("the positions")?,
            normals: reader.array("the normals")?,
            uvs: reader.array("the texture coordinates")?,
            tangents: reader.array("the tangents")?,
            uvs_1: reader.array("the second texture coordinates")?,
            colors: reader.array("the colors")?,
        },
        groups: reader.array("the groups")?,
        finer: reader.array("the finer groups")?,
        units: reader.array("the units")?,
        clusters: reader.array("the clusters")?,
        unit_vertices: reader.array("the vertex lists")?,
        indices: reader.array("the triangles")?,
    };
    hierarchy.validate().map_err(|fault| FileError::Invalid {
        primitive: index,
        fault,
    })?;
    Ok(BakedPrimitive {
        mesh_index,
        primitive_index,
        name,
        hierarchy,
    })
}

fn write_array<T: Pod>(bytes: &mut Vec<u8>, elements: &[T]) {
    bytes.extend_from_slice(&(elements.len() as u64).to_le_bytes());
    bytes.extend_from_slice(bytemuck::cast_slice(elements));
}

struct Reader<'a> {
    rest: &'a [u8],
}

impl<'a> Reader<'a> {
    fn take(&mut self, what: &'static str, needed: u64) -> Result<&'a [u8], FileError> {
        let available = self.rest.len() as u64;
        if needed > available {
            return Err(FileError::Truncated {
                what,
                needed,
                available,
            });
        }
        let (taken, rest) = self.rest.split_at(needed as usize);
        self.rest = rest;
        Ok(taken)
    }

    fn value<T: Pod>(&mut self, what: &'static str) -> Result<T, FileError> {
        let bytes = self.take(what, size_of::<T>() as u64)?;
        Ok(bytemuck::pod_read_unaligned(bytes))
    }

    fn array<T: Pod>(&mut self, what: &'static str) -> Result<Vec<T>, FileError> {
        let count: u64 = self.value(what)?;
        let needed = count.saturating_mul(size_of::<T>() as u64);
        let bytes = self.take(what, needed)?;
        Ok(bytemuck::pod_collect_to_vec(bytes))
    }
}
