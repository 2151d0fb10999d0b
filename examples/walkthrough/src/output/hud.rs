//! Numbers and labels on the screen.

use bevy::diagnostic::{Diagnostic, DiagnosticsStore, FrameTimeDiagnosticsPlugin};
use bevy::prelude::*;
use bevy_fieldlod::prelude::*;

use super::report::short_count;
use crate::cameras::{FullDetailCamera, MainCamera, ViewOptions};
use crate::quality::Quality;

const HELP: &str = "WASD QE fly   right mouse look   wheel zoom   Shift fast   P path\n\
                    L levels   F freeze   +/- pixel error   V split   Esc quit";

/// The panel of numbers.
#[derive(Component)]
struct Panel;

/// The label of one half of the split screen.
#[derive(Component)]
struct Label {
    view: Entity,
    title: &'static str,
}

/// Adds the labels of the split screen.
pub(crate) fn labels_plugin(app: &mut App) {
    app.add_systems(Startup, spawn_labels)
        .add_systems(Update, update_labels);
}

/// Adds the panel of numbers and key help.
pub(crate) fn panel_plugin(app: &mut App) {
    app.add_plugins(FrameTimeDiagnosticsPlugin::default())
        .add_systems(Startup, spawn_panel)
        .add_systems(Update, update_panel);
}

/// An empty text in the view of a camera.
fn text(view: Entity, size_px: f32, node: Node) -> impl Bundle {
    (
        UiTargetCamera(view),
        Text::default(),
        TextFont {
            font_size: FontSize::Px(size_px),
            ..default()
        },
        TextColor(Color::WHITE),
        TextShadow {
            offset: Vec2::splat(1.5),
            ..default()
        },
        Node {
            position_type: PositionType::Absolute,
            ..node
        },
    )
}

fn spawn_panel(mut commands: Commands, main: Single<Entity, With<MainCamera>>) {
    let node = Node {
        top: px(10),
        left: px(10),
        padding: UiRect::all(px(8)),
        ..default()
    };
    let dark = BackgroundColor(Color::srgba(0.0, 0.0, 0.0, 0.45));
    commands.spawn((Panel, text(*main, 15.0, node), dark));
}

fn spawn_labels(
    mut commands: Commands,
    main: Single<Entity, With<MainCamera>>,
    twin: Single<Entity, With<FullDetailCamera>>,
) {
    for (view, title) in [(*main, "levels of detail"), (*twin, "full detail")] {
        let node = Node {
            bottom: px(12),
            left: px(16),
            ..default()
        };
        commands.spawn((Label { view, title }, text(view, 20.0, node)));
    }
}

fn update_labels(
    options: Res<ViewOptions>,
    views: Query<&FieldLodViewStats>,
    labels: Query<(&Label, &mut Text, &mut Visibility)>,
) {
    for (label, mut text, mut visibility) in labels {
        visibility.set_if_neq(if options.split {
            Visibility::Inherited
        } else {
            Visibility::Hidden
        });
        let stats = views.get(label.view).copied().unwrap_or_default();
        let drawn = short_count(stats.triangles_drawn);
        text.set_if_neq(Text(format!("{}: {drawn} triangles", label.title)));
    }
}

fn update_panel(
    options: Res<ViewOptions>,
    quality: Res<Quality>,
    progress: Res<FieldLodProgress>,
    diagnostics: Res<DiagnosticsStore>,
    stats: Single<&FieldLodViewStats, With<MainCamera>>,
    mut panel: Single<&mut Text, With<Panel>>,
) {
    let frame_time = diagnostics.get(&FrameTimeDiagnosticsPlugin::FRAME_TIME);
    let frame_ms = frame_time.and_then(Diagnostic::smoothed).unwrap_or(0.0);
    let share = stats.triangles_drawn as f64 / stats.triangles_full.max(1) as f64;
    let numbers = format!(
        "frame        {frame_ms:.1} ms\n\
         triangles    {} of {} ({:.1} %)\n\
         units        {}\n\
         selection    {:.2} ms\n\
         pixel error  {:.2}\n\
         meshes       {} ready, {} waiting\n\
         quality      {}\n\
         {HELP}",
        short_count(stats.triangles_drawn),
        short_count(stats.triangles_full),
        share * 100.0,
        stats.units_drawn,
        stats.selection_time.as_secs_f64() * 1e3,
        options.error_px,
        progress.ready,
        progress.waiting,
        quality.description(),
    );
    panel.set_if_neq(Text(numbers));
}
