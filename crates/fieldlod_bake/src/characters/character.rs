//! The primitives that one skin moves, as one mesh.

use std::collections::BTreeMap;
use std::ops::Range;

use fieldlod_hierarchy::SourceHash;
use rustc_hash::FxHashMap;

use crate::import::{Import, ImportedPrimitive, Rig, Skin};
use crate::mesh::SourceMesh;
use crate::mesh::components::root;
use crate::plants::together::{Joint, as_one_mesh};

/// Primitives that change their levels together.
#[derive(Debug)]
pub struct Character<'a> {
    /// The primitives.
    pub parts: Vec<Part<'a>>,
    /// All parts as one mesh, in the bind pose.
    pub mesh: SourceMesh,
    /// For each vertex, its component. Triangles that share vertices are one, and so are those that share positions within
    /// a part.
    pub(super) component: Vec<u32>,
    pub(super) skin: Option<&'a Skin>,
    /// For each vertex, the joints that move it and their weights, which sum to 1. Empty without a skin.
    pub(super) influences: Vec<[(u16, f32); 4]>,
    /// The joints that move some vertex, as indices into the joints of the skin. Those that move the largest area come
    /// first.
    pub(super) joints_by_weight: Vec<u16>,
    /// The first of these.
    pub(super) carrier_joint: Option<u16>,
}

/// One primitive of a character.
#[derive(Debug)]
pub struct Part<'a> {
    /// Its index in the import.
    pub index: usize,
    /// The primitive.
    pub primitive: &'a ImportedPrimitive,
    pub(super) rig: &'a Rig,
    /// Its vertices among those of the character.
    pub vertices: Range<u32>,
}

impl Part<'_> {
    /// The hash of its mesh with joints and morph targets.
    pub(super) fn source_hash(&self) -> SourceHash {
        let vertices = self.primitive.mesh.source_hash();
        let joints = match self.rig.skin {
            Some(_) => vertices.with_joints(&self.rig.joints, &self.rig.weights),
            None => vertices,
        };
        let targets = self.rig.targets.iter();
        targets.fold(joints, |hash, target| hash.with_morph_target(target))
    }

    /// Whether each triangle has its own vertices, in order: its normals are then its own, too.
    pub(super) fn has_flat_triangles(&self) -> bool {
        let indices = self.primitive.mesh.indices.iter().copied();
        indices.eq(0..self.vertices.len() as u32)
    }

    pub(super) fn range(&self) -> Range<usize> {
        self.vertices.start as usize..self.vertices.end as usize
    }
}

impl<'a> Character<'a> {
    /// The characters of a file: primitives with one skin, or of one mesh without a skin.
    #[must_use]
    pub fn all_of(import: &'a Import) -> Vec<Self> {
        let mut by_key: BTreeMap<(bool, u32), Vec<Part<'a>>> = BTreeMap::new();
        for (index, primitive) in import.primitives.iter().enumerate() {
            let Some(rig) = &primitive.rig else {
                continue;
            };
            let mesh = primitive.place.mesh_index;
            let key = (rig.skin.is_none(), rig.skin.unwrap_or(mesh));
            by_key.entry(key).or_default().push(Part {
                index,
                primitive,
                rig,
                vertices: 0..0,
            });
        }
        let parts = by_key.into_values();
        parts.map(|parts| Self::of(parts, &import.skins)).collect()
    }

    fn of(mut parts: Vec<Part<'a>>, skins: &'a [Skin]) -> Self {
        let mut influences = Vec::new();
        let mut first = 0;
        for part in &mut parts {
            part.vertices = first..first + part.primitive.mesh.positions.len() as u32;
            first = part.vertices.end;
            influences.extend(influences_of(part.rig));
        }
        let meshes = parts.iter().map(|part| &part.primitive.mesh);
        let mesh = as_one_mesh(&meshes.collect::<Vec<_>>(), Joint::Surface);
        let skin = parts.first().and_then(|part| part.rig.skin);
        let mut character = Self {
            component: components(&parts, &mesh),
            parts,
            mesh,
            skin: skin.map(|skin| &skins[skin as usize]),
            influences,
            joints_by_weight: Vec::new(),
            carrier_joint: None,
        };
        character.joints_by_weight = character.joints_by_weight();
        character.carrier_joint = character.joints_by_weight.first().copied();
        character
    }

    pub(super) fn component_count(&self) -> usize {
        self.component
            .iter()
            .max()
            .map_or(0, |last| *last as usize + 1)
    }

    /// The triangles of all parts.
    #[must_use]
    pub fn triangles(&self) -> &[[u32; 3]] {
        self.mesh.indices.as_chunks().0
    }

    fn joints_by_weight(&self) -> Vec<u16> {
        let mut areas: BTreeMap<u16, f32> = BTreeMap::new();
        for triangle in self.triangles() {
            let [a, b, c] = triangle.map(|vertex| self.mesh.positions[vertex as usize]);
            let area = (b - a).cross(c - a).length();
            let influences = triangle
                .iter()
                .filter_map(|&v| self.influences.get(v as usize));
            for &(joint, weight) in influences.flatten().filter(|(_, weight)| *weight > 0.0) {
                *areas.entry(joint).or_default() += area * weight;
            }
        }
        let mut joints: Vec<(u16, f32)> = areas.into_iter().collect();
        joints.sort_by(|a, b| b.1.total_cmp(&a.1));
        joints.into_iter().map(|(joint, _)| joint).collect()
    }
}

/// The component of each vertex.
fn components(parts: &[Part<'_>], mesh: &SourceMesh) -> Vec<u32> {
    let mut leads_to: Vec<u32> = (0..mesh.positions.len() as u32).collect();
    for part in parts {
        let mut first_at: FxHashMap<[u32; 3], u32> = FxHashMap::default();
        for vertex in part.vertices.clone() {
            let position = mesh.positions[vertex as usize];
            let place = position.to_array().map(|x| (x + 0.0).to_bits());
            leads_to[vertex as usize] = *first_at.entry(place).or_insert(vertex);
        }
    }
    let (triangles, _) = mesh.indices.as_chunks::<3>();
    for &[a, b, c] in triangles {
        for (from, to) in [(a, b), (b, c)] {
            let (from, to) = (root(&mut leads_to, from), root(&mut leads_to, to));
            leads_to[from.max(to) as usize] = from.min(to);
        }
    }
    let mut numbers: FxHashMap<u32, u32> = FxHashMap::default();
    let vertices = 0..leads_to.len() as u32;
    let number = |vertex| {
        let next = numbers.len() as u32;
        *numbers.entry(root(&mut leads_to, vertex)).or_insert(next)
    };
    vertices.map(number).collect()
}

/// Joints and normalized weights of each vertex. Joints without weight may not exist, and become the first.
fn influences_of(rig: &Rig) -> impl Iterator<Item = [(u16, f32); 4]> + '_ {
    let pairs = rig.joints.iter().zip(&rig.weights);
    pairs.map(|(joints, weights)| {
        let sum: f32 = weights.iter().sum();
        std::array::from_fn(|k| match weights[k] {
            0.0 => (0, 0.0),
            weight => (joints[k], weight / sum),
        })
    })
}
