//! Props are drawn as whole meshes: the renderer draws the mesh of a level in place of the entity's [`Mesh3d`].

use bevy::prelude::*;
use fieldlod_select::Scene;

use crate::api::systems::FieldLodSystems;
use crate::draw::drawn_meshes::DrawnMeshes;
use crate::scene::lod_scene::{LodInstance, LodScene};
use crate::scene::view_cut::{ViewCut, ViewState};

/// Swaps whole meshes if some may need another level.
pub(crate) fn plugin(app: &mut App) {
    let any_to_swap = |scene: Res<LodScene>| !scene.whole_meshes_to_swap.is_empty();
    let systems = swap_whole_meshes.run_if(any_to_swap);
    app.add_systems(PostUpdate, systems.in_set(FieldLodSystems::Swap));
}

/// Sets whole meshes to the finest level that a view needs.
pub(crate) fn swap_whole_meshes(
    mut scene: ResMut<LodScene>,
    views: Query<&ViewCut>,
    drawn: Res<DrawnMeshes>,
) {
    let mut to_swap = std::mem::take(&mut scene.whole_meshes_to_swap);
    for &index in &to_swap {
        // The instance may have been removed, and its index reused.
        let Some(instance) = scene.instance(index).filter(|one| one.level.is_some()) else {
            continue;
        };
        let levels = views.iter();
        let levels = levels.filter_map(|cut| level_for(cut, &scene.scene, instance));
        // A mesh that no view draws keeps its level.
        if let Some(level) = levels.min()
            && instance.level != Some(level)
        {
            drawn.set(instance.entity, instance.mesh.mesh_at(level));
            scene.set_level(index, level);
        }
    }
    // Keeps the allocation.
    to_swap.clear();
    scene.whole_meshes_to_swap = to_swap;
}

/// The level of a whole mesh that a view needs; `None` if the view does not draw it.
fn level_for(cut: &ViewCut, scene: &Scene, instance: &LodInstance) -> Option<u32> {
    match cut.state {
        ViewState::Inactive => None,
        // Without a cut, the view draws the sources on its layers.
        ViewState::FullDetail => (cut.layers & instance.layers != 0).then_some(0),
        ViewState::Cut => cut.selector.units(scene, instance.id).first().copied(),
    }
}
