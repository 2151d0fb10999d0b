//! Settings of the plugin as a whole.

use std::path::PathBuf;
use std::time::Duration;

use bevy::prelude::*;
#[cfg(feature = "bake")]
use fieldlod_bake::BakeConfig;

/// Settings of the plugin. Insert it before or after [`FieldLodPlugin`](crate::FieldLodPlugin);
/// meshes that are already prepared keep what they got.
///
/// ```
/// # use bevy::prelude::*;
/// # use bevy_fieldlod::prelude::*;
/// # let mut app = App::new();
/// app.insert_resource(FieldLodConfig {
///     whole_world: true,
///     cache_folder: Some("target/fieldlod-cache".into()),
///     ..default()
/// });
/// // A game that ships its files, and whose frames must be even.
/// app.insert_resource(FieldLodConfig {
///     bake_at_run_time: false,
///     units_per_frame: Some(64),
///     upload_bytes_per_frame: Some(4 << 20),
///     ..default()
/// });
/// ```
#[derive(Resource, Clone, Debug, PartialEq, Reflect)]
#[reflect(Resource, Clone, Default)]
pub struct FieldLodConfig {
    /// Gives levels of detail to every [`Mesh3d`] of the world, as if each stood under an
    /// [`AutoLod`](crate::AutoLod), except those under a [`NoLod`](crate::NoLod).
    pub whole_world: bool,
    /// Meshes with fewer triangles are drawn as they are.
    pub plain_below_triangles: u32,
    /// Meshes with at least as many triangles are cut into units, each at its own level. Those in
    /// between are drawn as whole meshes.
    pub clusters_from_triangles: u32,
    /// Whether a file `statue.fieldlod` beside an asset `statue.glb` is looked for.
    pub look_beside_assets: bool,
    /// The folder that keeps baked hierarchies from run to run, keyed by what was baked; `None` keeps
    /// none. An entry that cannot be read is baked anew. Only with the `bake` feature.
    pub cache_folder: Option<PathBuf>,
    /// Whether meshes are baked at run time for which no `.fieldlod` file and no entry of the cache is
    /// found. A game that ships all files turns it off, and hears of a mesh that was forgotten
    /// ([`LodError::BakeDisabled`](crate::LodError::BakeDisabled)).
    pub bake_at_run_time: bool,
    /// How many threads bake, and prepare meshes in other ways; `None` takes half of the cores. They are
    /// made when the first mesh is prepared.
    pub bake_threads: Option<usize>,
    /// Meshes are prepared at the same time as long as they have no more triangles than this together; a
    /// larger one is prepared alone. A bake takes some hundred bytes for each triangle.
    pub triangles_at_once: u32,
    /// How meshes are baked at run time, unless their [`AutoLod::bake`](crate::AutoLod::bake) says otherwise:
    /// [`BakeConfig::fast`](crate::BakeConfig::fast) does not measure how far levels deviate from their source,
    /// which only [`FieldLodSettings::displacement_px`](crate::FieldLodSettings::displacement_px) needs.
    #[cfg(feature = "bake")]
    #[reflect(ignore)]
    pub bake: BakeConfig,
    /// The most bytes of levels that are sent to the GPU in a frame, though one piece at least; `None` sends
    /// all of a mesh as soon as it is prepared. The source is drawn until all pieces of its mesh are there.
    pub upload_bytes_per_frame: Option<usize>,
    /// The most entities of units that are spawned in a frame, though one at least; `None` spawns all that
    /// views draw. What a view drew of an object it goes on to draw until all units of its next cut are there.
    pub units_per_frame: Option<usize>,
    /// How many frames the entity of a unit outlives the last frame in which a view drew it.
    pub idle_frames: u32,
    /// Whether objects with levels of detail are culled by the GPU alone, where Bevy's GPU preprocessing can and
    /// no camera has [`NoIndirectDrawing`](bevy::render::view::NoIndirectDrawing): the CPU then looks at none that
    /// has not changed, and no list of the main world has them.
    pub gpu_culling: bool,
    /// Whether source meshes stay on the GPU while all that has them is drawn as units in all views. Otherwise they
    /// leave it, and come back from main memory in the frame in which a view draws them in full, or any other
    /// [`Mesh3d`] or [`Mesh2d`] has them. What draws the handle of a source by other means, as ray tracers and particles
    /// do, is not seen, and needs this. They always stay with [`units_per_frame`](Self::units_per_frame), which
    /// draws them now and then, and where main memory has them not.
    pub sources_on_gpu: bool,
    /// How much memory the meshes of `.fieldpages` files may take.
    pub memory: LodMemory,
}

/// How much memory the meshes of `.fieldpages` files ([`LodMesh3d`](crate::LodMesh3d)) may take. Where views want
/// more, the error that they allow grows by small steps, until what they want fits: that of
/// everything, in the same measure.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Reflect)]
#[reflect(Clone, Default, PartialEq)]
pub struct LodMemory {
    /// Bytes of meshes on the GPU. The coarsest levels of all meshes are always there; nothing else exceeds it.
    pub gpu_bytes: u64,
    /// Bytes of main memory of what is being read, decoded and sent to the GPU, where it does not stay. Tables
    /// of contents, about 170 kB for a million triangles, come on top.
    pub main_bytes: u64,
    /// How long what no view wants any more stays on the GPU while there is room for it, for when the camera comes
    /// back, by [`Time<Real>`](bevy::time::Real). [`Duration::MAX`] keeps all until its room is needed.
    pub keep_unused: Duration,
}

impl Default for LodMemory {
    /// 512 MiB on the GPU, as adapters do not tell how much they have; 64 MiB on the way there; five seconds.
    fn default() -> Self {
        Self {
            gpu_bytes: 512 << 20,
            main_bytes: 64 << 20,
            keep_unused: Duration::from_secs(5),
        }
    }
}

impl Default for FieldLodConfig {
    /// Plain below 400 triangles, clusters from 20 000 on; files beside assets, no cache; half of the cores;
    /// sources of units leave the GPU.
    fn default() -> Self {
        Self {
            whole_world: false,
            plain_below_triangles: 400,
            clusters_from_triangles: 20_000,
            look_beside_assets: true,
            cache_folder: None,
            bake_at_run_time: true,
            bake_threads: None,
            triangles_at_once: 4_000_000,
            #[cfg(feature = "bake")]
            bake: BakeConfig::default(),
            upload_bytes_per_frame: None,
            units_per_frame: None,
            idle_frames: 60,
            gpu_culling: true,
            sources_on_gpu: false,
            memory: LodMemory::default(),
        }
    }
}

/// How a mesh is given levels of detail.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Reflect)]
#[reflect(Clone, Default, PartialEq)]
pub enum LodKind {
    /// One of the others, chosen by the number of triangles: see [`FieldLodConfig`].
    #[default]
    Auto,
    /// The mesh has no levels of detail.
    Plain,
    /// The whole mesh is drawn at one level: by one entity, so that instances of a level are still drawn
    /// together. All views draw the same level, the finest that one of them asks for.
    ///
    /// A level has vertices of its own, with all attributes mixed or taken from those of the source, and
    /// fewer, larger leaves. A material that moves vertices, as wind does, finds positions, normals,
    /// colours and texture coordinates to go by, but must not go by the number of a vertex. Where it
    /// needs every vertex of the source, the mesh is to be [`Plain`](Self::Plain).
    ///
    /// A bake at run time goes by the base colour, its texture and the alpha of the `StandardMaterial` of the
    /// entity that asks first, and waits for that texture.
    WholeMesh,
    /// Each piece of the surface is drawn at its own level, and each view draws its own cut.
    Clusters,
}

impl FieldLodConfig {
    /// The kind of levels that `kind` stands for, of a mesh with that many triangles.
    #[must_use]
    pub fn kind_for(&self, kind: LodKind, triangles: usize) -> LodKind {
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
    fn the_kind_follows_the_triangles_unless_it_is_chosen() {
        let config = FieldLodConfig::default();
        let auto = [0, 399, 400, 19_999, 20_000].map(|t| config.kind_for(LodKind::Auto, t));
        use LodKind::{Clusters, Plain, WholeMesh};
        assert_eq!(auto, [Plain, Plain, WholeMesh, WholeMesh, Clusters]);
        assert_eq!(config.kind_for(Clusters, 12), Clusters);
    }
}
