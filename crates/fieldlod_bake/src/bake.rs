//! The recipe for one mesh.

use fieldlod_hierarchy::{Cards, Hierarchy};

use crate::config::BakeConfig;
use crate::levels::assemble::assemble;
use crate::levels::build_levels;
use crate::levels::vertices::LevelVertices;
use crate::mesh::surfaces::Surfaces;
use crate::mesh::{MeshError, SourceMesh};
use crate::plants::appearance::measure_levels;
use crate::report::BakeReport;

/// Bakes one mesh: all its levels of detail, or why there can be none.
///
/// A mesh that fits one cluster gives a single terminal group: valid, with nothing to choose from.
///
/// # Errors
/// A [`MeshError`] for a mesh that [`SourceMesh::validate`] refuses or a configuration out of range.
pub fn bake_mesh(mesh: &SourceMesh, config: &BakeConfig) -> Result<Hierarchy, MeshError> {
    Ok(bake_mesh_with_report(mesh, config)?.0)
}

/// [`bake_mesh`], with a report of what could not be simplified as usual.
///
/// # Errors
/// As [`bake_mesh`].
pub fn bake_mesh_with_report(
    mesh: &SourceMesh,
    config: &BakeConfig,
) -> Result<(Hierarchy, BakeReport), MeshError> {
    bake_mesh_with_progress(mesh, config, &|_| ())
}

/// [`bake_mesh`] with progress: `on_triangles` is told how many triangles each group consumed. All
/// levels together have about twice the source triangles.
pub(crate) fn bake_mesh_with_progress(
    mesh: &SourceMesh,
    config: &BakeConfig,
    on_triangles: &dyn Fn(usize),
) -> Result<(Hierarchy, BakeReport), MeshError> {
    // Check: the simplifier trusts what it is given.
    config.validate()?;
    mesh.validate()?;
    let baked = bake_valid_mesh(mesh, Surfaces::of([mesh]), config, on_triangles);
    let cards = baked.cards.into_iter().next().flatten();
    let hierarchy = Hierarchy {
        cards,
        ..baked.hierarchy
    };
    debug_assert_eq!(hierarchy.validate(), Ok(()));
    Ok((hierarchy, baked.report))
}

/// A mesh of one or more parts with all its levels of detail.
pub(crate) struct Baked {
    /// Without cards.
    pub(crate) hierarchy: Hierarchy,
    /// Those of each part, if any part has some.
    pub(crate) cards: Vec<Option<Cards>>,
    pub(crate) report: BakeReport,
}

/// [`bake_mesh_with_progress`] without checks, of a mesh of one or more parts that look like `surfaces`.
pub(crate) fn bake_valid_mesh(
    mesh: &SourceMesh,
    surfaces: Surfaces,
    config: &BakeConfig,
    on_triangles: &dyn Fn(usize),
) -> Baked {
    // Cluster, group, simplify and measure, level by level.
    let mut vertices = LevelVertices::of(mesh, config);
    vertices.surfaces = surfaces.clone();
    let (groups, report) = build_levels(mesh, &mut vertices, config, on_triangles);
    // Bound and order what is drawn together.
    let mut baked = Baked {
        hierarchy: assemble(mesh, vertices, &groups.0),
        cards: Vec::new(),
        report,
    };
    // Draw plants and the like that may be drawn as a whole, and see how good they look. Surfaces are judged
    // by their errors, by which that is calibrated.
    if config.measure_appearance && baked.report.has_aggregates {
        let with_cards = config.cards && surfaces.are_usable();
        baked.cards = measure_levels(&mut baked.hierarchy, &surfaces, with_cards);
    }
    baked
}
