//! Rocks in a field.

use std::sync::OnceLock;

use bevy::prelude::*;

use super::{Block, Paint, Place, Prop, Scene};

/// Metres between rocks of radius one.
const SPACING: f32 = 5.0;
/// Shapes of boulders.
const SHAPES: u32 = 3;

/// A square of rocks around the camera, each of `20 · 4^subdivisions` triangles.
#[must_use]
pub fn rocks(count: u32, subdivisions: u32) -> Scene {
    let side = (count as f32).sqrt().ceil() as u32;
    let places = (0..count).map(|index| {
        let cell = Vec2::new((index % side) as f32, (index / side) as f32);
        let at = (cell - Vec2::splat(side as f32 * 0.5)) * SPACING;
        let turn = Quat::from_rotation_y(index as f32);
        Place::new(0, Transform::from_xyz(at.x, 0.0, at.y).with_rotation(turn))
    });
    let rock = Prop::new(crate::rock(subdivisions, 1), 0, 1.0);
    field("rocks", vec![rock], places.collect(), on_a_circle)
}

/// Rocks of 81,920 triangles, the first of them near the camera.
pub(super) fn boulders(count: u32) -> Scene {
    let places = (0..count).map(|index| {
        let away = 3.0 + 90.0 * (index as f32 / count as f32).powi(2);
        let aside = ((index as f32 * 0.618).fract() - 0.5) * away * 1.2;
        let turn = Quat::from_rotation_y(index as f32 * 2.4);
        let at = Transform::from_xyz(aside, 0.4, -away).with_rotation(turn);
        Place::new((index % SHAPES) as usize, at)
    });
    let rocks = (0..SHAPES).map(|seed| Prop::new(crate::rock(6, seed), 0, 1.0));
    field("boulders", rocks.collect(), places.collect(), ahead)
}

fn field(
    name: &'static str,
    props: Vec<Prop>,
    places: Vec<Place>,
    path: fn(f32) -> Transform,
) -> Scene {
    let at = Vec3::ZERO;
    Scene {
        name,
        props,
        blocks: vec![Block { at, places }],
        paints: vec![Paint::Plain(Color::srgb(0.6, 0.55, 0.5))],
        is_flat: true,
        ends_in_box: false,
        path,
        range_scale: 1.0,
        levels: OnceLock::new(),
        cache: OnceLock::new(),
    }
}

fn on_a_circle(metres: f32) -> Transform {
    let angle = metres / 20.0;
    let eye = Vec3::new(20.0 * angle.cos(), 1.7, 20.0 * angle.sin());
    let ahead = Vec3::new(-angle.sin(), -0.05, angle.cos());
    Transform::from_translation(eye).looking_to(ahead, Vec3::Y)
}

fn ahead(metres: f32) -> Transform {
    let eye = Vec3::new(0.0, 2.2, 8.0 - metres);
    Transform::from_translation(eye).looking_to(Vec3::new(0.1, -0.08, -1.0), Vec3::Y)
}
