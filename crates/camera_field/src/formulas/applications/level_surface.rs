//! Surfaces of equal strength (§3.3).
//!
//! ```text
//! C / (ρ² cos³φ) = k    ⇔    ρ = √(C / (k cos³φ))    ⇔    z = √(C / (k cos φ))    (13)
//! ```

use super::intrinsics::Intrinsics;
use super::scalar::{Real, Vec2, Vec3};

/// A surface of equal strength as triangles, for drawing.
#[expect(
    clippy::disallowed_types,
    reason = "only this mesh, which is for drawing, allocates"
)]
#[derive(Clone, Debug, PartialEq)]
pub struct LevelSurfaceMesh {
    /// Points in camera space, row by row.
    pub positions: Vec<Vec3>,
    /// Three indices per triangle. The front faces the camera.
    pub indices: Vec<u32>,
}

impl Intrinsics {
    /// Distance `ρ` at which the strength equals `strength`, at an angle off the axis given by
    /// its cosine (eq. 13).
    #[inline]
    pub fn level_radius(&self, strength: Real, cos_phi: Real) -> Real {
        (self.constant_px2() / (strength * cos_phi * cos_phi * cos_phi)).sqrt()
    }

    /// The point of the level surface on the sight ray with slopes `(x/z, y/z)`.
    #[inline]
    pub fn level_point(&self, strength: Real, slope: Vec2) -> Vec3 {
        let secant = (1.0 + slope.length_squared()).sqrt();
        let depth = (self.constant_px2() * secant / strength).sqrt();
        slope.extend(1.0) * depth
    }

    /// The level surface within the field of view as a grid of `cells × cells` quads.
    /// Allocates: for drawing only.
    ///
    /// # Panics
    /// Panics if `cells` is zero.
    pub fn level_surface_mesh(&self, strength: Real, cells: u16) -> LevelSurfaceMesh {
        assert!(cells > 0, "a level surface needs at least one cell");
        let steps = || (0..=cells).map(|step| Real::from(step) / Real::from(cells));
        let range = self.slope_max - self.slope_min;
        // Each position is on the sight ray of a point of a grid on the image.
        let positions = steps()
            .flat_map(|v| steps().map(move |u| Vec2::new(u, v)))
            .map(|share| self.level_point(strength, self.slope_min + share * range))
            .collect();
        // Each cell of the grid has two triangles.
        let side = u32::from(cells) + 1;
        let indices = (0..u32::from(cells))
            .flat_map(|row| (0..u32::from(cells)).map(move |column| row * side + column))
            .flat_map(|corner| {
                let below = corner + side;
                [corner, below, corner + 1, corner + 1, below, below + 1]
            })
            .collect();
        LevelSurfaceMesh { positions, indices }
    }
}
