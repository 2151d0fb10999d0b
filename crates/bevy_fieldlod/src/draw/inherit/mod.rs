//! Units inherit components of their object: its material, of any type, and the other components that affect how it
//! is drawn.

mod changed_components;
mod components;

use bevy::camera::visibility::{NoFrustumCulling, RenderLayers, VisibilityRange};
use bevy::light::{NotShadowCaster, NotShadowReceiver, TransmittedShadowReceiver};
use bevy::mesh::MeshTag;
use bevy::pbr::wireframe::{
    NoWireframe, Wireframe, WireframeColor, WireframeLineWidth, WireframeTopology,
};
use bevy::pbr::{Lightmap, MaterialExtension};
use bevy::prelude::*;
use bevy::render::batching::NoAutomaticBatching;

use crate::api::bake_material::read_extended_materials;
use crate::api::systems::FieldLodSystems;
use crate::scene::lod_scene::LodScene;
use changed_components::{renew_units_of_changed, renew_units_of_other_materials};
pub(crate) use components::InheritedComponents;

/// Copies changed components of objects to their units.
#[derive(SystemSet, Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(crate) struct RenewUnits;

/// Registers the inherited components and the systems that copy their changes.
pub(crate) fn plugin(app: &mut App) {
    let has_units = |scene: Res<LodScene>| scene.has_units();
    app.init_resource::<InheritedComponents>()
        // Material types are found by their names in the registry; without a `MaterialPlugin`, it lacks this one.
        .register_type::<MeshMaterial3d<StandardMaterial>>()
        .configure_sets(
            PostUpdate,
            RenewUnits
                .run_if(has_units)
                .in_set(FieldLodSystems::Inherit),
        )
        .add_systems(
            PostUpdate,
            (
                renew_units_of_changed::<MeshMaterial3d<StandardMaterial>>,
                renew_units_of_other_materials,
            )
                .in_set(RenewUnits),
        )
        .inherit_in_lod_units::<RenderLayers>()
        .inherit_in_lod_units::<NotShadowCaster>()
        .inherit_in_lod_units::<NotShadowReceiver>()
        .inherit_in_lod_units::<TransmittedShadowReceiver>()
        .inherit_in_lod_units::<NoFrustumCulling>()
        .inherit_in_lod_units::<Lightmap>()
        .inherit_in_lod_units::<MeshTag>()
        .inherit_in_lod_units::<VisibilityRange>()
        .inherit_in_lod_units::<NoAutomaticBatching>()
        .inherit_in_lod_units::<Wireframe>()
        .inherit_in_lod_units::<NoWireframe>()
        .inherit_in_lod_units::<WireframeColor>()
        .inherit_in_lod_units::<WireframeLineWidth>()
        .inherit_in_lod_units::<WireframeTopology>();
}

/// Adds to the components that units inherit from their object.
///
/// ```
/// # use bevy::prelude::*;
/// # use bevy_fieldlod::prelude::*;
/// /// A renderer extension reads it on every entity that it draws.
/// #[derive(Component, Clone)]
/// struct Outlined;
///
/// let mut app = App::new();
/// app.inherit_in_lod_units::<Outlined>();
/// ```
pub trait FieldLodAppExt {
    /// Units inherit `C` and follow its changes: for components that a renderer extension reads on every entity
    /// that it draws. Units always inherit materials, render layers, visibility ranges, lightmaps, mesh tags,
    /// wireframes, and the components that control shadows.
    fn inherit_in_lod_units<C: Component + Clone>(&mut self) -> &mut Self;

    /// Bakes at run time read the base of extended materials, such as those of plants in the wind: levels then keep the
    /// area of leaves that its texture cuts out, and draw far leaves as opaque triangles. A material is read once. For
    /// materials of other types, see [`BakeMaterial`](crate::BakeMaterial).
    fn bake_extended_material<E: MaterialExtension>(&mut self) -> &mut Self;
}

impl FieldLodAppExt for App {
    fn inherit_in_lod_units<C: Component + Clone>(&mut self) -> &mut Self {
        let world = self.world_mut();
        let component = world.register_component::<C>();
        // A game may call this before it adds the plugin.
        world.init_resource::<InheritedComponents>();
        world.resource_mut::<InheritedComponents>().add(component);
        self.add_systems(PostUpdate, renew_units_of_changed::<C>.in_set(RenewUnits))
    }

    fn bake_extended_material<E: MaterialExtension>(&mut self) -> &mut Self {
        self.add_systems(
            PostUpdate,
            read_extended_materials::<E>
                .after(FieldLodSystems::Track)
                .before(FieldLodSystems::Prepare),
        )
    }
}
