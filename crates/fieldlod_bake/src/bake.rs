//! The recipe for one mesh.

use fieldlod_hierarchy::{CLUSTERS_FROM_TRIANGLES, Hierarchy};

use crate::config::BakeConfig;
use crate::layers::Layers;
use crate::levels::assemble::assemble;
use crate::levels::build::build_levels;
use crate::levels::source_order::in_source_order;
use crate::levels::vertices::{LevelVertices, NORMAL_WEIGHT};
use crate::mesh::surfaces::Surfaces;
use crate::mesh::topology::Topology;
use crate::mesh::two_sided::Sheets;
use crate::mesh::used_vertices::Compact;
use crate::mesh::{MeshError, SourceMesh};
use crate::plants::appearance::measure_levels;
use crate::progress::Progress;
use crate::report::BakeReport;

/// Bakes all levels of detail of one mesh.
///
/// A mesh with a dozen triangles or fewer becomes a single terminal group: valid, but without coarser levels.
///
/// # Errors
/// A [`MeshError`] if the configuration is out of range, or if [`SourceMesh::validate`] rejects the mesh. Positions of
/// unused vertices are not checked.
pub fn bake_mesh(mesh: &SourceMesh, config: &BakeConfig) -> Result<Hierarchy, MeshError> {
    Ok(bake_mesh_with_report(mesh, config)?.0)
}

/// [`bake_mesh`], with a report: stuck groups, fallbacks and the size of the coarsest level.
///
/// # Errors
/// The errors of [`bake_mesh`].
pub fn bake_mesh_with_report(
    mesh: &SourceMesh,
    config: &BakeConfig,
) -> Result<(Hierarchy, BakeReport), MeshError> {
    bake_mesh_with_progress(mesh, &[], config, &Progress::default())
}

/// [`bake_mesh`] with progress. `kept` marks vertices that stay at all levels: one value per vertex, or empty.
pub(crate) fn bake_mesh_with_progress(
    mesh: &SourceMesh,
    kept: &[bool],
    config: &BakeConfig,
    progress: &Progress<'_>,
) -> Result<(Hierarchy, BakeReport), MeshError> {
    config.validate()?;
    let compact = Compact::of(mesh)?;
    let (used, kept) = (&compact.mesh, compact.at_used(kept));
    let (hierarchy, report) =
        bake_valid_mesh(used, Surfaces::of([&**used]), &kept, config, progress);
    let hierarchy = compact.of_whole(hierarchy);
    debug_assert_eq!(hierarchy.validate(), Ok(()));
    Ok((hierarchy, report))
}

/// Bakes a valid mesh of one or more parts with these `surfaces`.
pub(crate) fn bake_valid_mesh(
    mesh: &SourceMesh,
    surfaces: Surfaces,
    kept: &[bool],
    config: &BakeConfig,
    progress: &Progress<'_>,
) -> (Hierarchy, BakeReport) {
    // Weld vertices, and remove the backs of two-sided sheets: only one side is simplified.
    let topology = Topology::of(mesh, &surfaces);
    let rounded_vertices = topology.rounded;
    let sheets = Sheets::of(mesh, &topology);
    let front = sheets.as_ref().map(|sheets| sheets.front_of(mesh));
    let simplified = front.as_ref().unwrap_or(mesh);
    // Scale positions and weight attributes.
    let mut vertices = LevelVertices::of(simplified, topology, surfaces.clone(), NORMAL_WEIGHT);
    vertices.keep(kept, config.lock_borders);
    // Meshes in units have no levels of the whole mesh, which layers need.
    let is_whole = surfaces.is_joined() || mesh.triangle_count() < CLUSTERS_FROM_TRIANGLES as usize;
    let layers = is_whole
        .then(|| Layers::of(simplified, &vertices))
        .flatten();
    // Cluster, group, simplify and measure, level by level.
    let (mut groups, mut report) = build_levels(simplified, &mut vertices, config, progress);
    report.rounded_vertices = rounded_vertices;
    if let Some(sheets) = &sheets {
        sheets.add_backs(&mut groups, &mut vertices);
        report.two_sided_triangles = 2 * sheets.back_count();
    }
    // `assemble` consumes the vertices.
    let measures_tears = vertices.shows_tears(config) && surfaces.any_textured();
    let mut origin = vertices.origin.clone();
    let scaled_from_local = vertices.local_from_scaled.recip();
    // Bound and order the units.
    let mut hierarchy = assemble(mesh, vertices, &groups.0);
    let coarsest = hierarchy
        .groups
        .last()
        .map(|group| hierarchy.triangle_count_of(group));
    report.coarsest_triangles = coarsest.unwrap_or(0) as usize;
    // Measure levels of plants and torn textures on pictures. Other meshes keep the error of the simplifier, to which
    // the pictures are calibrated.
    let torn = report.first_torn_group().filter(|_| measures_tears);
    if config.measure_appearance && (report.has_aggregates || torn.is_some()) {
        measure_levels(&mut hierarchy, &surfaces, report.has_aggregates, torn);
    }
    // Keep layers in front of what they lie on.
    if let Some(layers) = layers {
        hierarchy = layers.lift(hierarchy, &mut origin, scaled_from_local);
    }
    // Renderers blend the triangles of a mesh in their order.
    if surfaces.any_blended() {
        hierarchy = in_source_order(hierarchy, mesh, &origin);
    }
    (hierarchy, report)
}
