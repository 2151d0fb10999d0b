//! What units inherit from the entity whose surface they draw: its material, whatever that is, and all
//! else that says how it is drawn.

mod changes;
mod components;

use bevy::prelude::*;

use crate::api::systems::FieldLodSystems;
use crate::cards::DressObjects;
use crate::scene::lod_scene::LodScene;
pub(crate) use changes::renew_units;
pub(crate) use components::InheritedComponents;

/// Copies what changed on an entity to its units.
pub(crate) fn plugin(app: &mut App) {
    let systems = renew_units.after(DressObjects).run_if(has_units);
    app.init_resource::<InheritedComponents>()
        .register_type::<MeshMaterial3d<StandardMaterial>>()
        .add_systems(PostUpdate, systems.in_set(FieldLodSystems::Inherit));
}

fn has_units(scene: Option<Res<LodScene>>) -> bool {
    scene.is_some_and(|scene| scene.has_units())
}

/// Adds to what units inherit from the entity whose surface they draw.
///
/// ```
/// # use bevy::prelude::*;
/// # use bevy_fieldlod::prelude::*;
/// /// Read by a renderer extension on every entity that it draws.
/// #[derive(Component, Clone)]
/// struct Outlined;
///
/// let mut app = App::new();
/// app.inherit_in_lod_units::<Outlined>();
/// ```
pub trait FieldLodAppExt {
    /// Units inherit `C`, and follow its changes: for components that a renderer extension reads on
    /// every entity that it draws. Materials, render layers, visibility ranges, lightmaps, mesh tags,
    /// wireframes, and how shadows are cast and received are inherited anyway.
    fn inherit_in_lod_units<C: Component + Clone>(&mut self) -> &mut Self;
}

impl FieldLodAppExt for App {
    fn inherit_in_lod_units<C: Component + Clone>(&mut self) -> &mut Self {
        let world = self.world_mut();
        let component = world.register_component::<C>();
        world.init_resource::<InheritedComponents>();
        world.resource_mut::<InheritedComponents>().add(component);
        let systems = changes::renew_units_for::<C>.run_if(has_units);
        self.add_systems(PostUpdate, systems.in_set(FieldLodSystems::Inherit))
    }
}
