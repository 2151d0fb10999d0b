//! The baselines' formulas give the numbers that their sources give by hand, and the measure measures.

use fieldlod_bake::{BakeConfig, bake_mesh, fixtures};
use fieldlod_lab::chooser::Chooser;
use fieldlod_lab::displacement::SourceSurface;
use fieldlod_lab::eye::{Eye, Instance};
use fieldlod_lab::method::Method;
use fieldlod_lab::object::{ErrorSource, LodObject};
use fieldlod_lab::object_view::ObjectView;
use glam::{Affine3A, Vec2, Vec3};

const HD: Vec2 = Vec2::new(1920.0, 1080.0);

fn rock() -> LodObject {
    let hierarchy = bake_mesh(&fixtures::rock(4, 7), &BakeConfig::fine_grained()).unwrap();
    LodObject::new(hierarchy, ErrorSource::Measured)
}

fn eye(distance: f32) -> Eye {
    Eye::perspective(60.0, HD, 0.01).looking_at(Vec3::Z * distance, Vec3::ZERO)
}

fn first_group(object: &LodObject) -> usize {
    let mut groups = object.hierarchy.groups.iter();
    groups.position(|group| !group.is_terminal()).unwrap()
}

#[test]
fn clusterlod_is_error_times_focal_length_over_distance_to_the_sphere() {
    let object = rock();
    let group = first_group(&object);
    let eye = eye(50.0);
    let view = ObjectView::new(&object, &Instance::default(), &eye);
    let bounds = object.hierarchy.groups[group].bounds;
    let distance = bounds.center.distance(Vec3::Z * 50.0) - bounds.radius;
    let expected = object.errors_in_local[group] * 540.0 / 30f32.to_radians().tan() / distance;
    let found = Method::ClusterlodTight
        .group_error_px(&view, group)
        .unwrap();
    assert!((found / expected - 1.0).abs() < 1e-5, "{found} {expected}");
}

#[test]
fn nested_spheres_hold_all_finer_ones() {
    let object = rock();
    for (index, group) in object.hierarchy.groups.iter().enumerate() {
        let outer = object.nested_bounds[index];
        for &finer in object.hierarchy.finer_groups(group) {
            let inner = object.nested_bounds[finer as usize];
            let reach = outer.center.distance(inner.center) + inner.radius;
            assert!(
                reach <= outer.radius * 1.00001,
                "{index}: {reach} {}",
                outer.radius
            );
        }
    }
}

#[test]
fn meshlets_leave_the_scale_out() {
    let object = rock();
    let group = first_group(&object);
    let (scale, eye) = (10.0, eye(500.0));
    let instance = Instance::at(Affine3A::from_scale(Vec3::splat(scale)));
    let view = ObjectView::new(&object, &instance, &eye);
    let with = Method::Clusterlod.group_error_px(&view, group).unwrap();
    let without = Method::Meshlets.group_error_px(&view, group).unwrap();
    assert!((with / without / scale - 1.0).abs() < 1e-5);
}

#[test]
fn nanite_knows_the_stretch_off_the_axis() {
    let object = rock();
    let group = first_group(&object);
    let error_px = |yaw_deg: f32| {
        let eye = eye(400.0).turned(yaw_deg, 0.0);
        let view = ObjectView::new(&object, &Instance::default(), &eye);
        Method::Nanite.group_error_px(&view, group).unwrap()
    };
    // The radial stretch is 1/cos²φ.
    let expected = 1.0 / 40f32.to_radians().cos().powi(2);
    let found = error_px(40.0) / error_px(0.0);
    assert!((found / expected - 1.0).abs() < 0.02, "{found} {expected}");
}

#[test]
fn whole_objects_change_level_where_their_range_starts() {
    let object = rock();
    let start = object.range_start(1, 1.0);
    for method in [
        Method::VisibilityRange,
        Method::ThreeLod,
        Method::ProjectedSize,
    ] {
        let level = |distance: f32| {
            let eye = eye(0.0).looking_at(object.center + Vec3::Z * distance, object.center);
            let view = ObjectView::new(&object, &Instance::default(), &eye);
            method.object_level(&view, 1.0).unwrap()
        };
        let around = (level(start * 0.999), level(start * 1.001));
        assert_eq!(around, (0, 1), "{}", method.name());
    }
}

#[test]
fn the_source_is_displaced_nowhere_and_the_coarsest_cut_within_its_deviation() {
    let object = rock();
    let source = SourceSurface::new(&object.hierarchy, 4_000);
    let (near, far) = (eye(4.0), eye(1e7));
    let mut chooser = Chooser::new(Method::Guaranteed, 0.0);
    let finest = chooser.choose(&ObjectView::new(&object, &Instance::default(), &near));
    let finest = source.cut(&finest.units);
    let none = source.displacement(&finest, &Instance::default(), &near, false);
    assert_eq!(none.max_px, 0.0);
    assert!(none.samples > 500, "{none:?}");

    let mut chooser = Chooser::new(Method::Clusterlod, 1.0);
    let coarsest = chooser.choose(&ObjectView::new(&object, &Instance::default(), &far));
    let coarsest = source.cut(&coarsest.units);
    let found = source.displacement(&coarsest, &Instance::default(), &near, false);
    let deviation = object.level_errors_in_local.last().unwrap();
    let nearest = 4.0 - object.radius - object.center.length();
    let bound = f64::from(deviation * near.focal_px() / nearest * 1.2);
    assert!(
        found.max_px <= bound && found.max_px > bound * 0.1,
        "{found:?} {bound}"
    );
    assert!(found.mean_px <= found.p99_9_px && found.p99_9_px <= found.max_px);
}
