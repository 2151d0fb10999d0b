//! Props are drawn as whole meshes: the renderer draws the mesh of a level in place of the entity's [`Mesh3d`].

use bevy::camera::primitives::{Aabb, Frustum};
use bevy::ecs::system::SystemParam;
use bevy::prelude::*;
use fieldlod_select::Scene;

use crate::api::systems::FieldLodSystems;
use crate::draw::drawn_meshes::DrawnMeshes;
use crate::scene::lod_scene::{LodInstance, LodScene};
use crate::scene::view_cut::{ViewCut, ViewState};

/// Most whole meshes outside all views that get a coarser level in one frame. Bevy sorts each into batches again in
/// every view. Those that wait keep a level that is finer than needed, which a camera that turns back needs again.
const COARSER_OUTSIDE: usize = 32;

/// Swaps whole meshes if some may need another level.
pub(crate) fn plugin(app: &mut App) {
    let any_to_swap = |scene: Res<LodScene>| {
        !scene.whole_meshes_to_swap.is_empty() || !scene.coarser_outside.is_empty()
    };
    let systems = swap_whole_meshes.run_if(any_to_swap);
    app.add_systems(PostUpdate, systems.in_set(FieldLodSystems::Swap));
}

/// Sets whole meshes to the finest level that a view needs.
pub(crate) fn swap_whole_meshes(
    mut scene: ResMut<LodScene>,
    views: Views,
    drawn: Res<DrawnMeshes>,
) {
    let mut to_swap = std::mem::take(&mut scene.whole_meshes_to_swap);
    for &index in &to_swap {
        let wanted = views.level_for(&scene, index);
        if scene.is_finer_than(index, wanted) && !views.see(&scene, index) {
            scene.coarsen_later(index);
        } else {
            set_level(&mut scene, &drawn, index, wanted);
        }
    }
    // Keeps the allocation.
    to_swap.clear();
    scene.whole_meshes_to_swap = to_swap;
    for index in scene.take_coarser(COARSER_OUTSIDE) {
        let wanted = views.level_for(&scene, index);
        set_level(&mut scene, &drawn, index, wanted);
    }
}

/// Draws a whole mesh at a level. A mesh that no view draws keeps its level.
fn set_level(scene: &mut LodScene, drawn: &DrawnMeshes, index: u32, wanted: Option<u32>) {
    if let Some(level) = wanted
        && let Some(instance) = scene.instance(index)
        && instance.level != Some(level)
    {
        drawn.set(instance.entity, instance.mesh.mesh_at(level));
        scene.set_level(index, level);
    }
}

/// The views, and the bounds of what they draw.
#[derive(SystemParam)]
pub(crate) struct Views<'w, 's> {
    views: Query<'w, 's, (&'static ViewCut, Option<&'static Frustum>)>,
    bounds: Query<'w, 's, (&'static Aabb, &'static GlobalTransform)>,
}

impl Views<'_, '_> {
    /// The finest level that a view needs of a whole mesh; `None` without a view that draws it.
    fn level_for(&self, scene: &LodScene, index: u32) -> Option<u32> {
        // The instance may have been removed, and its index reused.
        let instance = scene.instance(index).filter(|one| one.level.is_some())?;
        let levels = self.views.iter();
        let levels = levels.filter_map(|(cut, _)| level_for(cut, &scene.scene, instance));
        levels.min()
    }

    /// Whether an instance may be in the image of a view.
    fn see(&self, scene: &LodScene, index: u32) -> bool {
        let bounds = scene.instance(index);
        let bounds = bounds.and_then(|one| self.bounds.get(one.entity).ok());
        let Some((aabb, at)) = bounds else {
            return true;
        };
        let mut views = self.views.iter();
        views.any(|(cut, frustum)| {
            let is_outside =
                |frustum: &Frustum| !frustum.intersects_obb(aabb, &at.affine(), true, false);
            cut.state != ViewState::Inactive && !frustum.is_some_and(is_outside)
        })
    }
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
