//! What a large mesh hides others with: some of its coarse levels.

use fieldlod_hierarchy::{Group, Hierarchy, Unit};
use glam::{Mat3, Vec3};

use super::image_plane::ImagePlane;
use super::solid::SolidLevel;
use crate::boxes::{AxisBox, LocalBox};
use crate::stretch::largest_stretch;

/// The most triangles of an occluder's levels.
const LEVELS: [usize; 4] = [4096, 1024, 256, 64];

/// One coarse level of a mesh.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct OccluderMesh {
    parts: Vec<OccluderPart>,
    /// How far the level errs, in local units.
    error_in_local: f32,
    /// The level as it hides for certain, if that is known.
    pub(crate) solid: Option<SolidLevel>,
}

/// A part of it that is drawn or not drawn as a whole.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct OccluderPart {
    bounds: LocalBox,
    positions: Vec<Vec3>,
    triangles: Vec<[u16; 3]>,
}

/// The coarse levels of a mesh as a whole, finest first.
pub(crate) fn occluder_levels(hierarchy: &Hierarchy) -> Vec<OccluderMesh> {
    let mut levels: Vec<OccluderMesh> = Vec::new();
    let mut wanted = LEVELS.iter().copied().peekable();
    // A hierarchy may come without its geometry.
    let has_geometry = !hierarchy.unit_vertices.is_empty();
    let level_count = if has_geometry {
        hierarchy.level_count()
    } else {
        0
    };
    for group_level in 0..level_count {
        let refined = refined_from_level(hierarchy, group_level);
        let level = OccluderMesh::new(hierarchy, &refined);
        let count = level.triangle_count();
        let is_wanted = wanted.peek().is_some_and(|&most| count <= most);
        if is_wanted && count > 0 {
            levels.push(level);
            while wanted.next_if(|&most| count <= most).is_some() {}
        }
    }
    levels
}

/// The cut that keeps nothing finer than `group_level`, unless there is nothing coarser.
fn refined_from_level(hierarchy: &Hierarchy, group_level: u32) -> Vec<bool> {
    let is_coarse = |group: &Group| group.level >= group_level;
    let mut refined: Vec<bool> = hierarchy.groups.iter().map(is_coarse).collect();
    hierarchy.close_refinement(&mut refined);
    refined
}

impl OccluderMesh {
    /// The units of a cut, and the greatest error of what it simplifies.
    fn new(hierarchy: &Hierarchy, refined: &[bool]) -> Self {
        let simplified = hierarchy.groups.iter().zip(refined);
        let errors = simplified.filter(|(_, refined)| !**refined);
        let errors = errors.map(|(group, _)| group.error_in_local);
        let error_in_local = errors.fold(0.0, f32::max);
        let units = hierarchy.drawn_units(refined);
        Self {
            parts: units
                .map(|unit| OccluderPart::new(hierarchy, &hierarchy.units[unit], error_in_local))
                .collect(),
            error_in_local,
            solid: SolidLevel::new(hierarchy, refined),
        }
    }

    fn triangle_count(&self) -> usize {
        self.parts.iter().map(|part| part.triangles.len()).sum()
    }

    /// Where its vertices are.
    pub(crate) fn positions(&self) -> impl Iterator<Item = Vec3> + '_ {
        self.parts.iter().flat_map(|part| &part.positions).copied()
    }

    #[cfg(test)]
    pub(crate) fn parts(&self) -> &[OccluderPart] {
        &self.parts
    }

    /// The parts that may be in an image, and their triangles.
    pub(crate) fn parts_in_view<'a>(
        &'a self,
        plane: &'a ImagePlane,
        linear: &'a Mat3,
        origin: Vec3,
    ) -> impl Iterator<Item = &'a OccluderPart> + 'a {
        let is_in_view = move |part: &&OccluderPart| {
            !plane.is_beyond(&AxisBox::around(&part.bounds, linear, origin))
        };
        self.parts.iter().filter(is_in_view)
    }

    /// Where it is drawn: pushed back by how far it errs.
    pub(crate) fn pushed_back(&self, linear: &Mat3, origin: Vec3) -> Vec3 {
        let back = self.error_in_local * largest_stretch(linear);
        origin.with_z(origin.z + back)
    }
}

/// A vertex, moved inward.
fn inward(hierarchy: &Hierarchy, vertex: u32, distance: f32) -> Vec3 {
    let vertices = &hierarchy.vertices;
    let normal = vertices.normals.get(vertex as usize);
    vertices.positions[vertex as usize] - normal.copied().unwrap_or_default() * distance
}

impl OccluderPart {
    /// Of a level with an error, which its surface recedes by.
    fn new(hierarchy: &Hierarchy, unit: &Unit, error: f32) -> Self {
        let vertices = hierarchy.vertices_of(unit).iter();
        let (triangles, _) = hierarchy.indices_of(unit).as_chunks::<3>();
        Self {
            bounds: LocalBox {
                center: (unit.aabb.min + unit.aabb.max) * 0.5,
                half_size: (unit.aabb.max - unit.aabb.min) * 0.5,
            },
            positions: vertices
                .map(|&vertex| inward(hierarchy, vertex, error))
                .collect(),
            triangles: triangles.to_vec(),
        }
    }

    pub(crate) fn triangle_count(&self) -> u32 {
        self.triangles.len() as u32
    }

    /// Its triangles in camera space; `corners` is room for its vertices.
    pub(crate) fn triangles_in_camera<'a>(
        &'a self,
        linear: &Mat3,
        origin: Vec3,
        corners: &'a mut Vec<Vec3>,
    ) -> impl Iterator<Item = [Vec3; 3]> + 'a {
        corners.clear();
        corners.extend(self.positions.iter().map(|&at| *linear * at + origin));
        let corner = |index: u16| corners[usize::from(index)];
        self.triangles
            .iter()
            .map(move |triangle| triangle.map(corner))
    }
}
