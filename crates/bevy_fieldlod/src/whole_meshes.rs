//! Props are drawn as whole meshes: the entity's [`Mesh3d`] becomes that of a level.

use bevy::camera::visibility::RenderLayers;
use bevy::prelude::*;
use fieldlod_select::{InstanceId, Scene};

use crate::lod_mesh::{LodObject, LodSource};
use crate::lod_scene::{DrawnAs, LodScene};
use crate::systems::FieldLodSystems;
use crate::view_cut::{ViewCut, ViewState};

/// Swaps whole meshes where some may have to change their level.
pub(crate) fn plugin(app: &mut App) {
    let any_to_swap = |scene: Res<LodScene>| !scene.whole_meshes_to_swap.is_empty();
    let systems = swap_whole_meshes.run_if(any_to_swap);
    app.add_systems(PostUpdate, systems.in_set(FieldLodSystems::Swap));
}

/// Gives whole meshes the finest level that a view which sees them asks for.
fn swap_whole_meshes(
    mut scene: ResMut<LodScene>,
    views: Query<(&ViewCut, Option<&RenderLayers>)>,
    mut meshes: Query<(&mut Mesh3d, &LodObject, &LodSource, Option<&RenderLayers>)>,
) {
    let mut to_swap = std::mem::take(&mut scene.whole_meshes_to_swap);
    for &index in &to_swap {
        // Instances may have gone, and others taken their index, since they were noted.
        let Some(instance) = scene.instance(index) else {
            continue;
        };
        let DrawnAs::WholeMesh { level: current } = instance.drawn_as else {
            continue;
        };
        let Ok((mut mesh, object, source, layers)) = meshes.get_mut(instance.entity) else {
            continue;
        };
        // Views that do not see its layers have no say.
        let layers = layers.unwrap_or_default();
        let views_that_see = views
            .iter()
            .filter(|(_, view)| view.unwrap_or_default().intersects(layers));
        let finest = views_that_see
            .filter_map(|(cut, _)| level_for(cut, &scene.scene, instance.id))
            .min();
        // A mesh that no view sees stays as it is.
        if let Some(level) = finest.filter(|&level| level != current) {
            mesh.0 = object.mesh.mesh_at(level, source).clone();
            scene.set_level(index, level);
        }
    }
    // The storage is used again in the next frame.
    to_swap.clear();
    scene.whole_meshes_to_swap = to_swap;
}

/// The level of a whole mesh that a view asks for; `None` if it has no say.
fn level_for(cut: &ViewCut, scene: &Scene, instance: InstanceId) -> Option<u32> {
    match cut.state {
        ViewState::Inactive => None,
        ViewState::FullDetail => Some(0),
        ViewState::Cut => cut.selector.units(scene, instance).first().copied(),
    }
}
