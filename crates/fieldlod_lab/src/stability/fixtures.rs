//! The generated objects of the cases.

use fieldlod_bake::{BakeConfig, SourceMesh, bake_mesh, clusterlod_hierarchy, fixtures};
use serde::Serialize;

use crate::object::{ErrorSource, LodObject};

/// A generated object.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Fixture {
    /// A boulder of radius about 1, closed.
    Rock,
    /// A knotted tube with an empty center, closed.
    Knot,
    /// A square of hills, 1 unit wide, with a border.
    Terrain,
    /// A thin closed shell: two spheres, 3 % apart. The inner sphere faces inwards.
    Shell,
}

impl Fixture {
    /// All fixtures.
    pub const ALL: [Self; 4] = [Self::Rock, Self::Knot, Self::Terrain, Self::Shell];

    /// Returns `true` if the mesh is closed.
    #[must_use]
    pub fn is_closed(self) -> bool {
        self != Self::Terrain
    }

    /// Generates and bakes the object. Groups have an eighth of the default size, so the object has as many levels and
    /// groups as a mesh with eight times the triangles.
    ///
    /// # Panics
    /// If the baker rejects the generated mesh.
    #[must_use]
    pub fn bake(self) -> LodObject {
        let hierarchy = bake_mesh(&self.mesh(), &small_groups());
        LodObject::new(hierarchy.expect("a valid mesh"), ErrorSource::Measured)
    }

    /// The same object baked by clusterlod.
    ///
    /// # Panics
    /// If the baker rejects the generated mesh.
    #[must_use]
    pub fn bake_by_clusterlod(self) -> LodObject {
        let hierarchy = clusterlod_hierarchy(&self.mesh(), &small_groups());
        LodObject::new(hierarchy.expect("a valid mesh"), ErrorSource::Reported)
    }

    fn mesh(self) -> SourceMesh {
        match self {
            Self::Rock => fixtures::rock(5, 7),
            Self::Knot => fixtures::torus_knot(512, 24),
            Self::Terrain => fixtures::height_field(112),
            Self::Shell => shell(),
        }
    }
}

/// Groups of an eighth of the default size.
fn small_groups() -> BakeConfig {
    BakeConfig {
        cluster_triangles: 64,
        group_clusters: 8,
        ..BakeConfig::default()
    }
}

fn shell() -> SourceMesh {
    // Winding and normals of the inner sphere are flipped.
    let outer = fixtures::icosphere(5);
    let mut inner = fixtures::icosphere(5);
    for position in &mut inner.positions {
        *position *= 0.97;
    }
    for normal in &mut inner.normals {
        *normal = -*normal;
    }
    for triangle in inner.indices.as_chunks_mut::<3>().0 {
        triangle.swap(1, 2);
    }
    fixtures::joined(&[outer, inner])
}
