//! Random changes of a world.

use bevy::prelude::*;
use bevy_fieldlod::prelude::*;
use fieldlod_tests::soak::{LOSSES, folder, soak};

use crate::headless::app_without_render_plugins;

fn app() -> App {
    let mut app = app_without_render_plugins(folder());
    app.insert_resource(LodPriority::LoadingScreen);
    app
}

/// Steps of each test. `FIELDLOD_SOAK_STEPS` sets another number, for long runs by hand.
fn steps() -> usize {
    let steps = std::env::var("FIELDLOD_SOAK_STEPS");
    steps.map_or(5_000, |steps| steps.parse().expect("a number of steps"))
}

#[test]
fn changed_world_equals_fresh_world() {
    soak(steps(), false, LOSSES.len(), &app);
}

#[test]
fn changed_streamed_world_equals_fresh_world() {
    soak(steps(), true, LOSSES.len(), &app);
}
