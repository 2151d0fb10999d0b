//! Shows the scene in a window, along the path or in free flight.

use std::f32::consts::SQRT_2;

use bevy::app::AppExit;
use bevy::prelude::*;
use bevy::window::{PresentMode, WindowResolution};
use bevy_fieldlod::prelude::*;

use super::hud;
use crate::args::Args;
use crate::cameras::{CameraTarget, ViewOptions, flight};
use crate::quality::Quality;
use crate::scene;

/// Opens the window and runs until it is closed.
pub(crate) fn run(args: &Args, quality: &Quality) -> Result<(), String> {
    let window = Window {
        title: "fieldlod walkthrough".into(),
        resolution: WindowResolution::from(quality.size_in_px),
        present_mode: PresentMode::AutoVsync,
        ..default()
    };
    let mut app = App::new();
    app.add_plugins(scene::default_plugins(true).set(WindowPlugin {
        primary_window: Some(window),
        ..default()
    }))
    .insert_resource(CameraTarget::default());
    scene::add_to(&mut app, args, quality);
    app.add_plugins((flight::plugin, hud::labels_plugin, hud::panel_plugin))
        .add_systems(Update, switch);
    match app.run() {
        AppExit::Success => Ok(()),
        AppExit::Error(code) => Err(format!("the window closed with exit code {code}")),
    }
}

/// Handles the keys that change the view.
fn switch(
    keys: Res<ButtonInput<KeyCode>>,
    mut options: ResMut<ViewOptions>,
    mut debug: ResMut<FieldLodDebug>,
    mut exit: MessageWriter<AppExit>,
) {
    for key in keys.get_just_pressed() {
        match key {
            KeyCode::KeyL => debug.color_levels = !debug.color_levels,
            KeyCode::KeyF => debug.freeze = !debug.freeze,
            KeyCode::KeyV => options.split = !options.split,
            KeyCode::Equal | KeyCode::NumpadAdd => {
                options.error_px = (options.error_px * SQRT_2).min(1e3);
            }
            KeyCode::Minus | KeyCode::NumpadSubtract => {
                options.error_px = (options.error_px / SQRT_2).max(1e-2);
            }
            KeyCode::Escape => {
                exit.write(AppExit::Success);
            }
            _ => {}
        }
    }
}
