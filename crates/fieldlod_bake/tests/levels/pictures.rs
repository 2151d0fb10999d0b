//! Damaged levels that deviation samples accept, but pictures or cuts reject.

use fieldlod_bake::{SourceMesh, VerifyError, VerifySettings, fixtures, verify};
use fieldlod_hierarchy::{Group, Hierarchy, Sphere};
use glam::Vec3;

/// A mesh with one coarser level that consists of `triangles`. Its error is `error` and its deviation is 1.
fn with_level(mesh: &SourceMesh, triangles: &[[u32; 3]], error: f32) -> Hierarchy {
    let mut hierarchy = Hierarchy {
        source: mesh.source_hash(),
        source_vertex_count: mesh.positions.len() as u32,
        vertices: mesh.vertices.clone(),
        ..Hierarchy::default()
    };
    let group = Group {
        bounds: Sphere::around(mesh.positions.iter().copied()),
        error_in_local: error,
        deviation_in_local: 1.0,
        ..Group::default()
    };
    let whole = mesh.indices.as_chunks::<3>().0;
    hierarchy.push_whole_mesh(whole, group).unwrap();
    let terminal = Group {
        error_in_local: f32::INFINITY,
        deviation_in_local: f32::INFINITY,
        ..group
    };
    hierarchy.push_whole_mesh(triangles, terminal).unwrap();
    hierarchy
}

fn check(mesh: &SourceMesh, triangles: &[[u32; 3]]) -> Result<f32, VerifyError> {
    let hierarchy = with_level(mesh, triangles, 0.02);
    assert_eq!(hierarchy.validate(), Ok(()));
    let verified = verify(mesh, &hierarchy, &VerifySettings::default());
    verified.map(|verified| verified.wrong_pixels)
}

#[test]
fn verify_rejects_cloth_with_missing_border() {
    let mut cloth = fixtures::height_field(48);
    let backs = cloth.indices.as_chunks::<3>().0.iter();
    let backs: Vec<u32> = backs.flat_map(|&[a, b, c]| [a, c, b]).collect();
    cloth.indices.extend(backs);
    let whole = cloth.indices.as_chunks::<3>().0;
    assert!(check(&cloth, whole).unwrap() < 0.01);
    let is_inside = |triangle: &&[u32; 3]| {
        let middle = cloth.positions[triangle[0] as usize] - Vec3::new(0.5, 0.0, 0.5);
        middle.x.abs().max(middle.z.abs()) < 0.35
    };
    let shrunk: Vec<[u32; 3]> = whole.iter().filter(is_inside).copied().collect();
    let fault = check(&cloth, &shrunk).unwrap_err();
    assert!(
        matches!(fault, VerifyError::Pictures { level: 1, .. }),
        "{fault}"
    );
}

#[test]
fn verify_rejects_torn_sphere() {
    // Corners that differ by rounding are welded, so cuts show the holes.
    let mut ball = fixtures::icosphere(4).without_shared_vertices();
    for (index, position) in ball.positions.iter_mut().enumerate() {
        *position *= 1.0 + (index % 7) as f32 * 1e-7;
    }
    let whole = ball.indices.as_chunks::<3>().0;
    assert!(check(&ball, whole).unwrap() < 0.01);
    let torn: Vec<[u32; 3]> = whole.iter().step_by(2).copied().collect();
    let fault = check(&ball, &torn).unwrap_err();
    assert!(matches!(fault, VerifyError::Hole { .. }), "{fault}");
}
