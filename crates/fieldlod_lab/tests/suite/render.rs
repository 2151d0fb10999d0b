//! The reference renderer draws correct outlines, and always draws the same picture of a cut.

use std::f64::consts::PI;

use fieldlod_bake::{BakeConfig, bake_mesh, fixtures};
use fieldlod_hierarchy::Hierarchy;
use fieldlod_lab::eye::Eye;
use fieldlod_lab::measure::image_error;
use fieldlod_lab::render::{RenderError, SUPERSAMPLING};
use glam::{UVec2, Vec2, Vec3};

use crate::common::renderer;

const SIZE_PX: Vec2 = Vec2::new(320.0, 180.0);

fn sphere() -> Hierarchy {
    bake_mesh(&fixtures::icosphere(5), &BakeConfig::fine_grained()).unwrap()
}

fn source(hierarchy: &Hierarchy) -> Vec<u32> {
    let units = hierarchy.source_units();
    units.map(|unit| unit as u32).collect()
}

fn eye(distance: f32) -> Eye {
    let eye = Eye::perspective(40.0, SIZE_PX, 0.01);
    eye.looking_at(Vec3::new(0.0, 0.0, distance), Vec3::ZERO)
}

/// A sphere of radius 1 at distance d covers a disk of radius f/√(d² − 1), with the focal length f in pixels.
#[test]
fn silhouette_of_a_sphere_has_the_expected_area() {
    let Some((renderer, _lock)) = renderer() else {
        return;
    };
    let sphere = sphere();
    let model = renderer.upload(&sphere, None);
    for distance in [3.0f32, 8.0] {
        let picture = renderer.draw(&model, &eye(distance), &source(&sphere));
        let covered = picture.unwrap().covered;
        let texels = covered.iter().filter(|covered| **covered).count() as f64;
        let px2 = texels / f64::from(SUPERSAMPLING * SUPERSAMPLING);
        let radius_px =
            f64::from(eye(distance).focal_px()) / (f64::from(distance).powi(2) - 1.0).sqrt();
        let disk = PI * radius_px * radius_px;
        assert!((px2 - disk).abs() < 0.005 * disk, "{px2} {disk}");
    }
}

#[test]
fn same_cut_gives_the_same_picture() {
    let Some((renderer, _lock)) = renderer() else {
        return;
    };
    let sphere = sphere();
    let model = renderer.upload(&sphere, None);
    let units = source(&sphere);
    let draw = |distance| renderer.draw(&model, &eye(distance), &units).unwrap();
    let first = draw(3.0);
    assert_eq!(first.size_px, UVec2::new(320, 180));
    assert_ne!(draw(4.0), first);
    assert_eq!(draw(3.0), first);
}

/// The RMSE grows with each coarser level. FLIP and the silhouette error are above 0.
#[test]
fn coarser_levels_have_larger_rmse() {
    let Some((renderer, _lock)) = renderer() else {
        return;
    };
    let sphere = sphere();
    let model = renderer.upload(&sphere, None);
    let reference = renderer.draw(&model, &eye(3.0), &source(&sphere)).unwrap();
    let mut last = 0.0;
    for level in 1..sphere.level_count().min(5) {
        let units = sphere.units.iter().zip(0..);
        let of_level = units.filter(|(unit, _)| sphere.level_of(unit) == level);
        let units: Vec<u32> = of_level.map(|(_, index)| index).collect();
        let picture = renderer.draw(&model, &eye(3.0), &units).unwrap();
        let error = image_error(&reference, &picture, true);
        assert!(error.rmse > last, "level {level}: {error:?}, before {last}");
        let flip = error.flip.unwrap();
        assert!(error.silhouette_px > 0.0, "{error:?}");
        assert!(flip > 0.0 && flip < 0.5, "{error:?}");
        last = error.rmse;
    }
}

#[test]
fn rejects_orthographic_views() {
    let Some((renderer, _lock)) = renderer() else {
        return;
    };
    let sphere = sphere();
    let model = renderer.upload(&sphere, None);
    let refused = renderer.draw(&model, &Eye::orthographic(3.0, SIZE_PX), &[]);
    assert!(matches!(refused, Err(RenderError::Orthographic)));
}
