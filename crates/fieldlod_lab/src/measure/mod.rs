//! Differences of a picture from a reference.

mod flip;
mod silhouette;

use serde::Serialize;

use crate::render::Picture;

pub use flip::flip_mean;
pub use silhouette::silhouette_px;

/// Differences of a picture from the reference.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct ImageError {
    /// Root mean squared difference of the colour channels, on a scale of 255, over the pixels that show a
    /// surface in either picture.
    pub rmse: f64,
    /// Mean distance between the outlines, in pixels; see [`silhouette_px`].
    pub silhouette_px: f64,
    /// Sum of FLIP (P. Andersson et al., "FLIP: A Difference Evaluator for Alternating Images", HPG
    /// 2020) over the picture, divided by the number of these pixels, if requested. FLIP also spreads to pixels around.
    pub flip: Option<f64>,
}

/// Compares a picture with the reference. FLIP takes most of the time, so it is optional.
///
/// # Panics
/// If their sizes differ.
#[must_use]
pub fn image_error(reference: &Picture, picture: &Picture, with_flip: bool) -> ImageError {
    assert_eq!(reference.size_px, picture.size_px, "pictures of one size");
    // Only pixels that show a surface count. Otherwise the error would depend on the size of the background.
    let shown = shown_in_either(reference, picture);
    let pixels = shown.iter().filter(|&&shown| shown).count().max(1) as f64;
    let pairs = reference.colors.iter().zip(&picture.colors).zip(&shown);
    let squares = pairs.filter(|(_, shown)| **shown).map(|((a, b), _)| {
        let differences = [a[0] - b[0], a[1] - b[1], a[2] - b[2]];
        differences.iter().map(|d| f64::from(d * d)).sum::<f64>()
    });
    ImageError {
        rmse: (squares.sum::<f64>() / (3.0 * pixels)).sqrt(),
        silhouette_px: silhouette_px(reference, picture),
        // FLIP is a mean over the whole picture. Scaled, it does not depend on the size of the background.
        flip: with_flip.then(|| flip_mean(reference, picture) * shown.len() as f64 / pixels),
    }
}

/// The greatest of some values, at least 0.
///
/// # Panics
/// If a value is NaN. [`f64::max`] ignores NaN.
pub(crate) fn greatest(values: impl Iterator<Item = f64>) -> f64 {
    let values = values.inspect(|value| assert!(!value.is_nan(), "a measured value is NaN"));
    values.fold(0.0, f64::max)
}

/// The geometric mean of the positive values. `None` without any.
///
/// # Panics
/// If a value is NaN.
pub(crate) fn geometric_mean(values: impl Iterator<Item = f64>) -> Option<f64> {
    let values = values.inspect(|value| assert!(!value.is_nan(), "a measured value is NaN"));
    let logs: Vec<f64> = values.filter(|v| *v > 0.0).map(f64::ln).collect();
    (!logs.is_empty()).then(|| (logs.iter().sum::<f64>() / logs.len() as f64).exp())
}

/// For each pixel, whether it has a covered texel in `a` or in `b`.
fn shown_in_either(a: &Picture, b: &Picture) -> Vec<bool> {
    use crate::render::SUPERSAMPLING as N;
    let width = a.size_px.x * N;
    let shows = |picture: &Picture, x: u32, y: u32| {
        (0..N).any(|dy| {
            (0..N).any(|dx| picture.covered[((y * N + dy) * width + x * N + dx) as usize])
        })
    };
    let pixels = (0..a.size_px.y).flat_map(|y| (0..a.size_px.x).map(move |x| (x, y)));
    pixels
        .map(|(x, y)| shows(a, x, y) || shows(b, x, y))
        .collect()
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;
    use crate::render::SUPERSAMPLING;
    use glam::UVec2;

    /// A picture of one level, in which the first `covered_columns` of pixels show a surface.
    pub(crate) fn flat(size_px: UVec2, level: f32, covered_columns: u32) -> Picture {
        let texels = size_px * SUPERSAMPLING;
        let column = |index: u32| index % texels.x / SUPERSAMPLING;
        Picture {
            size_px,
            colors: vec![[level; 3]; (size_px.x * size_px.y) as usize],
            covered: (0..texels.x * texels.y)
                .map(|index| column(index) < covered_columns)
                .collect(),
        }
    }

    #[test]
    fn equal_pictures_have_no_error() {
        let picture = flat(UVec2::new(16, 8), 90.0, 5);
        assert_eq!(
            image_error(&picture, &picture, false),
            ImageError::default()
        );
        assert_eq!(image_error(&picture, &picture, true).flip, Some(0.0));
    }

    /// A step of 10 levels on a quarter of the shown pixels: √(100/4) = 5.
    #[test]
    fn known_step_gives_known_rmse() {
        let size = UVec2::new(16, 8);
        let reference = flat(size, 90.0, 8);
        let mut picture = reference.clone();
        for y in 0..8 {
            for x in 0..2 {
                picture.colors[y * 16 + x] = [100.0; 3];
            }
        }
        let error = image_error(&reference, &picture, true);
        assert!((error.rmse - 5.0).abs() < 1e-9, "{error:?}");
        assert_eq!(error.silhouette_px, 0.0);
        let flip = error.flip.unwrap();
        assert!(flip > 0.0 && flip < 0.25, "{error:?}");
    }
}
