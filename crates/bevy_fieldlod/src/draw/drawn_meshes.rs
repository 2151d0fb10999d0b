//! Draws entities with another mesh than their [`Mesh3d`]. Only the render world changes; no component does.
//!
//! Bevy extracts mesh entities, then looks up where their meshes lie in the buffers of the GPU. Between these steps,
//! the id of the other mesh replaces the id of the entity's mesh. All passes then draw it, with the entity's material,
//! lightmap, tag, layers and last transform. Bevy extracts an entity and sorts it into a batch again only if one of its
//! components changed. An entity whose drawn mesh changes is therefore added to Bevy's lists of changed entities. If
//! both meshes have the same pipelines, it is added after pipelines were chosen, since each view would choose the same
//! one again.
//!
//! Skins and morph weights belong to the entity and stay. Morph targets belong to the mesh.

use std::sync::{Mutex, MutexGuard, PoisonError};

use bevy::asset::AssetId;
use bevy::pbr::{
    MeshExtractionSystems, MeshesToReextractNextFrame, MorphIndices, MorphUniforms,
    RenderMeshInstanceGpuQueue, RenderMeshInstanceGpuQueues, RenderMeshInstanceSharedFlat,
    RenderMeshInstanceSharedFlatBlob, RenderMeshInstances, collect_meshes_for_gpu_building,
    prepare_morph_descriptors,
};
use bevy::prelude::*;
use bevy::render::camera::{
    DirtySpecializationSystems, DirtySpecializations, DirtyWireframeSpecializations,
};
use bevy::render::mesh::RenderMesh;
use bevy::render::mesh::allocator::MeshAllocator;
use bevy::render::render_asset::RenderAssets;
use bevy::render::render_resource::AtomicPod;
use bevy::render::sync_world::{MainEntity, MainEntityHashMap};
use bevy::render::{Extract, ExtractSchedule, Render, RenderApp, RenderSystems};

/// The queue of changes for the render world.
///
/// `None` without a renderer.
#[derive(Resource, Default)]
pub(crate) struct DrawnMeshes(Option<Mutex<Vec<(Entity, Change)>>>);

/// A change of one entity in the render world.
#[derive(Clone, Copy, Debug)]
enum Change {
    /// Draws it with this mesh; with `None`, with its [`Mesh3d`].
    Draw(Option<AssetId<Mesh>>),
    /// Extracts it again.
    ExtractAgain,
}

impl DrawnMeshes {
    /// Draws an entity with `mesh` from this frame on; with `None`, with its [`Mesh3d`], which is also drawn while the
    /// GPU does not have `mesh`.
    pub(crate) fn set(&self, entity: Entity, mesh: Option<AssetId<Mesh>>) {
        self.push(entity, Change::Draw(mesh));
    }

    /// Extracts an entity again in this frame, after a change that Bevy does not detect.
    pub(crate) fn extract_again(&self, entity: Entity) {
        self.push(entity, Change::ExtractAgain);
    }

    fn push(&self, entity: Entity, change: Change) {
        if let Some(mut changes) = self.lock() {
            changes.push((entity, change));
        }
    }

    // The rendering tests compile this module by itself, so it names nothing else of the crate.
    fn lock(&self) -> Option<MutexGuard<'_, Vec<(Entity, Change)>>> {
        let changes = self.0.as_ref()?;
        Some(changes.lock().unwrap_or_else(PoisonError::into_inner))
    }
}

/// The mesh of each entity that is drawn with another mesh than its [`Mesh3d`].
#[derive(Resource, Default)]
struct OtherMeshes {
    meshes: MainEntityHashMap<AssetId<Mesh>>,
    /// Whether the mesh of some entity changed in this frame.
    any_changed: bool,
    /// Entities that keep their pipelines and are to be sorted into batches again.
    to_sort: Vec<MainEntity>,
}

/// Draws other meshes, if there is a renderer.
pub(crate) fn plugin(app: &mut App) {
    let mut drawn = DrawnMeshes::default();
    if let Some(render_app) = app.get_sub_app_mut(RenderApp) {
        drawn.0 = Some(Mutex::default());
        render_app.init_resource::<OtherMeshes>().add_systems(
            ExtractSchedule,
            (
                // Bevy then extracts the entities in this frame, and sorts them into batches again.
                extract_changes
                    .before(MeshExtractionSystems)
                    .in_set(DirtySpecializationSystems::CheckForChanges),
                draw_other_meshes.after(MeshExtractionSystems),
            ),
        );
        let any_changed = |others: Res<OtherMeshes>| others.any_changed;
        render_app.add_systems(
            Render,
            (
                update_morph_descriptors
                    .run_if(any_changed)
                    .after(collect_meshes_for_gpu_building)
                    .in_set(RenderSystems::PrepareMeshes),
                // Between the choice of pipelines and the sorting into batches.
                sort_again.in_set(RenderSystems::PrepareViews),
            ),
        );
    }
    app.insert_resource(drawn);
}

/// Applies the queue, and adds its entities to Bevy's lists of changed entities.
fn extract_changes(
    changes: Extract<Res<DrawnMeshes>>,
    entities: Extract<Query<&Mesh3d>>,
    meshes: Res<RenderAssets<RenderMesh>>,
    mut others: ResMut<OtherMeshes>,
    mut to_extract: Option<ResMut<MeshesToReextractNextFrame>>,
    mut to_bin: ResMut<DirtySpecializations>,
    mut wireframes_to_bin: ResMut<DirtyWireframeSpecializations>,
) {
    others.any_changed = false;
    for (entity, change) in changes
        .lock()
        .iter_mut()
        .flat_map(|changes| changes.drain(..))
    {
        others.any_changed = true;
        let source = entities.get(entity);
        let entity = MainEntity::from(entity);
        let Ok(source) = source else {
            // Bevy would never remove the instance of a despawned entity that is in `to_extract`.
            others.meshes.remove(&entity);
            continue;
        };
        let keeps_pipelines = match change {
            Change::ExtractAgain => false,
            Change::Draw(mesh) => {
                let last = match mesh {
                    Some(mesh) => others.meshes.insert(entity, mesh),
                    None => others.meshes.remove(&entity),
                };
                let of_source = source.id();
                have_same_pipelines(&meshes, [last, mesh].map(|mesh| mesh.unwrap_or(of_source)))
            }
        };
        // Despite its name, Bevy reads the list in this frame. It is missing where the CPU builds instances, since
        // all entities are extracted in each frame there.
        if let Some(to_extract) = &mut to_extract {
            to_extract.insert(entity);
        }
        if keeps_pipelines {
            others.to_sort.push(entity);
        } else {
            to_bin.changed_renderables.insert(entity);
        }
        wireframes_to_bin.changed_renderables.insert(entity);
    }
}

/// Whether two meshes are drawn with the same pipelines. Meshes that are not on the GPU have none yet.
fn have_same_pipelines(meshes: &RenderAssets<RenderMesh>, ids: [AssetId<Mesh>; 2]) -> bool {
    match ids.map(|id| meshes.get(id)) {
        [Some(a), Some(b)] => a.key_bits.bits() == b.key_bits.bits() && a.layout == b.layout,
        _ => false,
    }
}

/// Lets Bevy sort entities into batches again.
fn sort_again(mut others: ResMut<OtherMeshes>, mut to_bin: ResMut<DirtySpecializations>) {
    to_bin.changed_renderables.extend(others.to_sort.drain(..));
}

/// Replaces the mesh ids of the instances that were extracted in this frame.
fn draw_other_meshes(
    others: Res<OtherMeshes>,
    meshes: Res<RenderAssets<RenderMesh>>,
    instances: Res<RenderMeshInstances>,
    queues: Option<ResMut<RenderMeshInstanceGpuQueues>>,
) {
    if others.meshes.is_empty() {
        return;
    }
    let is_on_gpu = |mesh: &AssetId<Mesh>| meshes.get(*mesh).is_some();
    // Where the CPU builds instances, Bevy has extracted all of them in this frame.
    if let RenderMeshInstances::CpuBuilding(instances) = &*instances {
        for (entity, mesh) in &others.meshes {
            if is_on_gpu(mesh)
                && let Some(instance) = instances.get(entity)
            {
                instance.set_mesh_asset_id(*mesh);
            }
        }
    }
    let draw_other = |entity: &MainEntity, shared: &mut RenderMeshInstanceSharedFlat| {
        if let Some(mesh) = others.meshes.get(entity).filter(|mesh| is_on_gpu(mesh)) {
            // Only the blob has a setter.
            let blob = RenderMeshInstanceSharedFlatBlob::from(&*shared);
            blob.set_mesh_asset_id(*mesh);
            *shared = RenderMeshInstanceSharedFlat::read_from_blob(&blob);
        }
    };
    // If the GPU builds instances, the extracted ones are still in queues.
    let Some(mut queues) = queues else {
        return;
    };
    for queue in queues.iter_mut() {
        match queue {
            RenderMeshInstanceGpuQueue::None => {}
            RenderMeshInstanceGpuQueue::CpuCulling { changed, .. } => {
                for (entity, builder) in changed {
                    draw_other(entity, &mut builder.shared);
                }
            }
            RenderMeshInstanceGpuQueue::GpuCulling {
                changed_cpu_culling,
                changed_gpu_culling,
                ..
            } => {
                for (entity, builder, _) in
                    changed_cpu_culling.iter_mut().chain(changed_gpu_culling)
                {
                    draw_other(entity, &mut builder.shared);
                }
            }
        }
    }
}

/// Updates the morph descriptors after changed meshes were collected. Bevy updates them earlier. Without this, a mesh
/// is drawn with the morph targets of its last level for one frame.
fn update_morph_descriptors(
    indices: ResMut<MorphIndices>,
    uniforms: ResMut<MorphUniforms>,
    instances: Res<RenderMeshInstances>,
    meshes: Res<RenderAssets<RenderMesh>>,
    allocator: Res<MeshAllocator>,
) {
    prepare_morph_descriptors(indices, uniforms, instances, meshes, allocator);
}
