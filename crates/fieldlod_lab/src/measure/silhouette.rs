//! Distance between outlines.

use std::f64::consts::FRAC_PI_4;

use crate::render::{Picture, SUPERSAMPLING};

/// Mean distance between the outlines, in pixels: the area that only one picture covers, divided by the
/// length of the reference's outline. 0 if the reference has no outline.
///
/// The length is the number of texel edges along the outline times π/4, which is right on average over
/// all directions (A. Cauchy, M. Crofton).
#[must_use]
pub fn silhouette_px(reference: &Picture, picture: &Picture) -> f64 {
    let texels_to_px = 1.0 / f64::from(SUPERSAMPLING);
    let pairs = reference.covered.iter().zip(&picture.covered);
    let area = pairs.filter(|(a, b)| a != b).count() as f64 * texels_to_px * texels_to_px;
    let outline = outline_steps(reference) as f64 * FRAC_PI_4 * texels_to_px;
    if outline > 0.0 { area / outline } else { 0.0 }
}

/// The number of texel edges between covered and uncovered texels.
fn outline_steps(picture: &Picture) -> usize {
    let width = (picture.size_px.x * SUPERSAMPLING) as usize;
    let rows = || picture.covered.chunks_exact(width);
    let along = rows().flat_map(|row| row.windows(2));
    let along = along.filter(|pair| pair[0] != pair[1]);
    let below = picture.covered.iter().zip(&picture.covered[width..]);
    along.count() + below.filter(|(a, b)| a != b).count()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::measure::tests::flat;
    use glam::UVec2;

    fn disk(size_px: u32, radius_px: f64) -> Picture {
        let mut picture = flat(UVec2::splat(size_px), 0.0, 0);
        let texels = size_px * SUPERSAMPLING;
        let middle = f64::from(texels) * 0.5;
        let radius = radius_px * f64::from(SUPERSAMPLING);
        for (index, covered) in (0..texels * texels).zip(&mut picture.covered) {
            let from_middle = |at: u32| f64::from(at) + 0.5 - middle;
            let (x, y) = (from_middle(index % texels), from_middle(index / texels));
            *covered = x.hypot(y) < radius;
        }
        picture
    }

    /// The ring between disks of 40 and 42 px is 2 px wide. Its outer edge is a little longer than its inner edge.
    #[test]
    fn distance_of_concentric_disks_is_the_ring_width() {
        let off = silhouette_px(&disk(100, 40.0), &disk(100, 42.0));
        let ring = (42.0f64.powi(2) - 40.0f64.powi(2)) / (2.0 * 40.0);
        assert!((off - ring).abs() < 0.03, "{off} {ring}");
    }

    #[test]
    fn picture_without_outline_has_no_distance() {
        let all = flat(UVec2::splat(8), 0.0, 8);
        assert_eq!(silhouette_px(&all, &flat(UVec2::splat(8), 0.0, 4)), 0.0);
    }
}
