//! A scene whose large meshes are in a file of their own: a `.glb` file without their geometry.
//!
//! Nodes, materials, images, animations and small meshes are kept. A large primitive keeps its material. Its triangles
//! become those of its coarsest level, which other programs show. Its `extras` name the `.fieldpages` file beside the
//! scene, its place in that file, and its number of triangles there:
//! `{ "fieldlod": { "pages": "world.fieldpages", "mesh": 0, "primitive": 0, "triangles": 327680 } }`.

use std::collections::{BTreeMap, BTreeSet};

use fieldlod_hierarchy::{BakedFile, BakedPrimitive, Hierarchy};
use serde_json::{Map, Value, json};
use thiserror::Error;

use crate::glb;

const FLOAT: u32 = 5126;
const UNSIGNED_INT: u32 = 5125;
/// Extensions of primitives that do not refer to their vertices or triangles.
const EXTENSIONS_KEPT: [&str; 1] = ["KHR_materials_variants"];

/// Why a scene cannot be written.
#[derive(Debug, Error)]
pub(crate) enum SceneFault {
    #[error("its JSON cannot be read: {0}")]
    Json(#[from] serde_json::Error),
    #[error("invalid glTF: index out of range")]
    Reference,
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
    /// Takes meshes of so many triangles and more out of `source`, a self-contained `.glb` file, and names `pages` in
    /// their place.
    pub(crate) fn new(
        source: &[u8],
        baked: BakedFile,
        pages: &str,
        large_from_triangles: u64,
    ) -> Result<Self, SceneFault> {
        let (json, binary) = glb::parts(source).ok_or(SceneFault::Reference)?;
        let mut json: Value = serde_json::from_slice(json)?;
        let is_large = |primitive: &BakedPrimitive| {
            let is_large = primitive.hierarchy.source_triangle_count() >= large_from_triangles;
            // Pages have neither joints nor morph targets.
            is_large && !is_rigged(&json, primitive)
        };
        let (large, small) = baked.primitives.into_iter().partition(is_large);
        let (large, small) = (
            BakedFile { primitives: large },
            BakedFile { primitives: small },
        );
        let mut added = Added::default();
        for primitive in &large.primitives {
            replace(&mut json, primitive, pages, &mut added)?;
        }
        let dropped = drop_unused_accessors(&mut json, &added.replaced);
        let binary = pack(&mut json, binary, &added, &dropped)?;
        for (accessor, view) in dropped {
            json["accessors"][accessor]["bufferView"] = view.into();
        }
        Ok(Self {
            glb: glb::whole(json.to_string().as_bytes(), &binary),
            large,
            small,
            dropped_extensions: added.dropped_extensions,
        })
    }
}

/// Files that images of a self-contained `.glb` file are in, as its JSON names them.
pub(crate) fn image_files(source: &[u8]) -> Result<Vec<String>, SceneFault> {
    let (json, _) = glb::parts(source).ok_or(SceneFault::Reference)?;
    let json: Value = serde_json::from_slice(json)?;
    let images = json["images"].as_array().into_iter().flatten();
    let files = images.filter_map(|image| image["uri"].as_str());
    let is_data = |uri: &str| {
        uri.get(..5)
            .is_some_and(|s| s.eq_ignore_ascii_case("data:"))
    };
    Ok(files
        .filter(|uri| !is_data(uri))
        .map(str::to_owned)
        .collect())
}

/// Changes of a scene.
#[derive(Default)]
struct Added {
    /// Views that it gets, by their numbers.
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
) -> Result<(), SceneFault> {
    let (mesh, index) = (baked.mesh_index as usize, baked.primitive_index as usize);
    let coarsest = Coarsest::of(&baked.hierarchy);
    let mut attributes = Map::new();
    for (name, kind, values) in &coarsest.attributes {
        let accessor = add_accessor(json, added, FLOAT, kind, f32_bytes(values), values);
        attributes.insert((*name).into(), accessor.into());
    }
    let bytes = coarsest
        .indices
        .iter()
        .flat_map(|i| i.to_le_bytes())
        .collect();
    let indices = add_accessor(json, added, UNSIGNED_INT, "SCALAR", bytes, &[]);
    let primitive = json["meshes"][mesh]["primitives"].get_mut(index);
    let primitive = primitive
        .and_then(Value::as_object_mut)
        .ok_or(SceneFault::Reference)?;
    let old = primitive.insert("attributes".into(), attributes.into());
    let old_indices = primitive.insert("indices".into(), indices.into());
    let old = old.as_ref().and_then(Value::as_object);
    let old = old.into_iter().flat_map(Map::values).chain(&old_indices);
    added.replaced.extend(old.filter_map(as_index));
    primitive.insert("mode".into(), 4.into());
    let extensions = primitive.get_mut("extensions");
    if let Some(extensions) = extensions.and_then(Value::as_object_mut) {
        extensions.retain(|name, _| {
            let is_kept = EXTENSIONS_KEPT.contains(&name.as_str());
            if !is_kept {
                added.dropped_extensions.insert(name.clone());
            }
            is_kept
        });
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

/// The coarsest cut as a mesh.
struct Coarsest {
    /// Names, types and values.
    attributes: Vec<(&'static str, &'static str, Vec<f32>)>,
    indices: Vec<u32>,
}

impl Coarsest {
    fn of(hierarchy: &Hierarchy) -> Self {
        let mut refined = vec![false; hierarchy.groups.len()];
        hierarchy.close_refinement(&mut refined);
        let units = hierarchy.drawn_units(&refined);
        let triangles = units.flat_map(|unit| hierarchy.triangles_of(&hierarchy.units[unit]));
        let corners: Vec<u32> = triangles.flatten().collect();
        let used: BTreeSet<u32> = corners.iter().copied().collect();
        let places: BTreeMap<u32, u32> = used.iter().copied().zip(0..).collect();
        let vertices = &hierarchy.vertices;
        let positions = numbers(&vertices.positions, &used, |v| v.to_array());
        let normals = numbers(&vertices.normals, &used, |v| v.to_array());
        let uvs = numbers(&vertices.uvs, &used, |v| v.to_array());
        let uvs_1 = numbers(&vertices.uvs_1, &used, |v| v.to_array());
        let tangents = numbers(&vertices.tangents, &used, |v| v.to_array());
        let colors = numbers(&vertices.colors, &used, |v| v.to_array());
        let mut attributes = vec![
            ("POSITION", "VEC3", positions),
            ("NORMAL", "VEC3", normals),
            ("TEXCOORD_0", "VEC2", uvs),
            ("TEXCOORD_1", "VEC2", uvs_1),
            ("TANGENT", "VEC4", tangents),
            ("COLOR_0", "VEC4", colors),
        ];
        attributes.retain(|(_, _, values)| !values.is_empty());
        Self {
            attributes,
            indices: corners.iter().map(|corner| places[corner]).collect(),
        }
    }
}

/// The numbers of an attribute at some vertices; none of one that is not there.
fn numbers<V: Copy, const N: usize>(
    values: &[V],
    vertices: &BTreeSet<u32>,
    numbers: impl Fn(V) -> [f32; N],
) -> Vec<f32> {
    let held = vertices.iter().filter_map(|v| values.get(*v as usize));
    held.flat_map(|&value| numbers(value)).collect()
}

fn f32_bytes(values: &[f32]) -> Vec<u8> {
    values
        .iter()
        .flat_map(|value| value.to_le_bytes())
        .collect()
}

/// Adds an accessor with its own view, and returns its number.
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
    let list = json[list].as_array_mut().expect("it was just made");
    list.push(value);
    list.len() - 1
}

/// Empties accessors of the `replaced` meshes that nothing else refers to, and takes their views from them. Returns both.
/// All accessors keep their numbers, by which extensions may name them: any number in an extension counts as a
/// reference.
fn drop_unused_accessors(json: &mut Value, replaced: &BTreeSet<usize>) -> BTreeMap<usize, usize> {
    let mut used = BTreeSet::new();
    visit_accessors(json, &mut |accessor| used.extend(as_index(accessor)));
    numbers_in_extensions(json, false, &mut used);
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

fn as_index(value: &Value) -> Option<usize> {
    value.as_u64().map(|index| index as usize)
}

/// Collects the numbers in all extensions.
fn numbers_in_extensions(value: &Value, is_inside: bool, numbers: &mut BTreeSet<usize>) {
    match value {
        Value::Object(object) => {
            for (key, value) in object {
                numbers_in_extensions(value, is_inside || key == "extensions", numbers);
            }
        }
        Value::Array(list) => {
            let each = list.iter();
            each.for_each(|value| numbers_in_extensions(value, is_inside, numbers));
        }
        _ if is_inside => numbers.extend(as_index(value)),
        _ => {}
    }
}

/// Visits all accessor numbers.
fn visit_accessors(json: &mut Value, visit: &mut impl FnMut(&mut Value)) {
    for primitive in each(json, "meshes").flat_map(|mesh| each(mesh, "primitives")) {
        visit_values(primitive.get_mut("attributes"), visit);
        for target in each(primitive, "targets") {
            visit_values(Some(target), visit);
        }
        primitive
            .get_mut("indices")
            .into_iter()
            .for_each(&mut *visit);
    }
    for skin in each(json, "skins") {
        skin.get_mut("inverseBindMatrices")
            .into_iter()
            .for_each(&mut *visit);
    }
    for sampler in each(json, "animations").flat_map(|animation| each(animation, "samplers")) {
        for end in ["input", "output"] {
            sampler.get_mut(end).into_iter().for_each(&mut *visit);
        }
    }
    for node in each(json, "nodes") {
        visit_values(
            node.pointer_mut("/extensions/EXT_mesh_gpu_instancing/attributes"),
            visit,
        );
    }
}

/// The values of a list, or nothing.
fn each<'a>(value: &'a mut Value, list: &str) -> impl Iterator<Item = &'a mut Value> + use<'a> {
    let list = value.get_mut(list).and_then(Value::as_array_mut);
    list.into_iter().flatten()
}

fn visit_values(object: Option<&mut Value>, visit: &mut impl FnMut(&mut Value)) {
    let values = object.and_then(Value::as_object_mut);
    let values = values.into_iter().flat_map(Map::values_mut);
    values.for_each(visit);
}

/// Returns the bytes of all views, but for those of `dropped` that nothing refers to. All keep their numbers.
fn pack(
    json: &mut Value,
    binary: &[u8],
    added: &Added,
    dropped: &BTreeMap<usize, usize>,
) -> Result<Vec<u8>, SceneFault> {
    let mut used = BTreeSet::new();
    visit_views(json, &mut |view| used.extend(as_index(view)));
    numbers_in_extensions(json, false, &mut used);
    let unused: BTreeSet<usize> = dropped.values().copied().collect();
    let unused: BTreeSet<usize> = unused.difference(&used).copied().collect();
    let mut bytes = Vec::new();
    let views = json.get_mut("bufferViews").and_then(Value::as_array_mut);
    for (number, view) in views.into_iter().flatten().enumerate() {
        if unused.contains(&number) {
            // Readers refuse an empty view, and an accessor without one.
            *view = json!({ "buffer": 0, "byteOffset": 0, "byteLength": 4 });
            continue;
        }
        let of_view = match added.views.get(&number) {
            Some(bytes) => bytes.as_slice(),
            None => bytes_of(view, binary)?,
        };
        view["byteOffset"] = bytes.len().into();
        bytes.extend_from_slice(of_view);
        bytes.resize(bytes.len().next_multiple_of(4), 0);
    }
    json["buffers"] = json!([{ "byteLength": bytes.len() }]);
    Ok(bytes)
}

fn bytes_of<'a>(view: &Value, binary: &'a [u8]) -> Result<&'a [u8], SceneFault> {
    let start = view["byteOffset"].as_u64().unwrap_or(0) as usize;
    let length = view["byteLength"].as_u64().ok_or(SceneFault::Reference)? as usize;
    let end = start.checked_add(length).ok_or(SceneFault::Reference)?;
    binary.get(start..end).ok_or(SceneFault::Reference)
}

/// Visits all view numbers. Extensions use the same key for them.
fn visit_views(value: &mut Value, visit: &mut impl FnMut(&mut Value)) {
    match value {
        Value::Object(object) => {
            for (key, value) in object {
                if key == "bufferView" {
                    visit(value);
                } else {
                    visit_views(value, visit);
                }
            }
        }
        Value::Array(list) => list.iter_mut().for_each(|value| visit_views(value, visit)),
        _ => {}
    }
}
