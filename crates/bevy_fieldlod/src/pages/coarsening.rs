//! Adjusts the selection of views to the pages that fit into memory.

use bevy::prelude::*;
use fieldlod_select::LodSettings;

use super::streams::PageStreams;
use crate::api::settings::FieldLodCamera;
use crate::scene::view_cut::ViewCut;

/// Scales the thresholds of all views by the coarsening of the residency. Objects outside the image keep the detail of
/// casters, also without lights; otherwise a turning camera would find only their coarsest level.
pub(super) fn adjust_views(
    streams: Res<PageStreams>,
    mut views: Query<(Option<&FieldLodCamera>, &mut ViewCut)>,
) {
    let coarsening = streams.coarsening();
    for (settings, mut cut) in &mut views {
        if let Some((view, wanted)) = &mut cut.wanted {
            let settings = settings.copied().unwrap_or_default();
            *view = view.with_any_shadow_light();
            *wanted = LodSettings {
                error_px: wanted.error_px.map(|px| px * coarsening),
                displacement_px: wanted.displacement_px.map(|px| px * coarsening),
                advanced: settings.to_lod_settings(true).advanced,
                ..*wanted
            };
        }
    }
}
