//! Levels of kits: loose pieces that are seen one by one keep their places and their area.

use crate::aggregates::covered;
use fieldlod_bake::{
    BakeConfig, SourceMesh, VerifySettings, bake_mesh, bake_together, fixtures, verify,
};
use fieldlod_hierarchy::Hierarchy;
use glam::Vec3;

/// Extent of a mesh in pixels from which on its pieces are noticed.
const LEAST_PX: f32 = 24.0;

/// Moves a mesh into the unit sphere.
fn in_unit_sphere(mut mesh: SourceMesh) -> SourceMesh {
    let (mut min, mut max) = (Vec3::INFINITY, Vec3::NEG_INFINITY);
    for &position in &mesh.positions {
        (min, max) = (min.min(position), max.max(position));
    }
    let (middle, radius) = ((min + max) * 0.5, (max - min).length() * 0.5);
    for position in &mut mesh.positions {
        *position = (*position - middle) / radius;
    }
    mesh
}

/// The levels that are drawn while a mesh of radius 1 is larger than [`LEAST_PX`], at one pixel of error.
fn noticed_levels(hierarchy: &Hierarchy) -> Vec<Vec<[u32; 3]>> {
    let cuts = hierarchy.whole_mesh_cuts().into_iter();
    let is_noticed = |level: u32| {
        let error = hierarchy.largest_below(level, |group| {
            group.error_in_local.max(group.whole_mesh_error_in_local)
        });
        2.0 > error * LEAST_PX
    };
    cuts.filter(|cut| is_noticed(cut.group_level))
        .map(|cut| cut.triangles)
        .collect()
}

/// Thin round pieces get narrower when they are simplified.
const ROUND: [&str; 2] = ["chain", "cables"];

#[test]
fn kits_keep_their_covered_area() {
    let all = fixtures::loose_pieces(1).into_iter();
    for kit in all.filter(|it| !it.is_plant && !ROUND.contains(&it.name)) {
        let mesh = in_unit_sphere(kit.mesh);
        let hierarchy = bake_mesh(&mesh, &BakeConfig::default()).unwrap();
        let verified = verify(&mesh, &hierarchy, &VerifySettings::default());
        assert!(verified.is_ok(), "{}: {verified:?}", kit.name);
        let levels = noticed_levels(&hierarchy);
        let source = covered(&hierarchy, &levels[0], |_| true);
        for triangles in &levels[1..] {
            let share = covered(&hierarchy, triangles, |_| true) / source;
            println!("{}: {} triangles cover {share}", kit.name, triangles.len());
            assert!((0.95..1.05).contains(&share), "{}: {share}", kit.name);
        }
    }
}

#[test]
fn trims_that_meet_a_body_keep_their_area_and_facing() {
    let [body, trims] = fixtures::platform();
    assert_measure_is_kept(&[&body, &trims], |hierarchy, triangles| {
        let area = |triangle: &[u32; 3]| {
            let [a, b, c] = triangle.map(|vertex| hierarchy.vertices.positions[vertex as usize]);
            (b - a).cross(c - a).length() * 0.5
        };
        triangles.iter().map(area).sum()
    });
}

/// Checks the levels of each mesh of an object.
fn assert_measure_is_kept(
    meshes: &[&SourceMesh],
    measure: impl Fn(&Hierarchy, &[[u32; 3]]) -> f32,
) {
    let baked = bake_together(meshes, &BakeConfig::default());
    for (mesh, baked) in meshes.iter().zip(baked) {
        let (hierarchy, _) = baked.unwrap();
        let verified = verify(mesh, &hierarchy, &VerifySettings::default());
        assert!(verified.is_ok(), "{verified:?}");
        let levels = noticed_levels(&hierarchy);
        let source = measure(&hierarchy, &levels[0]);
        for triangles in &levels {
            let share = measure(&hierarchy, triangles) / source;
            assert!(
                (0.95..1.05).contains(&share),
                "{}: {share}",
                triangles.len()
            );
        }
    }
}
