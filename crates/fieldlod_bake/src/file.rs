//! Bakes whole files: from a glTF file to the contents of a `.fieldlod` file.

use std::collections::BTreeMap;
use std::path::Path;

use fieldlod_hierarchy::{Aabb, BakedFile, BakedPrimitive, CLUSTERS_FROM_TRIANGLES, Hierarchy};
use rayon::prelude::*;
use rustc_hash::FxHashMap;

use crate::characters::bake_rigged;
use crate::config::BakeConfig;
use crate::import::{
    Import, ImportError, ImportedPrimitive, PrimitivePlace, Skipped, UnreadImage, import_gltf,
};
use crate::levels::neighbours::meeting_vertices;
use crate::mesh::components::{connect, find_first};
use crate::mesh::{MeshError, SourceMesh, bits};
use crate::plants::together::{bake_together_with_progress, config_for_adjacent, layered_sets};
use crate::progress::{BakeProgress, Progress};
use crate::report::BakeReport;

/// The levels of detail of all primitives of a file.
#[derive(Clone, Debug, PartialEq)]
pub struct BakeOutcome {
    /// The hierarchies, ready to be written.
    pub file: BakedFile,
    /// Reports of the bake of each primitive of `file`, in the same order.
    pub reports: Vec<BakeReport>,
    /// Primitives that were skipped, and why.
    pub skipped: Vec<Skipped>,
    /// Images that could not be read. Surfaces with them count as unknown.
    pub unread_images: Vec<UnreadImage>,
}

/// Imports a `.gltf` or `.glb` file and bakes all its primitives, in parallel.
///
/// `progress` is called from several threads: after each level and each rigged primitive, and at the end.
///
/// # Errors
/// The errors of [`import_gltf`] and [`bake_import`]. The import skips a faulty primitive among others.
pub fn bake_file(
    path: &Path,
    config: &BakeConfig,
    progress: &(dyn Fn(BakeProgress) + Sync),
) -> Result<BakeOutcome, ImportError> {
    bake_import(import_gltf(path)?, config, progress)
}

/// [`bake_file`] for an imported file.
///
/// # Errors
/// The errors of [`bake_mesh`](crate::bake_mesh) and [`bake_rigged`], and an error for a file without triangles.
pub fn bake_import(
    mut import: Import,
    config: &BakeConfig,
    progress: &(dyn Fn(BakeProgress) + Sync),
) -> Result<BakeOutcome, ImportError> {
    if import.primitives.is_empty() {
        return Err(nothing_to_bake(&import));
    }
    let triangles = import.primitives.iter().map(|p| p.mesh.triangle_count());
    let progress = Progress::new(triangles.sum(), progress);
    let rigged = bake_rigged_primitives(&import, config, &progress)?;
    import
        .primitives
        .retain(|primitive| primitive.rig.is_none());
    let first = first_layered(&import, config);
    let first_of = |primitive: &ImportedPrimitive| first[primitive.place.mesh_index as usize];
    // A stable sort: the primitives of a mesh stay in order.
    import.primitives.sort_by_key(first_of);
    // The primitives of one glTF mesh may be one plant.
    let meshes: Vec<&[ImportedPrimitive]> = import
        .primitives
        .chunk_by(|a, b| first_of(a) == first_of(b))
        .collect();
    // `outer` has one value per primitive, in the same order as the chunks above.
    let mut outer = outer_vertices(&import);
    let outer: Vec<Vec<Vec<bool>>> = meshes
        .iter()
        .map(|mesh| outer.drain(..mesh.len()).collect())
        .collect();
    let in_parallel = meshes
        .par_iter()
        .zip(&outer)
        .map(|(mesh, outer)| bake_primitives(mesh, outer, config, &progress));
    let baked = in_parallel.collect::<Result<Vec<_>, ImportError>>()?;
    let mut baked: Vec<_> = baked.into_iter().flatten().chain(rigged).collect();
    // Rigged primitives were baked separately. Files list primitives in the order of the glTF file.
    baked.sort_by_key(|(primitive, _)| (primitive.mesh_index, primitive.primitive_index));
    let (mut primitives, reports): (Vec<_>, Vec<_>) = baked.into_iter().unzip();
    share_grids(&mut primitives, &import.space_of_mesh);
    // The estimated number of triangles is seldom exact. The rest counts as done.
    progress.finish();
    Ok(BakeOutcome {
        file: BakedFile { primitives },
        reports,
        skipped: import.skipped,
        unread_images: import.unread_images,
    })
}

/// Bakes the primitives with a skin or morph targets.
fn bake_rigged_primitives(
    import: &Import,
    config: &BakeConfig,
    progress: &Progress<'_>,
) -> Result<Vec<(BakedPrimitive, BakeReport)>, ImportError> {
    let baked = bake_rigged(import, config).into_iter();
    let finished = baked.map(|(place, baked)| {
        let finished = finish(&place, baked)?;
        let triangles = finished.0.hierarchy.source_triangle_count() as usize;
        progress.add(2 * triangles);
        Ok(finished)
    });
    finished.collect()
}

/// The result of a bake with its place in the file.
fn finish(
    place: &PrimitivePlace,
    baked: Result<(Hierarchy, BakeReport), MeshError>,
) -> Result<(BakedPrimitive, BakeReport), ImportError> {
    let (hierarchy, report) = baked.map_err(|fault| ImportError::Primitive {
        place: place.clone(),
        fault: fault.into(),
    })?;
    let (mesh, index) = (place.mesh_index, place.primitive_index);
    let primitive = BakedPrimitive::new(mesh, index, &*place.name, hierarchy);
    Ok((primitive, report))
}

/// For each glTF mesh, the first mesh that it changes levels together with: a thin layer lies on another mesh with the
/// same global transform.
fn first_layered(import: &Import, config: &BakeConfig) -> Vec<u32> {
    let mut first: Vec<u32> = (0..import.space_of_mesh.len() as u32).collect();
    for indices in primitives_of_spaces(import).into_values() {
        let primitives: Vec<_> = indices.iter().map(|&i| &import.primitives[i]).collect();
        let mesh_of = |index: usize| primitives[index].place.mesh_index;
        // Primitives of one mesh are compared when it is baked.
        if (1..primitives.len()).all(|index| mesh_of(index) == mesh_of(0)) {
            continue;
        }
        let meshes: Vec<&SourceMesh> = primitives.iter().map(|own| &own.mesh).collect();
        for set in layered_sets(&meshes, config) {
            set.iter()
                .for_each(|&index| connect(&mut first, mesh_of(set[0]), mesh_of(index)));
        }
    }
    let all = 0..first.len() as u32;
    all.map(|mesh| find_first(&mut first, mesh)).collect()
}

/// The indices of the primitives that share each global transform. Vertices can be compared only in one space.
fn primitives_of_spaces(import: &Import) -> BTreeMap<u32, Vec<usize>> {
    let mut of_spaces: BTreeMap<u32, Vec<usize>> = BTreeMap::new();
    for (index, primitive) in import.primitives.iter().enumerate() {
        let space = import.space_of_mesh[primitive.place.mesh_index as usize];
        of_spaces.entry(space).or_default().push(index);
    }
    of_spaces
}

/// For each primitive, the vertices where it meets other meshes with the same global transform.
fn outer_vertices(import: &Import) -> Vec<Vec<bool>> {
    let mut outer = vec![Vec::new(); import.primitives.len()];
    for indices in primitives_of_spaces(import).into_values() {
        let primitives = indices.iter().map(|&index| &import.primitives[index]);
        let meshes: Vec<_> = primitives.clone().map(|own| &own.mesh).collect();
        let meeting = meeting_vertices(&meshes, primitives.map(|own| own.place.mesh_index));
        for (index, meeting) in indices.into_iter().zip(meeting) {
            outer[index] = meeting;
        }
    }
    outer
}

/// Gives primitives that share positions in one space, or that change levels together, the box of them all.
fn share_grids(primitives: &mut [BakedPrimitive], space_of_mesh: &[u32]) {
    let mut first: Vec<u32> = (0..primitives.len() as u32).collect();
    let mut at: FxHashMap<_, u32> = FxHashMap::default();
    for (index, primitive) in (0..).zip(&*primitives) {
        let space = space_of_mesh[primitive.mesh_index as usize];
        let positions = primitive.hierarchy.vertices.positions.iter();
        let positions = positions.map(|position| (space, bits(*position), 0));
        // Primitives that change levels together have equal spheres.
        let groups = primitive.hierarchy.groups.iter().take(1);
        let spheres = groups.map(|group| group.bounds);
        let spheres = spheres.map(|s| (u32::MAX, bits(s.center), s.radius.to_bits()));
        for key in positions.chain(spheres) {
            connect(&mut first, index, *at.entry(key).or_insert(index));
        }
    }
    let mut boxes: BTreeMap<u32, Vec<Aabb>> = BTreeMap::new();
    for (index, primitive) in (0..).zip(&*primitives) {
        let positions = primitive.hierarchy.vertices.positions.iter().copied();
        let own = boxes.entry(find_first(&mut first, index)).or_default();
        own.extend(Aabb::around(positions));
    }
    for (index, primitive) in (0..).zip(primitives) {
        let own = &boxes[&find_first(&mut first, index)];
        let corners = own.iter().flat_map(|own| [own.min, own.max]);
        primitive.grid_box = Aabb::around(corners).filter(|_| own.len() > 1);
    }
}

/// Bakes the primitives of one glTF mesh, or of several that lie on each other.
fn bake_primitives(
    primitives: &[ImportedPrimitive],
    outer: &[Vec<bool>],
    config: &BakeConfig,
    progress: &Progress<'_>,
) -> Result<Vec<(BakedPrimitive, BakeReport)>, ImportError> {
    let meshes: Vec<&SourceMesh> = primitives.iter().map(|primitive| &primitive.mesh).collect();
    // Primitives of which one is drawn in units are baked separately. If they share too many border vertices, they are
    // baked together even then: otherwise they would have cracks.
    let is_large = |mesh: &&SourceMesh| mesh.triangle_count() >= CLUSTERS_FROM_TRIANGLES as usize;
    let own = meeting_vertices(&meshes, 0..);
    let config = &if meshes.iter().any(is_large) {
        config_for_adjacent(&meshes, &own, config)
    } else {
        config.clone()
    };
    let baked = bake_together_with_progress(&meshes, &own, outer, config, progress);
    let finished = primitives.iter().zip(baked);
    finished
        .map(|(primitive, baked)| finish(&primitive.place, baked))
        .collect()
}

fn nothing_to_bake(import: &Import) -> ImportError {
    // A fault is the better message: other primitives were skipped on purpose, such as points and lines.
    if let Some(fault) = import.first_fault() {
        return fault;
    }
    match import.skipped.first() {
        Some(first) => ImportError::AllSkipped {
            count: import.skipped.len(),
            place: first.place.clone(),
            reason: first.reason.clone(),
        },
        None => ImportError::NoMeshes,
    }
}
