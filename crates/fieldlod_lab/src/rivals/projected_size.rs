//! The height of the whole object in the picture.
//!
//! ```text
//! size = 2 R s f / d pixels;   a level starts below the size at which its error is the threshold
//! ```
//! Knows zoom, window and scale; not where in the picture the object is, nor that its near parts are
//! nearer than its middle. Sources: Unreal's `ScreenSize`, Unity's `LODGroup`.

use super::{REFERENCE_FOCAL_PX, Seen};

pub(super) fn level(seen: &Seen, threshold_px: f32) -> u32 {
    let diameter = 2.0 * seen.object.radius;
    let size_at_unit_px = diameter * seen.max_scale * seen.eye.focal_px();
    let size_px = if seen.eye.is_orthographic() {
        size_at_unit_px
    } else {
        size_at_unit_px / seen.distance_to_center()
    };
    let starts = |level: &u32| {
        let start = seen.object.range_start(*level, threshold_px);
        size_px <= diameter * REFERENCE_FOCAL_PX / start
    };
    (1..seen.object.level_count()).take_while(starts).count() as u32
}
