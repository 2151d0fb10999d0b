//! The hierarchy to verify, with its source.

use fieldlod_hierarchy::Hierarchy;
use glam::Vec3;

use super::report::VerifySettings;
use crate::levels::vertices::power_of_two_below;
use crate::mesh::SourceMesh;
use crate::mesh::bounds::offset_of;
use crate::mesh::surface::Surface;
use crate::mesh::used_vertices::Compact;

/// Distances below this, in scaled units, are rounding.
pub(super) const ROUNDING: f32 = 1e-6;

/// A hierarchy, its source mesh, and the settings.
pub(super) struct Subject<'a> {
    pub(super) mesh: &'a SourceMesh,
    pub(super) hierarchy: &'a Hierarchy,
    pub(super) settings: &'a VerifySettings,
    /// Positions of all vertices, offset and scaled so that squares do not overflow.
    pub(super) positions: Vec<Vec3>,
    /// Exact positions of the source, offset and scaled alike.
    source: Vec<Vec3>,
    pub(super) scaled_from_local: f32,
    /// The largest distance of a stored vertex of the source from its exact position, in scaled units.
    rounding: f32,
    /// For each vertex of the source, the first vertex at its place.
    pub(super) place: Vec<u32>,
}

/// A triangle of a cut.
pub(super) struct CutTriangle {
    /// The group that produced the triangle. `None` for source geometry.
    pub(super) produced_by: Option<u32>,
    /// Indices of the triangle's vertices.
    pub(super) corners: [u32; 3],
}

impl<'a> Subject<'a> {
    pub(super) fn new(
        mesh: &'a SourceMesh,
        compact: &Compact<'_>,
        hierarchy: &'a Hierarchy,
        settings: &'a VerifySettings,
    ) -> Self {
        let source = compact.mesh.positions.iter();
        let offset = offset_of(source.clone().copied());
        let source: Vec<Vec3> = source.map(|p| *p - offset).collect();
        let scaled_from_local = power_of_two_below(&source).recip();
        let scaled = |positions: &[Vec3]| -> Vec<Vec3> {
            let positions = positions.iter();
            positions
                .map(|p| (*p - offset) * scaled_from_local)
                .collect()
        };
        let positions = scaled(&hierarchy.vertices.positions);
        let source = scaled(&mesh.positions);
        let used = mesh.indices.iter().map(|&v| v as usize);
        let distances = used.map(|v| positions[v].distance(source[v]));
        Self {
            rounding: distances.fold(0.0, f32::max),
            mesh,
            hierarchy,
            settings,
            positions,
            source,
            scaled_from_local,
            place: compact.places(),
        }
    }

    pub(super) fn source_triangles(&self) -> &'a [[u32; 3]] {
        self.mesh.indices.as_chunks::<3>().0
    }

    /// The exact corners of all triangles of the source in scaled units.
    pub(super) fn source_corners(&self) -> Vec<[Vec3; 3]> {
        let triangles = self.source_triangles().iter();
        triangles
            .map(|t| t.map(|vertex| self.source[vertex as usize]))
            .collect()
    }

    /// Whether the alpha of vertex colours and of the texture shows a point of a triangle, given the weights of its
    /// corners.
    pub(super) fn opacity_test(&self, triangle: &[u32; 3]) -> impl Fn(Vec3) -> bool + '_ {
        let vertices = &self.hierarchy.vertices;
        let surface = self.mesh.visible_surface();
        let uses_uvs_1 = surface.and_then(|surface| Some(surface.mapping()?.uses_uvs_1));
        let uvs = [&vertices.uvs, &vertices.uvs_1][usize::from(uses_uvs_1 == Some(true))];
        let [a, b, c] = triangle.map(|v| uvs.get(v as usize).copied().unwrap_or_default());
        let of_vertex = |surface: &Surface, v: u32| {
            let color = vertices.colors.get(v as usize);
            color.is_none_or(|color| surface.opacity_of_vertex(color.w) > 0.0)
        };
        let is_hidden = |surface| !triangle.iter().any(|&v| of_vertex(surface, v));
        let is_hidden = surface.is_some_and(|surface| is_hidden(surface));
        move |shares| {
            let uv = a * shares.x + b * shares.y + c * shares.z;
            !is_hidden && surface.is_none_or(|surface| surface.drawn_at(uv).is_some())
        }
    }

    /// The corners of a triangle in scaled units.
    pub(super) fn corners(&self, triangle: [u32; 3]) -> [Vec3; 3] {
        triangle.map(|vertex| self.positions[vertex as usize])
    }

    /// The stated deviation of triangles that `producer` made, in scaled units. The rounding for source geometry.
    pub(super) fn deviation_in_scaled(&self, producer: Option<u32>) -> f32 {
        let group = producer.map(|group| &self.hierarchy.groups[group as usize]);
        group.map_or(self.rounding, |group| {
            group.deviation_in_local * self.scaled_from_local
        })
    }

    /// The units of the cut that refines the groups for which `criterion` holds.
    pub(super) fn cut(&self, mut criterion: impl FnMut(usize) -> bool) -> Vec<usize> {
        let mut refined = vec![false; self.hierarchy.groups.len()];
        let hierarchy = self.hierarchy;
        hierarchy.refine_by(&mut refined, |group, _| criterion(group));
        hierarchy.drawn_units(&refined).collect()
    }

    /// The triangles of some units.
    pub(super) fn triangles_of(&self, units: &[usize]) -> Vec<CutTriangle> {
        let units = units.iter().map(|&unit| &self.hierarchy.units[unit]);
        let triangles = units.flat_map(|unit| {
            let triangles = self.hierarchy.triangles_of(unit);
            triangles.map(|corners| CutTriangle {
                produced_by: unit.producer(),
                corners,
            })
        });
        triangles.collect()
    }
}
