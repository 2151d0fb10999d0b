//! In a small world, visible flux needs fewer triangles at equal error.

use fieldlod_bake::fixtures;
use fieldlod_lab::eye::Eye;
use fieldlod_lab::scenes::{World, measure, table};
use glam::{Affine3A, Vec2, Vec3};

use crate::common::renderer;

/// A large rock with small ones behind it, and one beside it.
fn rocks_behind_rocks() -> World {
    let mut world = World::new("rocks");
    let rock = world.add_mesh(&fixtures::rock(4, 1), true).unwrap();
    let pieces = world.add_mesh(&fixtures::rock(5, 2), false).unwrap();
    let mut place = |mesh, scale: f32, at: Vec3| {
        let at = Affine3A::from_translation(at) * Affine3A::from_scale(Vec3::splat(scale));
        world.place(mesh, at);
    };
    place(pieces, 6.0, Vec3::new(0.0, 0.0, -8.0));
    for index in 0..12u8 {
        let across = f32::from(index % 4) * 1.5 - 2.2;
        let up = f32::from(index / 4) - 1.0;
        place(rock, 1.0, Vec3::new(across, up, -20.0));
    }
    place(pieces, 2.0, Vec3::new(8.0, 0.0, -14.0));
    let eye = Eye::perspective(60.0, Vec2::new(320.0, 180.0), 0.1);
    for side in [-0.5, 0.5] {
        let from = Vec3::new(side, 0.5, 4.0);
        world.look(eye.looking_at(from, Vec3::new(0.0, 0.0, -10.0)));
    }
    world
}

#[test]
fn visible_flux_needs_fewer_triangles_at_equal_error() {
    let Some((renderer, _lock)) = renderer() else {
        return;
    };
    let result = measure(&renderer, &rocks_behind_rocks()).unwrap();
    let [without, with] = &result.rows;
    assert_eq!((without.share, without.visible_flux), (1.0, false));
    assert!(with.visible_flux && with.share < 1.0, "{result:?}");
    assert!(without.rmse > 0.0);
    assert!((with.rmse / without.rmse - 1.0).abs() < 0.25, "{result:?}");
    assert!(table(&result).contains("| with | "));
}
