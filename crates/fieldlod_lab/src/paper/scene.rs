//! Scenes of spheres and boxes, and depth images of them by ray casting.
//!
//! World space as in the figures: x right, y down, z away from the reader.

use camera_field::double::PosedCamera;
use glam::{DVec3, dvec2, dvec3};

/// A solid of a scene.
#[derive(Clone, Copy, Debug)]
pub(super) enum Solid {
    Sphere { center: DVec3, radius: f64 },
    Box { min: DVec3, max: DVec3 },
}

/// A scene in which cameras are placed.
#[derive(Clone, Debug)]
pub(super) struct Scene {
    pub(super) solids: Vec<Solid>,
}

/// The place at which a ray meets a scene.
#[derive(Clone, Copy, Debug)]
pub(super) struct RayHit {
    pub(super) position: DVec3,
    pub(super) normal: DVec3,
}

impl Scene {
    /// Columns, boxes and balls on a floor before a wall; cameras stand before it.
    pub(super) fn stage() -> Self {
        let solids = vec![
            box_at(dvec3(0.0, 2.0, 10.0), dvec3(24.0, 0.5, 24.0)),
            box_at(dvec3(0.0, 0.0, 17.0), dvec3(24.0, 9.0, 0.5)),
            block(-5.45, 10.28, [0.93, 3.45, 0.88]),
            block(-3.47, 10.17, [1.31, 0.89, 0.55]),
            ball(0.41, 14.00, 0.51),
            block(5.51, 9.45, [1.19, 0.64, 0.65]),
            ball(-6.09, 10.85, 0.60),
            ball(2.20, 12.04, 0.71),
            block(4.18, 12.77, [1.32, 0.83, 1.18]),
            block(-6.16, 12.07, [0.68, 1.04, 0.62]),
            ball(6.94, 10.83, 0.71),
            block(-6.61, 13.67, [1.19, 3.39, 0.58]),
            ball(3.79, 12.50, 0.42),
            block(-4.41, 8.39, [1.34, 2.53, 0.52]),
            block(-6.27, 12.46, [1.25, 0.66, 0.97]),
            ball(-3.62, 14.62, 0.78),
        ];
        Self { solids }
    }

    /// A ring of solids around a tall one; cameras look in from all sides.
    pub(super) fn plaza() -> Self {
        let solids = vec![
            box_at(dvec3(0.0, 2.0, 0.0), dvec3(30.0, 0.5, 30.0)),
            box_at(DVec3::ZERO, dvec3(1.6, 4.0, 1.6)),
            block(3.60, 0.0, [0.87, 3.46, 1.15]),
            ball(4.21, 2.43, 0.50),
            ball(2.36, 4.09, 0.69),
            block(0.0, 4.56, [1.35, 0.73, 0.80]),
            block(-1.42, 2.46, [0.54, 0.64, 0.87]),
            ball(-4.11, 2.37, 0.93),
            block(-2.52, 0.0, [0.84, 0.97, 1.29]),
            ball(-3.37, -1.95, 0.59),
            block(-1.62, -2.80, [1.07, 2.50, 0.64]),
            block(0.0, -4.08, [0.84, 0.88, 1.04]),
            ball(2.07, -3.59, 0.40),
            ball(2.07, -1.20, 0.82),
        ];
        Self { solids }
    }

    /// Finds the first solid that a ray meets.
    pub(super) fn cast(&self, origin: DVec3, direction: DVec3) -> Option<RayHit> {
        // The nearest of all solids that the ray meets.
        let hits = self.solids.iter().filter_map(|solid| {
            let distance = solid.distance(origin, direction)?;
            Some((distance, solid))
        });
        let (distance, solid) = hits.min_by(|a, b| a.0.total_cmp(&b.0))?;
        let position = origin + direction * distance;
        Some(RayHit {
            position,
            normal: solid.normal(position),
        })
    }

    /// Tells whether a point is at least `margin` away from every solid.
    pub(super) fn is_free(&self, p: DVec3, margin: f64) -> bool {
        self.solids.iter().all(|solid| match *solid {
            Solid::Sphere { center, radius } => p.distance(center) > radius + margin,
            Solid::Box { min, max } => p.distance(p.clamp(min, max)) > margin,
        })
    }

    /// Finds what every pixel of a camera sees, row by row.
    pub(super) fn capture(&self, camera: &PosedCamera) -> Vec<Option<RayHit>> {
        // A ray through the middle of each pixel.
        let image = camera.intrinsics.image_px();
        let first = camera.intrinsics.slope_min * camera.intrinsics.focal_px;
        let (columns, rows) = (image.x.round() as u32, image.y.round() as u32);
        let pixels = (0..rows).flat_map(|row| (0..columns).map(move |column| (column, row)));
        pixels
            .map(|(column, row)| {
                let pixel = first + dvec2(f64::from(column), f64::from(row)) + 0.5;
                let ray = (pixel / camera.intrinsics.focal_px).extend(1.0);
                let direction = camera.pose.world_from_camera * ray;
                self.cast(camera.pose.origin, direction)
            })
            .collect()
    }
}

impl Solid {
    fn distance(&self, origin: DVec3, direction: DVec3) -> Option<f64> {
        match *self {
            Self::Sphere { center, radius } => {
                let offset = origin - center;
                let a = direction.length_squared();
                let b = offset.dot(direction);
                let c = offset.length_squared() - radius * radius;
                let root = (b * b - a * c).sqrt();
                // NaN where the ray misses.
                let distance = (-b - root) / a;
                (distance > 0.0).then_some(distance)
            }
            Self::Box { min, max } => {
                // Where the ray is within all three pairs of faces.
                let one = (min - origin) / direction;
                let other = (max - origin) / direction;
                let enter = one.min(other).max_element();
                let leave = one.max(other).min_element();
                (enter > 0.0 && enter <= leave).then_some(enter)
            }
        }
    }

    fn normal(&self, position: DVec3) -> DVec3 {
        match *self {
            Self::Sphere { center, .. } => (position - center).normalize(),
            Self::Box { min, max } => {
                // The face that is nearest for its distance from the middle.
                let half = (max - min) * 0.5;
                let share = (position - (min + max) * 0.5) / half;
                let face = share.abs().max_element();
                let axis = share
                    .to_array()
                    .map(|s| if s.abs() == face { s.signum() } else { 0.0 });
                DVec3::from(axis).normalize()
            }
        }
    }
}

fn box_at(center: DVec3, size: DVec3) -> Solid {
    Solid::Box {
        min: center - size * 0.5,
        max: center + size * 0.5,
    }
}

/// A ball that lies on the floor, at y = 1.75.
fn ball(x: f64, z: f64, radius: f64) -> Solid {
    Solid::Sphere {
        center: dvec3(x, 1.75 - radius, z),
        radius,
    }
}

/// A column or a low box that stands on the floor.
fn block(x: f64, z: f64, size: [f64; 3]) -> Solid {
    box_at(dvec3(x, 1.75 - 0.5 * size[1], z), size.into())
}
