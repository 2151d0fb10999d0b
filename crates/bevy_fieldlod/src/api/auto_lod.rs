//! Marks on mesh entities and scenes.

use bevy::prelude::*;
#[cfg(feature = "bake")]
use fieldlod_bake::BakeConfig;

use crate::api::config::LodKind;
use crate::assets::baked_lods::BakedLods;

/// Gives levels of detail to the meshes of this entity and of all its descendants.
///
/// Put it on an entity with a [`Mesh3d`], or on the root of a glTF scene. The source meshes are
/// drawn until their hierarchies are ready. Skinned and morphed meshes are left as they are.
/// Removing it puts everything back.
///
/// ```
/// # use bevy::prelude::*;
/// # use bevy_fieldlod::{BakeConfig, prelude::*};
/// fn setup(mut commands: Commands, assets: Res<AssetServer>) {
///     let castle = assets.load(GltfAssetLabel::Scene(0).from_asset("castle.glb"));
///     commands.spawn((WorldAssetRoot(castle), AutoLod::default()));
///     // Twice as fine as all else, cut into units whatever its size.
///     let hero = assets.load(GltfAssetLabel::Primitive { mesh: 0, primitive: 0 }.from_asset("hero.glb"));
///     let fine = AutoLod { kind: LodKind::Clusters, bias: 2.0, ..default() };
///     commands.spawn((Mesh3d(hero), fine));
///     // A terrain in small units, for which physics uses the third level.
///     let terrain = GltfAssetLabel::Primitive { mesh: 0, primitive: 0 }.from_asset("terrain.glb");
///     let in_small_units = AutoLod {
///         bake: Some(BakeConfig::fine_grained()),
///         simplified_level: Some(2),
///         ..default()
///     };
///     commands.spawn((Mesh3d(assets.load(terrain)), in_small_units));
/// }
/// # bevy::ecs::system::assert_is_system(setup);
/// ```
#[derive(Component, Clone, Debug, PartialEq, Reflect)]
#[reflect(Component, Clone, Default, PartialEq)]
pub struct AutoLod {
    /// Where to find the hierarchies: the asset made by `fieldlod bake`. Without it they are looked
    /// for beside the asset and in the cache, or baked in background tasks.
    pub baked: Option<Handle<BakedLods>>,
    /// How the meshes are given levels of detail.
    pub kind: LodKind,
    /// How much an error on these meshes counts: 2 draws them as fine as at half the distance.
    pub bias: f32,
    /// Draws these meshes at this level in all views, 0 being the finest, whatever it shows; the coarsest
    /// where a mesh has fewer. [`FieldLodSettings::forced_level`](crate::FieldLodSettings::forced_level) is the
    /// same for a view, and comes before this.
    pub forced_level: Option<u32>,
    /// Gives each mesh entity a [`LodSimplified`](crate::LodSimplified) mesh of this level, in main memory
    /// alone: for picking and physics that need not know every triangle.
    pub simplified_level: Option<u32>,
    /// How these meshes are baked, if they are baked at run time; `None` bakes them as
    /// [`FieldLodConfig::bake`](crate::FieldLodConfig::bake) says.
    #[cfg(feature = "bake")]
    #[reflect(ignore)]
    pub bake: Option<BakeConfig>,
}

impl Default for AutoLod {
    /// Everything chosen by the plugin; errors count once.
    fn default() -> Self {
        Self {
            baked: None,
            kind: LodKind::Auto,
            bias: 1.0,
            forced_level: None,
            simplified_level: None,
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
}

/// Leaves the meshes of this entity and of its descendants as they are, within an [`AutoLod`] or
/// where [`FieldLodConfig::whole_world`](crate::FieldLodConfig::whole_world) is set.
#[derive(Component, Clone, Copy, Debug, Default, PartialEq, Eq, Reflect)]
#[reflect(Component, Clone, Default, PartialEq)]
pub struct NoLod;
