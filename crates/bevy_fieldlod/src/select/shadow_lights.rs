//! The lights that cast shadows into a view.

use bevy::camera::primitives::{self, Frustum};
use bevy::camera::visibility::RenderLayers;
use bevy::ecs::system::SystemParam;
use bevy::light::{DirectionalLight, PointLight, SpotLight};
use bevy::prelude::*;
use fieldlod_hierarchy::Sphere;
use fieldlod_select::ShadowLight;

use crate::scene::view_cut::layer_bits;

/// All lights.
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

/// The lights of a view.
#[derive(Default)]
pub(crate) struct LitBy {
    /// The layers of objects that cast shadows into it.
    pub(crate) layers: u64,
    pub(crate) lights: Vec<ShadowLight>,
}

impl ShadowLights<'_, '_> {
    /// The visible lights with shadows that reach a view and share a layer with it, and all layers of these lights.
    pub(crate) fn lit_by(&self, frustum: &Frustum, view_layers: u64) -> LitBy {
        let mut lit = LitBy::default();
        for ((directional, point, spot), pose, is_shown, layers) in &self.lights {
            let layers = layer_bits(layers);
            if !is_shown.get() || layers & view_layers == 0 {
                continue;
            }
            let sun = directional.filter(|light| light.shadow_maps_enabled);
            let point = point.filter(|light| light.shadow_maps_enabled);
            let spot = spot.filter(|light| light.shadow_maps_enabled);
            let ranges = [
                point.map(|light| light.range),
                spot.map(|light| light.range),
            ];
            let center = pose.translation();
            let reaches = |radius: &f32| {
                let center = center.into();
                frustum.intersects_sphere(
                    &primitives::Sphere {
                        center,
                        radius: *radius,
                    },
                    // With the far plane, like Bevy when it assigns lights to views.
                    true,
                )
            };
            let lamps = ranges.into_iter().flatten().filter(reaches);
            let lamps = lamps.map(|radius| ShadowLight::Lamp(Sphere { center, radius }));
            let sun = sun.map(|_| ShadowLight::Sun(pose.forward().as_vec3()));
            let before = lit.lights.len();
            lit.lights.extend(sun.into_iter().chain(lamps));
            if lit.lights.len() > before {
                lit.layers |= layers;
            }
        }
        lit
    }
}
