//! Mean and deviation of the sampling density on a surface (§4.2.1).
//!
//! ```text
//! μ = ∫ c · da / ∫ da                             (17)
//! σ = √( ∫ (c · n − μ)² da / ∫ da )               (18)
//! ```
//!
//! The paper integrates numerically. On triangles, both have a closed form, with `w = 1/z` at the
//! corners and `h₃` the sum of all products of three of them:
//!
//! ```text
//! ∫ (c · n)² da = C² (n · P)² ∫ z⁻⁶ da = C² (n · P)² · area/10 · w₀ w₁ w₂ h₃(w₀, w₁, w₂)
//! ```
//!
//! This is the Hermite–Genocchi formula for the second divided difference of `z⁻⁴/20`.
//!
//! The paper calls them mean and deviation of flux. They are those of flux *density*, in samples per
//! unit area.

use super::intrinsics::Intrinsics;
use super::scalar::{Real, Vec3};

/// Flux and its square, summed over the surface that a camera sees.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct SurfaceSamples {
    /// `∫ c · da`: samples that fall on the surface, in square pixels.
    pub flux_px2: Real,
    /// `∫ (c · n)² da`.
    pub squared_density: Real,
    /// Area of the surface inside the field of view, in square scene units.
    pub area: Real,
}

impl SurfaceSamples {
    /// Adds a visible triangle in camera space. Triangles that face away and parts outside
    /// the field of view add nothing. Callers must leave out hidden triangles.
    pub fn add_triangle(&mut self, camera: &Intrinsics, triangle: [Vec3; 3]) {
        for part in camera.clip_triangle(triangle).fan() {
            self.add_triangle_in_view(camera, part);
        }
    }

    fn add_triangle_in_view(&mut self, camera: &Intrinsics, triangle: [Vec3; 3]) {
        let [p0, p1, p2] = triangle;
        let flux_px2 = camera.flux_through_triangle_in_view(triangle);
        let area = 0.5 * (p1 - p0).cross(p2 - p0).length();
        if !(flux_px2 > 0.0 && area > 0.0) {
            return;
        }
        // The mean of (c · n)² over the triangle is `mean_square` times the square of its flux density.
        let inverse_depths = Vec3::new(1.0 / p0.z, 1.0 / p1.z, 1.0 / p2.z);
        let product = inverse_depths.x * inverse_depths.y * inverse_depths.z;
        // Φ = −C (n · P) area w₀w₁w₂, so Φ² / (area w₀w₁w₂) replaces C² (n · P)² area w₀w₁w₂.
        let mean_square = products_of_three(inverse_depths) / (10.0 * product);
        self.flux_px2 += flux_px2;
        self.squared_density += flux_px2 * (flux_px2 / area) * mean_square;
        self.area += area;
    }

    /// Mean sampling density `μ` over the visible surface (eq. 17); zero where nothing is visible.
    pub fn mean(&self) -> Real {
        if self.area > 0.0 {
            self.flux_px2 / self.area
        } else {
            0.0
        }
    }

    /// Standard deviation `σ` of the sampling density (eq. 18).
    pub fn deviation(&self) -> Real {
        let mean = self.mean();
        if self.area > 0.0 {
            // Rounding can make the variance of an even density negative.
            let variance = self.squared_density / self.area - mean * mean;
            variance.max(0.0).sqrt()
        } else {
            0.0
        }
    }

    /// The same samples over the whole surface of the given area. Unseen parts have density zero.
    ///
    /// Equations 17 and 18 divide by the *visible* area. A camera close to a small piece then beats a
    /// camera that sees the whole surface. Statistics over the whole surface make placements
    /// comparable.
    #[must_use]
    pub fn over_whole_surface(self, area: Real) -> Self {
        Self { area, ..self }
    }
}

/// The index of the placement with the highest `μ − σ`; the first of equal ones.
///
/// The paper prefers a high mean and a low deviation but gives no weights. Their difference is our
/// choice: most of the surface exceeds this density.
pub fn best_placement(placements: &[SurfaceSamples]) -> Option<usize> {
    let score = |samples: &SurfaceSamples| samples.mean() - samples.deviation();
    let mut best: Option<(usize, Real)> = None;
    for (index, placement) in placements.iter().enumerate() {
        let candidate = score(placement);
        if best.is_none_or(|(_, highest)| candidate > highest) {
            best = Some((index, candidate));
        }
    }
    best.map(|(index, _)| index)
}

/// `h₃`: the sum of all ten products of three factors from three numbers, with repetition.
fn products_of_three(w: Vec3) -> Real {
    let of_one = w.x * w.x * w.x;
    let of_two = of_one + w.y * (w.x * w.x + w.y * (w.x + w.y));
    let pairs = w.x * w.x + w.y * w.y + w.z * w.z + w.x * w.y + w.y * w.z + w.z * w.x;
    of_two + w.z * pairs
}
