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

/// Why a scene cannot be written.
#[derive(Debug, Error)]
pub(crate) enum SceneFault {
    #[error("a scene must be a .glb file")]
    NotGlb,
    #[error("could not read its JSON: {0}")]
    Json(#[from] serde_json::Error),
    #[error("external buffers are not supported; pack the scene as a self-contained .glb")]
    OtherBuffers,
    #[error(
        "compressed buffer views are not supported for small meshes; decompress the scene first"
    )]
    Packed,
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
    /// Image files that the scene names.
    pub(crate) images: Vec<String>,
}

impl Scene {
    /// Replaces meshes with at least `large_from_triangles` by a reference to `pages`.
    pub(crate) fn new(
        source: &[u8],
        baked: BakedFile,
        pages: &str,
        large_from_triangles: u64,
    ) -> Result<Self, SceneFault> {
        let (json, binary) = glb::parts(source).ok_or(SceneFault::NotGlb)?;
        let mut json: Value = serde_json::from_slice(json)?;
        let is_large = |primitive: &BakedPrimitive| {
            primitive.hierarchy.source_triangle_count() >= large_from_triangles
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
        drop_unused_accessors(&mut json)?;
        let binary = pack(&mut json, binary, &added)?;
        let images = json["images"].as_array().into_iter().flatten();
        let files = images.filter_map(|image| image["uri"].as_str());
        let files = files.filter(|uri| !uri.starts_with("data:"));
        let images = files.map(str::to_owned).collect();
        Ok(Self {
            glb: glb::whole(json.to_string().as_bytes(), &binary),
            large,
            small,
            images,
        })
    }
}

/// New buffer views by their numbers.
#[derive(Default)]
struct Added(BTreeMap<usize, Vec<u8>>);

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
    primitive.insert("attributes".into(), attributes.into());
    primitive.insert("indices".into(), indices.into());
    primitive.insert("mode".into(), 4.into());
    if let Some(extensions) = primitive
        .get_mut("extensions")
        .and_then(Value::as_object_mut)
    {
        extensions.remove("KHR_draco_mesh_compression");
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
        let of = |vertex: &u32| *vertex as usize;
        let vertices = &hierarchy.vertices;
        let positions = used
            .iter()
            .flat_map(|v| vertices.positions[of(v)].to_array());
        let mut attributes = vec![("POSITION", "VEC3", positions.collect())];
        if !vertices.normals.is_empty() {
            let normals = used.iter().flat_map(|v| vertices.normals[of(v)].to_array());
            attributes.push(("NORMAL", "VEC3", normals.collect()));
        }
        if !vertices.uvs.is_empty() {
            let uvs = used.iter().flat_map(|v| vertices.uvs[of(v)].to_array());
            attributes.push(("TEXCOORD_0", "VEC2", uvs.collect()));
        }
        Self {
            attributes,
            indices: corners.iter().map(|corner| places[corner]).collect(),
        }
    }
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
    added.0.insert(view, bytes);
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

/// Removes unused accessors.
fn drop_unused_accessors(json: &mut Value) -> Result<(), SceneFault> {
    let mut used = BTreeSet::new();
    visit_accessors(json, &mut |accessor| used.extend(accessor.as_u64()));
    let accessors = json["accessors"].take();
    let kept = used
        .iter()
        .map(|&number| accessors.get(number as usize).cloned());
    let kept: Option<Vec<Value>> = kept.collect();
    json["accessors"] = kept.ok_or(SceneFault::Reference)?.into();
    let numbers: BTreeMap<u64, usize> = used.into_iter().zip(0..).collect();
    visit_accessors(json, &mut |accessor| renumber(accessor, &numbers));
    Ok(())
}

fn renumber(value: &mut Value, numbers: &BTreeMap<u64, usize>) {
    if let Some(&number) = value.as_u64().and_then(|number| numbers.get(&number)) {
        *value = number.into();
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

/// Removes unused views, and returns the bytes of the others.
fn pack(json: &mut Value, binary: &[u8], added: &Added) -> Result<Vec<u8>, SceneFault> {
    let views = match json["bufferViews"].take() {
        Value::Array(views) => views,
        _ => Vec::new(),
    };
    let mut used = BTreeSet::new();
    visit_views(json, &mut |view| used.extend(view.as_u64()));
    let (mut bytes, mut kept) = (Vec::new(), Vec::new());
    for &number in &used {
        let mut view = views
            .get(number as usize)
            .cloned()
            .ok_or(SceneFault::Reference)?;
        let of_view = match added.0.get(&(number as usize)) {
            Some(bytes) => bytes.as_slice(),
            None => bytes_of(&view, json, binary)?,
        };
        view["byteOffset"] = bytes.len().into();
        bytes.extend_from_slice(of_view);
        bytes.resize(bytes.len().next_multiple_of(4), 0);
        kept.push(view);
    }
    let numbers: BTreeMap<u64, usize> = used.into_iter().zip(0..).collect();
    visit_views(json, &mut |view| renumber(view, &numbers));
    json["bufferViews"] = kept.into();
    json["buffers"] = json!([{ "byteLength": bytes.len() }]);
    Ok(bytes)
}

fn bytes_of<'a>(view: &Value, json: &Value, binary: &'a [u8]) -> Result<&'a [u8], SceneFault> {
    if view.get("extensions").is_some() {
        return Err(SceneFault::Packed);
    }
    if view["buffer"] != 0 || json["buffers"][0].get("uri").is_some() {
        return Err(SceneFault::OtherBuffers);
    }
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
