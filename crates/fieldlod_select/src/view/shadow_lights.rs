//! Finds the instances outside a view that may cast a shadow into it.

use camera_field::Camera;
use fieldlod_hierarchy::Sphere;
use glam::Vec3;

use super::View;
use super::sides::planes_in_camera;
use crate::lanes::{Lane, V3};

/// Largest number of lights of a view. With more lights, any instance may cast a shadow. Each light is tested for each
/// instance outside the view.
const MOST_LIGHTS: usize = 4;
/// Sine of the angle below which a direction is along a side. The rounding of a few operations is far smaller, and a
/// larger sine only keeps more casters.
const ALONG: f32 = 1e-3;

/// A light that casts shadows into a view.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ShadowLight {
    /// A light whose rays all go in one direction, a unit vector in the world.
    Sun(Vec3),
    /// A light whose rays end within this sphere.
    Lamp(Sphere),
}

/// The lights of a view.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) enum ShadowLights {
    /// Any instance may cast a shadow.
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
}

/// The lights of a view and the sides of its image.
pub(crate) struct ShadowTest {
    lights: Vec<LightTest>,
}

enum LightTest {
    /// The sides of the image over which the rays of a sun leave it, each a plane of camera space with its offset. No
    /// shadow enters over them.
    Sun(Vec<(Vec3, f32)>),
    Lamp(Sphere),
}

impl ShadowTest {
    /// `None` if any instance may cast a shadow.
    pub(crate) fn new(view: &View) -> Option<Self> {
        let ShadowLights::These(lights) = &view.shadow_lights else {
            return None;
        };
        let mut sides = planes_in_camera(&view.image_camera).to_vec();
        // No surface behind the eye is visible.
        if matches!(view.image_camera, Camera::Perspective(_)) {
            sides.push((Vec3::Z, 0.0));
        }
        let test = |light: &ShadowLight| match light {
            ShadowLight::Sun(direction) => {
                let along = view.camera_from_world * *direction;
                let leads_out = |(inward, _): &&(Vec3, f32)| along.dot(*inward) < -ALONG;
                LightTest::Sun(sides.iter().filter(leads_out).copied().collect())
            }
            ShadowLight::Lamp(reach) => LightTest::Lamp(*reach),
        };
        Some(Self {
            lights: lights.iter().flatten().map(test).collect(),
        })
    }

    /// Which spheres cast no shadow of any light into the image.
    #[inline(always)]
    pub(crate) fn is_dark<L: Lane>(&self, world: V3<L>, seen: V3<L>, radius: L) -> L::Mask {
        let all = L::zero().is_at_most(L::zero());
        self.lights.iter().fold(all, |dark, light| {
            dark & match light {
                LightTest::Sun(sides) => sides.iter().fold(!all, |dark, &(inward, offset)| {
                    let inside_by = seen.dot(V3::splat(inward)) + (L::splat(offset) + radius);
                    dark | inside_by.is_below(L::zero())
                }),
                LightTest::Lamp(reach) => {
                    let away = world.minus(V3::splat(reach.center));
                    let least = radius + L::splat(reach.radius);
                    least.is_below(away.dot(away).sqrt())
                }
            }
        })
    }
}
