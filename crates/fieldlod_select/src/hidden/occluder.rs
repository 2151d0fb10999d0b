//! Occluders of a large mesh: some of its coarse levels.

use fieldlod_hierarchy::{Group, Hierarchy, Unit};
use glam::{Mat3, Vec3};

use super::boxes::{AxisBox, LocalBox};
use super::image_plane::ImagePlane;
use super::screen_triangle::Corner;

/// Largest number of triangles of each level of an occluder. More levels cost memory; fewer levels leave large steps
/// between them.
const LEVELS: [usize; 4] = [4096, 1024, 256, 64];

/// One coarse level of a mesh.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct OccluderMesh {
    parts: Vec<OccluderPart>,
}

/// A part of an occluder, drawn if its box is in view.
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
        let units = hierarchy.drawn_units(&refined);
        let counts = units.map(|unit| hierarchy.units[unit].triangle_count as usize);
        let count: usize = counts.sum();
        let is_wanted = wanted.peek().is_some_and(|&most| count <= most);
        if is_wanted && count > 0 {
            levels.push(OccluderMesh::new(hierarchy, &refined));
            while wanted.next_if(|&most| count <= most).is_some() {}
        }
    }
    levels
}

/// The groups that the cut at `group_level` refines, and all groups that must be refined with them.
fn refined_from_level(hierarchy: &Hierarchy, group_level: u32) -> Vec<bool> {
    let is_coarse = |group: &Group| group.level >= group_level;
    let mut refined: Vec<bool> = hierarchy.groups.iter().map(is_coarse).collect();
    hierarchy.close_refinement(&mut refined);
    refined
}

impl OccluderMesh {
    /// The occluder of a cut.
    fn new(hierarchy: &Hierarchy, refined: &[bool]) -> Self {
        let units = hierarchy.drawn_units(refined);
        Self {
            parts: units
                .map(|unit| OccluderPart::new(hierarchy, &hierarchy.units[unit]))
                .collect(),
        }
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
}

impl OccluderPart {
    fn new(hierarchy: &Hierarchy, unit: &Unit) -> Self {
        let vertices = hierarchy.vertices_of(unit).iter();
        let (triangles, _) = hierarchy.indices_of(unit).as_chunks::<3>();
        Self {
            bounds: LocalBox {
                center: (unit.aabb.min + unit.aabb.max) * 0.5,
                half_size: (unit.aabb.max - unit.aabb.min) * 0.5,
            },
            positions: vertices
                .map(|&vertex| hierarchy.vertices.positions[vertex as usize])
                .collect(),
            triangles: triangles.to_vec(),
        }
    }

    pub(crate) fn triangle_count(&self) -> u32 {
        self.triangles.len() as u32
    }

    /// The triangles of the part in the image; `corners` is a buffer for vertices.
    pub(crate) fn placed_triangles<'a>(
        &'a self,
        plane: &ImagePlane,
        linear: &Mat3,
        origin: Vec3,
        corners: &'a mut Vec<Corner>,
    ) -> impl Iterator<Item = [Corner; 3]> + 'a {
        let placed = |&at: &Vec3| Corner::new(plane, *linear * at + origin);
        corners.clear();
        corners.extend(self.positions.iter().map(placed));
        let corner = |index: u16| corners[usize::from(index)];
        self.triangles
            .iter()
            .map(move |triangle| triangle.map(corner))
    }
}
