//! Numbers and labels on the screen.

use bevy::diagnostic::{Diagnostic, DiagnosticsStore, FrameTimeDiagnosticsPlugin};
use bevy::prelude::*;
use bevy_fieldlod::prelude::*;

use crate::cameras::{FullDetailCamera, MainCamera, ViewOptions};
use crate::flight::Walk;
use crate::quality::Quality;
use crate::report::in_short;

const HELP: &str = "WASD QE fly   right mouse look   wheel zoom   Shift fast   P path\n\
                    L levels   F freeze   +/- pixel error   V split   N night   Esc quit";

/// The panel of numbers.
#[derive(Component)]
struct Panel;

/// The name of one half of the split screen.
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

fn text_style(size_px: f32) -> (TextFont, TextColor, TextShadow) {
    let font = TextFont {
        font_size: FontSize::Px(size_px),
        ..default()
    };
    let shadow = TextShadow {
        offset: Vec2::splat(1.5),
        ..default()
    };
    (font, TextColor(Color::WHITE), shadow)
}

fn spawn_panel(mut commands: Commands, main: Single<Entity, With<MainCamera>>) {
    commands.spawn((
        Panel,
        UiTargetCamera(*main),
        Text::default(),
        text_style(15.0),
        Node {
            position_type: PositionType::Absolute,
            top: px(10),
            left: px(10),
            padding: UiRect::all(px(8)),
            ..default()
        },
        BackgroundColor(Color::srgba(0.0, 0.0, 0.0, 0.45)),
    ));
}

fn spawn_labels(
    mut commands: Commands,
    main: Single<Entity, With<MainCamera>>,
    twin: Single<Entity, With<FullDetailCamera>>,
) {
    for (view, title) in [(*main, "levels of detail"), (*twin, "full detail")] {
        commands.spawn((
            Label { view, title },
            UiTargetCamera(view),
            Text::default(),
            text_style(20.0),
            Node {
                position_type: PositionType::Absolute,
                bottom: px(12),
                left: px(16),
                ..default()
            },
        ));
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
        let drawn = views
            .get(label.view)
            .map_or(0, |stats| stats.triangles_drawn);
        let line = format!("{}: {} triangles", label.title, in_short(drawn));
        text.set_if_neq(Text(line));
    }
}

fn update_panel(
    options: Res<ViewOptions>,
    walk: Res<Walk>,
    debug: Res<FieldLodDebug>,
    quality: Res<Quality>,
    progress: Res<FieldLodProgress>,
    diagnostics: Res<DiagnosticsStore>,
    main: Single<(&FieldLodViewStats, &Projection), With<MainCamera>>,
    mut panel: Single<&mut Text, With<Panel>>,
) {
    let frame_ms = diagnostics
        .get(&FrameTimeDiagnosticsPlugin::FRAME_TIME)
        .and_then(Diagnostic::smoothed)
        .unwrap_or(0.0);
    let (stats, projection) = *main;
    let fov_in_deg = match projection {
        Projection::Perspective(perspective) => perspective.fov.to_degrees(),
        _ => 0.0,
    };
    let share = stats.triangles_drawn as f64 / stats.triangles_full.max(1) as f64;
    let lines = [
        format!("frame        {frame_ms:.1} ms"),
        format!(
            "triangles    {} of {} ({:.1} %)",
            in_short(stats.triangles_drawn),
            in_short(stats.triangles_full),
            share * 100.0
        ),
        format!("units        {}", stats.units_drawn),
        format!(
            "selection    {:.2} ms",
            stats.selection_time.as_secs_f64() * 1e3
        ),
        format!("pixel error  {:.2}", options.error_px),
        format!("view angle   {fov_in_deg:.0} degrees"),
        format!("meshes       {}", progress_line(&progress)),
        quality_line(&quality),
        modes(&walk, &debug),
        HELP.to_owned(),
    ];
    let lines: Vec<_> = lines.into_iter().filter(|line| !line.is_empty()).collect();
    panel.set_if_neq(Text(lines.join("\n")));
}

fn progress_line(progress: &FieldLodProgress) -> String {
    let counts = [
        (progress.ready, "ready"),
        (progress.waiting, "in the making"),
        (progress.plain, "plain"),
    ];
    let parts = counts.into_iter().filter(|(count, _)| *count > 0);
    let parts = parts.map(|(count, what)| format!("{count} {what}"));
    parts.collect::<Vec<_>>().join(", ")
}

/// The line on reduced quality; empty at full quality.
fn quality_line(quality: &Quality) -> String {
    match quality.is_reduced {
        true => format!("quality      {}", quality.description()),
        false => String::new(),
    }
}

fn modes(walk: &Walk, debug: &FieldLodDebug) -> String {
    let modes = [
        (!walk.on_path, "free flight"),
        (debug.color_levels, "level colours"),
        (debug.freeze, "cut frozen"),
    ];
    let on = modes.into_iter().filter(|(on, _)| *on);
    on.map(|(_, name)| name).collect::<Vec<_>>().join(", ")
}
