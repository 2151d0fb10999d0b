//! Parses the bytes of a file into a valid glTF document.

use std::collections::HashMap;

use fieldlod_hierarchy::glb;
use glam::Mat4;
use gltf::json::validation::Checked;
use gltf::{Document, Semantic};
use serde_json::{Value, json};

use super::error::ImportError;
use super::format::little_endian;
use super::meshopt_views;
use super::rig::{Node, ancestors};

const BYTE_ORDER_MARK: &[u8] = b"\xef\xbb\xbf";

/// The contents of a file.
pub(super) struct Read<'a> {
    pub(super) document: Document,
    /// The animations, which the document lacks.
    pub(super) animations: Value,
    /// The binary chunk of a GLB.
    pub(super) blob: Option<&'a [u8]>,
}

/// Reads a file's bytes.
pub(super) fn read(bytes: &[u8]) -> Result<Read<'_>, ImportError> {
    let (mut json, blob) = json_of(bytes)?;
    let animations = json.get_mut("animations").map(Value::take);
    Ok(Read {
        document: parse(json)?,
        animations: animations.unwrap_or_default(),
        blob,
    })
}

/// The JSON of a file, and the binary chunk if it is a GLB.
pub(super) fn json_of(bytes: &[u8]) -> Result<(Value, Option<&[u8]>), ImportError> {
    if bytes.is_empty() {
        return Err(ImportError::Empty);
    }
    let (json, blob) = if bytes.starts_with(glb::MAGIC) {
        split_glb(bytes)?
    } else {
        (bytes.strip_prefix(BYTE_ORDER_MARK).unwrap_or(bytes), None)
    };
    // Files of other formats get a better message than a JSON error.
    let first = json.iter().find(|byte| !byte.is_ascii_whitespace());
    if blob.is_none() && first != Some(&b'{') {
        return Err(ImportError::NotGltf);
    }
    Ok((serde_json::from_slice(json).map_err(|e| invalid(&e))?, blob))
}

/// A binary glTF file of JSON and one binary chunk.
pub(super) fn glb_of(json: &Value, binary: &[u8]) -> Result<Vec<u8>, ImportError> {
    let text = json.to_string();
    glb::file_of(&[(glb::JSON, text.as_bytes()), (glb::BIN, binary)])
        .map_err(|bytes| ImportError::TooLargeForGlb { bytes })
}

/// The JSON and binary chunks of a GLB. Chunks of other types are ignored, as the specification demands.
fn split_glb(bytes: &[u8]) -> Result<(&[u8], Option<&[u8]>), ImportError> {
    let truncated = |what, needed: usize, available: usize| ImportError::Truncated {
        what,
        needed: needed as u64,
        available: available as u64,
    };
    let Some(header) = bytes.first_chunk::<{ glb::HEADER_BYTES }>() else {
        return Err(truncated("the GLB header", glb::HEADER_BYTES, bytes.len()));
    };
    let version = little_endian(&header[4..8]);
    if version != 2 {
        let found = version.to_string();
        return Err(ImportError::Version { found });
    }
    let length = little_endian(&header[8..]) as usize;
    // Ignore bytes after the stated length, such as a line end, as viewers do.
    let Some(rest) = bytes.get(glb::HEADER_BYTES..length) else {
        let needed = length.max(glb::HEADER_BYTES);
        return Err(truncated("the file", needed, bytes.len().min(length)));
    };
    // The first chunk of each kind.
    let (mut json, mut blob) = (None, None);
    let mut chunks = glb::Chunks(rest);
    for (kind, chunk) in &mut chunks {
        match kind {
            glb::JSON if json.is_none() => json = Some(chunk),
            glb::BIN if blob.is_none() => blob = Some(chunk),
            _ => {}
        }
    }
    match chunks.0 {
        [] => {}
        [a, b, c, d, _, _, _, _, rest @ ..] => {
            let needed = u32::from_le_bytes([*a, *b, *c, *d]) as usize;
            return Err(truncated("a chunk", needed, rest.len()));
        }
        rest => return Err(truncated("a chunk header", 8, rest.len())),
    }
    let json = json.ok_or_else(|| ImportError::Invalid("the GLB has no JSON chunk".into()))?;
    Ok((json, blob))
}

/// The document of a file's JSON, without animations.
pub(super) fn parse(mut json: Value) -> Result<Document, ImportError> {
    drop_unread_parts(&mut json);
    let mut root: gltf::json::Root = serde_json::from_value(json).map_err(|e| invalid(&e))?;
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
    // The gltf crate rejects required extensions, depending on features that other crates may enable.
    root.extensions_required.clear();
    check_positions_exist(&root)?;
    // The gltf crate validates all indices. Later indexing relies on this.
    Document::from_json(root).map_err(|error| match error {
        gltf::Error::Validation(faults) => ImportError::Invalid(describe(&faults)),
        error => invalid(&error),
    })
}

fn invalid(error: &dyn std::fmt::Display) -> ImportError {
    ImportError::Invalid(one_line(&error.to_string()))
}

/// Removes animations, because the gltf crate rejects some of their extensions; [`read`] keeps them. A texture without
/// `source` gets the image of an extension, or an empty image.
fn drop_unread_parts(json: &mut Value) {
    if let Some(json) = json.as_object_mut() {
        json.remove("animations");
    }
    let images = json
        .get("images")
        .and_then(Value::as_array)
        .map_or(0, Vec::len);
    let mut lacks_image = false;
    let textures = json.get_mut("textures").and_then(Value::as_array_mut);
    let textures = textures.into_iter().flatten();
    let textures = textures.filter_map(Value::as_object_mut);
    for texture in textures.filter(|texture| !texture.contains_key("source")) {
        let extensions = texture.get("extensions").and_then(Value::as_object);
        let mut sources = extensions
            .into_iter()
            .flat_map(|extensions| extensions.values());
        let source = sources.find_map(|extension| extension.get("source")?.as_u64());
        lacks_image |= source.is_none();
        texture.insert("source".into(), json!(source.unwrap_or(images as u64)));
    }
    if lacks_image {
        let mut all = json["images"].as_array().cloned().unwrap_or_default();
        all.push(json!({}));
        json["images"] = all.into();
    }
}

/// Returns `true` for extensions that do not affect geometry, or that are supported.
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

/// The validation of the gltf crate panics without this check.
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

/// Replaces control characters, because messages are one line.
fn one_line(text: &str) -> String {
    text.chars()
        .map(|c| if c.is_control() { ' ' } else { c })
        .collect()
}

/// Nodes with this many ancestors or more share their placement with no other node. Bounds the time for damaged files.
const MOST_ANCESTORS: usize = 64;

/// For each mesh, an id of the global transform of its node. A mesh of several nodes has an id of its own.
pub(super) fn spaces_of_meshes(nodes: &[Node], meshes: usize) -> Vec<u32> {
    let placed = |node: u32| {
        let chain = ancestors(nodes, node).take(MOST_ANCESTORS + 1);
        let chain: Vec<u32> = chain.collect();
        let place = chain.iter().fold(Mat4::IDENTITY, |place, &node| {
            nodes[node as usize].transform() * place
        });
        (chain.len() <= MOST_ANCESTORS).then(|| place.to_cols_array().map(f32::to_bits))
    };
    let mut drawn_by: Vec<Vec<u32>> = vec![Vec::new(); meshes];
    for (index, node) in (0..).zip(nodes) {
        if let Some(mesh) = node.mesh {
            drawn_by[mesh as usize].push(index);
        }
    }
    // Bits are compared: transforms that differ by rounding place shared borders at different points.
    let mut first_at: HashMap<[u32; 16], u32> = HashMap::new();
    let space = |(mesh, nodes): (u32, &Vec<u32>)| match nodes[..] {
        [node] => placed(node).map_or(mesh, |place| *first_at.entry(place).or_insert(mesh)),
        _ => mesh,
    };
    (0..).zip(&drawn_by).map(space).collect()
}
