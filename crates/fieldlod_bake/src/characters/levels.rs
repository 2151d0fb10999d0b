//! The levels of a character.

use fieldlod_hierarchy::{Group, Hierarchy, Sphere};
use rayon::prelude::*;

use super::character::{Character, Part};
use super::deviation::{deviations, deviations_of_components, mean_distances};
use super::poses::{Pose, Training, clip_poses};
use super::simplify::Simplifier;
use crate::config::BakeConfig;
use crate::import::Import;
use crate::mesh::MeshError;
use crate::report::BakeReport;

/// A guarantee is this many times the largest deviation in the training poses. Held-out clips deviated up to 1.47 times
/// as far. Smaller margins are exceeded; larger margins keep finer levels for longer than needed.
const POSE_MARGIN: f32 = 1.5;
/// Smallest number of triangles to simplify to. Fewer show no limbs.
const FEWEST_TRIANGLES: usize = 24;
/// The error of a level relative to the root mean square of its distances. The errors that the simplifier reports for
/// static meshes are 4 to 5 times the root mean square of their distances. Characters and props therefore change levels
/// at similar differences.
const ERROR_PER_RMS: f32 = 4.0;
/// Strengths of poses relative to shape. Each level uses the strength that deviates least. Without 0, 1 or 4, four
/// characters need 24, 4 or 20 % more triangles at equal deviation; with 2 or 8 in place of 4, 18 % more; with 0.5 or 2
/// in place of 1, 2 % more. A fourth candidate, 4 with protected texture seams, saves 0.2 %.
const STRENGTHS: [f32; 3] = [0.0, 1.0, 4.0];

/// A level of the whole character, measured in the training poses.
struct Level {
    triangles: Vec<[u32; 3]>,
    /// The largest distance from the source.
    deviation: f32,
    /// The error that decides when the level is drawn.
    error: f32,
}

/// The hierarchies of all parts, in order.
pub(super) fn bake(
    character: &Character<'_>,
    import: &Import,
    config: &BakeConfig,
) -> Result<Vec<(Hierarchy, BakeReport)>, MeshError> {
    let training = Training::of(
        character,
        import,
        &clip_poses(character, import, &import.clips),
    );
    let levels = levels_of(character, &training, config);
    let bounds = bounds(character, &training.poses);
    let group = |level: usize| {
        let next = levels.get(level + 1);
        Group {
            bounds,
            error_in_local: next.map_or(f32::INFINITY, |next| next.error),
            deviation_in_local: next
                .filter(|_| config.measure_deviation)
                .map_or(f32::INFINITY, Level::stated_deviation),
            ..Group::default()
        }
    };
    let groups: Vec<Group> = (0..levels.len()).map(group).collect();
    let parts = character.parts.iter();
    parts
        .map(|part| hierarchy(character, part, &levels, &groups))
        .collect()
}

/// All levels, finest first, starting with the source.
fn levels_of(character: &Character<'_>, training: &Training, config: &BakeConfig) -> Vec<Level> {
    let few = training.chosen();
    let simplifier = Simplifier::of(character, few);
    let targets = std::iter::successors(Some(character.triangles().len()), |&count| {
        let target = (count as f32 * config.simplify_ratio) as usize;
        (target >= FEWEST_TRIANGLES).then_some(target)
    });
    let jobs = targets
        .skip(1)
        .flat_map(|target| STRENGTHS.map(|strength| (target, strength)));
    let jobs: Vec<(usize, f32)> = jobs.collect();
    let simplified = jobs.par_iter();
    let simplified = simplified.map(|(target, strength)| simplifier.simplify(*target, *strength));
    let candidates: Vec<Vec<[u32; 3]>> = simplified.collect();
    let measured = deviations_of_components(character, few, &candidates);
    let candidates: Vec<_> = candidates.into_iter().zip(measured).collect();
    let mut levels = vec![Level {
        triangles: character.triangles().to_vec(),
        deviation: 0.0,
        error: 0.0,
    }];
    let mut simplified = Vec::new();
    for of_level in candidates.chunks(STRENGTHS.len()) {
        let last = &levels[levels.len() - 1];
        let most = last.triangles.len() as f32 * config.stuck_ratio;
        let coarser = of_level.iter().map(|(triangles, of_components)| {
            let level = last.coarser(character, triangles, of_components);
            (triangles, level)
        });
        // Without enough progress, there is no level. Candidates of the next target are compared with the same level.
        let usable = coarser.filter(|(_, level)| level.triangles.len() as f32 <= most);
        let best = usable.min_by(|(_, a), (_, b)| a.deviation.total_cmp(&b.deviation));
        if let Some((triangles, level)) = best {
            simplified.push(triangles);
            levels.push(level);
        }
    }
    let mut rms = 0.0f32;
    let means = mean_distances(character, few, &simplified);
    for (level, mean) in levels.iter_mut().skip(1).zip(means) {
        // Errors must not shrink towards coarser levels.
        rms = rms.max(mean);
        // Four times the root mean square may exceed the largest distance. The distance in all poses may be measured
        // later, and must not change the error.
        level.error = (rms * ERROR_PER_RMS).min(level.deviation).min(f32::MAX);
    }
    if few.len() < training.poses.len() && config.measure_deviation {
        measure_again(character, &training.poses, &mut levels[1..]);
    }
    levels
}

/// Measures levels in all training poses. A part of these poses was used to choose the levels.
fn measure_again(character: &Character<'_>, poses: &[Pose], levels: &mut [Level]) {
    let triangles: Vec<&[[u32; 3]]> = levels.iter().map(|level| &*level.triangles).collect();
    let measured = deviations(character, poses, &triangles);
    let mut deviation = 0.0f32;
    for (level, own) in levels.iter_mut().zip(measured) {
        // Deviations must not shrink towards coarser levels.
        deviation = deviation.max(own);
        level.deviation = deviation;
    }
}

impl Level {
    /// The deviation that the hierarchy states, with a margin for other poses.
    fn stated_deviation(&self) -> f32 {
        (self.deviation * POSE_MARGIN).min(f32::MAX)
    }

    /// The next level, with `triangles`. A component that vanishes far from all others would determine the deviation,
    /// so it keeps its triangles of this level.
    fn coarser(
        &self,
        character: &Character<'_>,
        triangles: &[[u32; 3]],
        of_components: &[f32],
    ) -> Self {
        let component = |triangle: &[u32; 3]| character.component[triangle[0] as usize] as usize;
        let mut is_left = vec![false; of_components.len()];
        triangles
            .iter()
            .for_each(|triangle| is_left[component(triangle)] = true);
        let numbered = of_components.iter().enumerate();
        let of_left = numbered.filter(|(index, _)| is_left[*index]);
        let deviation = of_left.fold(self.deviation, |most, (_, own)| most.max(*own));
        let is_kept = |triangle: &&[u32; 3]| {
            let own = component(triangle);
            !is_left[own] && of_components[own] > deviation
        };
        let kept = self.triangles.iter().filter(is_kept);
        Self {
            triangles: triangles.iter().chain(kept).copied().collect(),
            deviation,
            error: 0.0,
        }
    }
}

/// A sphere around the character in all poses.
fn bounds(character: &Character<'_>, poses: &[Pose]) -> Sphere {
    Sphere::around(poses.iter().flat_map(|pose| pose.positions(character)))
}

/// The levels of a part, with indices into its vertices. A part that vanishes keeps its previous level.
fn levels_of_part(part: &Part<'_>, levels: &[Level]) -> Vec<Vec<[u32; 3]>> {
    let mut own: Vec<Vec<[u32; 3]>> = Vec::new();
    for level in levels {
        let is_own = |triangle: &&[u32; 3]| part.vertices.contains(&triangle[0]);
        let to_own = |triangle: &[u32; 3]| triangle.map(|vertex| vertex - part.vertices.start);
        let triangles: Vec<_> = level.triangles.iter().filter(is_own).map(to_own).collect();
        own.push(match own.last() {
            Some(last) if triangles.is_empty() => last.clone(),
            _ => triangles,
        });
    }
    own
}

fn hierarchy(
    character: &Character<'_>,
    part: &Part<'_>,
    levels: &[Level],
    groups: &[Group],
) -> Result<(Hierarchy, BakeReport), MeshError> {
    let mesh = &part.primitive.mesh;
    let mut hierarchy = Hierarchy {
        source: part.source_hash(),
        source_vertex_count: mesh.positions.len() as u32,
        vertices: mesh.finite_vertices(),
        carrier_joint: character.carrier_joint(),
        ..Hierarchy::default()
    };
    let levels = levels_of_part(part, levels);
    for (triangles, group) in levels.iter().zip(groups) {
        let pushed = hierarchy.push_whole_mesh(triangles, *group);
        let vertices = mesh.positions.len();
        pushed.ok_or(MeshError::TooLargeForRig { vertices })?;
    }
    debug_assert_eq!(hierarchy.validate(), Ok(()));
    let report = BakeReport {
        whole_mesh_levels: levels.len() - 1,
        coarsest_triangles: levels.last().map_or(0, Vec::len),
        ..BakeReport::default()
    };
    Ok((hierarchy, report))
}
