//! A glTF file in the form that Bevy reads.

use gltf::accessor::{DataType, Dimensions};
use gltf::{Accessor, Document};
use serde_json::{Value, json};

use super::accessor::read_vectors;
use super::buffers::Buffers;
use super::error::{AccessorFault, ImportError};
use super::{ReadBeside, document, meshopt_views};

const FLOAT: u32 = 5126;
const QUANTIZATION: &str = "KHR_mesh_quantization";

/// Rewrites a `.gltf` or `.glb` file as a self-contained `.glb` file that Bevy 0.19 reads.
///
/// - Buffers beside the file and in data URIs become its one binary chunk. Images stay where they are.
/// - Buffer views packed by `EXT_meshopt_compression` or `KHR_meshopt_compression` are unpacked.
/// - Vertex attributes in formats of `KHR_mesh_quantization` become 32-bit floating-point numbers in the same
///   units, so that nodes stay as they are.
///
/// Accessors and buffer views keep their indices, and everything else stays as it is.
///
/// # Errors
/// An [`ImportError`] if the file cannot be read, or if it requires an extension that is not supported.
pub fn unpack_gltf(bytes: &[u8], beside: &ReadBeside<'_>) -> Result<Vec<u8>, ImportError> {
    let (mut json, blob) = document::json_of(bytes)?;
    let document = document::parse(json.clone())?;
    let buffers = Buffers::load(&document, blob, beside)?;
    let mut file = Unpacked::default();
    for view in document.views() {
        let bytes = buffers.view(&view);
        let bytes = bytes.ok_or_else(|| outside("bufferViews", view.index()))?;
        file.replace_view(&mut json, view.index(), bytes);
    }
    let mut accessors = document.accessors();
    for index in quantized_attributes(&document) {
        let Some(accessor) = accessors.find(|accessor| accessor.index() == index) else {
            continue;
        };
        let floats = floats_of(&accessor, &buffers);
        let floats = floats.map_err(|_| outside("accessors", index))?;
        file.replace_accessor(&mut json, &accessor, &floats);
    }
    for list in ["extensionsUsed", "extensionsRequired"] {
        drop_extensions(&mut json, list);
    }
    let count = file.binary.len();
    json["buffers"] = json!([{ "byteLength": count }]);
    Ok(document::glb_of(&json, &file.binary))
}

fn outside(list: &str, index: usize) -> ImportError {
    ImportError::Invalid(format!("{list}[{index}] reads outside its buffer"))
}

#[derive(Default)]
struct Unpacked {
    binary: Vec<u8>,
}

impl Unpacked {
    /// Adds bytes, and returns where they begin.
    fn push(&mut self, bytes: &[u8]) -> usize {
        self.binary.resize(self.binary.len().next_multiple_of(4), 0);
        let offset = self.binary.len();
        self.binary.extend_from_slice(bytes);
        offset
    }

    fn replace_view(&mut self, json: &mut Value, index: usize, bytes: &[u8]) {
        let offset = self.push(bytes);
        let view = &mut json["bufferViews"][index];
        (view["buffer"], view["byteOffset"]) = (json!(0), json!(offset));
        view["byteLength"] = json!(bytes.len());
        if let Some(extensions) = view.get_mut("extensions").and_then(Value::as_object_mut) {
            extensions.retain(|name, _| !meshopt_views::EXTENSIONS.contains(&name.as_str()));
        }
    }

    fn replace_accessor(&mut self, json: &mut Value, old: &Accessor<'_>, floats: &[f32]) {
        let bytes: Vec<u8> = floats.iter().flat_map(|x| x.to_le_bytes()).collect();
        let offset = self.push(&bytes);
        let view = json!({ "buffer": 0, "byteOffset": offset, "byteLength": bytes.len() });
        let Some(views) = json["bufferViews"].as_array_mut() else {
            return;
        };
        views.push(view);
        let view = views.len() - 1;
        let width = old.dimensions().multiplicity();
        let extreme = |start: f32, pick: fn(f32, f32) -> f32| -> Vec<f32> {
            let axis = |axis| floats.iter().skip(axis).step_by(width).copied();
            (0..width).map(|k| axis(k).fold(start, pick)).collect()
        };
        let accessor = &mut json["accessors"][old.index()];
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

/// The accessors of vertex attributes and morph targets in formats that Bevy does not read, ascending.
fn quantized_attributes(document: &Document) -> Vec<usize> {
    let primitives = document.meshes().flat_map(|mesh| mesh.primitives());
    let mut quantized = Vec::new();
    let mut add = |accessor: Option<Accessor<'_>>, may_be_shares: bool| {
        quantized.extend(
            accessor
                .filter(|a| !is_plain(a, may_be_shares))
                .map(|a| a.index()),
        );
    };
    for primitive in primitives {
        for (semantic, accessor) in primitive.attributes() {
            match semantic {
                gltf::Semantic::TexCoords(_) => add(Some(accessor), true),
                gltf::Semantic::Positions | gltf::Semantic::Normals | gltf::Semantic::Tangents => {
                    add(Some(accessor), false);
                }
                _ => {}
            }
        }
        for target in primitive.morph_targets() {
            for accessor in [target.positions(), target.normals(), target.tangents()] {
                add(accessor, false);
            }
        }
    }
    quantized.sort_unstable();
    quantized.dedup();
    quantized
}

fn is_plain(accessor: &Accessor<'_>, may_be_shares: bool) -> bool {
    match accessor.data_type() {
        DataType::F32 => true,
        DataType::U8 | DataType::U16 => may_be_shares && accessor.normalized(),
        // No extension knows these.
        DataType::U32 => true,
        DataType::I8 | DataType::I16 => false,
    }
}

fn floats_of(accessor: &Accessor<'_>, buffers: &Buffers) -> Result<Vec<f32>, AccessorFault> {
    Ok(match accessor.dimensions() {
        Dimensions::Vec2 => read_vectors::<2>(accessor, buffers, [0.0; 2], None)?.into_flattened(),
        Dimensions::Vec3 => read_vectors::<3>(accessor, buffers, [0.0; 3], None)?.into_flattened(),
        Dimensions::Vec4 => read_vectors::<4>(accessor, buffers, [0.0; 4], None)?.into_flattened(),
        _ => {
            let accessor = accessor.index();
            return Err(AccessorFault::OutOfBounds { accessor });
        }
    })
}

/// Drops the names of extensions that the file needs no more.
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
