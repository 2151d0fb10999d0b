//! The levels of a character.

use fieldlod_hierarchy::{Group, Hierarchy, Sphere};
use glam::Vec3;
use meshopt::SimplifyOptions;

use super::character::{Character, Part};
use crate::config::BakeConfig;
use crate::deviation::deviation_in_local;
use crate::mesh::{MeshError, adapter};
use crate::report::BakeReport;

/// The coarsest level has at least this many triangles.
const FEWEST_TRIANGLES: usize = 24;

/// Triangles of the whole character at a level, and its error.
struct Level {
    triangles: Vec<[u32; 3]>,
    error_in_local: f32,
}

/// The hierarchies of all parts, in order.
pub(super) fn bake(
    character: &Character<'_>,
    config: &BakeConfig,
) -> Result<Vec<(Hierarchy, BakeReport)>, MeshError> {
    let levels = levels_of(character, config);
    let of_parts: Vec<Vec<Vec<[u32; 3]>>> = character
        .parts
        .iter()
        .map(|part| levels_of_part(part, &levels))
        .collect();
    let deviations = deviations(character, &of_parts, config);
    let bounds = Sphere::around(character.positions.iter().copied());
    let groups: Vec<Group> = (0..levels.len())
        .map(|level| Group {
            bounds,
            error_in_local: levels
                .get(level + 1)
                .map_or(f32::INFINITY, |next| next.error_in_local),
            deviation_in_local: deviations.get(level + 1).copied().unwrap_or(f32::INFINITY),
            ..Group::default()
        })
        .collect();
    let parts = character.parts.iter().zip(of_parts);
    let of_part = |(part, levels)| hierarchy(character, part, levels, &groups);
    parts.map(of_part).collect()
}

fn levels_of(character: &Character<'_>, config: &BakeConfig) -> Vec<Level> {
    let triangles = |indices: &[u32]| indices.as_chunks::<3>().0.to_vec();
    let mut levels = vec![Level {
        triangles: triangles(&character.indices),
        error_in_local: 0.0,
    }];
    let positions: Vec<[f32; 3]> = character.positions.iter().map(Vec3::to_array).collect();
    loop {
        let last = &levels[levels.len() - 1];
        let count = last.triangles.len();
        let target = (count as f32 * config.simplify_ratio) as usize;
        if target < FEWEST_TRIANGLES {
            return levels;
        }
        let mut error = 0.0;
        let options = SimplifyOptions::ErrorAbsolute | SimplifyOptions::Permissive;
        let indices = meshopt::simplify(
            &character.indices,
            &adapter(&positions),
            target * 3,
            f32::MAX,
            options,
            Some(&mut error),
        );
        let is_stuck = indices.len() as f32 > count as f32 * 3.0 * config.stuck_ratio;
        if indices.is_empty() || is_stuck {
            return levels;
        }
        let error_in_local = last.error_in_local.max(error).clamp(0.0, f32::MAX);
        levels.push(Level {
            triangles: triangles(&indices),
            error_in_local,
        });
    }
}

/// The levels of a part, with its own indices. A part that vanishes keeps its last level.
fn levels_of_part(part: &Part<'_>, levels: &[Level]) -> Vec<Vec<[u32; 3]>> {
    let mut own: Vec<Vec<[u32; 3]>> = Vec::new();
    for level in levels {
        let is_own = |triangle: &&[u32; 3]| triangle.iter().all(|v| part.vertices.contains(v));
        let to_own = |triangle: &[u32; 3]| triangle.map(|vertex| vertex - part.vertices.start);
        let triangles: Vec<_> = level.triangles.iter().filter(is_own).map(to_own).collect();
        own.push(match own.last() {
            Some(last) if triangles.is_empty() => last.clone(),
            _ => triangles,
        });
    }
    own
}

/// For each level, the largest deviation of all parts at it or at a finer one.
fn deviations(
    character: &Character<'_>,
    of_parts: &[Vec<Vec<[u32; 3]>>],
    config: &BakeConfig,
) -> Vec<f32> {
    let count = of_parts.first().map_or(0, Vec::len);
    let mut deviations = vec![0.0f32; count];
    if !config.measure_deviation {
        return vec![f32::INFINITY; count];
    }
    for (part, levels) in character.parts.iter().zip(of_parts) {
        let mesh = &part.primitive.mesh;
        let levels: Vec<&[[u32; 3]]> = levels.iter().map(Vec::as_slice).collect();
        let measured = deviation_in_local(mesh, &mesh.positions, &levels[1..]);
        for (deviation, measured) in deviations[1..].iter_mut().zip(measured) {
            *deviation = deviation.max(measured);
        }
    }
    deviations
}

fn hierarchy(
    character: &Character<'_>,
    part: &Part<'_>,
    levels: Vec<Vec<[u32; 3]>>,
    groups: &[Group],
) -> Result<(Hierarchy, BakeReport), MeshError> {
    let (mesh, rig) = (&part.primitive.mesh, part.rig);
    let mut source = mesh.source_hash();
    if rig.skin.is_some() {
        source = source.with_joints(&rig.joints, &rig.weights);
    }
    for target in &rig.targets {
        source = source.with_morph_target(target);
    }
    let mut hierarchy = Hierarchy {
        source,
        source_vertex_count: mesh.positions.len() as u32,
        vertices: mesh.finite_vertices(),
        carrier_joint: rig.skin.and(character.carrier_joint),
        ..Hierarchy::default()
    };
    for (triangles, group) in levels.iter().zip(groups) {
        let pushed = hierarchy.push_whole_mesh(triangles, *group);
        pushed.ok_or(MeshError::TooLargeForRig {
            vertices: mesh.positions.len(),
        })?;
    }
    debug_assert_eq!(hierarchy.validate(), Ok(()));
    let report = BakeReport {
        whole_mesh_levels: levels.len() - 1,
        coarsest_triangles: levels.last().map_or(0, Vec::len),
        ..BakeReport::default()
    };
    Ok((hierarchy, report))
}
