//! A glTF file in the form that Bevy reads.

use std::collections::BTreeSet;

use gltf::{Accessor, Document, Semantic};
use serde_json::{Value, json};

use super::accessor::read_numbers;
use super::buffers::Buffers;
use super::error::ImportError;
use super::format::{Attribute, Formats};
use super::{ReadBeside, document, meshopt_views};

/// Component type of glTF: 32-bit floating-point numbers.
const FLOAT: u32 = 5126;
const QUANTIZATION: &str = "KHR_mesh_quantization";

/// A self-contained glTF file: its JSON, and the bytes of its one buffer.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct UnpackedGltf {
    /// The JSON.
    pub json: Value,
    /// The bytes of the buffer.
    pub binary: Vec<u8>,
}

/// Rewrites a `.gltf` or `.glb` file as a self-contained file that Bevy 0.19 reads.
///
/// - Buffers beside the file and in data URIs become one buffer. Images stay where they are.
/// - Buffer views packed by `EXT_meshopt_compression` or `KHR_meshopt_compression` are unpacked.
/// - Vertex attributes in formats of `KHR_mesh_quantization` become 32-bit floating-point numbers in the same
///   units, so that nodes stay as they are.
///
/// Accessors and buffer views keep their indices, and everything else stays as it is.
///
/// # Errors
/// An [`ImportError`] if the file cannot be read, or if it requires an extension that is not supported.
pub fn unpack_gltf(bytes: &[u8], beside: &ReadBeside<'_>) -> Result<UnpackedGltf, ImportError> {
    let (json, blob) = document::json_of(bytes)?;
    let document = document::parse(json.clone())?;
    let buffers = Buffers::load(&document, blob, beside)?;
    let mut file = UnpackedGltf {
        json,
        binary: Vec::new(),
    };
    // Every view gets its own copy, even if views overlap: offsets of accessors in a view then stay valid.
    for view in document.views() {
        let bytes = buffers.view(&view);
        let bytes = bytes.ok_or_else(|| outside("bufferViews", view.index()))?;
        file.replace_view(view.index(), bytes);
    }
    let quantized = quantized_attributes(&document);
    let accessors = document.accessors();
    for accessor in accessors.filter(|accessor| quantized.contains(&accessor.index())) {
        let floats = read_numbers(&accessor, &buffers);
        let floats = floats.map_err(|_| outside("accessors", accessor.index()))?;
        file.replace_accessor(&accessor, &floats);
    }
    for list in ["extensionsUsed", "extensionsRequired"] {
        drop_extensions(&mut file.json, list);
    }
    file.json["buffers"] = json!([{ "byteLength": file.binary.len() }]);
    Ok(file)
}

fn outside(list: &str, index: usize) -> ImportError {
    ImportError::Invalid(format!("{list}[{index}] reads outside its buffer"))
}

impl UnpackedGltf {
    /// Encodes the file as binary glTF.
    ///
    /// # Errors
    /// [`ImportError::TooLargeForGlb`] above 4 GiB.
    pub fn to_glb(&self) -> Result<Vec<u8>, ImportError> {
        document::glb_of(&self.json, &self.binary)
    }

    /// Adds bytes, and returns their offset.
    fn push(&mut self, bytes: &[u8]) -> usize {
        // glTF aligns accessors to their component, which has at most four bytes.
        self.binary.resize(self.binary.len().next_multiple_of(4), 0);
        let offset = self.binary.len();
        self.binary.extend_from_slice(bytes);
        offset
    }

    fn replace_view(&mut self, index: usize, bytes: &[u8]) {
        let offset = self.push(bytes);
        let view = &mut self.json["bufferViews"][index];
        (view["buffer"], view["byteOffset"]) = (json!(0), json!(offset));
        view["byteLength"] = json!(bytes.len());
        if let Some(extensions) = view.get_mut("extensions").and_then(Value::as_object_mut) {
            extensions.retain(|name, _| !meshopt_views::EXTENSIONS.contains(&name.as_str()));
        }
    }

    fn replace_accessor(&mut self, old: &Accessor<'_>, floats: &[f32]) {
        let bytes: Vec<u8> = floats.iter().flat_map(|x| x.to_le_bytes()).collect();
        let offset = self.push(&bytes);
        let view = json!({ "buffer": 0, "byteOffset": offset, "byteLength": bytes.len() });
        let Some(views) = self.json["bufferViews"].as_array_mut() else {
            return;
        };
        views.push(view);
        let view = views.len() - 1;
        let width = old.dimensions().multiplicity();
        // Bounds of integers are in the old format, so they are computed again.
        let extreme = |start: f32, pick: fn(f32, f32) -> f32| -> Vec<f32> {
            let axis = |axis| floats.iter().skip(axis).step_by(width).copied();
            (0..width).map(|k| axis(k).fold(start, pick)).collect()
        };
        let accessor = &mut self.json["accessors"][old.index()];
        (accessor["bufferView"], accessor["componentType"]) = (json!(view), json!(FLOAT));
        accessor["min"] = json!(extreme(f32::INFINITY, f32::min));
        accessor["max"] = json!(extreme(f32::NEG_INFINITY, f32::max));
        if let Some(accessor) = accessor.as_object_mut() {
            for key in ["byteOffset", "normalized", "sparse"] {
                accessor.remove(key);
            }
        }
    }
}

/// The accessors of vertex attributes and morph targets in formats that Bevy does not read.
fn quantized_attributes(document: &Document) -> BTreeSet<usize> {
    let primitives = document.meshes().flat_map(|mesh| mesh.primitives());
    let mut quantized = BTreeSet::new();
    for primitive in primitives {
        let attributes = primitive.attributes();
        let attributes = attributes.filter_map(|(semantic, accessor)| match semantic {
            Semantic::Positions => Some((accessor, Attribute::Position)),
            Semantic::Normals => Some((accessor, Attribute::Normal)),
            Semantic::Tangents => Some((accessor, Attribute::Tangent)),
            Semantic::TexCoords(_) => Some((accessor, Attribute::Uv)),
            _ => None,
        });
        let targets = primitive.morph_targets();
        let targets = targets.flat_map(|t| [t.positions(), t.normals(), t.tangents()]);
        // All deltas have the format of positions, also those of tangents.
        let targets = targets.flatten().map(|delta| (delta, Attribute::Position));
        let all = attributes.chain(targets);
        let own = all.filter(|(accessor, attribute)| !Formats::AsBevy.allow(*attribute, accessor));
        quantized.extend(own.map(|(accessor, _)| accessor.index()));
    }
    quantized
}

/// Drops the names of extensions that the unpacked file does not use.
fn drop_extensions(json: &mut Value, list: &str) {
    let Some(names) = json.get_mut(list).and_then(Value::as_array_mut) else {
        return;
    };
    names.retain(|name| {
        let name = name.as_str().unwrap_or_default();
        name != QUANTIZATION && !meshopt_views::EXTENSIONS.contains(&name)
    });
    if names.is_empty()
        && let Some(json) = json.as_object_mut()
    {
        json.remove(list);
    }
}
