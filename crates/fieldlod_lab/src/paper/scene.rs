//! Scenes of spheres and boxes, and depth images of them by ray casting.
//!
//! World space as in the figures: x right, y down, z away from the reader.

use camera_field::double::PosedCamera;
use fieldlod_hierarchy::fixtures::Random;
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

/// Where a ray meets a scene.
#[derive(Clone, Copy, Debug)]
pub(super) struct RayHit {
    pub(super) position: DVec3,
    pub(super) normal: DVec3,
}

impl Scene {
    /// Columns, boxes and balls on a floor before a wall; cameras stand before it.
    pub(super) fn stage() -> Self {
        let mut random = Random::new(181);
        let mut solids = vec![
            box_at(dvec3(0.0, 2.0, 10.0), dvec3(24.0, 0.5, 24.0)),
            box_at(dvec3(0.0, 0.0, 17.0), dvec3(24.0, 9.0, 0.5)),
        ];
        for _ in 0..14 {
            let at = dvec3(
                between(&mut random, -8.0, 8.0),
                0.0,
                between(&mut random, 8.0, 15.0),
            );
            solids.push(some_solid(&mut random, at));
        }
        Self { solids }
    }

    /// A ring of solids around a tall one; cameras look in from all sides.
    pub(super) fn plaza() -> Self {
        let mut random = Random::new(182);
        let mut solids = vec![
            box_at(dvec3(0.0, 2.0, 0.0), dvec3(30.0, 0.5, 30.0)),
            box_at(DVec3::ZERO, dvec3(1.6, 4.0, 1.6)),
        ];
        for step in 0..12 {
            let turn = f64::from(step) / 12.0 * core::f64::consts::TAU;
            let radius = between(&mut random, 2.2, 5.0);
            let at = dvec3(turn.cos() * radius, 0.0, turn.sin() * radius);
            solids.push(some_solid(&mut random, at));
        }
        Self { solids }
    }

    /// The first solid that a ray meets.
    pub(super) fn cast(&self, origin: DVec3, direction: DVec3) -> Option<RayHit> {
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

    /// Whether a point is at least `margin` away from every solid.
    pub(super) fn is_free(&self, p: DVec3, margin: f64) -> bool {
        self.solids.iter().all(|solid| match *solid {
            Solid::Sphere { center, radius } => p.distance(center) > radius + margin,
            Solid::Box { min, max } => p.distance(p.clamp(min, max)) > margin,
        })
    }

    /// What every pixel of a camera sees, row by row.
    pub(super) fn capture(&self, camera: &PosedCamera) -> Vec<Option<RayHit>> {
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

/// A random number between two.
pub(super) fn between(random: &mut Random, least: f64, greatest: f64) -> f64 {
    least + (greatest - least) * f64::from(random.unit())
}

/// A ball, a column or a low box that stands on the floor at y = 1.75.
fn some_solid(random: &mut Random, at: DVec3) -> Solid {
    let kind = f64::from(random.unit());
    if kind < 0.4 {
        let radius = between(random, 0.4, 1.0);
        Solid::Sphere {
            center: dvec3(at.x, 1.75 - radius, at.z),
            radius,
        }
    } else {
        let height = if kind < 0.7 {
            between(random, 2.5, 3.5)
        } else {
            between(random, 0.6, 1.4)
        };
        let size = dvec3(between(random, 0.5, 1.4), height, between(random, 0.5, 1.4));
        box_at(dvec3(at.x, 1.75 - 0.5 * height, at.z), size)
    }
}
