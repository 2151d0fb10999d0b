//! The numbers that `bake` and `inspect` print about a hierarchy.

use fieldlod_bake::PrimitivePlace;
use fieldlod_hierarchy::{BakedPrimitive, Group, Hierarchy};
use serde::Serialize;

/// Numbers of one primitive.
#[derive(Debug, Serialize)]
pub(crate) struct PrimitiveSummary {
    pub(crate) mesh: u32,
    pub(crate) primitive: u32,
    pub(crate) name: String,
    /// Vertices of the source.
    pub(crate) source_vertices: u32,
    /// Vertices created by simplification.
    pub(crate) moved_vertices: u32,
    /// Largest distance between a position in the file and in the source; 0 in a lossless file.
    pub(crate) position_error_in_local: f32,
    /// The joint that places the mesh for selection, if it is skinned.
    pub(crate) carrier_joint: Option<u16>,
    pub(crate) source_triangles: u64,
    /// Triangles of the coarsest cut.
    pub(crate) coarsest_triangles: u64,
    pub(crate) groups: usize,
    pub(crate) units: usize,
    pub(crate) levels: Vec<LevelSummary>,
}

/// Numbers of one level.
#[derive(Debug, Serialize)]
pub(crate) struct LevelSummary {
    pub(crate) level: u32,
    pub(crate) groups: usize,
    /// Groups without a simplification.
    pub(crate) terminal_groups: usize,
    pub(crate) units: usize,
    pub(crate) triangles: u64,
    /// Simplification errors of the groups that are not terminal.
    pub(crate) error_in_local: Option<Spread>,
    /// Deviations of these groups from the source; `None` if not measured.
    pub(crate) deviation_in_local: Option<Spread>,
    pub(crate) radius_in_local: Option<Spread>,
    /// Area of the mesh at this level relative to the source.
    pub(crate) area_share: f64,
}

#[derive(Clone, Copy, Debug, Serialize)]
pub(crate) struct Spread {
    pub(crate) min: f32,
    pub(crate) median: f32,
    pub(crate) max: f32,
}

impl Spread {
    fn of(values: impl Iterator<Item = f32>) -> Option<Self> {
        let mut sorted: Vec<f32> = values.collect();
        sorted.sort_by(f32::total_cmp);
        Some(Self {
            min: *sorted.first()?,
            // The upper one of two middle values: a value that occurs.
            median: sorted[sorted.len() / 2],
            max: *sorted.last()?,
        })
    }
}

impl PrimitiveSummary {
    pub(crate) fn of(primitive: &BakedPrimitive) -> Self {
        let hierarchy = &primitive.hierarchy;
        let terminal = hierarchy.groups.iter().filter(|group| group.is_terminal());
        let levels = 0..hierarchy.level_count();
        let vertices = hierarchy.vertices.positions.len();
        Self {
            mesh: primitive.mesh_index,
            primitive: primitive.primitive_index,
            name: primitive.name.clone(),
            source_vertices: hierarchy.source_vertex_count,
            moved_vertices: vertices as u32 - hierarchy.source_vertex_count,
            position_error_in_local: primitive.position_error_in_local,
            carrier_joint: primitive.hierarchy.carrier_joint,
            source_triangles: hierarchy.source_triangle_count(),
            coarsest_triangles: terminal.map(|g| hierarchy.triangle_count_of(g)).sum(),
            groups: hierarchy.groups.len(),
            units: hierarchy.units.len(),
            levels: levels
                .map(|level| LevelSummary::of(hierarchy, level))
                .collect(),
        }
    }

    /// The place of the primitive in the file, with its name if it has one.
    pub(crate) fn title(&self) -> String {
        let place = PrimitivePlace {
            mesh_index: self.mesh,
            primitive_index: self.primitive,
            name: self.name.clone(),
        };
        place.to_string()
    }
}

impl LevelSummary {
    fn of(hierarchy: &Hierarchy, level: u32) -> Self {
        let all = hierarchy.groups.iter();
        let groups: Vec<&Group> = all.filter(|group| group.level == level).collect();
        let simplified = || groups.iter().filter(|group| !group.is_terminal());
        let deviations = simplified().map(|group| group.deviation_in_local);
        Self {
            level,
            groups: groups.len(),
            terminal_groups: groups.iter().filter(|group| group.is_terminal()).count(),
            units: groups.iter().map(|group| group.units().len()).sum(),
            triangles: groups
                .iter()
                .map(|group| hierarchy.triangle_count_of(group))
                .sum(),
            error_in_local: Spread::of(simplified().map(|group| group.error_in_local)),
            deviation_in_local: Spread::of(deviations.filter(|deviation| deviation.is_finite())),
            radius_in_local: Spread::of(groups.iter().map(|group| group.bounds.radius)),
            area_share: area_share(hierarchy, level),
        }
    }
}

/// The area of the cut at `level` relative to the source.
fn area_share(hierarchy: &Hierarchy, level: u32) -> f64 {
    let area_of = |level| -> f64 {
        let units = hierarchy.units_at_level(level).into_iter();
        let areas = units.map(|unit| hierarchy.area_of_unit(&hierarchy.units[unit]));
        areas.sum()
    };
    let source = area_of(0);
    if source > 0.0 {
        area_of(level) / source
    } else {
        1.0
    }
}
