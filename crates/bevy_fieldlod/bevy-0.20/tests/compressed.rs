//! Meshes that Bevy 0.20 has compressed get levels, as near to full detail as those of the same meshes without
//! compression.

use bevy::mesh::MeshCompressionArgs;
use bevy::prelude::*;
use bevy_fieldlod::prelude::*;
use fieldlod_tests::apps::bevy_mesh;
use fieldlod_tests::stage::Stage;
use image::RgbaImage;

/// Pictures at full detail and with levels; `None` without an adapter.
fn draw(mesh: Mesh, kind: LodKind) -> Option<[RgbaImage; 2]> {
    let mut stage = Stage::new()?;
    let mesh = stage.add(mesh);
    let stone = stage.add(StandardMaterial::from(Color::srgb(0.6, 0.5, 0.4)));
    let towards = Transform::default().looking_to(Vec3::new(-1.0, -0.8, -0.3), Vec3::Y);
    stage.spawn((DirectionalLight::default(), towards));
    let pose = Transform::from_xyz(0.0, 0.5, 4.0).looking_at(Vec3::ZERO, Vec3::Y);
    let view = FieldLodCamera::with_error_px(1.0);
    let eye = stage.add_eye(pose, Color::BLACK, view);
    let object = stage.spawn((Mesh3d(mesh), MeshMaterial3d(stone)));
    stage.run_until_ready();
    let [full] = stage.shoot([&eye]);
    let auto_lod = AutoLod { kind, ..default() };
    stage.insert(object, auto_lod);
    stage.run_until_ready();
    assert_eq!(stage.progress().ready, 1, "{:?}", stage.progress());
    let [picture] = stage.shoot([&eye]);
    let stats = stage.stats(&eye);
    assert!(stats.triangles_drawn < stats.triangles_full, "{stats:?}");
    Some([full, picture])
}

fn rmse([a, b]: &[RgbaImage; 2]) -> f64 {
    let pairs = a.as_raw().iter().zip(b.as_raw());
    let squares = pairs.map(|(&a, &b)| f64::from(a.abs_diff(b)).powi(2));
    (squares.sum::<f64>() / a.as_raw().len() as f64).sqrt()
}

#[test]
fn compressed_meshes_have_levels() {
    let rock = bevy_mesh(&fieldlod_tests::rock(6, 5));
    let compressed = rock.clone().compressed_mesh(&MeshCompressionArgs::regular());
    let Ok(compressed) = compressed else {
        panic!("the mesh is not compressed");
    };
    for kind in [LodKind::WholeMesh, LodKind::Clusters] {
        let Some(expected) = draw(rock.clone(), kind) else {
            return;
        };
        let pictures = draw(compressed.clone(), kind).unwrap();
        let (expected, error) = (rmse(&expected), rmse(&pictures));
        println!("{kind:?}: {expected:.3} without compression, {error:.3} with it");
        assert!(0.0 < error && error < 1.5 * expected, "{error} against {expected}");
    }
}
