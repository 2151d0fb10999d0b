//! The texture side of the field: which mip level a surface needs (§4.1.4 of the paper), for whoever
//! streams textures.

use bevy::asset::AssetId;
use bevy::platform::collections::HashMap;
use bevy::prelude::*;
use camera_field::CAMERA_FROM_VIEW;

use crate::FieldLodSystems;
use crate::library::LodMesh;
use crate::objects::LodObject;
use crate::views::{ViewCuts, ViewState};

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

/// How finely some view samples the texture of a surface: on mesh entities with levels of detail,
/// as long as one sees it. Bounds, over the mesh's sphere and for its least stretched texture
/// coordinates: a piece of it may do with less.
#[derive(Component, Clone, Copy, Debug, PartialEq, Reflect)]
#[reflect(Component, Clone, PartialEq)]
pub struct TextureDetail {
    /// Pixels across a unit of texture coordinates: the root of `c·n` by the density of the texture
    /// coordinates. Infinite where the camera stands within the sphere.
    pub pixels_per_uv: f32,
}

/// The finest [`TextureDetail`] of all entities with a material.
#[derive(Resource, Clone, Debug, Default, PartialEq)]
pub struct FieldLodTextureDemand {
    /// For [`StandardMaterial`]s; those that no view sees are missing.
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
            (measure, gather).chain().after(FieldLodSystems::Select),
        );
    }
}

fn measure(
    mut commands: Commands,
    views: Query<(&ViewCuts, &GlobalTransform)>,
    mut objects: Query<(
        Entity,
        &LodObject,
        &GlobalTransform,
        Option<&mut TextureDetail>,
    )>,
    gone: Query<Entity, (With<TextureDetail>, Without<LodObject>)>,
) {
    for (entity, object, place, detail) in &mut objects {
        let seen = views
            .iter()
            .filter_map(|(cuts, eye)| pixels_per_uv(cuts, eye, &object.mesh, place));
        match (seen.reduce(f32::max), detail) {
            (Some(pixels_per_uv), Some(mut detail)) => {
                detail.set_if_neq(TextureDetail { pixels_per_uv });
            }
            (Some(pixels_per_uv), None) => {
                commands
                    .entity(entity)
                    .insert(TextureDetail { pixels_per_uv });
            }
            (None, Some(_)) => {
                commands.entity(entity).remove::<TextureDetail>();
            }
            (None, None) => {}
        }
    }
    for entity in &gone {
        commands.entity(entity).remove::<TextureDetail>();
    }
}

/// `None` outside the view and without texture coordinates.
fn pixels_per_uv(
    cuts: &ViewCuts,
    eye: &GlobalTransform,
    mesh: &LodMesh,
    place: &GlobalTransform,
) -> Option<f32> {
    let camera = cuts.view.filter(|_| cuts.state == ViewState::Cuts)?;
    let camera = camera.camera();
    let whole = mesh.whole.filter(|_| mesh.uv_per_area > 0.0)?;
    let place = place.affine();
    let center = place.transform_point3a(whole.center);
    let center = Vec3::from(eye.affine().inverse().transform_point3a(center));
    let scale = place.matrix3.x_axis.length();
    let scale = scale.max(place.matrix3.y_axis.length());
    let scale = scale.max(place.matrix3.z_axis.length());
    let (center, radius) = (
        CAMERA_FROM_VIEW * center,
        whole.half_extents.length() * scale,
    );
    if !camera.touches_sphere(center, radius) {
        return None;
    }
    let strength = camera.strength_over_sphere(center, radius).or_infinity();
    Some((strength * scale * scale / mesh.uv_per_area).sqrt())
}

fn gather(
    objects: Query<(&TextureDetail, &MeshMaterial3d<StandardMaterial>)>,
    mut demand: ResMut<FieldLodTextureDemand>,
) {
    let mut of_standard_materials: HashMap<_, TextureDetail> = HashMap::default();
    for (detail, material) in &objects {
        let most = of_standard_materials
            .entry(material.id())
            .or_insert(*detail);
        most.pixels_per_uv = most.pixels_per_uv.max(detail.pixels_per_uv);
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
