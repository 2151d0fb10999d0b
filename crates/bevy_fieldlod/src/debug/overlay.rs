//! The statistics of all cameras, as text.

use bevy::prelude::*;

use super::FieldLodDebug;
use crate::api::stats::{FieldLodProgress, FieldLodViewStats};

/// The text of [`FieldLodDebug::overlay`].
#[derive(Component)]
pub(super) struct Overlay;

/// Spawns, updates or despawns the text.
pub(super) fn update_overlay(
    mut commands: Commands,
    debug: Res<FieldLodDebug>,
    mut overlays: Query<(Entity, &mut Text), With<Overlay>>,
    views: Query<(&Camera, &FieldLodViewStats)>,
    progress: Res<FieldLodProgress>,
) {
    if !debug.overlay {
        for (overlay, _) in &overlays {
            commands.entity(overlay).despawn();
        }
        return;
    }
    let text = text(&views, &progress);
    if let Ok((_, mut shown)) = overlays.single_mut() {
        shown.set_if_neq(Text(text));
    } else {
        let node = Node {
            position_type: PositionType::Absolute,
            left: px(8.0),
            top: px(8.0),
            ..default()
        };
        commands.spawn((Overlay, Text(text), TextFont::from_font_size(14.0), node));
    }
}

fn text(views: &Query<(&Camera, &FieldLodViewStats)>, progress: &FieldLodProgress) -> String {
    let mut text = format!(
        "{} ready, {} plain, {} waiting",
        progress.ready, progress.plain, progress.waiting
    );
    for (_, stats) in views.iter().filter(|(camera, _)| camera.is_active) {
        text += &format!(
            "\n{} of {} triangles in {} meshes at {:.2} px, selected in {:.2} ms",
            stats.triangles_drawn,
            stats.triangles_full,
            stats.units_drawn,
            stats.error_px,
            stats.selection_time.as_secs_f64() * 1e3,
        );
        if stats.missing_pieces > 0 {
            text += &format!(
                "\n{} pieces are not in memory; errors up to {:.1} px",
                stats.missing_pieces, stats.missing_px
            );
        }
    }
    text
}
