//! Selects the cut of each view.
//!
//! In: placements of objects, cameras, lights and settings. Out: [`ViewCut`](crate::scene::view_cut::ViewCut)s, and the
//! units to spawn and the whole meshes to swap in [`LodScene`](crate::scene::lod_scene::LodScene).

mod drawn_layers;
pub(crate) mod shadow_lights;
mod skins;
pub(crate) mod views;
