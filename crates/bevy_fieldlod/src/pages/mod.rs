//! Streams meshes of `.fieldpages` files.
//!
//! In: the pages that selection needs, from [`ViewCut`](crate::scene::view_cut::ViewCut). Out: meshes of units on the
//! GPU, and the groups that selection may refine.
//!
//! The table of contents and the coarsest levels of all meshes stay in memory
//! ([`LodPages`](crate::assets::lod_pages::LodPages)). [`fieldlod_stream::Residency`] decides which other pages to load
//! and evict; this module reads, decodes, uploads and frees them. A group is refined once the GPU has the meshes of
//! its units. If it were refined earlier, the surface would have holes.

mod coarsening;
mod memory;
mod mesh_in_pages;
mod prepare;
mod read;
mod scene_pages;
mod streams;

use bevy::prelude::*;

pub use memory::FieldLodMemory;
use streams::PageStreams;

use crate::api::events::FieldLodEvent;
use crate::assets::standalone::StandaloneSteps;
use crate::prepare::PrepareSteps;
use crate::select::views::SelectSteps;

/// Streams meshes of `.fieldpages` files ([`LodMesh3d`](crate::LodMesh3d)). It is part of
/// [`FieldLodPlugin`](crate::FieldLodPlugin).
#[derive(Clone, Copy, Debug, Default)]
pub struct FieldLodPagesPlugin;

impl Plugin for FieldLodPagesPlugin {
    fn build(&self, app: &mut App) {
        let has_meshes = |streams: Res<PageStreams>| streams.has_meshes();
        app.add_plugins(scene_pages::plugin)
            .init_resource::<FieldLodMemory>()
            .init_resource::<PageStreams>()
            .add_systems(
                PostUpdate,
                (
                    prepare::make_meshes.in_set(StandaloneSteps::Make),
                    (
                        prepare::remove_sources.run_if(on_message::<AssetEvent<Mesh>>),
                        // Before entities get their levels: no view may refine a group without meshes.
                        prepare::stream_ready_meshes.run_if(on_message::<FieldLodEvent>),
                        (
                            streams::remove_unused_meshes,
                            streams::upload_read_pages,
                            streams::use_uploaded_pages,
                        )
                            .chain()
                            .run_if(has_meshes),
                    )
                        .chain()
                        .in_set(PrepareSteps::Read),
                    // Views select with the thresholds at which all needed pages fit.
                    coarsening::adjust_views
                        .run_if(has_meshes)
                        .in_set(SelectSteps::Adjust),
                    // Demand comes from the cuts of this frame.
                    streams::request_pages
                        .run_if(has_meshes)
                        .in_set(SelectSteps::Read),
                ),
            );
    }
}
