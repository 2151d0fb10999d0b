//! One case for each invariant of a hierarchy. Validation names the broken invariant.

use fieldlod_hierarchy::InvalidHierarchy as Fault;
use fieldlod_hierarchy::{Hierarchy, NO_GROUP, fixtures};
use glam::{Vec2, Vec3, Vec4};

fn fault_of(mut hierarchy: Hierarchy, change: impl FnOnce(&mut Hierarchy)) -> Fault {
    hierarchy.validate().unwrap();
    change(&mut hierarchy);
    hierarchy.validate().unwrap_err()
}

/// Changes of the two-level strip. The fault of each must match its pattern.
macro_rules! rejects {
    ($($change:expr => $pattern:pat,)+) => {
        #[test]
        fn validation_names_the_broken_invariant() {
            $(let fault = fault_of(fixtures::two_level_strip(), $change);
            assert!(matches!(fault, $pattern), "{fault:?} after {}", stringify!($change));)+
        }
    };
}

rejects! {
    |h| h.vertices.normals.truncate(5) => Fault::AttributeCount { count: 5, .. },
    |h| h.vertices.uvs.push(Vec2::ZERO) => Fault::AttributeCount { count: 1, .. },
    |h| h.vertices.tangents.push(Vec4::X) => Fault::AttributeCount { count: 1, .. },
    |h| h.vertices.uvs_1.push(Vec2::ZERO) => Fault::AttributeCount { count: 1, .. },
    |h| h.vertices.colors.push(Vec4::ONE) => Fault::AttributeCount { count: 1, .. },
    |h| h.vertices.positions[0].z = f32::NAN => Fault::PositionNotFinite { vertex: 0 },
    |h| h.vertices.positions[2].z = f32::NAN => Fault::PositionNotFinite { vertex: 2 },
    |h| h.groups[1].first_unit = 0 => Fault::BrokenRange { what: "units", .. },
    |h| h.groups[0].unit_count = 9 => Fault::BrokenRange { what: "units", .. },
    |h| h.groups[1].finer_count = 0 => Fault::BrokenRange { what: "finer groups", .. },
    |h| h.units[1].first_vertex = 5 => Fault::BrokenRange { what: "vertices", .. },
    |h| h.units[1].vertex_count = u32::MAX => Fault::BrokenRange { what: "vertices", .. },
    |h| h.units[0].triangle_count = 3 => Fault::BrokenRange { what: "triangles", .. },
    |h| h.indices.truncate(17) => Fault::BrokenRange { what: "triangles", index: 2, .. },
    |h| h.indices.extend([0; 3]) => Fault::BrokenRange { what: "triangles", index: 2, .. },
    |h| h.groups[0].level = 1 => Fault::BadLevel { group: 0, expected: 0, .. },
    |h| h.groups[1].level = 0 => Fault::BadLevel { group: 1, expected: 1, .. },
    |h| h.groups[1].level = 2 => Fault::BadLevel { group: 1, expected: 1, .. },
    |h| h.groups[1].level = u32::MAX => Fault::BadLevel { group: 1, expected: 1, .. },
    |h| h.units[0].consumed_by = 2 => Fault::DanglingReference { what: "group", .. },
    |h| h.units[1].produced_by = 2 => Fault::DanglingReference { what: "group", .. },
    |h| h.unit_vertices[0] = 6 => Fault::DanglingReference { what: "source vertex", .. },
    |h| h.unit_vertices[6] = 6 => Fault::DanglingReference { what: "vertex", .. },
    |h| h.indices[0] = 6 => Fault::DanglingReference { what: "vertex", .. },
    |h| h.finer[0] = 2 => Fault::DanglingReference { owner: "finer link", .. },
    |h| h.finer[0] = 1 => Fault::FinerNotBefore { group: 1, finer: 1 },
    |h| h.units[1].produced_by = NO_GROUP => Fault::FinerMismatch { group: 1 },
    |h| {
        h.groups[0].unit_count = 0;
        (h.groups[1].first_unit, h.groups[1].unit_count) = (0, 2);
    } => Fault::EmptyGroup { group: 0 },
    |h| {
        h.units[0].triangle_count = 6;
        (h.units[1].first_triangle, h.units[1].triangle_count) = (6, 0);
        h.indices[12..].fill(0);
    } => Fault::EmptyUnit { unit: 1 },
    |h| h.units[0].consumed_by = 1 => Fault::WrongConsumer { unit: 0, group: 0, named: 1 },
    |h| h.groups[0].error_in_local = f32::INFINITY
        => Fault::ProducedByTerminal { unit: 1, group: 0 },
    |h| h.groups[1].error_in_local = 1.0 => Fault::ProducesNothing { group: 1 },
    |h| h.groups[0].error_in_local = f32::NAN => Fault::BadError { group: 0, .. },
    |h| h.groups[0].error_in_local = -1.0 => Fault::BadError { group: 0, .. },
    |h| h.groups[0].whole_mesh_error_in_local = f32::NAN
        => Fault::BadWholeMeshError { group: 0, .. },
    |h| h.groups[0].whole_mesh_error_in_local = -1.0
        => Fault::BadWholeMeshError { group: 0, .. },
    |h| h.groups[0].deviation_in_local = f32::NAN => Fault::BadDeviation { group: 0, .. },
    |h| h.groups[0].deviation_in_local = -1.0 => Fault::BadDeviation { group: 0, .. },
    |h| h.groups[1].deviation_in_local = 1.0 => Fault::BadDeviation { group: 1, .. },
    |h| h.source_vertex_count = 7 => Fault::SourceVertexCount { count: 7, vertices: 6 },
    |h| h.source_vertex_count = 5
        => Fault::DanglingReference { owner: "unit", index: 0, what: "source vertex", target: 5 },
    |h| h.moved_from.push(0) => Fault::MovedFromCount { count: 1, moved: 0 },
    |h| {
        h.vertices.positions.push(Vec3::ZERO);
        h.vertices.normals.push(Vec3::Z);
        h.moved_from.push(6);
    } => Fault::DanglingReference { owner: "moved vertex", target: 6, .. },
    |h| h.groups[1].mean_normal = Vec3::ONE => Fault::BadMeanNormal { group: 1 },
    |h| h.groups[1].mean_normal = Vec3::NAN => Fault::BadMeanNormal { group: 1 },
    |h| h.groups[0].bounds.radius = -1.0 => Fault::BadBounds { group: 0 },
    |h| h.groups[0].bounds.radius = f32::NAN => Fault::BadBounds { group: 0 },
    |h| h.groups[0].bounds.radius = f32::INFINITY => Fault::BadBounds { group: 0 },
    |h| h.groups[0].bounds.center.x = f32::NAN => Fault::BadBounds { group: 0 },
    |h| h.units[1].aabb.max.x = 0.5 => Fault::TrianglesOutsideBounds { owner: "unit", index: 1 },
    |h| h.groups[1].bounds.radius *= 0.9 => Fault::TrianglesOutsideBounds { owner: "group", index: 1 },
    |h| h.groups[0].bounds.radius *= 0.9 => Fault::TrianglesOutsideBounds { owner: "group", index: 0 },
}

#[test]
fn empty_hierarchy_is_valid() {
    let empty = Hierarchy::default();
    assert_eq!(empty.validate(), Ok(()));
    assert_eq!((empty.level_count(), empty.aabb()), (0, None));
    assert!(empty.is_measured());
    let source = fixtures::two_level_strip().source_vertices();
    assert_eq!(empty.with_unused_vertices(&[], &source).validate(), Ok(()));
}

#[test]
fn deviations_are_measured_for_all_groups_or_none() {
    let mut hierarchy = fixtures::grid_pyramid(2);
    assert!(hierarchy.is_measured());
    let fault = fault_of(hierarchy.clone(), |h| {
        h.groups[0].deviation_in_local = f32::INFINITY;
    });
    assert!(matches!(fault, Fault::BadDeviation { .. }), "{fault:?}");
    for group in &mut hierarchy.groups {
        group.deviation_in_local = f32::INFINITY;
    }
    assert_eq!(hierarchy.validate(), Ok(()));
    assert!(!hierarchy.is_measured());
}
