//! Props are drawn as whole meshes: the entity's [`Mesh3d`] becomes that of a level.

use bevy::prelude::*;
use fieldlod_select::Scene;

use crate::api::systems::FieldLodSystems;
use crate::cards::LodCards;
use crate::scene::lod_mesh::{LodObject, LodSource};
use crate::scene::lod_scene::{LodInstance, LodScene};
use crate::scene::view_cut::{ViewCut, ViewState};

/// Swaps whole meshes where some may have to change their level.
pub(crate) fn plugin(app: &mut App) {
    let any_to_swap = |scene: Res<LodScene>| !scene.whole_meshes_to_swap.is_empty();
    let systems = swap_whole_meshes.run_if(any_to_swap);
    app.add_systems(PostUpdate, systems.in_set(FieldLodSystems::Swap));
}

/// Gives whole meshes the finest level that a view which sees them asks for.
pub(crate) fn swap_whole_meshes(
    mut scene: ResMut<LodScene>,
    views: Query<&ViewCut>,
    mut meshes: Query<(&mut Mesh3d, &LodObject, &LodSource, Option<&LodCards>)>,
) {
    let mut to_swap = std::mem::take(&mut scene.whole_meshes_to_swap);
    for &index in &to_swap {
        // Instances may have gone, and others taken their index, since they were noted.
        let Some(instance) = scene.instance(index) else {
            continue;
        };
        if instance.piece.is_none() {
            continue;
        }
        let Ok((mut mesh, object, source, cards)) = meshes.get_mut(instance.entity) else {
            continue;
        };
        let levels = views.iter();
        let finest = levels
            .filter_map(|cut| level_for(cut, &scene.scene, instance))
            .min();
        // A mesh that no view sees stays as it is.
        let Some(level) = finest else {
            continue;
        };
        let piece = object.mesh.piece_at(level, LodCards::can_be_drawn(cards));
        let wanted = object.mesh.mesh_at(piece, source);
        if mesh.0 != *wanted {
            mesh.0 = wanted.clone();
            scene.set_piece(index, piece);
        }
    }
    // The storage is used again in the next frame.
    to_swap.clear();
    scene.whole_meshes_to_swap = to_swap;
}

/// The level of a whole mesh that a view asks for; `None` if it has no say, as it does not see it.
fn level_for(cut: &ViewCut, scene: &Scene, instance: &LodInstance) -> Option<u32> {
    match cut.state {
        ViewState::Inactive => None,
        ViewState::FullDetail => (cut.layers & instance.layers != 0).then_some(0),
        ViewState::Cut => cut.selector.units(scene, instance.id).first().copied(),
    }
}
