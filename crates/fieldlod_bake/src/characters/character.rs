//! The primitives that one skin moves, as one mesh.

use std::collections::BTreeMap;
use std::ops::Range;

use fieldlod_hierarchy::{Hierarchy, SourceHash};
use glam::Vec3;

use super::apart::positions_apart;
use crate::import::{Import, ImportedPrimitive, Rig, Skin};
use crate::mesh::components::components_of;
use crate::mesh::{SourceMesh, adapter};
use crate::plants::together::{Joint, as_one_mesh};

/// Primitives that change their levels together.
#[derive(Debug)]
pub struct Character<'a> {
    /// The primitives.
    pub parts: Vec<Part<'a>>,
    /// All parts as one mesh, in the bind pose.
    pub mesh: SourceMesh,
    /// Positions in the bind pose in which parts that lie at one place are apart.
    pub(super) apart: Vec<Vec3>,
    /// For each vertex, the index of its connected component. Parts that meet are connected.
    pub(super) component: Vec<u32>,
    /// The skins that the parts are drawn with.
    pub(super) skins: Vec<&'a Skin>,
    /// For each vertex, the joints that move it and their weights. All are zero if its place is unknown. Empty without
    /// a skin.
    pub(super) influences: Vec<[(u16, f32); 4]>,
    /// Joints that move at least one vertex, as indices into the joints of the skin. Joints that move the largest area
    /// come first.
    pub(super) joints_by_weight: Vec<u16>,
}

/// One primitive of a character.
#[derive(Debug)]
pub struct Part<'a> {
    /// The index of the primitive in the import.
    pub index: usize,
    /// The primitive.
    pub primitive: &'a ImportedPrimitive,
    pub(super) rig: &'a Rig,
    /// The range of the primitive's vertices in the character.
    pub vertices: Range<u32>,
}

impl Part<'_> {
    /// The hash of the primitive's mesh with joints and morph targets.
    pub(super) fn source_hash(&self) -> SourceHash {
        let vertices = self.primitive.mesh.source_hash();
        let joints = if self.rig.skins.is_empty() {
            vertices
        } else {
            vertices.with_joints(&self.rig.joints, &self.rig.weights)
        };
        let targets = self.rig.targets.iter();
        targets.fold(joints, |hash, target| hash.with_morph_target(target))
    }

    /// Returns `true` if each triangle has its own vertices, in order. Triangles then share no normals.
    pub(super) fn has_flat_triangles(&self) -> bool {
        let indices = self.primitive.mesh.indices.iter().copied();
        indices.eq(0..self.vertices.len() as u32)
    }

    pub(super) fn range(&self) -> Range<usize> {
        self.vertices.start as usize..self.vertices.end as usize
    }
}

impl<'a> Character<'a> {
    /// The characters of a file: primitives with the same skins, or of one mesh without a skin.
    #[must_use]
    pub fn all_of(import: &'a Import) -> Vec<Self> {
        let mut by_key: BTreeMap<(&[u32], u32), Vec<Part<'a>>> = BTreeMap::new();
        for (index, primitive) in import.primitives.iter().enumerate() {
            let Some(rig) = &primitive.rig else {
                continue;
            };
            let mesh = primitive.place.mesh_index;
            let key = match &rig.skins[..] {
                [] => (&[][..], mesh),
                skins => (skins, 0),
            };
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

    fn of(mut parts: Vec<Part<'a>>, all_skins: &'a [Skin]) -> Self {
        let of_first = parts.iter().take(1).flat_map(|part| &part.rig.skins);
        let skins: Vec<&Skin> = of_first.map(|skin| &all_skins[*skin as usize]).collect();
        let mut influences = Vec::new();
        let mut first = 0;
        for part in &mut parts {
            part.vertices = first..first + part.primitive.mesh.positions.len() as u32;
            first = part.vertices.end;
            influences.extend(influences_of(part.rig, &skins));
        }
        let meshes = parts.iter().map(|part| &part.primitive.mesh);
        let mesh = as_one_mesh(&meshes.collect::<Vec<_>>(), Joint::Surface);
        let apart = positions_apart(&mesh, &influences);
        let mut character = Self {
            component: component_of_vertices(&mesh, &apart),
            apart,
            parts,
            mesh,
            skins,
            influences,
            joints_by_weight: Vec::new(),
        };
        character.joints_by_weight = character.joints_by_weight();
        character
    }

    /// The joint with an invertible matrix that moves the largest area. Poses are relative to it: a character that moves
    /// as a whole is not deformed.
    pub(super) fn carrier_joint(&self) -> Option<u16> {
        let mut joints = self.joints_by_weight.iter().copied();
        joints.find(|&joint| self.skins.iter().all(|skin| skin.is_invertible(joint)))
    }

    /// Whether Bevy draws a vertex at a place that depends on more than the pose. Its triangles stay at all levels.
    pub(super) fn is_odd(&self, vertex: u32) -> bool {
        let influences = self.influences.get(vertex as usize);
        influences.is_some_and(|own| own.iter().all(|(_, weight)| *weight == 0.0))
    }

    /// The triangles of all parts.
    #[must_use]
    pub fn triangles(&self) -> &[[u32; 3]] {
        self.mesh.indices.as_chunks().0
    }

    /// The triangles of all parts at a level. `baked` has a hierarchy for each part.
    #[must_use]
    pub fn triangles_at(&self, baked: &[&Hierarchy], level: usize) -> Vec<[u32; 3]> {
        let parts = self.parts.iter().zip(baked);
        let triangles = parts.flat_map(|(part, hierarchy)| {
            let triangles = hierarchy.triangles_of(&hierarchy.units[level]);
            triangles.map(|triangle| triangle.map(|vertex| vertex + part.vertices.start))
        });
        triangles.collect()
    }

    /// The area of all triangles in the bind pose.
    pub(super) fn area(&self) -> f32 {
        self.triangles().iter().map(|t| self.area_of(t)).sum()
    }

    fn area_of(&self, triangle: &[u32; 3]) -> f32 {
        let [a, b, c] = triangle.map(|vertex| self.mesh.positions[vertex as usize]);
        0.5 * (b - a).cross(c - a).length()
    }

    fn joints_by_weight(&self) -> Vec<u16> {
        let mut areas: BTreeMap<u16, f32> = BTreeMap::new();
        for triangle in self.triangles() {
            let area = self.area_of(triangle);
            let influences = triangle
                .iter()
                .filter_map(|&v| self.influences.get(v as usize));
            for &(joint, weight) in influences.flatten().filter(|(_, weight)| *weight > 0.0) {
                *areas.entry(joint).or_default() += area * weight;
            }
        }
        let mut joints: Vec<(u16, f32)> = areas.into_iter().collect();
        // A stable sort of a sorted map: equal areas stay in the order of joints.
        joints.sort_by(|a, b| b.1.total_cmp(&a.1));
        joints.into_iter().map(|(joint, _)| joint).collect()
    }
}

fn component_of_vertices(mesh: &SourceMesh, apart: &[Vec3]) -> Vec<u32> {
    let positions: Vec<[f32; 3]> = apart.iter().map(Vec3::to_array).collect();
    let is_locked = vec![false; positions.len()];
    let same_position = meshopt::generate_position_remap(&adapter(&positions));
    let components = components_of(&mesh.indices, &positions, &same_position, &is_locked);
    let mut component_of = vec![0; positions.len()];
    for (index, component) in (0..).zip(&components) {
        component
            .corners()
            .for_each(|v| component_of[v as usize] = index);
    }
    component_of
}

/// Joints and weights of each vertex. All are zero if any skin cannot use them.
fn influences_of<'a>(
    rig: &'a Rig,
    skins: &'a [&Skin],
) -> impl Iterator<Item = [(u16, f32); 4]> + 'a {
    let pairs = rig.joints.iter().zip(&rig.weights);
    pairs.map(|(&joints, &weights)| {
        let mut of_skins = skins.iter().map(|skin| skin.influences(joints, weights));
        let first = of_skins.next().flatten();
        first
            .filter(|_| of_skins.all(|own| own.is_some()))
            .unwrap_or_default()
    })
}
