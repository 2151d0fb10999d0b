//! The recipe.

use fieldlod_hierarchy::Hierarchy;
use rayon::prelude::*;

use crate::assemble::{assemble, finish_group};
use crate::attribute_errors::measure_attribute_errors;
use crate::config::BakeConfig;
use crate::deviation::measure_deviations;
use crate::input::SimplifierInput;
use crate::levels::build_levels;
use crate::mesh::{MeshError, SourceMesh};
use crate::report::BakeReport;

/// Bakes one mesh: all its levels of detail, or why there can be none.
///
/// A mesh that fits one cluster gives a single terminal group: valid, with nothing to choose from.
///
/// # Errors
/// A [`MeshError`] for a mesh that [`SourceMesh::validate`] refuses, a configuration out of range,
/// or units too large for 16-bit indices.
pub fn bake_mesh(mesh: &SourceMesh, config: &BakeConfig) -> Result<Hierarchy, MeshError> {
    Ok(bake_mesh_with_report(mesh, config)?.0)
}

/// [`bake_mesh`], and what resisted.
///
/// # Errors
/// As [`bake_mesh`].
pub fn bake_mesh_with_report(
    mesh: &SourceMesh,
    config: &BakeConfig,
) -> Result<(Hierarchy, BakeReport), MeshError> {
    bake_mesh_with_progress(mesh, config, &|_| ())
}

/// [`bake_mesh`], telling `on_triangles` how many triangles were worked off each time. All levels
/// together hold about twice the source triangles.
pub(crate) fn bake_mesh_with_progress(
    mesh: &SourceMesh,
    config: &BakeConfig,
    on_triangles: &dyn Fn(usize),
) -> Result<(Hierarchy, BakeReport), MeshError> {
    config.validate()?;
    mesh.validate()?;
    let mut input = SimplifierInput::of(mesh, config);
    let (mut groups, report) = build_levels(&mesh.indices, &mut input, config, on_triangles);
    let scaled_from_local = input.local_from_scaled.recip();
    measure_deviations(input, &mut groups);
    let finished = groups.par_iter().map(|group| finish_group(mesh, group));
    let finished = finished.collect::<Result<Vec<_>, _>>()?;
    let mut hierarchy = assemble(mesh, &groups, &finished);
    measure_attribute_errors(&mut hierarchy, scaled_from_local);
    debug_assert_eq!(hierarchy.validate(), Ok(()));
    Ok((hierarchy, report))
}
