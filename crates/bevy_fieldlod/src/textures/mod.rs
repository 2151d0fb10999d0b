//! The mip level that a surface needs (Lin and Lee 2004, §4.1.4), for texture streaming.
//!
//! In: the views and objects of the scene. Out: [`FieldLodTextureDemand`].

use bevy::asset::AssetId;
use bevy::camera::primitives::Aabb;
use bevy::platform::collections::HashMap;
use bevy::prelude::*;
use camera_field::CAMERA_FROM_VIEW;

use crate::api::systems::FieldLodSystems;
use crate::scene::lod_mesh::LodObject;
use crate::scene::lod_scene::{LodScene, largest_scale};
use crate::scene::view_cut::{ViewCut, ViewState};

/// Keeps [`FieldLodTextureDemand`] up to date for all meshes with levels of detail and texture coordinates. It does not
/// stream textures itself.
///
/// ```
/// use bevy::prelude::*;
/// use bevy_fieldlod::FieldLodTextureDemand;
///
/// /// Prints the finest mip level that some view needs.
/// fn stream(demand: Res<FieldLodTextureDemand>, materials: Res<Assets<StandardMaterial>>) {
///     for (id, detail) in &demand.of_standard_materials {
///         let Some(texture) = materials.get(*id).and_then(|m| m.base_color_texture.as_ref()) else {
///             continue;
///         };
///         let level = detail.mip_level(2048.0);
///         println!("{texture:?} needs mip level {level:.1}");
///     }
/// }
/// ```
#[derive(Clone, Copy, Debug, Default)]
pub struct FieldLodTexturePlugin;

/// How finely views sample the texture of a surface. The value is an upper bound over the mesh's bounding sphere. It
/// assumes the mean density of texture coordinates.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TextureDetail {
    /// Pixels per unit of texture coordinates: √(c·n / a). `c·n` is samples per surface area; `a` is texture area per
    /// surface area. Infinite if the camera is inside the sphere.
    pub pixels_per_uv: f32,
}

/// For each material, the finest [`TextureDetail`] of the entities that a view sees.
#[derive(Resource, Clone, Debug, Default, PartialEq)]
pub struct FieldLodTextureDemand {
    /// One entry per [`StandardMaterial`] that a view sees.
    pub of_standard_materials: HashMap<AssetId<StandardMaterial>, TextureDetail>,
}

impl TextureDetail {
    /// The mip level that a texture with `size_px` texels across needs: 0 for full size, 1 for half, and so on.
    /// Negative if the full size is too coarse.
    #[must_use]
    pub fn mip_level(&self, size_px: f32) -> f32 {
        // Assume a surface of area 1 that shows the whole texture once.
        let projection_factor = self.pixels_per_uv * self.pixels_per_uv;
        camera_field::mip_level(projection_factor, size_px * size_px, 0.0)
    }
}

impl Plugin for FieldLodTexturePlugin {
    fn build(&self, app: &mut App) {
        app.init_resource::<FieldLodTextureDemand>()
            .add_systems(PostUpdate, measure_materials.after(FieldLodSystems::Select));
    }
}

/// Finds the finest detail that each material needs.
fn measure_materials(
    views: Query<(&ViewCut, &GlobalTransform)>,
    scene: Res<LodScene>,
    objects: Query<(
        Entity,
        &LodObject,
        &Aabb,
        &GlobalTransform,
        &MeshMaterial3d<StandardMaterial>,
    )>,
    mut demand: ResMut<FieldLodTextureDemand>,
) {
    let mut of_standard_materials: HashMap<_, TextureDetail> = HashMap::default();
    for (entity, object, aabb, transform, material) in &objects {
        // The scale of a skinned object is that of its joint, as selection places it.
        let instance = scene.instance_of(entity);
        let placement = instance.and_then(|instance| scene.scene.placement(instance.id));
        let scale = placement.map_or(1.0, |placement| largest_scale(&placement));
        let of_views = views.iter().filter_map(|(cut, pose)| {
            pixels_per_uv(cut, pose, object.mesh.uv_per_area, scale, aabb, transform)
        });
        if let Some(pixels_per_uv) = of_views.reduce(f32::max) {
            let finest = of_standard_materials
                .entry(material.id())
                .or_insert(TextureDetail { pixels_per_uv });
            finest.pixels_per_uv = finest.pixels_per_uv.max(pixels_per_uv);
        }
    }
    demand.set_if_neq(FieldLodTextureDemand {
        of_standard_materials,
    });
}

/// Pixels per unit of texture coordinates; `None` outside the view or without texture coordinates.
fn pixels_per_uv(
    cut: &ViewCut,
    pose: &GlobalTransform,
    uv_per_area: f32,
    scale: f32,
    aabb: &Aabb,
    transform: &GlobalTransform,
) -> Option<f32> {
    let view = cut.view.filter(|_| cut.state == ViewState::Cut)?;
    let camera = view.camera();
    if uv_per_area <= 0.0 {
        return None;
    }
    let world_from_local = transform.affine();
    let radius = aabb.half_extents.length() * largest_scale(&world_from_local);
    let center_in_world = world_from_local.transform_point3a(aabb.center);
    let center_in_view = pose.affine().inverse().transform_point3a(center_in_world);
    let center = CAMERA_FROM_VIEW * Vec3::from(center_in_view);
    if !camera.touches_sphere(center, radius) {
        return None;
    }
    // Samples per surface area, divided by texture area per surface area, are samples per texture area.
    let strength = camera.strength_over_sphere(center, radius).or_infinity();
    Some((strength * scale * scale / uv_per_area).sqrt())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_texel_per_pixel_is_level_0() {
        let level = |pixels_per_uv, size_px| TextureDetail { pixels_per_uv }.mip_level(size_px);
        assert_eq!(level(1024.0, 1024.0), 0.0);
        assert_eq!(level(512.0, 1024.0), 1.0);
        assert_eq!(level(2048.0, 1024.0), -1.0);
    }
}
