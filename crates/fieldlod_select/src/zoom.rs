//! How much the lenses of two views differ: a bound of what that changes in every test.
//!
//! For `z` in all an orthographic view's sides move by at most `E (exp(z) − 1)`, with `E` its
//! [reach](Sides::reach) before: each step moves them by at most `z E`, and `E` grows by no more.

use camera_field::{Camera, Intrinsics, OrthographicIntrinsics};

use crate::sides::Sides;
use crate::view::View;

/// The most by which lenses may differ to be compared; so that `exp(z) ≤ 1 +` [`GROWTH`] `z`.
pub(crate) const MOST_ZOOM: f32 = 0.5;
pub(crate) const GROWTH: f32 = 1.3;
/// What rounding may take off a ratio.
const ROUNDING: f32 = 0.9999;

/// A number `z` such that the factors of errors, the focal lengths and the secants of two views differ by no
/// more than `exp(z)`, and the unit normals of their sides by no more than `z`; of orthographic views those factors and,
/// by no more than `z` times the lesser reach, the sides. Such numbers add up from view to view. `None` where they cannot be
/// compared.
pub(crate) fn zoom_between(from: &View, to: &View) -> Option<f32> {
    let cameras = |view: &View| [view.camera, view.kept_camera, view.image_camera];
    let mut most = 0.0;
    for (from, to) in cameras(from).iter().zip(&cameras(to)) {
        if from == to {
            continue;
        }
        let sides = [from, to].map(Sides::of);
        let change = match (from, to) {
            (Camera::Perspective(from), Camera::Perspective(to)) => {
                largest_ratio(factors(from), factors(to), sides[0].turned_to(&sides[1]))
            }
            (Camera::Orthographic(from), Camera::Orthographic(to)) => {
                let reach = sides[0].reach().min(sides[1].reach());
                let moved = sides[0].moved_to(&sides[1]).map(|moved| moved / reach);
                largest_ratio(scales(from), scales(to), moved)
            }
            _ => return None,
        };
        most = change?.max(most);
    }
    Some(most)
}

/// The zoom in which a number that may grow by the factors of [`zoom_between`] grows no more than `ratio` times.
pub(crate) fn zoom_to(ratio: f32) -> f32 {
    (ratio * ROUNDING - 1.0) / GROWTH
}

/// The largest of what numbers change by, relative, and of other changes; `None` if that is too large.
fn largest_ratio<const N: usize>(from: [f32; N], to: [f32; N], others: [f32; 4]) -> Option<f32> {
    let ratios = from.into_iter().zip(to);
    let changes = ratios.map(|(from, to)| (from / to).max(to / from) - 1.0);
    changes.chain(others).try_fold(0.0f32, |most, change| {
        (change <= MOST_ZOOM).then(|| change.max(most))
    })
}

/// What lenses without perspective count by.
fn scales(lens: &OrthographicIntrinsics) -> [f32; 2] {
    lens.pixels_per_unit.to_array()
}

/// What lenses count by.
fn factors(lens: &Intrinsics) -> [f32; 5] {
    let secant = lens.max_secant();
    let strength = lens.constant_px2() * secant * secant * secant;
    let focal_px = lens.focal_px.max_element();
    [
        lens.focal_px.x,
        lens.focal_px.y,
        secant,
        strength.sqrt(),
        focal_px * secant * secant,
    ]
}

#[cfg(test)]
mod tests {
    use glam::{Affine3A, Mat4, Vec2};

    use super::*;

    fn view(fov_y: f32, size_px: Vec2) -> View {
        let projection = Mat4::perspective_infinite_reverse_rh(fov_y, size_px.x / size_px.y, 0.1);
        let camera = Camera::from_projection(&projection, size_px).unwrap();
        View::new(camera, &Affine3A::IDENTITY)
    }

    #[test]
    fn lenses_differ_by_how_much_they_zoom() {
        let wide = view(1.0, Vec2::new(1920.0, 1080.0));
        assert_eq!(zoom_between(&wide, &wide), Some(0.0));
        let longer = zoom_between(&wide, &view(0.99, Vec2::new(1920.0, 1080.0))).unwrap();
        assert!((0.01..0.02).contains(&longer), "{longer}");
        let larger = zoom_between(&wide, &view(1.0, Vec2::new(1930.0, 1080.0))).unwrap();
        assert!((0.001..0.01).contains(&larger), "{larger}");
        assert_eq!(
            zoom_between(&wide, &view(0.3, Vec2::new(1920.0, 1080.0))),
            None
        );
        let nowhere = view(1.0, Vec2::splat(f32::MIN_POSITIVE));
        assert_eq!(zoom_between(&wide, &nowhere), None);
    }
}
