//! What instances hide others with: coarse levels and points of their meshes.

use std::sync::Arc;

use fieldlod_hierarchy::{Aabb, Group, Hierarchy, Unit};
use fieldlod_select::{InstanceId, MeshId};
use glam::{Mat3, Vec3};

use crate::clip::Corner;
use crate::image_plane::ImagePlane;
use crate::surface_samples::SurfaceSamples;

/// Largest number of triangles of each level of an occluder. More levels cost memory; fewer levels leave large steps
/// between them.
const LEVELS: [usize; 4] = [4096, 1024, 256, 64];

/// The geometry of a mesh for depth images and tests of visibility: some coarse levels, and points of its surface. It
/// does not borrow the hierarchy.
#[derive(Clone, Debug)]
pub struct Occluder {
    /// Whether the mesh is drawn as a whole, at one level at a time.
    pub(crate) is_whole: bool,
    pub(crate) samples: SurfaceSamples,
    /// Levels, finest first, each by its parts; empty without geometry.
    pub(crate) levels: Vec<Vec<OccluderPart>>,
}

impl Occluder {
    /// The occluder of a mesh, which must be [valid](Hierarchy::validate).
    #[must_use]
    pub fn new(hierarchy: &Hierarchy) -> Self {
        Self {
            is_whole: hierarchy.is_chain_of_whole_meshes(),
            samples: SurfaceSamples::new(hierarchy),
            levels: occluder_levels(hierarchy),
        }
    }
}

/// The occluders of a scene: of each mesh, and which instances hide nothing. Any number of views share them.
#[derive(Debug, Default)]
pub struct Occluders {
    meshes: Vec<Option<Arc<Occluder>>>,
    /// Instances that hide nothing, by index.
    excluded: Vec<Option<InstanceId>>,
    pub(crate) revision: u64,
}

impl Occluders {
    /// Sets the occluder of a mesh. Instances of a mesh without one hide nothing and count in full. Call it with `None`
    /// when a mesh is removed: another mesh may take its id.
    pub fn set_mesh(&mut self, mesh: MeshId, occluder: Option<Arc<Occluder>>) {
        let is_same =
            |known: &Arc<Occluder>| occluder.as_ref().is_some_and(|new| Arc::ptr_eq(known, new));
        let known = entry(&mut self.meshes, mesh.index());
        if !known.as_ref().map_or(occluder.is_none(), is_same) {
            *known = occluder;
            self.revision += 1;
        }
    }

    /// Sets whether an instance of the scene hides others. The default is `true`; use `false` for transparent instances.
    pub fn set_hides(&mut self, instance: InstanceId, hides: bool) {
        let excluded = (!hides).then_some(instance);
        let known = entry(&mut self.excluded, instance.index());
        if *known != excluded {
            *known = excluded;
            self.revision += 1;
        }
    }

    /// Drops the occluders that nothing else holds. Meshes keep theirs if the caller holds it.
    pub fn drop_unused(&mut self) {
        for occluder in &mut self.meshes {
            if occluder
                .as_ref()
                .is_some_and(|occluder| Arc::strong_count(occluder) == 1)
            {
                *occluder = None;
                self.revision += 1;
            }
        }
    }

    pub(crate) fn of_mesh(&self, mesh: MeshId) -> Option<&Occluder> {
        self.meshes.get(mesh.index())?.as_deref()
    }

    /// The occluder of an instance, if the instance hides others.
    pub(crate) fn hiding(&self, instance: InstanceId, mesh: MeshId) -> Option<&Occluder> {
        let excluded = self.excluded.get(instance.index());
        let occluder = self.of_mesh(mesh)?;
        let hides = excluded != Some(&Some(instance)) && !occluder.levels.is_empty();
        hides.then_some(occluder)
    }
}

fn entry<T>(list: &mut Vec<Option<T>>, index: usize) -> &mut Option<T> {
    if list.len() <= index {
        list.resize_with(index + 1, || None);
    }
    &mut list[index]
}

/// A part of an occluder, drawn if its box is in view.
#[derive(Clone, Debug)]
pub(crate) struct OccluderPart {
    bounds: Aabb,
    positions: Vec<Vec3>,
    pub(crate) triangles: Vec<[u16; 3]>,
}

/// The coarse levels of a mesh as a whole, finest first, each by its parts.
fn occluder_levels(hierarchy: &Hierarchy) -> Vec<Vec<OccluderPart>> {
    let mut levels = Vec::new();
    let mut wanted = LEVELS.iter().copied().peekable();
    // A hierarchy may come without its geometry.
    if hierarchy.unit_vertices.is_empty() {
        return levels;
    }
    for level in 0..hierarchy.level_count() {
        let is_coarse = |group: &Group| group.level >= level;
        let mut refined: Vec<bool> = hierarchy.groups.iter().map(is_coarse).collect();
        hierarchy.close_refinement(&mut refined);
        let drawn = hierarchy.drawn_units(&refined);
        let units: Vec<&Unit> = drawn.map(|unit| &hierarchy.units[unit]).collect();
        let counts = units.iter().map(|unit| unit.triangle_count as usize);
        let count: usize = counts.sum();
        if count > 0 && wanted.peek().is_some_and(|&most| count <= most) {
            let parts = units.iter().map(|unit| OccluderPart::new(hierarchy, unit));
            levels.push(parts.collect());
            // One level may be small enough for several limits.
            while wanted.next_if(|&most| count <= most).is_some() {}
        }
    }
    levels
}

/// The parts that may be in an image.
pub(crate) fn parts_in_view<'a>(
    parts: &'a [OccluderPart],
    plane: &'a ImagePlane,
    linear: &'a Mat3,
    origin: Vec3,
) -> impl Iterator<Item = &'a OccluderPart> + 'a {
    let is_in_view =
        move |part: &&OccluderPart| !plane.is_beyond(&box_in_camera(&part.bounds, linear, origin));
    parts.iter().filter(is_in_view)
}

/// The box of camera space around a box of local space.
fn box_in_camera(local: &Aabb, linear: &Mat3, origin: Vec3) -> Aabb {
    let half = (local.max - local.min) * 0.5;
    let [x, y, z] = [linear.x_axis, linear.y_axis, linear.z_axis].map(Vec3::abs);
    let half = x * half.x + y * half.y + z * half.z;
    let center = *linear * ((local.min + local.max) * 0.5) + origin;
    Aabb {
        min: center - half,
        max: center + half,
    }
}

impl OccluderPart {
    fn new(hierarchy: &Hierarchy, unit: &Unit) -> Self {
        let vertices = hierarchy.vertices_of(unit).iter();
        let (triangles, _) = hierarchy.indices_of(unit).as_chunks::<3>();
        Self {
            bounds: unit.aabb,
            positions: vertices
                .map(|&vertex| hierarchy.vertices.positions[vertex as usize])
                .collect(),
            triangles: triangles.to_vec(),
        }
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
