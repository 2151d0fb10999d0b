//! A small world of several objects: triangles at equal error, and what the files say.

mod common;

use fieldlod_bake::fixtures;
use fieldlod_lab::eye::Eye;
use fieldlod_lab::scenes::{Options, Visibility, World, WorldResult, measure};
use fieldlod_select::VisibleFlux;
use glam::{Affine3A, Vec2, Vec3};

/// A wall of rocks with rocks behind it, and one beside it.
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
        place(
            rock,
            1.0,
            Vec3::new(across, f32::from(index / 4) - 1.0, -20.0),
        );
    }
    place(pieces, 2.0, Vec3::new(8.0, 0.0, -14.0));
    let eye = Eye::perspective(60.0, Vec2::new(320.0, 180.0), 0.1);
    for side in [-0.5, 0.5] {
        let from = Vec3::new(side, 0.5, 4.0);
        world.look(eye.looking_at(from, Vec3::new(0.0, 0.0, -10.0)));
    }
    world
}

fn measured(shadows: bool) -> Option<(WorldResult, tempfile::TempDir)> {
    let (renderer, _one) = common::renderer()?;
    let folder = tempfile::tempdir().unwrap();
    let options = Options {
        shadows,
        limits: !shadows,
    };
    let result = measure(&renderer, &rocks_behind_rocks(), options, folder.path()).unwrap();
    Some((result, folder))
}

#[test]
fn what_is_hidden_takes_fewer_triangles_at_equal_error() {
    let Some((result, folder)) = measured(false) else {
        return;
    };
    let share = |visibility| {
        let row = result.rows.iter().find(|row| row.visibility == visibility);
        row.unwrap().share
    };
    let flux = Visibility::Buffer {
        least_share: VisibleFlux::default().least_share,
    };
    assert_eq!(share(Visibility::Unknown), 1.0);
    assert!(share(flux) < 0.85, "{result:?}");
    assert!(share(Visibility::HiddenInPicture) < 0.85, "{result:?}");
    // Nothing that the picture does not show changes it.
    assert_eq!(result.pixels_changed[1], Some(0));
    let base = result.rows[0].rmse;
    assert!(base > 0.0);
    for row in &result.rows {
        let is_limit = row.visibility == Visibility::Oracle;
        assert!(is_limit || (row.rmse / base - 1.0).abs() < 0.25, "{row:?}");
    }
    // What was written is what is returned.
    let text = std::fs::read(folder.path().join("rocks.json")).unwrap();
    let read: WorldResult = serde_json::from_slice(&text).unwrap();
    assert_eq!(read.rows.len(), result.rows.len());
    let table = std::fs::read_to_string(folder.path().join("rocks.md")).unwrap();
    assert!(table.contains("| visible flux | "), "{table}");
    let picture = image::open(folder.path().join("rocks depth.png")).unwrap();
    assert_eq!((picture.width(), picture.height()), (256, 144));
}

/// A caster that counts in full is drawn as without visible flux.
#[test]
fn hidden_casters_that_count_in_full_save_nothing() {
    let Some((result, _)) = measured(true) else {
        return;
    };
    let last = result.rows.last().unwrap();
    assert_eq!(last.visibility, Visibility::Buffer { least_share: 1.0 });
    assert_eq!(last.share, 1.0);
    assert!(result.rows[1].share < 0.95, "{result:?}");
}
