//! Lets the renderer make the pipelines of a material before anything needs them: what has none is not drawn, and
//! a wood would vanish for a moment where trees first become cards.

use std::sync::atomic::{AtomicBool, AtomicU32, Ordering};

use bevy::asset::RenderAssetUsages;
use bevy::camera::visibility::{NoFrustumCulling, RenderLayers};
use bevy::ecs::system::SystemParam;
use bevy::pbr::PreparedMaterial;
use bevy::prelude::*;
use bevy::render::erased_render_asset::ErasedRenderAssets;
use bevy::render::render_resource::PipelineCache;
use bevy::render::{Extract, ExtractSchedule, RenderApp};
use fieldlod_hierarchy::Card;

use super::MaterialOf;
use crate::api::auto_lod::NoLod;
use crate::api::systems::FieldLodSystems;
use crate::cards::card_levels::card_mesh;
use crate::select::views::drawn_px;

/// So many frames are drawn with the material before the renderer is asked whether it waits for pipelines: in the
/// first it hears of them, or in the second, where it draws beside the program.
const FEWEST_FRAMES: u32 = 3;
/// After so many nothing is waited for: a pipeline of something else may never be there.
const MOST_FRAMES: u32 = 240;

/// An unseen entity with the material of cards, which is there until its pipelines are.
#[derive(Component, Default)]
pub(super) struct WarmUp {
    frames: AtomicU32,
    is_over: AtomicBool,
}

/// Starts warm-ups.
#[derive(SystemParam)]
pub(super) struct WarmUps<'w, 's> {
    commands: Commands<'w, 's>,
    there: Query<'w, 's, (), With<WarmUp>>,
    layers: Query<'w, 's, &'static RenderLayers>,
    meshes: ResMut<'w, Assets<Mesh>>,
    drawn: ResMut<'w, DrawnMesh>,
}

/// A card without an extent, if there is a renderer.
#[derive(Resource, Default)]
pub(super) struct DrawnMesh {
    has_renderer: bool,
    mesh: Option<Handle<Mesh>>,
}

impl WarmUps<'_, '_> {
    /// Lets the pipelines of a material be made, of views that see `entity`; `None` without a renderer.
    pub(super) fn start(
        &mut self,
        entity: Entity,
        material: &Handle<StandardMaterial>,
    ) -> Option<Entity> {
        let drawn = &mut *self.drawn;
        if !drawn.has_renderer {
            return None;
        }
        let usage = RenderAssetUsages::default();
        let new_mesh = || self.meshes.add(card_mesh(&[Card::default()], 1, usage));
        let mesh = drawn.mesh.get_or_insert_with(new_mesh).clone();
        let unseen = (
            Name::new("pipelines of cards"),
            WarmUp::default(),
            Mesh3d(mesh),
            MeshMaterial3d(material.clone()),
            NoFrustumCulling,
            NoLod,
        );
        let mut unseen = self.commands.spawn(unseen);
        if let Ok(layers) = self.layers.get(entity) {
            unseen.insert(layers.clone());
        }
        Some(unseen.id())
    }

    pub(super) fn is_there(&self, warm_up: Entity) -> bool {
        self.there.contains(warm_up)
    }
}

pub(super) fn plugin(app: &mut App) {
    let mut drawn = DrawnMesh::default();
    if let Some(render_app) = app.get_sub_app_mut(RenderApp) {
        drawn.has_renderer = true;
        render_app.add_systems(ExtractSchedule, count_frames);
    }
    app.insert_resource(drawn).add_systems(
        PostUpdate,
        end_warm_ups
            .run_if(any_with_component::<WarmUp>)
            .in_set(FieldLodSystems::Track),
    );
}

fn end_warm_ups(mut commands: Commands, warm_ups: Query<(Entity, &WarmUp)>) {
    for (entity, warm_up) in &warm_ups {
        if warm_up.is_over.load(Ordering::Acquire) {
            commands.entity(entity).try_despawn();
        }
    }
}

/// Asks between two frames which warm-ups are over. Frames without a view count for none, nor do those in which the
/// textures of the material were not on the GPU.
fn count_frames(
    warm_ups: Extract<Query<(&WarmUp, &MaterialOf)>>,
    cameras: Extract<Query<&Camera, With<Camera3d>>>,
    materials: Res<ErasedRenderAssets<PreparedMaterial>>,
    pipelines: Res<PipelineCache>,
) {
    if warm_ups.is_empty() || cameras.iter().all(|camera| drawn_px(camera).is_none()) {
        return;
    }
    let are_pipelines_there = pipelines.waiting_pipelines().next().is_none();
    for (warm_up, material) in &warm_ups {
        if materials.get(material.id().untyped()).is_none() {
            continue;
        }
        let frames = 1 + warm_up.frames.fetch_add(1, Ordering::AcqRel);
        let is_over = frames >= FEWEST_FRAMES && are_pipelines_there || frames >= MOST_FRAMES;
        warm_up.is_over.store(is_over, Ordering::Release);
    }
}
