//! Views, settings and median times for the benches.
#![allow(dead_code, reason = "each bench uses its part")]

use std::time::{Duration, Instant};

use camera_field::Camera;
use fieldlod_select::{LodSettings, View};
use glam::{Affine3A, Mat4, Vec2, Vec3};

fn camera(fov_y_in_deg: f32) -> Camera {
    let fov_y = fov_y_in_deg.to_radians();
    let projection = Mat4::perspective_infinite_reverse_rh(fov_y, 16.0 / 9.0, 0.1);
    Camera::from_projection(&projection, Vec2::new(1920.0, 1080.0)).unwrap()
}

/// The threshold with the image error of the baseline at 1 px, by `fieldlod_lab/RECORD.md`.
const ERROR_PX: f32 = 1.37;

pub(crate) fn settings() -> LodSettings {
    LodSettings::with_error_px(ERROR_PX)
}

pub(crate) fn look(eye: Vec3, target: Vec3) -> View {
    look_through(60.0, eye, target)
}

/// [`look`] with another field of view.
pub(crate) fn look_through(fov_y_in_deg: f32, eye: Vec3, target: Vec3) -> View {
    let world_from_view = Mat4::look_at_rh(eye, target, Vec3::Y).inverse();
    View::new(camera(fov_y_in_deg), &Affine3A::from_mat4(world_from_view))
}

/// An orthographic view of `height` world units from top to bottom.
pub(crate) fn look_from_afar(height: f32, eye: Vec3, target: Vec3) -> View {
    let half = Vec2::new(16.0 / 9.0, 1.0) * (0.5 * height);
    let projection = Mat4::orthographic_rh(-half.x, half.x, -half.y, half.y, 1000.0, 0.0);
    let camera = Camera::from_projection(&projection, Vec2::new(1920.0, 1080.0)).unwrap();
    let world_from_view = Mat4::look_at_rh(eye, target, Vec3::Y).inverse();
    View::new(camera, &Affine3A::from_mat4(world_from_view))
}

/// Median times of several functions, run in turns.
pub(crate) fn medians<const N: usize>(
    rounds: usize,
    mut functions: [&mut dyn FnMut(); N],
) -> [Duration; N] {
    let mut times = [const { Vec::new() }; N];
    for _ in 0..rounds {
        for (function, times) in functions.iter_mut().zip(&mut times) {
            let start = Instant::now();
            function();
            times.push(start.elapsed());
        }
    }
    times.map(|mut times| {
        times.sort_unstable();
        times[times.len() / 2]
    })
}
