//! Distance ranges written by hand: one level for the whole object.
//!
//! ```text
//! VisibilityRange   level starts at   d        ≥ range of the level
//! three.js LOD                        d / zoom ≥ range (1 − hysteresis if shown in the last frame)
//! ```
//! `d` is the distance to the middle of the object. Neither knows the field of view, the window or
//! the object's scale; three.js did not know the zoom before pull request 18557. Its hysteresis is
//! a fraction, 0 by default (14565). Sources: `bevy_camera::visibility::VisibilityRange`; three.js
//! `src/objects/LOD.js`.

use super::Seen;

const THREE_HYSTERESIS: f32 = 0.0;

pub(super) fn visibility_range(seen: &Seen, threshold_px: f32) -> u32 {
    level(seen, threshold_px, seen.distance_to_center(), None)
}

pub(super) fn three_lod(seen: &Seen, threshold_px: f32, last_level: Option<u32>) -> u32 {
    let distance = seen.distance_to_center() / seen.eye.zoom;
    level(seen, threshold_px, distance, last_level)
}

fn level(seen: &Seen, threshold_px: f32, distance: f32, last_level: Option<u32>) -> u32 {
    let starts = |level: &u32| {
        let shown = last_level.is_some_and(|last| last == *level);
        let kept = if shown { 1.0 - THREE_HYSTERESIS } else { 1.0 };
        distance >= seen.object.range_start(*level, threshold_px) * kept
    };
    (1..seen.object.level_count()).take_while(starts).count() as u32
}
