//! Meshes of `.fieldpages` files, which are read in parts as views want them.
//!
//! The asset is the table of contents and the coarsest levels of all meshes ([`LodPages`](crate::assets::lod_pages::LodPages)); both stay. All else is
//! read page by page: selection says which groups views refine or would, [`fieldlod_stream::Residency`] which pages
//! to load and which to evict, and here they are read, decoded, sent to the GPU and freed. A group is refined only
//! once the GPU has the meshes of its units, so that there is never a hole.

pub(crate) mod mesh_in_pages;
mod read;
pub(crate) mod scene_pages;
mod streams;
mod tell;

use bevy::prelude::*;

pub(crate) use streams::PageStreams;
pub use tell::FieldLodMemory;

use crate::api::systems::FieldLodSystems;
use crate::draw::upload::send_pieces;

/// Loads and evicts pages while there are meshes that are read in parts.
pub(crate) fn plugin(app: &mut App) {
    let any = |streams: Res<PageStreams>| streams.any();
    app.init_resource::<PageStreams>()
        .init_resource::<FieldLodMemory>()
        .add_systems(
            PostUpdate,
            (
                (streams::forget_gone_meshes, streams::collect_pages)
                    .chain()
                    .run_if(any)
                    .in_set(FieldLodSystems::Prepare)
                    .before(send_pieces),
                streams::use_pages
                    .run_if(any)
                    .in_set(FieldLodSystems::Prepare)
                    .after(send_pieces),
                streams::order_pages
                    .run_if(any)
                    .in_set(FieldLodSystems::Select)
                    .after(crate::select::views::select_views),
            ),
        );
}
