//! The rules of other systems follow their formulas, and displacements are measured correctly.

use fieldlod_bake::{BakeConfig, bake_mesh, fixtures};
use fieldlod_lab::chooser::Chooser;
use fieldlod_lab::displacement::{Displacement, SourceSurface};
use fieldlod_lab::eye::{Eye, Instance};
use fieldlod_lab::method::Method;
use fieldlod_lab::object::{ErrorSource, LodObject};
use fieldlod_lab::object_view::ObjectView;
use glam::{Vec2, Vec3};

const HD: Vec2 = Vec2::new(1920.0, 1080.0);

fn rock() -> LodObject {
    let hierarchy = bake_mesh(&fixtures::rock(4, 7), &BakeConfig::fine_grained()).unwrap();
    LodObject::new(hierarchy, ErrorSource::Measured)
}

fn eye(distance: f32) -> Eye {
    Eye::perspective(60.0, HD, 0.01).looking_at(Vec3::Z * distance, Vec3::ZERO)
}

/// The error is `e f / (d − r)`. A group is refined at a threshold just below this error, and not just above it.
#[test]
fn clusterlod_refines_where_error_over_distance_exceeds_threshold() {
    let object = rock();
    let mut groups = object.hierarchy.groups.iter();
    let finest = groups.rposition(|group| group.level == 0 && !group.is_terminal());
    let finest = finest.unwrap();
    let eye = eye(50.0);
    let view = ObjectView::new(&object, &Instance::default(), &eye);
    let bounds = object.nested_bounds[finest];
    let distance = bounds.center.distance(Vec3::Z * 50.0) - bounds.radius;
    let error_px = object.errors_in_local[finest] * 540.0 / 30f32.to_radians().tan() / distance;
    let refined = |threshold_px: f32| {
        let choice = Chooser::new(Method::Clusterlod, threshold_px).choose(&view);
        choice.refined[finest]
    };
    assert!(refined(error_px * 0.9999), "{error_px}");
    assert!(!refined(error_px * 1.0001), "{error_px}");
}

#[test]
fn nested_spheres_contain_all_finer_spheres() {
    let object = rock();
    for (index, group) in object.hierarchy.groups.iter().enumerate() {
        let outer = object.nested_bounds[index];
        for &finer in object.hierarchy.finer_groups(group) {
            let inner = object.nested_bounds[finer as usize];
            let farthest = outer.center.distance(inner.center) + inner.radius;
            assert!(farthest <= outer.radius * 1.00001, "{index}: {farthest}");
        }
    }
}

#[test]
fn visibility_range_changes_level_at_range_start() {
    let object = rock();
    let start = object.range_start(1, 1.0);
    let triangles = |distance: f32| {
        let eye = eye(0.0).looking_at(object.center + Vec3::Z * distance, object.center);
        let view = ObjectView::new(&object, &Instance::default(), &eye);
        let choice = Chooser::new(Method::VisibilityRange, 1.0).choose(&view);
        object.triangle_count(&choice.units)
    };
    let source = object.hierarchy.source_triangle_count();
    assert_eq!(triangles(start * 0.999), source);
    assert!(triangles(start * 1.001) < source);
}

#[test]
fn displacement_of_coarsest_cut_stays_within_its_deviation() {
    let object = rock();
    let source = SourceSurface::new(&object.hierarchy, 4_000);
    let (near, far) = (eye(4.0), eye(1e7));
    // A threshold of 0 selects the source.
    let mut chooser = Chooser::new(Method::Guaranteed, 0.0);
    let finest = chooser.choose(&ObjectView::new(&object, &Instance::default(), &near));
    let displacement = |units: &[u32]| {
        let cut = source.cut(units);
        Displacement::of(&source.displacements(&cut, &Instance::default(), &near, false))
    };
    let none = displacement(&finest.units);
    assert_eq!(none.max_px, 0.0);
    assert!(none.samples > 500, "{none:?}");

    let mut chooser = Chooser::new(Method::Clusterlod, 1.0);
    let coarsest = chooser.choose(&ObjectView::new(&object, &Instance::default(), &far));
    let found = displacement(&coarsest.units);
    let deviation = object.level_errors_in_local.last().unwrap();
    let nearest = 4.0 - object.radius - object.center.length();
    // Off the axis, lengths are stretched by up to 1/cos²φ, 1.2 at 24°. The rock is less than 24° off the axis.
    let bound = f64::from(deviation * near.focal_px() / nearest * 1.2);
    assert!(found.max_px > 0.0 && found.max_px <= bound, "{found:?}");
}
