//! One test for each invariant of a hierarchy: broken, it is named.

use fieldlod_hierarchy::InvalidHierarchy as Fault;
use fieldlod_hierarchy::{Hierarchy, NO_GROUP, fixtures};
use glam::{Vec2, Vec3, Vec4};

fn fault_after(change: impl FnOnce(&mut Hierarchy)) -> Fault {
    fault_of(fixtures::two_level_strip(), change)
}

fn fault_of(mut hierarchy: Hierarchy, change: impl FnOnce(&mut Hierarchy)) -> Fault {
    hierarchy.validate().unwrap();
    change(&mut hierarchy);
    hierarchy.validate().unwrap_err()
}

macro_rules! assert_rejects {
    ($change:expr, $pattern:pat) => {
        let fault = fault_after($change);
        assert!(matches!(fault, $pattern), "{fault:?}");
    };
}

#[test]
fn accepts_an_empty_hierarchy() {
    Hierarchy::default().validate().unwrap();
    assert_eq!(Hierarchy::default().level_count(), 0);
    assert!(Hierarchy::default().aabb().is_none());
}

#[test]
fn rejects_attributes_for_some_vertices_only() {
    assert_rejects!(
        |h| h.vertices.normals.truncate(5),
        Fault::AttributeCount { count: 5, .. }
    );
    assert_rejects!(
        |h| h.vertices.uvs.push(Vec2::ZERO),
        Fault::AttributeCount { count: 1, .. }
    );
    assert_rejects!(
        |h| h.vertices.tangents.push(Vec4::X),
        Fault::AttributeCount { count: 1, .. }
    );
    assert_rejects!(
        |h| h.vertices.uvs_1.push(Vec2::ZERO),
        Fault::AttributeCount { count: 1, .. }
    );
    assert_rejects!(
        |h| h.vertices.colors.push(Vec4::ONE),
        Fault::AttributeCount { count: 1, .. }
    );
}

#[test]
fn rejects_positions_that_are_not_finite() {
    assert_rejects!(
        |h| h.vertices.positions[2].z = f32::NAN,
        Fault::PositionNotFinite { vertex: 2 }
    );
}

#[test]
fn rejects_broken_ranges() {
    assert_rejects!(
        |h| h.groups[1].first_unit = 0,
        Fault::BrokenRange { what: "units", .. }
    );
    assert_rejects!(
        |h| h.groups[0].unit_count = 9,
        Fault::BrokenRange { what: "units", .. }
    );
    assert_rejects!(
        |h| h.groups[1].finer_count = 0,
        Fault::BrokenRange {
            what: "finer groups",
            ..
        }
    );
    assert_rejects!(
        |h| h.units[1].first_vertex = 5,
        Fault::BrokenRange {
            what: "vertices",
            ..
        }
    );
    assert_rejects!(
        |h| h.units[1].vertex_count = u32::MAX,
        Fault::BrokenRange {
            what: "vertices",
            ..
        }
    );
    assert_rejects!(
        |h| h.units[0].triangle_count = 3,
        Fault::BrokenRange {
            what: "triangles",
            owner: "unit",
            ..
        }
    );
    assert_rejects!(
        |h| h.indices.truncate(17),
        Fault::BrokenRange {
            what: "triangles",
            ..
        }
    );
}

#[test]
fn rejects_wrong_levels() {
    for level in [0, 2, u32::MAX] {
        assert_rejects!(
            |h| h.groups[1].level = level,
            Fault::BadLevel {
                group: 1,
                expected: 1,
                ..
            }
        );
    }
    assert_rejects!(
        |h| h.groups[0].level = 1,
        Fault::BadLevel {
            group: 0,
            expected: 0,
            ..
        }
    );
}

#[test]
fn rejects_references_to_nothing() {
    assert_rejects!(
        |h| h.units[0].consumed_by = 2,
        Fault::DanglingReference { what: "group", .. }
    );
    assert_rejects!(
        |h| h.units[1].produced_by = 2,
        Fault::DanglingReference { what: "group", .. }
    );
    assert_rejects!(
        |h| h.unit_vertices[0] = 6,
        Fault::DanglingReference {
            what: "source vertex",
            ..
        }
    );
    assert_rejects!(
        |h| h.unit_vertices[6] = 6,
        Fault::DanglingReference { what: "vertex", .. }
    );
    assert_rejects!(
        |h| h.indices[0] = 6,
        Fault::DanglingReference { what: "vertex", .. }
    );
    assert_rejects!(
        |h| h.finer[0] = 2,
        Fault::DanglingReference {
            owner: "finer link",
            ..
        }
    );
}

#[test]
fn rejects_groups_out_of_order() {
    assert_rejects!(
        |h| h.finer[0] = 1,
        Fault::FinerNotBefore { group: 1, finer: 1 }
    );
}

#[test]
fn rejects_wrong_finer_groups() {
    assert_rejects!(
        |h| h.units[1].produced_by = NO_GROUP,
        Fault::FinerMismatch { group: 1 }
    );
}

#[test]
fn rejects_empty_groups_and_units() {
    assert_rejects!(
        |h| {
            h.groups[1].unit_count = 2;
            h.groups[0].unit_count = 0;
            h.groups[1].first_unit = 0;
        },
        Fault::EmptyGroup { group: 0 }
    );
    assert_rejects!(
        |h| {
            h.units[1].triangle_count = 0;
            h.units[0].triangle_count = 6;
            h.units[1].first_triangle = 6;
            h.indices[12..].fill(0);
        },
        Fault::EmptyUnit { unit: 1 }
    );
}

#[test]
fn rejects_units_of_another_group() {
    assert_rejects!(
        |h| h.units[0].consumed_by = 1,
        Fault::WrongConsumer {
            unit: 0,
            group: 0,
            named: 1
        }
    );
}

#[test]
fn rejects_a_terminal_group_that_produces() {
    assert_rejects!(
        |h| h.groups[0].error_in_local = f32::INFINITY,
        Fault::ProducedByTerminal { unit: 1, group: 0 }
    );
}

#[test]
fn rejects_a_group_whose_surface_vanishes() {
    assert_rejects!(
        |h| h.groups[1].error_in_local = 1.0,
        Fault::ProducesNothing { group: 1 }
    );
}

#[test]
fn rejects_invalid_errors() {
    for error in [f32::NAN, -1.0] {
        assert_rejects!(
            |h| h.groups[0].error_in_local = error,
            Fault::BadError { group: 0, .. }
        );
    }
}

#[test]
fn rejects_invalid_deviations() {
    for deviation in [f32::NAN, -1.0] {
        assert_rejects!(
            |h| h.groups[0].deviation_in_local = deviation,
            Fault::BadDeviation { group: 0, .. }
        );
    }
    assert_rejects!(
        |h| h.groups[1].deviation_in_local = 1.0,
        Fault::BadDeviation { group: 1, .. }
    );
}

/// Of several groups that are simplified, either all are measured or none is.
#[test]
fn rejects_partly_measured_deviations() {
    let infinite = f32::INFINITY;
    let fault = fault_of(fixtures::grid_pyramid(2), |h| {
        h.groups[0].deviation_in_local = infinite;
    });
    assert!(matches!(fault, Fault::BadDeviation { .. }), "{fault:?}");
    let mut unmeasured = fixtures::grid_pyramid(2);
    assert!(unmeasured.is_measured() && Hierarchy::default().is_measured());
    for group in &mut unmeasured.groups {
        group.deviation_in_local = infinite;
    }
    assert_eq!(unmeasured.validate(), Ok(()));
    assert!(!unmeasured.is_measured());
}

#[test]
fn rejects_more_source_vertices_than_vertices() {
    assert_rejects!(
        |h| h.source_vertex_count = 7,
        Fault::SourceVertexCount {
            count: 7,
            vertices: 6
        }
    );
}

#[test]
fn rejects_source_geometry_of_moved_vertices() {
    assert_rejects!(
        |h| h.source_vertex_count = 5,
        Fault::DanglingReference {
            owner: "unit",
            index: 0,
            what: "source vertex",
            target: 5
        }
    );
}

#[test]
fn rejects_origins_of_some_moved_vertices_only() {
    assert_rejects!(
        |h| h.moved_from.push(0),
        Fault::MovedFromCount { count: 1, moved: 0 }
    );
}

#[test]
fn rejects_origins_outside_the_source() {
    assert_rejects!(
        |h| {
            h.vertices.positions.push(Vec3::ZERO);
            h.vertices.normals.push(Vec3::Z);
            h.moved_from.push(6);
        },
        Fault::DanglingReference {
            owner: "moved vertex",
            target: 6,
            ..
        }
    );
}

#[test]
fn rejects_impossible_mean_normals() {
    for normal in [Vec3::splat(1.0), Vec3::splat(f32::NAN)] {
        assert_rejects!(
            |h| h.groups[1].mean_normal = normal,
            Fault::BadMeanNormal { group: 1 }
        );
    }
}

#[test]
fn rejects_impossible_bounds() {
    for radius in [-1.0, f32::NAN, f32::INFINITY] {
        assert_rejects!(
            |h| h.groups[0].bounds.radius = radius,
            Fault::BadBounds { owner: "group", .. }
        );
    }
    assert_rejects!(
        |h| h.groups[0].bounds.center.x = f32::NAN,
        Fault::BadBounds { .. }
    );
}

#[test]
fn rejects_too_small_bounds() {
    assert_rejects!(
        |h| h.units[1].aabb.max.x = 0.5,
        Fault::TrianglesOutsideBounds {
            owner: "unit",
            index: 1
        }
    );
    assert_rejects!(
        |h| h.groups[1].bounds.radius *= 0.9,
        Fault::TrianglesOutsideBounds {
            owner: "group",
            index: 1
        }
    );
    assert_rejects!(
        |h| h.groups[0].bounds.radius *= 0.9,
        Fault::TrianglesOutsideBounds {
            owner: "group",
            index: 0
        }
    );
}
