//! Which views see the shadows of which lights.

use bevy::camera::primitives::{Frustum, Sphere};
use bevy::camera::visibility::RenderLayers;
use bevy::ecs::system::SystemParam;
use bevy::light::{DirectionalLight, PointLight, SpotLight};
use bevy::prelude::*;

use crate::view_cut::layer_bits;

/// All lights, which may cast shadows.
#[derive(SystemParam)]
pub(crate) struct ShadowLights<'w, 's> {
    lights: Query<
        'w,
        's,
        (
            AnyOf<(
                &'static DirectionalLight,
                &'static PointLight,
                &'static SpotLight,
            )>,
            &'static GlobalTransform,
            &'static InheritedVisibility,
            Option<&'static RenderLayers>,
        ),
    >,
}

impl ShadowLights<'_, '_> {
    /// The layers of what casts shadows into a view: all those of the lights that reach it and are on one
    /// of its layers. None of lights that are hidden or cast no shadows.
    pub(crate) fn layers_lit(&self, frustum: &Frustum, view_layers: u64) -> u64 {
        let mut lit = 0;
        for ((directional, point, spot), pose, is_shown, layers) in &self.lights {
            let layers = layer_bits(layers);
            let reaches = |range: f32| {
                let center = pose.translation_vec3a();
                let sphere = Sphere {
                    center,
                    radius: range,
                };
                frustum.intersects_sphere(&sphere, true)
            };
            let casts = directional.is_some_and(|light| light.shadow_maps_enabled)
                || point.is_some_and(|light| light.shadow_maps_enabled && reaches(light.range))
                || spot.is_some_and(|light| light.shadow_maps_enabled && reaches(light.range));
            if casts && is_shown.get() && layers & view_layers != 0 {
                lit |= layers;
            }
        }
        lit
    }
}
