//! The texture side of the field: which mip level a surface needs (§4.1.4 of the paper), for whoever
//! streams textures.

use bevy::asset::AssetId;
use bevy::platform::collections::HashMap;
use bevy::prelude::*;
use camera_field::CAMERA_FROM_VIEW;

use crate::api::systems::FieldLodSystems;
use crate::scene::lod_mesh::{LodMesh, LodObject};
use crate::scene::view_cut::{ViewCut, ViewState};

/// Keeps [`TextureDetail`] and [`FieldLodTextureDemand`] up to date for all meshes with levels of detail that
/// have texture coordinates. Nothing streams textures by it: read them where you do.
///
/// ```
/// use bevy::prelude::*;
/// use bevy_fieldlod::FieldLodTextureDemand;
///
/// /// Asks for the finest mip level that some view needs.
/// fn stream(demand: Res<FieldLodTextureDemand>, materials: Res<Assets<StandardMaterial>>) {
///     for (id, detail) in &demand.of_standard_materials {
///         let Some(texture) = materials.get(*id).and_then(|m| m.base_color_texture.as_ref()) else {
///             continue;
///         };
///         let level = detail.mip_level(2048.0);
///         println!("{texture:?} is wanted from level {level:.1} on");
///     }
/// }
/// ```
#[derive(Clone, Copy, Debug, Default)]
pub struct FieldLodTexturePlugin;

/// How finely some view samples the texture of a surface. Mesh entities with levels of detail have it as
/// long as a view sees them. It is a bound over the sphere around the mesh, with the mean density of its
/// texture coordinates.
#[derive(Component, Clone, Copy, Debug, PartialEq, Reflect)]
#[reflect(Component, Clone, PartialEq)]
pub struct TextureDetail {
    /// Pixels across a unit of texture coordinates: the root of `c·n` by the density of the texture
    /// coordinates. Infinite where the camera stands within the sphere.
    pub pixels_per_uv: f32,
}

/// The finest [`TextureDetail`] of all entities that share a material.
#[derive(Resource, Clone, Debug, Default, PartialEq)]
pub struct FieldLodTextureDemand {
    /// That of each [`StandardMaterial`] that some view sees.
    pub of_standard_materials: HashMap<AssetId<StandardMaterial>, TextureDetail>,
}

impl TextureDetail {
    /// The mip level that is needed of a texture with `size_px` texels across: 0 for all of it, 1 for
    /// half, and so on. Negative where even all of it is too coarse.
    #[must_use]
    pub fn mip_level(&self, size_px: f32) -> f32 {
        // One unit of area with the texture once on it.
        let projection_factor = self.pixels_per_uv * self.pixels_per_uv;
        camera_field::mip_level(projection_factor, size_px * size_px, 0.0)
    }
}

impl Plugin for FieldLodTexturePlugin {
    fn build(&self, app: &mut App) {
        app.init_resource::<FieldLodTextureDemand>().add_systems(
            PostUpdate,
            (measure_objects, gather_materials)
                .chain()
                .after(FieldLodSystems::Select),
        );
    }
}

/// Measures how finely each object is seen.
fn measure_objects(
    mut commands: Commands,
    views: Query<(&ViewCut, &GlobalTransform)>,
    mut objects: Query<(
        Entity,
        &LodObject,
        &GlobalTransform,
        Option<&mut TextureDetail>,
    )>,
    former_objects: Query<Entity, (With<TextureDetail>, Without<LodObject>)>,
) {
    for (entity, object, transform, detail) in &mut objects {
        // The view that sees it finest counts.
        let pixels_per_uv = views
            .iter()
            .filter_map(|(cut, pose)| pixels_per_uv(cut, pose, &object.mesh, transform))
            .reduce(f32::max);
        let measured = pixels_per_uv.map(|pixels_per_uv| TextureDetail { pixels_per_uv });
        // The component comes and goes with the views that see the object.
        match (measured, detail) {
            (Some(measured), Some(mut detail)) => {
                detail.set_if_neq(measured);
            }
            (Some(measured), None) => {
                commands.entity(entity).try_insert(measured);
            }
            (None, Some(_)) => {
                commands.entity(entity).try_remove::<TextureDetail>();
            }
            (None, None) => {}
        }
    }
    // It goes with the levels of detail, too.
    for entity in &former_objects {
        commands.entity(entity).try_remove::<TextureDetail>();
    }
}

/// Pixels across a unit of texture coordinates; `None` outside the view and without texture coordinates.
fn pixels_per_uv(
    cut: &ViewCut,
    pose: &GlobalTransform,
    mesh: &LodMesh,
    transform: &GlobalTransform,
) -> Option<f32> {
    let view = cut.view.filter(|_| cut.state == ViewState::Cut)?;
    let camera = view.camera();
    let aabb = mesh.aabb.filter(|_| mesh.uv_per_area > 0.0)?;
    // The sphere around the mesh, as the camera sees it.
    let world_from_local = transform.affine();
    let axes = world_from_local.matrix3;
    let scale = axes
        .x_axis
        .length()
        .max(axes.y_axis.length())
        .max(axes.z_axis.length());
    let radius = aabb.half_extents.length() * scale;
    let center_in_world = world_from_local.transform_point3a(aabb.center);
    let center_in_view = pose.affine().inverse().transform_point3a(center_in_world);
    let center = CAMERA_FROM_VIEW * Vec3::from(center_in_view);
    // Only what a view may see counts.
    if !camera.touches_sphere(center, radius) {
        return None;
    }
    // Samples per area of surface over texture per area of surface: samples per area of texture.
    let strength = camera.strength_over_sphere(center, radius).or_infinity();
    Some((strength * scale * scale / mesh.uv_per_area).sqrt())
}

/// Finds the finest detail that each material needs.
fn gather_materials(
    objects: Query<(&TextureDetail, &MeshMaterial3d<StandardMaterial>)>,
    mut demand: ResMut<FieldLodTextureDemand>,
) {
    let mut of_standard_materials: HashMap<_, TextureDetail> = HashMap::default();
    for (detail, material) in &objects {
        let finest = of_standard_materials
            .entry(material.id())
            .or_insert(*detail);
        finest.pixels_per_uv = finest.pixels_per_uv.max(detail.pixels_per_uv);
    }
    demand.set_if_neq(FieldLodTextureDemand {
        of_standard_materials,
    });
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_texel_a_pixel_is_level_0_and_half_the_size_one_more() {
        let level = |pixels_per_uv, size_px| TextureDetail { pixels_per_uv }.mip_level(size_px);
        assert_eq!(level(1024.0, 1024.0), 0.0);
        assert_eq!(level(512.0, 1024.0), 1.0);
        assert_eq!(level(2048.0, 1024.0), -1.0);
    }
}
