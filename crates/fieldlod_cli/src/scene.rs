//! A scene whose large meshes are in a file of their own: a `.glb` file without their geometry.
//!
//! Nodes, materials, images, animations and small meshes are kept. A large primitive keeps its material. Its triangles
//! become those of its coarsest level, which other programs show. Its `extras` name the `.fieldpages` file beside the
//! scene, its place in that file, and its number of triangles there:
//! `{ "fieldlod": { "pages": "world.fieldpages", "mesh": 0, "primitive": 0, "triangles": 327680 } }`.

use std::collections::{BTreeMap, BTreeSet};

use fieldlod_bake::{ImportError, UnpackedGltf};
use fieldlod_hierarchy::{BakedFile, BakedPrimitive, Hierarchy};
use glam::{Vec2, Vec3, Vec4};
use serde_json::{Map, Value, json};

/// Component types of glTF: 32-bit floating-point numbers and 32-bit indices.
const FLOAT: u32 = 5126;
const UNSIGNED_INT: u32 = 5125;
/// Extensions of primitives that do not refer to their vertices or triangles.
const EXTENSIONS_KEPT: [&str; 1] = ["KHR_materials_variants"];

/// A reference in the JSON of a scene is out of range.
fn bad_reference() -> ImportError {
    ImportError::Invalid("index out of range".into())
}

/// A scene in parts.
pub(crate) struct Scene {
    /// The scene without its large meshes.
    pub(crate) glb: Vec<u8>,
    /// Levels of large meshes.
    pub(crate) large: BakedFile,
    /// Levels of the small meshes.
    pub(crate) small: BakedFile,
    /// Extensions of large meshes that the scene leaves out: they refer to triangles that are not in it.
    pub(crate) dropped_extensions: BTreeSet<String>,
}

impl Scene {
    /// Removes meshes with at least `large_from_triangles` from `source`, and refers to the file `pages` instead.
    /// Skinned and morphed meshes stay, because pages have neither joints nor morph targets.
    pub(crate) fn new(
        mut source: UnpackedGltf,
        baked: BakedFile,
        pages: &str,
        large_from_triangles: u64,
    ) -> Result<Self, ImportError> {
        let json = &mut source.json;
        let is_large = |primitive: &BakedPrimitive| {
            let is_large = primitive.hierarchy.source_triangle_count() >= large_from_triangles;
            is_large && !is_rigged(json, primitive)
        };
        let (large, small) = baked.primitives.into_iter().partition(is_large);
        let large = BakedFile { primitives: large };
        let mut added = Added::default();
        for primitive in &large.primitives {
            replace(json, primitive, pages, &mut added)?;
        }
        // Accessors lose their views before packing, so that `pack` sees which views are still used.
        let dropped = drop_unused_accessors(json, &added.replaced);
        source.binary = pack(json, &source.binary, &added, &dropped)?;
        for (accessor, view) in dropped {
            json["accessors"][accessor]["bufferView"] = view.into();
        }
        Ok(Self {
            glb: source.to_glb()?,
            large,
            small: BakedFile { primitives: small },
            dropped_extensions: added.dropped_extensions,
        })
    }
}

/// URIs of the image files of a scene, as in its JSON.
pub(crate) fn image_files(source: &UnpackedGltf) -> impl Iterator<Item = &str> {
    let files = each(&source.json, "images").filter_map(|image| image["uri"].as_str());
    files.filter(|uri| {
        let scheme = uri.get(..5);
        !scheme.is_some_and(|scheme| scheme.eq_ignore_ascii_case("data:"))
    })
}

/// Changes of a scene.
#[derive(Default)]
struct Added {
    /// Bytes of new views, by their indices.
    views: BTreeMap<usize, Vec<u8>>,
    /// Accessors of the meshes that were replaced.
    replaced: BTreeSet<usize>,
    dropped_extensions: BTreeSet<String>,
}

fn is_rigged(json: &Value, primitive: &BakedPrimitive) -> bool {
    let mesh = &json["meshes"][primitive.mesh_index as usize];
    let primitive = &mesh["primitives"][primitive.primitive_index as usize];
    !primitive["targets"].is_null() || !primitive["attributes"]["JOINTS_0"].is_null()
}

/// Replaces a primitive by its coarsest level.
fn replace(
    json: &mut Value,
    baked: &BakedPrimitive,
    pages: &str,
    added: &mut Added,
) -> Result<(), ImportError> {
    let (mesh, index) = (baked.mesh_index as usize, baked.primitive_index as usize);
    let (attributes, indices) = add_coarsest(json, added, &baked.hierarchy);
    let primitive = json["meshes"][mesh]["primitives"].get_mut(index);
    let primitive = primitive
        .and_then(Value::as_object_mut)
        .ok_or_else(bad_reference)?;
    let old = primitive.insert("attributes".into(), attributes);
    added.replaced.extend(old.iter().flat_map(indices_in));
    let old = primitive.insert("indices".into(), indices.into());
    added.replaced.extend(old.as_ref().and_then(as_index));
    // A triangle list; the source may have been a strip.
    primitive.insert("mode".into(), 4.into());
    let extensions = primitive.get_mut("extensions");
    if let Some(extensions) = extensions.and_then(Value::as_object_mut) {
        let (kept, dropped) = std::mem::take(extensions)
            .into_iter()
            .partition::<Map<_, _>, _>(|(name, _)| EXTENSIONS_KEPT.contains(&name.as_str()));
        *extensions = kept;
        added
            .dropped_extensions
            .extend(dropped.into_iter().map(|(name, _)| name));
    }
    let triangles = baked.hierarchy.source_triangle_count();
    let place = json!({ "pages": pages, "mesh": mesh, "primitive": index, "triangles": triangles });
    let extras = primitive.entry("extras").or_insert_with(|| json!({}));
    if !extras.is_object() {
        *extras = json!({});
    }
    extras["fieldlod"] = place;
    Ok(())
}

/// Adds the coarsest cut as a mesh. Returns its attributes and the accessor of its indices.
fn add_coarsest(json: &mut Value, added: &mut Added, hierarchy: &Hierarchy) -> (Value, usize) {
    // Only the vertices of the coarsest cut are written: this is what keeps the scene small.
    let units = hierarchy
        .units_at_level(hierarchy.level_count())
        .into_iter();
    let triangles = units.flat_map(|unit| hierarchy.triangles_of(&hierarchy.units[unit]));
    let corners: Vec<u32> = triangles.flatten().collect();
    let used: BTreeSet<u32> = corners.iter().copied().collect();
    let places: BTreeMap<u32, u32> = used.iter().copied().zip(0..).collect();
    let vertices = hierarchy.vertices.at(&used.into_iter().collect::<Vec<_>>());
    let mut attributes = json!({});
    let mut add = |name: &str, kind: &str, values: Vec<f32>| {
        if !values.is_empty() {
            let bytes = values.iter().flat_map(|value| value.to_le_bytes());
            let accessor = add_accessor(json, added, FLOAT, kind, bytes.collect(), &values);
            attributes[name] = accessor.into();
        }
    };
    let positions = vertices.positions.iter().flat_map(Vec3::to_array);
    add("POSITION", "VEC3", positions.collect());
    let normals = vertices.normals.iter().flat_map(Vec3::to_array);
    add("NORMAL", "VEC3", normals.collect());
    for (name, uvs) in [
        ("TEXCOORD_0", &vertices.uvs),
        ("TEXCOORD_1", &vertices.uvs_1),
    ] {
        let numbers = uvs.iter().flat_map(Vec2::to_array);
        add(name, "VEC2", numbers.collect());
    }
    for (name, values) in [
        ("TANGENT", &vertices.tangents),
        ("COLOR_0", &vertices.colors),
    ] {
        let numbers = values.iter().flat_map(Vec4::to_array);
        add(name, "VEC4", numbers.collect());
    }
    let bytes = corners
        .iter()
        .flat_map(|corner| places[corner].to_le_bytes());
    let bytes: Vec<u8> = bytes.collect();
    let indices = add_accessor(json, added, UNSIGNED_INT, "SCALAR", bytes, &[]);
    (attributes, indices)
}

/// Adds an accessor with its own view, and returns its index.
fn add_accessor(
    json: &mut Value,
    added: &mut Added,
    component: u32,
    kind: &str,
    bytes: Vec<u8>,
    values: &[f32],
) -> usize {
    let width = match kind {
        "VEC4" => 4,
        "VEC3" => 3,
        "VEC2" => 2,
        _ => 1,
    };
    let mut accessor = json!({
        "componentType": component, "type": kind, "count": bytes.len() / (4 * width),
    });
    // glTF requires the extent of positions; other vectors may have one.
    if kind == "VEC3" {
        let axis = |axis: usize| values.iter().skip(axis).step_by(3).copied();
        let least = [0, 1, 2].map(|a| axis(a).fold(f32::INFINITY, f32::min));
        let most = [0, 1, 2].map(|a| axis(a).fold(f32::NEG_INFINITY, f32::max));
        (accessor["min"], accessor["max"]) = (json!(least), json!(most));
    }
    let view = push(
        json,
        "bufferViews",
        json!({ "buffer": 0, "byteLength": bytes.len() }),
    );
    accessor["bufferView"] = view.into();
    added.views.insert(view, bytes);
    push(json, "accessors", accessor)
}

fn push(json: &mut Value, list: &str, value: Value) -> usize {
    if !json[list].is_array() {
        json[list] = json!([]);
    }
    let list = json[list].as_array_mut().expect("the list is an array");
    list.push(value);
    list.len() - 1
}

/// Empties accessors of the `replaced` meshes that nothing else refers to, and returns them with their views. All
/// accessors keep their indices, because extensions may refer to them: any number in an extension counts as a reference.
fn drop_unused_accessors(json: &mut Value, replaced: &BTreeSet<usize>) -> BTreeMap<usize, usize> {
    let mut used = used_accessors(json);
    add_numbers_below("extensions", json, false, &mut used);
    let mut dropped = BTreeMap::new();
    for &unused in replaced.difference(&used) {
        let Some(accessor) = json["accessors"].get_mut(unused) else {
            continue;
        };
        if let Some(view) = as_index(&accessor["bufferView"]) {
            *accessor = json!({ "componentType": FLOAT, "type": "SCALAR", "count": 1 });
            dropped.insert(unused, view);
        }
    }
    dropped
}

fn used_accessors(json: &Value) -> BTreeSet<usize> {
    let mut used = BTreeSet::new();
    for primitive in each(json, "meshes").flat_map(|mesh| each(mesh, "primitives")) {
        used.extend(indices_in(&primitive["attributes"]));
        used.extend(each(primitive, "targets").flat_map(indices_in));
        used.extend(as_index(&primitive["indices"]));
    }
    let skins = each(json, "skins");
    used.extend(skins.filter_map(|skin| as_index(&skin["inverseBindMatrices"])));
    for sampler in each(json, "animations").flat_map(|animation| each(animation, "samplers")) {
        used.extend(as_index(&sampler["input"]));
        used.extend(as_index(&sampler["output"]));
    }
    used
}

/// The values of a list; none if it is missing.
fn each<'a>(value: &'a Value, list: &str) -> impl Iterator<Item = &'a Value> + use<'a> {
    value[list].as_array().into_iter().flatten()
}

fn as_index(value: &Value) -> Option<usize> {
    value.as_u64().map(|index| index as usize)
}

/// The indices that are values of an object.
fn indices_in(object: &Value) -> impl Iterator<Item = usize> {
    let values = object.as_object().into_iter().flat_map(Map::values);
    values.filter_map(as_index)
}

/// Adds all numbers below values with this key.
fn add_numbers_below(key: &str, value: &Value, is_below: bool, numbers: &mut BTreeSet<usize>) {
    match value {
        Value::Object(object) => {
            for (own_key, value) in object {
                add_numbers_below(key, value, is_below || own_key == key, numbers);
            }
        }
        Value::Array(list) => {
            for value in list {
                add_numbers_below(key, value, is_below, numbers);
            }
        }
        _ => numbers.extend(as_index(value).filter(|_| is_below)),
    }
}

/// Returns the bytes of all views, without those of `dropped` that nothing refers to. All views keep their indices.
fn pack(
    json: &mut Value,
    binary: &[u8],
    added: &Added,
    dropped: &BTreeMap<usize, usize>,
) -> Result<Vec<u8>, ImportError> {
    let mut used = BTreeSet::new();
    // Extensions may refer to views by other keys, so every number in an extension counts.
    for key in ["bufferView", "extensions"] {
        add_numbers_below(key, json, false, &mut used);
    }
    let dropped: BTreeSet<usize> = dropped.values().copied().collect();
    let mut bytes = Vec::new();
    let views = json.get_mut("bufferViews").and_then(Value::as_array_mut);
    for (number, view) in views.into_iter().flatten().enumerate() {
        if dropped.contains(&number) && !used.contains(&number) {
            // Readers reject an empty view, and an accessor without a view.
            *view = json!({ "buffer": 0, "byteOffset": 0, "byteLength": 4 });
            continue;
        }
        // New views come from memory, all others from the buffer of the source.
        let of_view = match added.views.get(&number) {
            Some(bytes) => bytes.as_slice(),
            None => bytes_of(view, binary)?,
        };
        view["byteOffset"] = bytes.len().into();
        bytes.extend_from_slice(of_view);
        // glTF aligns accessors to their component, which has at most four bytes.
        bytes.resize(bytes.len().next_multiple_of(4), 0);
    }
    json["buffers"] = json!([{ "byteLength": bytes.len() }]);
    Ok(bytes)
}

fn bytes_of<'a>(view: &Value, binary: &'a [u8]) -> Result<&'a [u8], ImportError> {
    let start = view["byteOffset"].as_u64().unwrap_or(0) as usize;
    let length = view["byteLength"].as_u64().ok_or_else(bad_reference)? as usize;
    let end = start.checked_add(length).ok_or_else(bad_reference)?;
    binary.get(start..end).ok_or_else(bad_reference)
}
