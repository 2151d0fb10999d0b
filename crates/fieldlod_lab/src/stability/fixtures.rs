//! The generated objects that cases run on.

use fieldlod_bake::{BakeConfig, SourceMesh, bake_mesh, clusterlod_hierarchy, fixtures};
use serde::Serialize;

use crate::object::{ErrorSource, LodObject};

/// A generated object.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Fixture {
    /// A boulder of radius about 1, closed.
    Rock,
    /// A knotted tube around a free middle, closed.
    Knot,
    /// A square of hills, 1 unit wide, with a border.
    Terrain,
    /// Two spheres, 3 % apart, the inner one turned inside out: a thin shell, closed.
    Shell,
}

impl Fixture {
    /// All fixtures.
    pub const ALL: [Self; 4] = [Self::Rock, Self::Knot, Self::Terrain, Self::Shell];

    /// Whether every edge has two triangles.
    #[must_use]
    pub fn is_closed(self) -> bool {
        self != Self::Terrain
    }

    /// Makes and bakes it, in groups an eighth of the default's size: as many levels and groups as a
    /// mesh of eight times the triangles has.
    ///
    /// # Panics
    /// Never, unless the baker refuses a sound mesh.
    #[must_use]
    pub fn bake(self) -> LodObject {
        let hierarchy = bake_mesh(&self.mesh(), &small_groups());
        LodObject::new(hierarchy.expect("a sound mesh"), ErrorSource::Measured)
    }

    /// The same as clusterlod bakes it.
    ///
    /// # Panics
    /// Never, unless the baker refuses a sound mesh.
    #[must_use]
    pub fn bake_by_clusterlod(self) -> LodObject {
        let hierarchy = clusterlod_hierarchy(&self.mesh(), &small_groups());
        LodObject::new(hierarchy.expect("a sound mesh"), ErrorSource::Reported)
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

/// An eighth of the default's size.
fn small_groups() -> BakeConfig {
    BakeConfig {
        cluster_triangles: 64,
        group_clusters: 8,
        ..BakeConfig::default()
    }
}

fn shell() -> SourceMesh {
    // The inner sphere's triangles run the other way round, as do its normals.
    let outer = fixtures::icosphere(5);
    let mut inner = fixtures::icosphere(5);
    for (position, normal) in inner.positions.iter_mut().zip(&mut inner.normals) {
        *position *= 0.97;
        *normal = -*normal;
    }
    for triangle in inner.indices.as_chunks_mut::<3>().0 {
        triangle.swap(1, 2);
    }
    fixtures::joined(&[outer, inner])
}
