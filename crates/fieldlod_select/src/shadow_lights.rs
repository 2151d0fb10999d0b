//! Which things outside a view may throw a shadow into it.

use fieldlod_hierarchy::Sphere;
use glam::{Mat3, Vec3};

use crate::lane::V3;
use crate::sides::Sides;

/// Lights that a view can tell apart; with more of them, all things may cast.
const MOST_LIGHTS: usize = 4;
/// Directions that lead inwards or outwards by less are along a side.
const ALONG: f32 = 1e-3;

/// A light that casts shadows into a view.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ShadowLight {
    /// Its rays all go in one direction, a unit vector in the world.
    Sun(Vec3),
    /// Its rays reach no farther than this sphere.
    Lamp(Sphere),
}

/// The lights of a view.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) enum ShadowLights {
    /// Anything may cast.
    #[default]
    Any,
    These([Option<ShadowLight>; MOST_LIGHTS]),
}

impl ShadowLights {
    pub(crate) fn new(lights: &[ShadowLight]) -> Self {
        if lights.len() > MOST_LIGHTS {
            return Self::Any;
        }
        Self::These(std::array::from_fn(|index| lights.get(index).copied()))
    }

    /// How far lights have moved, and how far they have turned; `None` if they are others.
    pub(crate) fn moved_since(&self, last: &Self) -> Option<(f32, f32)> {
        let (Self::These(now), Self::These(before)) = (self, last) else {
            return (self == last).then_some((0.0, 0.0));
        };
        let mut most = (0.0f32, 0.0f32);
        for pair in now.iter().zip(before) {
            match pair {
                (Some(ShadowLight::Sun(now)), Some(ShadowLight::Sun(before))) => {
                    most.1 = most.1.max(now.distance(*before));
                }
                (Some(ShadowLight::Lamp(now)), Some(ShadowLight::Lamp(before))) => {
                    let moved = now.center.distance(before.center);
                    most.0 = most.0.max(moved + (now.radius - before.radius).abs());
                }
                (None, None) => {}
                _ => return None,
            }
        }
        Some(most)
    }
}

/// The lights of a view and the sides of its image.
pub(crate) struct ShadowTest {
    lights: ShadowLights,
    sides: Sides<f32>,
    has_near_side: bool,
    camera_from_world: Mat3,
}

impl ShadowTest {
    /// The test of an image with these sides, behind whose eye nothing is seen if it `has_near_side`.
    pub(crate) fn new(
        lights: ShadowLights,
        sides: Sides<f32>,
        has_near_side: bool,
        camera_from_world: Mat3,
    ) -> Self {
        Self {
            lights,
            sides,
            has_near_side,
            camera_from_world,
        }
    }

    /// How far a sphere, in the world and in camera space, is from where it might cast a shadow into the
    /// image; not positive where it may. Turns count at `distance` from the eye.
    pub(crate) fn distance_dark(&self, world: &Sphere, camera: &Sphere, distance: f32) -> f32 {
        let ShadowLights::These(lights) = &self.lights else {
            return 0.0;
        };
        let dark = |light: &ShadowLight| match light {
            ShadowLight::Sun(direction) => self.beyond_sides(*direction, camera, distance),
            ShadowLight::Lamp(reach) => {
                let gap = world.center.distance(reach.center) - reach.radius - camera.radius;
                // NaN may cast.
                if gap > 0.0 { gap } else { 0.0 }
            }
        };
        lights
            .iter()
            .flatten()
            .map(dark)
            .fold(f32::INFINITY, f32::min)
    }

    /// The same for a sun: a shadow does not come in over a side that its rays lead away from.
    fn beyond_sides(&self, direction: Vec3, sphere: &Sphere, distance: f32) -> f32 {
        let direction = self.camera_from_world * direction;
        let beyond = |inside: f32, inwards: f32| {
            if inwards < -ALONG {
                (-inside - sphere.radius).min((-inwards - ALONG) * distance)
            } else {
                0.0
            }
        };
        let (center, along) = (V3::splat(sphere.center), V3::splat(direction));
        let sides = self.sides.inside(center).into_iter();
        let sides = sides.zip(self.sides.towards(along));
        let farthest = sides.fold(0.0f32, |most, (inside, inwards)| {
            most.max(beyond(inside, inwards))
        });
        match self.has_near_side {
            true => farthest.max(beyond(sphere.center.z, direction.z)),
            false => farthest,
        }
    }
}
