//! Finds the instances outside a view that may cast a shadow into it.

use camera_field::Camera;
use fieldlod_hierarchy::Sphere;
use glam::Vec3;

use super::View;
use super::sides::planes_in_camera;
use crate::lanes::bits::LANES;
use crate::lanes::smaller;
use crate::scene::columns::{EightSpheres, sphere_at};

/// Largest number of lights that are tested for each instance. With more lights, every instance counts as a caster.
const MOST_LIGHTS: usize = 4;
/// Sine of the angle below which a direction counts as parallel to a side. The rounding of a few operations is far
/// smaller, and a larger sine only keeps more casters.
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

/// Tests whether spheres may cast shadows into the image of a view.
pub(crate) struct ShadowTest {
    lights: Vec<LightTest>,
}

enum LightTest {
    /// The sides through which the rays of a sun leave the image: inward normals and offsets in camera space. No shadow
    /// enters through these sides.
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

    /// 1 for each of eight spheres in world space that casts no shadow into the image. `seen` bounds them in camera
    /// space.
    #[inline(always)]
    pub(crate) fn dark(&self, spheres: &EightSpheres, seen: &EightSpheres) -> [u8; LANES] {
        let mut dark = [1; LANES];
        for light in &self.lights {
            // Infinite, so that nothing is dark if a sun has no sides.
            let mut inside_by = [f32::INFINITY; LANES];
            match light {
                LightTest::Sun(sides) => {
                    // A sphere outside one of these sides casts no shadow into the image.
                    for (inward, offset) in sides {
                        for (lane, least) in inside_by.iter_mut().enumerate() {
                            let (center, radius) = sphere_at(seen, lane);
                            *least = smaller(center.dot(*inward) + (offset + radius), *least);
                        }
                    }
                }
                LightTest::Lamp(reach) => {
                    for (lane, inside_by) in inside_by.iter_mut().enumerate() {
                        let away = sphere_at(spheres, lane).0 - reach.center;
                        let touching = sphere_at(seen, lane).1 + reach.radius;
                        *inside_by = touching - away.dot(away).sqrt();
                    }
                }
            }
            for (dark, inside_by) in dark.iter_mut().zip(inside_by) {
                *dark &= u8::from(inside_by < 0.0);
            }
        }
        dark
    }
}
