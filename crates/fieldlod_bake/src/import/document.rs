//! From a file's bytes to a glTF document that is safe to walk.

use std::collections::HashSet;

use gltf::json::validation::Checked;
use gltf::{Document, Semantic};

use super::error::ImportError;
use super::meshopt_views;

const GLB_MAGIC: &[u8] = b"glTF";
const JSON_CHUNK: u32 = u32::from_le_bytes(*b"JSON");
const BINARY_CHUNK: u32 = u32::from_le_bytes(*b"BIN\0");

/// Reads a file's bytes: its document, and the binary chunk if it is a GLB.
pub(super) fn read(bytes: &[u8]) -> Result<(Document, Option<&[u8]>), ImportError> {
    if bytes.is_empty() {
        return Err(ImportError::Empty);
    }
    if bytes.starts_with(GLB_MAGIC) {
        let (json, blob) = split_glb(bytes)?;
        return Ok((parse(json)?, blob));
    }
    let first = bytes.iter().find(|byte| !byte.is_ascii_whitespace());
    if first != Some(&b'{') {
        return Err(ImportError::NotGltf);
    }
    Ok((parse(bytes)?, None))
}

/// The JSON and binary chunks of a GLB. Chunks of other types are passed over, as the
/// specification asks.
fn split_glb(bytes: &[u8]) -> Result<(&[u8], Option<&[u8]>), ImportError> {
    let mut rest = bytes;
    take(&mut rest, GLB_MAGIC.len() as u64, "the GLB header")?;
    // The header: version, and the length of all.
    let version = take_u32(&mut rest, "the GLB header")?;
    if version != 2 {
        let found = version.to_string();
        return Err(ImportError::Version { found });
    }
    let length = take_u32(&mut rest, "the GLB header")?;
    let available = bytes.len() as u64;
    if available < u64::from(length) {
        return Err(ImportError::Truncated {
            what: "the file",
            needed: u64::from(length),
            available,
        });
    }
    // The first chunk of each kind.
    let (mut json, mut blob) = (None, None);
    while !rest.is_empty() {
        let chunk_length = take_u32(&mut rest, "a chunk header")?;
        let chunk_type = take_u32(&mut rest, "a chunk header")?;
        let chunk = take(&mut rest, u64::from(chunk_length), "a chunk")?;
        match chunk_type {
            JSON_CHUNK if json.is_none() => json = Some(chunk),
            BINARY_CHUNK if blob.is_none() => blob = Some(chunk),
            _ => {}
        }
    }
    match json {
        Some(json) => Ok((json, blob)),
        None => Err(ImportError::Invalid("the GLB has no JSON chunk".into())),
    }
}

fn take_u32(rest: &mut &[u8], what: &'static str) -> Result<u32, ImportError> {
    let bytes = take(rest, 4, what)?;
    Ok(bytes
        .iter()
        .rev()
        .fold(0, |value, &byte| value << 8 | u32::from(byte)))
}

fn take<'a>(rest: &mut &'a [u8], needed: u64, what: &'static str) -> Result<&'a [u8], ImportError> {
    let available = rest.len() as u64;
    if needed > available {
        return Err(ImportError::Truncated {
            what,
            needed,
            available,
        });
    }
    let (taken, after) = rest.split_at(needed as usize);
    *rest = after;
    Ok(taken)
}

fn parse(json: &[u8]) -> Result<Document, ImportError> {
    let invalid =
        |error: &dyn std::fmt::Display| ImportError::Invalid(one_line(&error.to_string()));
    // The crate's own messages may hold line ends.
    let parsed = gltf::Gltf::from_slice_without_validation(json);
    let mut root = match parsed {
        Ok(parsed) => parsed.document.into_json(),
        Err(gltf::Error::Deserialize(error)) => return Err(invalid(&error)),
        Err(error) => return Err(invalid(&error)),
    };
    // What this program can read.
    if !root.asset.version.starts_with("2.") {
        let found = one_line(&root.asset.version);
        return Err(ImportError::Version { found });
    }
    if let Some(name) = root
        .extensions_required
        .iter()
        .find(|name| !is_harmless(name))
    {
        return Err(ImportError::Extension(one_line(name)));
    }
    // Which extensions the gltf crate knows depends on features that other crates may turn on.
    root.extensions_required.clear();
    check_positions_exist(&root)?;
    Document::from_json(root).map_err(|error| match error {
        gltf::Error::Validation(faults) => ImportError::Invalid(describe(&faults)),
        error => invalid(&error),
    })
}

/// Extensions that change nothing about vertices and triangles, or that are read.
fn is_harmless(extension: &str) -> bool {
    if extension == "KHR_mesh_quantization" || meshopt_views::EXTENSIONS.contains(&extension) {
        return true;
    }
    let harmless = [
        "KHR_materials_",
        "KHR_texture_",
        "EXT_texture_",
        "MSFT_texture_",
        "KHR_lights_",
        "EXT_lights_",
        "KHR_animation_pointer",
        "KHR_node_visibility",
        "KHR_xmp",
        "EXT_mesh_gpu_instancing",
    ];
    harmless.iter().any(|prefix| extension.starts_with(prefix))
}

/// The gltf crate's own validation indexes with this unchecked.
fn check_positions_exist(root: &gltf::json::Root) -> Result<(), ImportError> {
    for (mesh_index, mesh) in root.meshes.iter().enumerate() {
        for (primitive_index, primitive) in mesh.primitives.iter().enumerate() {
            let accessor = primitive
                .attributes
                .get(&Checked::Valid(Semantic::Positions));
            if accessor.is_some_and(|accessor| accessor.value() >= root.accessors.len()) {
                return Err(ImportError::Invalid(format!(
                    "meshes[{mesh_index}].primitives[{primitive_index}].attributes.POSITION: \
                     no such accessor"
                )));
            }
        }
    }
    Ok(())
}

type Fault = (gltf::json::Path, gltf::json::validation::Error);

fn describe(faults: &[Fault]) -> String {
    let Some((path, fault)) = faults.first() else {
        return "unknown fault".into();
    };
    let first = format!("{path}: {fault}");
    match faults.len() - 1 {
        0 => one_line(&first),
        more => one_line(&format!("{first} (and {more} more)")),
    }
}

/// Text from a file may hold line ends; messages are one line.
fn one_line(text: &str) -> String {
    text.chars()
        .map(|c| if c.is_control() { ' ' } else { c })
        .collect()
}

/// A set of meshes.
pub(super) struct MeshIndices(HashSet<usize>);

impl MeshIndices {
    /// The meshes that some node draws with a skin.
    pub(super) fn on_skinned_nodes(document: &Document) -> Self {
        let skinned = document.nodes().filter(|node| node.skin().is_some());
        Self(
            skinned
                .filter_map(|node| node.mesh())
                .map(|mesh| mesh.index())
                .collect(),
        )
    }

    pub(super) fn contains(&self, mesh_index: usize) -> bool {
        self.0.contains(&mesh_index)
    }
}
