//! The layers that objects are drawn on: none while they are hidden or beyond their [`VisibilityRange`].

use bevy::camera::ShadowLodOrigin;
use bevy::camera::primitives::Aabb;
use bevy::camera::visibility::{RenderLayers, VisibilityRange};
use bevy::ecs::query::QueryItem;
use bevy::ecs::system::SystemParam;
use bevy::prelude::*;

use crate::scene::lod_mesh::LodObject;
use crate::scene::view_cut::{ViewCut, layer_bits};

/// The placement of an object, and the components that affect its layers.
pub(super) type Placement = (
    Entity,
    &'static GlobalTransform,
    &'static LodObject,
    &'static InheritedVisibility,
    Option<&'static RenderLayers>,
    Option<(&'static VisibilityRange, Option<&'static Aabb>)>,
);

/// Finds the layers that objects are drawn on.
#[derive(SystemParam)]
pub(super) struct DrawnLayers<'w, 's> {
    cameras: Query<'w, 's, (&'static GlobalTransform, Option<&'static Camera>), Viewpoint>,
}

/// Viewpoints that Bevy measures visibility ranges from.
type Viewpoint = Or<(With<ViewCut>, With<ShadowLodOrigin>)>;

impl DrawnLayers<'_, '_> {
    /// The layers of an object; 0 if it is hidden or out of its visibility range for all cameras.
    pub(super) fn of(&self, object: &QueryItem<Placement>) -> u64 {
        let (_, transform, _, is_shown, layers, range) = object;
        let is_near = range.is_none_or(|(range, aabb)| {
            let center = match aabb.filter(|_| range.use_aabb) {
                Some(aabb) => transform.transform_point(aabb.center.into()),
                None => transform.translation(),
            };
            self.cameras.iter().any(|(pose, camera)| {
                // An entity with `ShadowLodOrigin` need not be a camera.
                let is_active = camera.is_none_or(|camera| camera.is_active);
                is_active && range.is_visible_at_all(pose.translation().distance(center))
            })
        });
        // No view draws an object on no layer.
        if is_shown.get() && is_near {
            layer_bits(*layers)
        } else {
            0
        }
    }
}
