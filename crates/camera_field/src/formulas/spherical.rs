//! The field in spherical coordinates around the optical axis.
//!
//! ```text
//! c          = −C / (ρ² cos³φ) u_ρ                                    (7)
//! curl c     = 3C sin φ / (ρ³ cos⁴φ) u_θ                              (12)
//! grad |c|   = −2C / (ρ³ cos³φ) u_ρ + 3C sin φ / (ρ³ cos⁴φ) u_φ       (14)
//! ```
//!
//! The φ component of the gradient equals the curl: the curl is the change of the strength across
//! the sight rays.
#![expect(
    clippy::disallowed_methods,
    reason = "these functions take angles; selection uses the Cartesian forms"
)]

use super::intrinsics::Intrinsics;
use super::scalar::{Real, Vec3};

/// A point by its distance from the camera and its two angles, in radians.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Spherical {
    /// Distance `ρ` from the centre of projection, in scene units.
    pub rho: Real,
    /// Angle `θ` around the optical axis, from x towards y.
    pub theta: Real,
    /// Angle `φ` off the optical axis.
    pub phi: Real,
}

/// The unit vectors of spherical coordinates at one point; right-handed in the order (ρ, φ, θ).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SphericalBasis {
    /// Away from the camera.
    pub u_rho: Vec3,
    /// Away from the optical axis.
    pub u_phi: Vec3,
    /// Around the optical axis.
    pub u_theta: Vec3,
}

impl Spherical {
    /// Spherical coordinates of a point in camera space.
    pub fn from_cartesian(p: Vec3) -> Self {
        let off_axis = (p.x * p.x + p.y * p.y).sqrt();
        Self {
            rho: p.length(),
            theta: p.y.atan2(p.x),
            phi: off_axis.atan2(p.z),
        }
    }

    /// The point in camera space.
    pub fn to_cartesian(self) -> Vec3 {
        self.basis().u_rho * self.rho
    }

    /// The unit vectors at this point.
    pub fn basis(self) -> SphericalBasis {
        let (sin_phi, cos_phi) = self.phi.sin_cos();
        let (sin_theta, cos_theta) = self.theta.sin_cos();
        SphericalBasis {
            u_rho: Vec3::new(sin_phi * cos_theta, sin_phi * sin_theta, cos_phi),
            u_phi: Vec3::new(cos_phi * cos_theta, cos_phi * sin_theta, -sin_phi),
            u_theta: Vec3::new(-sin_theta, cos_theta, 0.0),
        }
    }
}

impl Intrinsics {
    /// The component of the field along `u_ρ` (eq. 7); negative, as it points to the camera.
    /// Zero outside the field of view.
    pub fn spherical_field(&self, at: Spherical) -> Real {
        let cosine = at.phi.cos();
        self.in_view(at, -1.0 / (at.rho * at.rho * cosine * cosine * cosine))
    }

    /// The component of the curl along `u_θ` (eq. 12).
    pub fn spherical_curl(&self, at: Spherical) -> Real {
        let (sine, cosine) = at.phi.sin_cos();
        let cos_squared = cosine * cosine;
        let rho_cubed = at.rho * at.rho * at.rho;
        self.in_view(at, 3.0 * sine / (rho_cubed * cos_squared * cos_squared))
    }

    /// The components of the gradient of the strength along `u_ρ` and `u_φ` (eq. 14).
    pub fn spherical_gradient(&self, at: Spherical) -> (Real, Real) {
        let along = 2.0 * self.spherical_field(at) / at.rho;
        (along, self.spherical_curl(at))
    }

    fn in_view(&self, at: Spherical, per_constant: Real) -> Real {
        if self.contains(at.to_cartesian()) {
            self.constant_px2() * per_constant
        } else {
            0.0
        }
    }
}
