//! Level of detail (§4.1.5, §4.2.2).
//!
//! The paper lists the strength, the projection factor, the aspect ratio and the curl as criteria,
//! but does not say how to use them. [`coarsest_level`] turns a geometric error into a level.

use super::bounds::SphereBound;
use super::scalar::Real;

/// The coarsest level with an error of at most `max_error_px` pixels, or 0, the finest, if there is none.
///
/// `errors` are the geometric errors of the levels in scene units, finest first. `pixel_scale` is a
/// bound over the object, such as
/// [`Intrinsics::pixel_scale_over_sphere`](crate::Intrinsics::pixel_scale_over_sphere).
pub fn coarsest_level(errors: &[Real], pixel_scale: SphereBound, max_error_px: Real) -> usize {
    let SphereBound::Bounded(scale) = pixel_scale else {
        return 0;
    };
    // From the coarsest level, so that errors need not be sorted.
    errors
        .iter()
        .rposition(|error| error * scale <= max_error_px)
        .unwrap_or(0)
}
