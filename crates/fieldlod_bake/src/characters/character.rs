//! The primitives that one skin moves, as one mesh.

use std::collections::BTreeMap;
use std::ops::Range;

use glam::Vec3;

use crate::import::{Import, ImportedPrimitive, Rig};

/// Primitives that change their levels together.
pub(crate) struct Character<'a> {
    pub(crate) parts: Vec<Part<'a>>,
    /// Positions of the vertices of all parts, in the bind pose.
    pub(crate) positions: Vec<Vec3>,
    /// Triangles of all parts.
    pub(crate) indices: Vec<u32>,
    /// The joint with the most weight, as an index into the joints of the skin.
    pub(crate) carrier_joint: Option<u16>,
}

/// One primitive of a character.
pub(crate) struct Part<'a> {
    /// Its index in the import.
    pub(crate) index: usize,
    pub(crate) primitive: &'a ImportedPrimitive,
    pub(crate) rig: &'a Rig,
    /// Its vertices among those of the character.
    pub(crate) vertices: Range<u32>,
}

impl<'a> Character<'a> {
    /// The characters of a file: primitives with one skin, or of one mesh without a skin.
    pub(crate) fn all_of(import: &'a Import) -> Vec<Self> {
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
        by_key.into_values().map(Self::of).collect()
    }

    fn of(mut parts: Vec<Part<'a>>) -> Self {
        let (mut positions, mut indices) = (Vec::new(), Vec::new());
        for part in &mut parts {
            let mesh = &part.primitive.mesh;
            let first = positions.len() as u32;
            positions.extend(&mesh.positions);
            indices.extend(mesh.indices.iter().map(|index| first + index));
            part.vertices = first..positions.len() as u32;
        }
        Self {
            carrier_joint: heaviest_joint(&parts),
            parts,
            positions,
            indices,
        }
    }
}

/// The joint that moves the largest area.
fn heaviest_joint(parts: &[Part<'_>]) -> Option<u16> {
    let mut areas: BTreeMap<u16, f32> = BTreeMap::new();
    for part in parts {
        let mesh = &part.primitive.mesh;
        let (triangles, _) = mesh.indices.as_chunks::<3>();
        for triangle in triangles {
            let [a, b, c] = triangle.map(|vertex| mesh.positions[vertex as usize]);
            let area = (b - a).cross(c - a).length();
            for vertex in triangle.map(|vertex| vertex as usize) {
                let joints = part.rig.joints.get(vertex).into_iter().flatten();
                let weights = part.rig.weights.get(vertex).into_iter().flatten();
                for (&joint, weight) in joints.zip(weights).filter(|(_, weight)| **weight > 0.0) {
                    *areas.entry(joint).or_default() += area * weight;
                }
            }
        }
    }
    let heaviest = areas.into_iter().max_by(|a, b| a.1.total_cmp(&b.1));
    heaviest.map(|(joint, _)| joint)
}
