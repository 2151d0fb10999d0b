//! The recipe for one mesh.

use fieldlod_hierarchy::Hierarchy;

use crate::aggregate::has_leaves;
use crate::appearance::measure_levels;
use crate::assemble::assemble;
use crate::config::BakeConfig;
use crate::levels::build_levels;
use crate::mesh::{MeshError, SourceMesh};
use crate::report::BakeReport;
use crate::surfaces::Surfaces;
use crate::vertices::LevelVertices;

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
    Ok(bake_valid_mesh(
        mesh,
        Surfaces::of([mesh]),
        config,
        on_triangles,
    ))
}

/// [`bake_mesh_with_progress`] without checks, of a mesh of one or more parts that look like `surfaces`.
pub(crate) fn bake_valid_mesh(
    mesh: &SourceMesh,
    surfaces: Surfaces,
    config: &BakeConfig,
    on_triangles: &dyn Fn(usize),
) -> (Hierarchy, BakeReport) {
    // Cluster, group, simplify and measure, level by level.
    let mut vertices = LevelVertices::of(mesh, config);
    vertices.surfaces = surfaces.clone();
    let (groups, report) = build_levels(mesh, &mut vertices, config, on_triangles);
    // Bound and order what is drawn together.
    let mut hierarchy = assemble(mesh, vertices, &groups.0);
    // Draw plants and the like that may be drawn as a whole, and see how good they look. Surfaces are judged
    // by their errors, by which that is calibrated.
    if config.measure_appearance && report.has_aggregates {
        let with_cards = config.cards && mesh.usable_surface().is_some() && has_leaves(mesh);
        measure_levels(&mut hierarchy, &surfaces, with_cards);
    }
    debug_assert_eq!(hierarchy.validate(), Ok(()));
    (hierarchy, report)
}
