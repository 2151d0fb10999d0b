//! The image metric FLIP, computed by NVIDIA's implementation.

use nv_flip::{DEFAULT_PIXELS_PER_DEGREE, FlipImageRgb8};

use crate::render::Picture;

/// The mean of FLIP over the picture, from 0 to 1, seen at 67 pixels per degree, as on a desktop screen.
#[must_use]
pub fn flip_mean(reference: &Picture, picture: &Picture) -> f64 {
    let [reference, picture] = [reference, picture].map(|picture| {
        let size = picture.size_px;
        FlipImageRgb8::with_data(size.x, size.y, &picture.to_bytes())
    });
    let errors = nv_flip::flip(reference, picture, DEFAULT_PIXELS_PER_DEGREE).to_vec();
    let sum: f64 = errors.iter().map(|&error| f64::from(error)).sum();
    sum / errors.len().max(1) as f64
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::measure::tests::flat;
    use glam::UVec2;

    /// Black on white is about the largest possible error.
    #[test]
    fn flip_of_black_on_white_is_nearly_one() {
        let [black, white] = [0.0, 255.0].map(|level| flat(UVec2::splat(32), level, 32));
        let error = flip_mean(&black, &white);
        assert!((0.9..=1.0).contains(&error), "{error}");
    }
}
