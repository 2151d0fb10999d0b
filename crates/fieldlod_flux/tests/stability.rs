//! Visible flux adds no flicker on a path, and instances are refined in the frame in which they appear.

mod common;

use std::collections::HashMap;

use common::{Eye, Stage, look, perspective, placed, settings};
use fieldlod_select::{InstanceId, Selector, View};
use glam::{Affine3A, Quat, Vec3};

/// A unit that comes back within this number of frames counts as a flip.
const FLIP_FRAMES: usize = 5;
const FRAMES: usize = 240;

fn put_wall(stage: &mut Stage) -> InstanceId {
    stage.put(Vec3::new(0.0, 0.0, -5.0), Vec3::new(3.0, 3.0, 0.3))
}

/// Adds a row of rocks at a depth.
fn put_row(stage: &mut Stage, depth: f32) {
    for index in 0..9u8 {
        let x = (f32::from(index) - 4.0) * 3.0;
        stage.put(Vec3::new(x, 0.0, -depth), Vec3::ONE);
    }
}

/// Counts units that leave the cut and soon come back.
#[derive(Default)]
struct Flips {
    left_at: HashMap<(InstanceId, u32), usize>,
    count: usize,
}

impl Flips {
    /// Counts units that come back in this frame, at most [`FLIP_FRAMES`] after they left.
    fn add_frame(&mut self, frame: usize, selector: &Selector) {
        for change in selector.changes() {
            let units = change.left.iter();
            self.left_at
                .extend(units.map(|&unit| ((change.instance, unit), frame)));
            let is_back = |unit: &&u32| {
                let left = self.left_at.get(&(change.instance, **unit));
                left.is_some_and(|&left| frame - left <= FLIP_FRAMES)
            };
            self.count += change.entered.iter().filter(is_back).count();
        }
    }
}

/// Selects and checks the frames of a path. In some frame, an instance must have less than half of the triangles that
/// it has without visible flux.
fn play(mut stage: Stage, mut frame: impl FnMut(usize, &mut Stage) -> View) {
    let (mut eye, mut plain) = (Eye::default(), Selector::default());
    let [mut flips, mut plain_flips] = [Flips::default(), Flips::default()];
    let mut coarser = 0;
    for index in 0..FRAMES {
        let view = frame(index, &mut stage);
        stage.scene.update();
        eye.select(&stage, &view, &settings());
        plain.select(&stage.scene, &view, &settings());
        flips.add_frame(index, &eye.selector);
        plain_flips.add_frame(index, &plain);
        // A fully visible instance has at least the triangles that it has without visible flux.
        let fresh = stage.select_all_visible(&view);
        let image = eye.flux.depth_image().unwrap();
        for &id in &stage.ids {
            let [now, fully] = [&eye.selector, &fresh].map(|of| stage.triangles(of, id));
            let is_seen = image.visible_share(&stage.scene, &stage.occluders, id) == 1.0;
            assert!(now >= fully || !is_seen, "frame {index}: {now} of {fully}");
            coarser += usize::from(now * 2 < fully);
        }
    }
    let counts = [flips.count, plain_flips.count];
    assert!(counts[0] <= counts[1], "{counts:?} units came back");
    assert!(coarser > 0);
}

/// A view from `eye` along −Z.
fn ahead(eye: Vec3) -> View {
    look(perspective(1.0), eye, eye - Vec3::Z * 10.0)
}

/// A triangle wave between −1 and 1.
fn sway(frame: usize, period: usize) -> f32 {
    let phase = (frame % period) as f32 / period as f32;
    (phase * 4.0 - 2.0).abs() - 1.0
}

/// The camera moves past the wall's edge, sways at the edge, or turns by 143 degrees every 60 frames.
#[test]
fn row_behind_wall_does_not_flicker() {
    let paths: [fn(usize) -> View; 3] = [
        |frame| ahead(Vec3::X * (frame as f32 * 0.025)),
        |frame| ahead(Vec3::X * (2.5 + sway(frame, 32) * 0.8)),
        |frame| {
            let turn = Quat::from_rotation_y((frame / 60) as f32 * 2.5);
            let eye = Vec3::X * 4.0;
            look(perspective(1.0), eye, eye + turn * Vec3::NEG_Z * 10.0)
        },
    ];
    for path in paths {
        let mut stage = Stage::new();
        put_wall(&mut stage);
        put_row(&mut stage, 14.0);
        play(stage, |frame, _| path(frame));
    }
}

#[test]
fn row_behind_opening_door_does_not_flicker() {
    let mut stage = Stage::new();
    let half_size = Vec3::new(3.0, 3.0, 0.2);
    let door = stage.put(Vec3::new(0.0, 0.0, -5.0), half_size);
    put_row(&mut stage, 14.0);
    // The door turns about its left edge.
    play(stage, |frame, stage| {
        let turn = Quat::from_rotation_y(frame as f32 * 0.01);
        let hinge = Affine3A::from_rotation_translation(turn, Vec3::new(-3.0, 0.0, -5.0));
        let placement = hinge * placed(Vec3::X * 3.0, half_size);
        stage.scene.set_placement(door, placement);
        ahead(Vec3::ZERO)
    });
}

#[test]
fn row_behind_fence_does_not_flicker() {
    let mut stage = Stage::new();
    for post in 0..40u8 {
        let x = f32::from(post) * 0.5 - 10.0;
        stage.put(Vec3::new(x, 0.0, -3.0), Vec3::new(0.18, 2.0, 0.18));
    }
    put_row(&mut stage, 14.0);
    // 1.4 m/s at 60 Hz.
    play(stage, |frame, _| {
        ahead(Vec3::X * (frame as f32 * 0.0233 - 2.8))
    });
}

#[test]
fn row_behind_ridge_does_not_flicker() {
    let mut stage = Stage::new();
    for hill in 0..5u8 {
        let x = (f32::from(hill) - 2.0) * 5.0;
        stage.put(Vec3::new(x, -2.4, -6.0), Vec3::new(5.0, 3.0, 1.5));
    }
    put_row(&mut stage, 20.0);
    // Head-bob twice a second uncovers and hides rocks of the row.
    play(stage, |frame, _| {
        let height = 0.1 + sway(frame, 30) * 0.12;
        ahead(Vec3::new(frame as f32 * 0.0233, height, 0.0))
    });
}

#[test]
fn rocks_behind_walls_do_not_flicker_on_turns() {
    let mut stage = Stage::new();
    for index in 0..24u8 {
        let turn = Quat::from_rotation_y(f32::from(index) * 0.2618);
        if index.is_multiple_of(3) {
            stage.put(turn * Vec3::new(0.0, 0.0, -5.0), Vec3::new(1.4, 1.4, 0.3));
        }
        let far = 9.0 + f32::from(index % 5) * 2.0;
        stage.put(turn * Vec3::new(0.0, 0.0, -far), Vec3::ONE);
    }
    // The camera turns by 3 degrees a frame, to and fro.
    play(stage, |frame, _| {
        let turn = Quat::from_rotation_y(sway(frame, 160) * 0.0524 * 40.0);
        look(perspective(1.0), Vec3::ZERO, turn * Vec3::NEG_Z * 10.0)
    });
}

#[test]
fn row_behind_removed_wall_does_not_flicker() {
    let mut stage = Stage::new();
    put_row(&mut stage, 14.0);
    let mut wall = None;
    play(stage, |frame, stage| {
        if frame.is_multiple_of(80) {
            wall = Some(put_wall(stage));
        }
        if let Some(id) = wall.take_if(|_| frame % 80 == 60) {
            stage.remove(id);
        }
        ahead(Vec3::ZERO)
    });
}
