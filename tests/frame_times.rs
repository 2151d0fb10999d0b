//! Times of the parts of a frame.

use std::time::{Duration, Instant};

use bevy::prelude::*;
use bevy::render::RenderApp;
use bevy::render::renderer::{PendingCommandBuffers, RenderGraph, RenderGraphSystems};

/// The parts of one frame.
#[derive(Clone, Copy, Debug, Default)]
pub struct FrameTimes {
    /// The main world.
    pub main: Duration,
    /// The extraction, for which both worlds wait.
    pub extract: Duration,
    /// The render world, including the submission to the GPU.
    pub render: Duration,
}

impl FrameTimes {
    /// Runs a frame as [`App::update`] does.
    pub fn of_update(app: &mut App) -> Self {
        let mut times = Self::default();
        let apps = app.sub_apps_mut();
        let start = Instant::now();
        apps.main.run_default_schedule();
        times.main = start.elapsed();
        for sub_app in apps.sub_apps.values_mut() {
            let start = Instant::now();
            sub_app.extract(apps.main.world_mut());
            times.extract += start.elapsed();
            let start = Instant::now();
            sub_app.update();
            times.render += start.elapsed();
        }
        apps.main.world_mut().clear_trackers();
        times
    }
}

/// Drops the commands of all further frames when they are recorded. The GPU draws nothing.
///
/// # Panics
/// Without a renderer.
pub fn drop_commands(app: &mut App) {
    fn take(mut pending: ResMut<PendingCommandBuffers>) {
        *pending = default();
    }
    let after_recording = take
        .after(RenderGraphSystems::Render)
        .before(RenderGraphSystems::Submit);
    let render = app.sub_app_mut(RenderApp);
    render.add_systems(RenderGraph, after_recording);
}

/// The element in the middle.
///
/// # Panics
/// If there is none.
pub fn median(times: impl Iterator<Item = Duration>) -> Duration {
    let mut times: Vec<Duration> = times.collect();
    times.sort_unstable();
    times[times.len() / 2]
}
