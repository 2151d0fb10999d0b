//! Closed meshes have no holes in pictures.

use bevy::light::GlobalAmbientLight;
use bevy::prelude::*;
use bevy_fieldlod::prelude::*;
use fieldlod_tests::apps::bevy_mesh;
use fieldlod_tests::stage::Stage;

use crate::picture::enclosed;

const BACKGROUND: Color = Color::srgb(1.0, 0.0, 1.0);

/// Directions spread evenly over the sphere (a Fibonacci lattice).
fn directions(count: u16) -> impl Iterator<Item = Vec3> {
    (0..count).map(move |i| {
        let height = 1.0 - 2.0 * (f32::from(i) + 0.5) / f32::from(count);
        let angle = f32::from(i) * 2.399_963;
        let radius = (1.0 - height * height).sqrt();
        Vec3::new(radius * angle.cos(), height, radius * angle.sin())
    })
}

#[test]
fn closed_mesh_has_no_holes() {
    let Some(mut stage) = Stage::new() else {
        return;
    };
    // The mesh is star-shaped, so background inside its outline is a hole.
    let boulder = stage.add(bevy_mesh(&fieldlod_tests::rock(6, 3)));
    let white = stage.add(StandardMaterial {
        unlit: true,
        ..Color::WHITE.into()
    });
    stage.app.insert_resource(GlobalAmbientLight::NONE);
    stage.spawn((Mesh3d(boulder), MeshMaterial3d(white), AutoLod::default()));
    let eye = stage.add_eye(Transform::default(), BACKGROUND, FieldLodCamera::default());
    let empty = image::Rgba([255, 0, 255, 255]);
    let (mut triangle_counts, mut frames) = (Vec::new(), Vec::new());
    stage.run_until_ready();
    for (index, direction) in directions(12).enumerate() {
        let distance = [2.2, 3.5, 6.0, 12.0][index % 4];
        let pose =
            Transform::from_translation(direction * distance).looking_at(Vec3::ZERO, Vec3::Y);
        for error_px in [0.5, 2.0, 8.0, 40.0] {
            let bundle = (pose, FieldLodCamera::with_error_px(error_px));
            stage.insert(eye.entity, bundle);
            frames.push((stage.draw(&eye), direction, distance, error_px));
            triangle_counts.push(stage.stats(&eye).triangles_drawn);
        }
    }
    for (frame, direction, distance, error_px) in frames {
        let picture = stage.wait(&frame);
        let covered = picture.pixels().filter(|&&pixel| pixel != empty).count();
        assert!(covered > 100, "nothing is drawn from {direction}");
        let holes = enclosed(&picture, empty);
        assert_eq!(
            holes, 0,
            "holes from {direction} at {distance} and {error_px} px"
        );
    }
    triangle_counts.sort_unstable();
    triangle_counts.dedup();
    assert!(
        triangle_counts.len() > 20,
        "the views hardly differ in their cuts"
    );
}

#[test]
fn hole_test_detects_missing_triangles() {
    let Some(mut stage) = Stage::new() else {
        return;
    };
    let mut boulder = fieldlod_tests::rock(5, 3);
    // One triangle in twenty is missing.
    boulder.indices = boulder
        .indices
        .chunks(60)
        .flat_map(|chunk| chunk[3..].to_vec())
        .collect();
    let boulder = stage.add(bevy_mesh(&boulder));
    let white = stage.add(StandardMaterial {
        unlit: true,
        ..Color::WHITE.into()
    });
    stage.spawn((Mesh3d(boulder), MeshMaterial3d(white)));
    let pose = Transform::from_xyz(0.0, 0.0, 2.5).looking_at(Vec3::ZERO, Vec3::Y);
    let eye = stage.add_eye(pose, BACKGROUND, FieldLodCamera::default());
    stage.run_until_ready();
    let [picture] = stage.shoot([&eye]);
    assert!(enclosed(&picture, image::Rgba([255, 0, 255, 255])) > 20);
}
