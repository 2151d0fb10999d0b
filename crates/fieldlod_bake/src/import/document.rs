//! From a file's bytes to a glTF document that is safe to walk.

use std::collections::HashMap;

use glam::Mat4;
use gltf::json::validation::Checked;
use gltf::{Document, Semantic};
use serde_json::{Value, json};

use super::error::ImportError;
use super::meshopt_views;

const BYTE_ORDER_MARK: &[u8] = b"\xef\xbb\xbf";
const GLB_MAGIC: &[u8] = b"glTF";
const JSON_CHUNK: u32 = u32::from_le_bytes(*b"JSON");
const BINARY_CHUNK: u32 = u32::from_le_bytes(*b"BIN\0");

/// A file's document, its animations, which the document does not hold, and the binary chunk if it is a GLB.
pub(super) struct Read<'a> {
    pub(super) document: Document,
    pub(super) animations: Value,
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
    let (json, blob) = match bytes.starts_with(GLB_MAGIC) {
        true => split_glb(bytes)?,
        false => (bytes.strip_prefix(BYTE_ORDER_MARK).unwrap_or(bytes), None),
    };
    let first = json.iter().find(|byte| !byte.is_ascii_whitespace());
    if blob.is_none() && first != Some(&b'{') {
        return Err(ImportError::NotGltf);
    }
    Ok((serde_json::from_slice(json).map_err(|e| invalid(&e))?, blob))
}

/// A binary glTF file of JSON and one binary chunk.
pub(super) fn glb_of(json: &Value, binary: &[u8]) -> Vec<u8> {
    let text = json.to_string();
    let mut chunks = Vec::with_capacity(text.len() + binary.len() + 24);
    for (kind, bytes, padding) in [
        (JSON_CHUNK, text.as_bytes(), b' '),
        (BINARY_CHUNK, binary, 0),
    ] {
        let padded = bytes.len().next_multiple_of(4);
        chunks.extend((padded as u32).to_le_bytes());
        chunks.extend(kind.to_le_bytes());
        chunks.extend(bytes);
        chunks.resize(chunks.len() + padded - bytes.len(), padding);
    }
    let length = 12 + chunks.len() as u32;
    [
        GLB_MAGIC,
        &2u32.to_le_bytes(),
        &length.to_le_bytes(),
        &chunks,
    ]
    .concat()
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
    if available < u64::from(length) || length < 12 {
        return Err(ImportError::Truncated {
            what: "the file",
            needed: u64::from(length.max(12)),
            available: available.min(u64::from(length)),
        });
    }
    // Viewers ignore bytes behind the file, such as a line end.
    rest = &bytes[12..length as usize];
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

/// The document of a file's JSON, without the parts that a bake does not look at.
pub(super) fn parse(mut json: Value) -> Result<Document, ImportError> {
    drop_unread_parts(&mut json);
    let mut root: gltf::json::Root = serde_json::from_value(json).map_err(|e| invalid(&e))?;
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

fn invalid(error: &dyn std::fmt::Display) -> ImportError {
    ImportError::Invalid(one_line(&error.to_string()))
}

/// Drops what extensions may change beyond the schema of glTF, which the gltf crate would refuse: animations with
/// pointers, and textures with an image of an extension alone. The latter get that image, or one without bytes.
fn drop_unread_parts(json: &mut Value) {
    if let Some(json) = json.as_object_mut() {
        json.remove("animations");
    }
    let images = json
        .get("images")
        .and_then(Value::as_array)
        .map_or(0, Vec::len);
    let mut has_nameless = false;
    let textures = json.get_mut("textures").and_then(Value::as_array_mut);
    let textures = textures.into_iter().flatten();
    let textures = textures.filter_map(Value::as_object_mut);
    for texture in textures.filter(|texture| !texture.contains_key("source")) {
        let extensions = texture.get("extensions").and_then(Value::as_object);
        let mut sources = extensions
            .into_iter()
            .flat_map(|extensions| extensions.values());
        let source = sources.find_map(|extension| extension.get("source")?.as_u64());
        has_nameless |= source.is_none();
        texture.insert("source".into(), json!(source.unwrap_or(images as u64)));
    }
    if has_nameless {
        let mut all = json["images"].as_array().cloned().unwrap_or_default();
        all.push(json!({}));
        json["images"] = all.into();
    }
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

/// Nodes below more than these are placed unlike any other.
const MOST_ANCESTORS: usize = 64;

/// For each mesh, a number that meshes share which are drawn by one node each, in the same place.
pub(super) fn spaces_of_meshes(document: &Document) -> Vec<u32> {
    let mut parents = vec![None; document.nodes().len()];
    for node in document.nodes() {
        for child in node.children() {
            parents[child.index()] = Some(node.index());
        }
    }
    let transforms: Vec<Mat4> = document
        .nodes()
        .map(|node| Mat4::from_cols_array_2d(&node.transform().matrix()))
        .collect();
    let placed = |node: usize| {
        let ancestors = std::iter::successors(Some(node), |&node| parents[node]);
        let chain: Vec<usize> = ancestors.take(MOST_ANCESTORS + 1).collect();
        let place = chain
            .iter()
            .fold(Mat4::IDENTITY, |m, &node| transforms[node] * m);
        (chain.len() <= MOST_ANCESTORS).then(|| place.to_cols_array().map(f32::to_bits))
    };
    let mut nodes: Vec<Vec<usize>> = vec![Vec::new(); document.meshes().len()];
    for node in document.nodes() {
        if let Some(mesh) = node.mesh() {
            nodes[mesh.index()].push(node.index());
        }
    }
    let mut first_at: HashMap<[u32; 16], u32> = HashMap::new();
    let meshes = (0..).zip(&nodes);
    let space = |(mesh, nodes): (u32, &Vec<usize>)| match nodes[..] {
        [node] => placed(node).map_or(mesh, |place| *first_at.entry(place).or_insert(mesh)),
        _ => mesh,
    };
    meshes.map(space).collect()
}
