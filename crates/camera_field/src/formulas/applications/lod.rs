//! Criteria for levels of detail (§4.1.5, §4.2.2).
//!
//! The paper lists these quantities but does not say how to use them. [`coarsest_level`] turns a
//! geometric error into a level. The means of eq. 17 and 18 are in
//! [`SurfaceSamples`](crate::SurfaceSamples).

use super::bounds::SphereBound;
use super::intrinsics::Intrinsics;
use super::scalar::{Real, Vec3};

/// The quantities of the field at one point that a level of detail may depend on.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LodCriteria {
    /// Samples per unit area perpendicular to the sight ray (eq. 5).
    pub strength: Real,
    /// Samples per unit area of the surface (eq. 16); negative if the surface faces away.
    pub projection_factor: Real,
    /// Aspect ratio of the sampling pattern, 1 for a round pattern (§3.4).
    pub aspect_ratio: Real,
    /// `|curl c| / c = 3 tan φ / ρ`: relative change of the strength per unit of length
    /// across the sight ray (eq. 12).
    pub relative_curl: Real,
}

impl Intrinsics {
    /// The criteria of a piece of surface; `None` outside the field of view.
    pub fn lod_criteria(&self, p: Vec3, normal: Vec3) -> Option<LodCriteria> {
        let strength = self.strength(p);
        (strength > 0.0).then(|| LodCriteria {
            strength,
            projection_factor: self.projection_factor(p, normal),
            aspect_ratio: Self::aspect_ratio(p),
            relative_curl: self.curl_magnitude(p) / strength,
        })
    }
}

/// The coarsest level with an error of at most `max_error_px` pixels, or 0, the finest, if there is none.
///
/// `errors` are the geometric errors of the levels in scene units, finest first. `pixel_scale` is a
/// bound over the object, such as [`Intrinsics::pixel_scale_over_sphere`].
pub fn coarsest_level(errors: &[Real], pixel_scale: SphereBound, max_error_px: Real) -> usize {
    let SphereBound::Bounded(scale) = pixel_scale else {
        return 0;
    };
    errors
        .iter()
        .rposition(|error| error * scale <= max_error_px)
        .unwrap_or(0)
}
