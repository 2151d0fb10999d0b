//! Components that mark mesh entities and scenes.

use bevy::prelude::*;
#[cfg(feature = "bake")]
use fieldlod_bake::BakeConfig;

use crate::api::config::LodKind;
use crate::assets::baked_lods::BakedLods;

/// Adds levels of detail to the meshes of this entity and of all its descendants.
///
/// Insert it on an entity with a [`Mesh3d`], or on the root of a glTF scene. The source meshes are drawn until
/// their levels are ready. Skinned and morphed meshes have levels if they come from a glTF file. Removing the
/// component restores the source meshes.
///
/// ```
/// # use bevy::prelude::*;
/// # use bevy_fieldlod::{BakeConfig, prelude::*};
/// fn setup(mut commands: Commands, assets: Res<AssetServer>) {
///     let castle = assets.load(GltfAssetLabel::Scene(0).from_asset("castle.glb"));
///     commands.spawn((WorldAssetRoot(castle), AutoLod::default()));
///     // Draws the hero twice as fine as other objects, and as units even if it is small.
///     let hero = assets.load(GltfAssetLabel::Primitive { mesh: 0, primitive: 0 }.from_asset("hero.glb"));
///     let fine = AutoLod { kind: LodKind::Clusters, bias: 2.0, ..default() };
///     commands.spawn((Mesh3d(hero), fine));
///     // Bakes a terrain in small units.
///     let terrain = GltfAssetLabel::Primitive { mesh: 0, primitive: 0 }.from_asset("terrain.glb");
///     let in_small_units = AutoLod {
///         bake: Some(BakeConfig::fine_grained()),
///         ..default()
///     };
///     commands.spawn((Mesh3d(assets.load(terrain)), in_small_units));
/// }
/// # bevy::ecs::system::assert_is_system(setup);
/// ```
#[derive(Component, Clone, Debug, PartialEq, Reflect)]
#[reflect(Component, Clone, Default, PartialEq)]
pub struct AutoLod {
    /// The hierarchies, made by `fieldlod bake`. If it is `None`, the plugin searches beside the asset and in the
    /// cache, and otherwise bakes in background tasks.
    pub baked: Option<Handle<BakedLods>>,
    /// The kind of levels of detail.
    pub kind: LodKind,
    /// Factor of the errors of these meshes. At 2 they are drawn as finely as at half the distance.
    pub bias: f32,
    /// Settings of bakes at run time; `None` uses [`FieldLodAppConfig::bake`](crate::FieldLodAppConfig::bake).
    #[cfg(feature = "bake")]
    #[reflect(ignore)]
    pub bake: Option<BakeConfig>,
}

impl Default for AutoLod {
    /// The plugin chooses the kind and the source of the levels; the bias is 1.
    fn default() -> Self {
        Self {
            baked: None,
            kind: LodKind::Auto,
            bias: 1.0,
            #[cfg(feature = "bake")]
            bake: None,
        }
    }
}

impl AutoLod {
    /// Uses the hierarchies of a `.fieldlod` file instead of baking.
    #[must_use]
    pub fn from_file(baked: Handle<BakedLods>) -> Self {
        Self {
            baked: Some(baked),
            ..Self::default()
        }
    }

    /// The default with a chosen kind of levels.
    #[must_use]
    pub fn of_kind(kind: LodKind) -> Self {
        Self {
            kind,
            ..Self::default()
        }
    }

    /// Whether entities under both share levels. A change of the kind may also change which primitives are baked together,
    /// and so the levels.
    pub(crate) fn is_same_request(&self, other: &Self) -> bool {
        self.request() == other.request()
    }

    /// Without the bias, which does not affect preparation. Entities with equal requests share levels.
    pub(crate) fn request(&self) -> Self {
        Self {
            bias: 1.0,
            ..self.clone()
        }
    }
}

/// Excludes the meshes of this entity and of its descendants from the [`AutoLod`] of an ancestor and from
/// [`FieldLodAppConfig::whole_world`](crate::FieldLodAppConfig::whole_world).
#[derive(Component, Clone, Copy, Debug, Default, PartialEq, Eq, Reflect)]
#[reflect(Component, Clone, Default, PartialEq)]
pub struct NoLod;
