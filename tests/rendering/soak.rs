//! Random changes of a world that is drawn.

use bevy_fieldlod::prelude::*;
use fieldlod_tests::soak::{folder, soak};
use fieldlod_tests::stage::Stage;

/// Steps of each test. `FIELDLOD_SOAK_STEPS` sets another number, for long runs by hand.
fn steps() -> usize {
    let steps = std::env::var("FIELDLOD_SOAK_STEPS");
    steps.map_or(100, |steps| steps.parse().expect("a number of steps"))
}

fn soak_culled_by(gpu_culling: bool, streams: bool) {
    let app = || {
        let mut stage = Stage::unfinished_in(folder())?;
        stage.finish();
        stage.shrink_shadow_maps();
        stage.config().advanced.gpu_culling = gpu_culling;
        stage.app.insert_resource(LodPriority::LoadingScreen);
        Some(stage.app)
    };
    if app().is_some() {
        // Bevy 0.19.1 goes on drawing a camera after most losses, and panics where a sun has no cascades for it.
        let losses = 1;
        soak(steps(), streams, losses, &|| app().expect("an adapter"));
    }
}

#[test]
fn world_culled_by_gpu_equals_fresh_world() {
    soak_culled_by(true, true);
}

#[test]
fn world_culled_by_cpu_equals_fresh_world() {
    soak_culled_by(false, false);
}
