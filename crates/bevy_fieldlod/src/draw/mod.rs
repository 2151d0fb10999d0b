//! Makes Bevy draw the selected cuts.
//!
//! In: the cuts and [`LodScene`](crate::scene::lod_scene::LodScene). Out: the mesh that the renderer draws for each
//! whole mesh, the entities of units, and the lists of visible entities. The lists are filtered in the main world, or
//! updated in the render world if the GPU culls.

pub(crate) mod cpu_lists;
pub(crate) mod drawn_meshes;
pub(crate) mod gpu_culling;
mod gpu_lists;
pub(crate) mod inherit;
mod list_changes;
mod motion;
pub(crate) mod released_sources;
pub(crate) mod units;
pub(crate) mod upload;
mod whole_meshes;

use bevy::prelude::*;

/// Everything between selection and Bevy's renderer, in the order of a frame.
pub(crate) fn plugin(app: &mut App) {
    app.add_plugins((
        upload::plugin,
        gpu_culling::plugin,
        inherit::plugin,
        drawn_meshes::plugin,
        whole_meshes::plugin,
        units::plugin,
        cpu_lists::plugin,
        list_changes::plugin,
        gpu_lists::plugin,
        motion::plugin,
        released_sources::plugin,
    ));
}
