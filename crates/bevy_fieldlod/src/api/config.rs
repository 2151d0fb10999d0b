//! Settings of the whole app.

use std::path::PathBuf;
use std::time::Duration;

use bevy::prelude::*;
#[cfg(feature = "bake")]
use fieldlod_bake::BakeConfig;
use fieldlod_hierarchy::CLUSTERS_FROM_TRIANGLES;

/// Settings of the whole app. Insert it before or after [`FieldLodPlugin`](crate::FieldLodPlugin). Changed thresholds
/// and bake settings do not affect meshes that are already prepared.
///
/// ```
/// # use bevy::prelude::*;
/// # use bevy_fieldlod::prelude::*;
/// # let mut app = App::new();
/// app.insert_resource(FieldLodAppConfig {
///     whole_world: true,
///     cache_folder: Some("target/fieldlod-cache".into()),
///     ..default()
/// });
/// // A game that ships all its `.fieldlod` files.
/// app.insert_resource(FieldLodAppConfig {
///     bake_at_run_time: false,
///     ..default()
/// });
/// ```
#[derive(Resource, Clone, Debug, PartialEq, Reflect)]
#[reflect(Resource, Clone, Default)]
pub struct FieldLodAppConfig {
    /// Adds levels of detail to every [`Mesh3d`] of the world, except those under a [`NoLod`](crate::NoLod), as if
    /// each were under an [`AutoLod`](crate::AutoLod).
    pub whole_world: bool,
    /// Meshes with fewer triangles are drawn without levels of detail, except primitives that are baked with larger
    /// ones.
    pub plain_below_triangles: u32,
    /// Meshes with at least this many triangles are drawn as units, each at its own level. Meshes between the two
    /// thresholds are drawn as whole meshes. A larger primitive that cannot keep the vertices where it meets other
    /// primitives of its glTF mesh is a whole mesh, too. Skinned and morphed meshes are whole meshes at any size.
    pub clusters_from_triangles: u32,
    /// The folder that caches baked hierarchies between runs, keyed by the input of the bake; `None` caches nothing.
    /// An unreadable entry is baked again. Without the `bake` feature, the folder is ignored.
    pub cache_folder: Option<PathBuf>,
    /// Whether meshes without a `.fieldlod` file and without a cache entry are baked at run time. A game that ships
    /// all files disables it; a mesh without a file then fails with
    /// [`LodError::BakeDisabled`](crate::LodError::BakeDisabled).
    pub bake_at_run_time: bool,
    /// Settings of bakes at run time, unless [`AutoLod::bake`](crate::AutoLod::bake) overrides them.
    ///
    /// Deviations, which take half or more of the bake of most static meshes, are measured only once there is a camera
    /// with a limit of the [displacement](crate::FieldLodCamera::displacement_px). Meshes that are ready by then are
    /// baked again in the background: until then, this camera draws their source meshes, and others their levels.
    /// [`AutoLod::bake`](crate::AutoLod::bake) measures at once.
    #[cfg(feature = "bake")]
    #[reflect(ignore)]
    pub bake: BakeConfig,
    /// Memory budgets of the meshes of `.fieldpages` files.
    pub memory: LodMemory,
    /// Settings that are rarely changed.
    pub advanced: AdvancedAppConfig,
}

/// Settings of the whole app that are rarely changed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Reflect)]
#[reflect(Clone, Default, PartialEq)]
pub struct AdvancedAppConfig {
    /// Number of threads that bake and prepare meshes; `None` uses half of the cores. The threads start with the
    /// first mesh.
    pub bake_threads: Option<usize>,
    /// Whether the GPU alone culls objects with levels of detail. It needs Bevy's GPU preprocessing, and no camera
    /// with [`NoIndirectDrawing`](bevy::render::view::NoIndirectDrawing). The CPU then visits changed objects only.
    /// The lists of visible entities in the main world do not contain objects that the GPU culls.
    pub gpu_culling: bool,
    /// Whether source meshes stay on the GPU while all views draw their units. By default they are evicted. They are
    /// uploaded again in the frame in which a view draws full detail or another [`Mesh3d`] or [`Mesh2d`] uses them.
    /// Enable it if a ray tracer or a particle system uses the handles of source meshes, because the plugin cannot
    /// detect these uses, or if the game removes meshes from `Assets<Mesh>` while entities draw them. Source meshes that
    /// are not in main memory always stay.
    pub sources_on_gpu: bool,
}

impl Default for AdvancedAppConfig {
    /// Half of the cores; GPU culling; source meshes of units are evicted from the GPU.
    fn default() -> Self {
        Self {
            bake_threads: None,
            gpu_culling: true,
            sources_on_gpu: false,
        }
    }
}

/// How fast meshes are loaded and baked. Change the resource at any time; it affects meshes that are not started yet.
///
/// ```
/// # use bevy::prelude::*;
/// # use bevy_fieldlod::prelude::*;
/// fn show_loading_screen(mut commands: Commands) {
///     commands.insert_resource(LodPriority::LoadingScreen);
/// }
/// fn start_playing(mut commands: Commands, progress: Res<FieldLodProgress>) {
///     if progress.share_done() == 1.0 {
///         commands.insert_resource(LodPriority::Background);
///     }
/// }
/// # bevy::ecs::system::assert_is_system(show_loading_screen);
/// # bevy::ecs::system::assert_is_system(start_playing);
/// ```
#[derive(Resource, Clone, Copy, Debug, Default, PartialEq, Eq, Reflect)]
#[reflect(Resource, Clone, Default, PartialEq)]
pub enum LodPriority {
    /// [`AdvancedAppConfig::bake_threads`] with a low priority, so that the frame rate stays high.
    #[default]
    Background,
    /// All cores with normal priority, for a loading screen.
    LoadingScreen,
}

/// Memory budgets of the meshes of `.fieldpages` files ([`LodMesh3d`](crate::LodMesh3d)). If views need more than
/// [`gpu_bytes`](Self::gpu_bytes), the error thresholds of all views grow by small steps until the pages fit.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Reflect)]
#[reflect(Clone, Default, PartialEq)]
pub struct LodMemory {
    /// Bytes of meshes on the GPU. Only the coarsest levels of all meshes, which are always resident, may exceed it.
    pub gpu_bytes: u64,
    /// Bytes of main memory of pages that are being read, decoded and uploaded. Tables of contents, about 170 kB per
    /// million triangles, are not included.
    pub main_bytes: u64,
    /// How long a page that no view needs stays on the GPU, in [`Time<Real>`](bevy::time::Real), if the budget
    /// permits. [`Duration::MAX`] keeps pages until the budget is exhausted.
    pub keep_unused: Duration,
}

impl Default for LodMemory {
    /// 512 MiB on the GPU, because wgpu does not report how much it has; 64 MiB of main memory; five seconds.
    fn default() -> Self {
        Self {
            gpu_bytes: 512 << 20,
            main_bytes: 64 << 20,
            keep_unused: Duration::from_secs(5),
        }
    }
}

impl Default for FieldLodAppConfig {
    /// Plain below 100 triangles, units from 20,000 on; no cache.
    ///
    /// Rocks of 80 triangles save no triangles with levels, those of 320 half of them. Between the thresholds, units
    /// save at most 5 % of the triangles of whole meshes, and need more than twice the entities
    /// (`tests/benches/RECORD.md`, "frame, kinds").
    fn default() -> Self {
        Self {
            whole_world: false,
            plain_below_triangles: 100,
            clusters_from_triangles: CLUSTERS_FROM_TRIANGLES,
            cache_folder: None,
            bake_at_run_time: true,
            #[cfg(feature = "bake")]
            bake: BakeConfig::default(),
            memory: LodMemory::default(),
            advanced: AdvancedAppConfig::default(),
        }
    }
}

/// The kind of levels of detail of a mesh.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Reflect)]
#[reflect(Clone, Default, PartialEq)]
pub enum LodKind {
    /// One of the other kinds, chosen by the number of triangles: see [`FieldLodAppConfig`].
    #[default]
    Auto,
    /// The mesh has no levels of detail.
    Plain,
    /// One entity draws the whole mesh at one level, so that Bevy batches instances of a level. All views draw the
    /// same level, the finest that any view needs.
    ///
    /// A level has its own vertices, with attributes that are interpolated or copied from the source. Levels of plants
    /// have fewer and larger leaves. A material that moves vertices, such as wind, can read positions, normals, colours
    /// and texture coordinates, but must not depend on vertex indices. If a material needs every vertex of the source,
    /// use [`Plain`](Self::Plain).
    ///
    /// A bake at run time reads the `StandardMaterial` of the first entity with the mesh: the base colour, its texture
    /// and the alpha mode. It waits for the texture.
    WholeMesh,
    /// Each unit of the surface is drawn at its own level, and each view draws its own cut. Skinned and morphed meshes
    /// are drawn as whole meshes instead.
    Clusters,
}

impl FieldLodAppConfig {
    /// Resolves [`LodKind::Auto`] by the number of triangles; returns other kinds unchanged.
    pub(crate) fn kind_for(&self, kind: LodKind, triangles: usize) -> LodKind {
        match kind {
            LodKind::Auto if triangles < self.plain_below_triangles as usize => LodKind::Plain,
            LodKind::Auto if triangles < self.clusters_from_triangles as usize => {
                LodKind::WholeMesh
            }
            LodKind::Auto => LodKind::Clusters,
            chosen => chosen,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn auto_kind_depends_on_triangle_count() {
        let config = FieldLodAppConfig::default();
        let auto = [0, 99, 100, 19_999, 20_000].map(|t| config.kind_for(LodKind::Auto, t));
        use LodKind::{Clusters, Plain, WholeMesh};
        assert_eq!(auto, [Plain, Plain, WholeMesh, WholeMesh, Clusters]);
        assert_eq!(config.kind_for(Clusters, 12), Clusters);
    }
}
