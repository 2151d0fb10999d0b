//! The recipe.

use fieldlod_hierarchy::Hierarchy;
use rayon::prelude::*;

use crate::assemble::{assemble, finish_group};
use crate::deviation::measure_deviations;
use crate::input::SimplifierInput;
use crate::watertight::simplify_watertight;
use crate::{BakeConfig, MeshError, SourceMesh};

/// Bakes one mesh: all its levels of detail, or why there can be none.
///
/// A mesh that fits one cluster gives a single terminal group: valid, with nothing to choose from.
///
/// # Errors
/// A [`MeshError`] for a mesh that [`SourceMesh::validate`] refuses, a configuration out of range,
/// or units too large for 16-bit indices.
pub fn bake_mesh(mesh: &SourceMesh, config: &BakeConfig) -> Result<Hierarchy, MeshError> {
    bake_mesh_with_progress(mesh, config, &|_| ())
}

/// [`bake_mesh`], telling `on_triangles` how many triangles were worked off each time. All levels
/// together hold about twice the source triangles.
pub(crate) fn bake_mesh_with_progress(
    mesh: &SourceMesh,
    config: &BakeConfig,
    on_triangles: &dyn Fn(usize),
) -> Result<Hierarchy, MeshError> {
    config.validate()?;
    mesh.validate()?;
    let mut input = SimplifierInput::of(mesh, config);
    let mut groups = simplify_watertight(mesh, &mut input, config, on_triangles);
    measure_deviations(&mesh.indices, &input, &mut groups);
    let finished = groups.par_iter().map(|group| finish_group(mesh, group));
    let finished = finished.collect::<Result<Vec<_>, _>>()?;
    let hierarchy = assemble(mesh, &groups, &finished);
    debug_assert_eq!(hierarchy.validate(), Ok(()));
    Ok(hierarchy)
}
