//! What storage does.

use crate::synthetic;
use crate::{LodSettings, Scene, Selector, View};
use camera_field::{Camera, Intrinsics};
use glam::{Affine3A, Vec2, Vec3};

#[test]
fn a_warm_selector_does_not_grow() {
    let mut scene = Scene::default();
    let mesh = scene.add_mesh(&synthetic::ball(3, 0.004));
    for index in 0..400u16 {
        let (x, z) = (f32::from(index % 20), f32::from(index / 20));
        let place = Vec3::new(x * 3.0, 0.0, z * -3.0);
        scene.add_instance(mesh, Affine3A::from_translation(place), 1.0);
    }
    scene.update();
    let camera = Camera::Perspective(Intrinsics::centered(935.0, Vec2::new(1920.0, 1080.0)));
    let mut selector = Selector::default();
    let mut lap = || {
        for step in 0..200u8 {
            let eye = Vec3::new(30.0, 1.5, 10.0 - f32::from(step) * 0.2);
            let view = View::new(camera, &Affine3A::from_translation(eye));
            selector.select(&scene, &view, &LodSettings::with_error_px(1.0));
        }
        selector.last_cuts().unwrap().0.capacity()
    };
    // The second lap begins where the first ended, as all others do.
    let warm = [lap(), lap()][1];
    for _ in 0..10 {
        assert_eq!(lap(), warm);
    }
}
