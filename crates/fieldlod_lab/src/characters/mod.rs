//! Levels of skinned and morphed meshes, in held-out animations.
//!
//! The bake gets half of the clips: every second one, or the first half of each if there are few. The levels are measured in
//! the other half. The baseline simplifies each primitive by itself in the bind pose, with normals, `Regularize` and
//! `Permissive`, as gltfpack can.

mod pictures;

use std::fmt::Write;

use fieldlod_bake::{
    BakeConfig, Channel, Character, Clip, Import, Pose, bake_rigged, clip_poses, deviations,
    plain_levels,
};
use fieldlod_hierarchy::Hierarchy;
use serde::Serialize;

use crate::chart::at_error;
use crate::measure::{geometric_mean, greatest};
use crate::render::{RenderError, Renderer};
pub use pictures::PictureOptions;
use pictures::at_equal_rmse;

/// Files with more clips are split by clips, and others by time: of few clips, half would miss whole kinds of motion.
const MANY_CLIPS: usize = 10;
/// Largest number of held-out poses in which levels are measured. Fewer may miss the largest deviation; the time grows with
/// the number.
const MOST_POSES: usize = 64;

/// Largest number of vertices of a drawn character: a drawn level is one unit with 16-bit indices. A bake
/// limits only the vertices of each part.
const MOST_DRAWN_VERTICES: usize = 1 << 16;

/// The levels of one character, measured in held-out poses.
#[derive(Clone, Debug, Serialize)]
pub struct CharacterResult {
    /// The name of its file.
    pub name: String,
    /// Number of its primitives.
    pub parts: usize,
    /// Triangles of its source.
    pub triangles: usize,
    /// Number of held-out poses.
    pub poses: usize,
    /// Triangles of each level, and its greatest deviation relative to the character's radius.
    pub levels: Vec<(usize, f32)>,
    /// Triangles of each level of the baseline, and its greatest deviation relative to the character's radius.
    pub plain: Vec<(usize, f32)>,
    /// The greatest ratio of measured to stated deviation. It equals the pixels of displacement at a guarantee of 1 px.
    pub of_promise: f64,
    /// The greatest ratio of the baseline's deviation to its deviation in the bind pose.
    pub plain_of_bind: f64,
    /// Triangles relative to the baseline at equal deviations.
    pub at_equal_deviation: Option<f64>,
    /// Triangles relative to the baseline at equal RMSE: the geometric mean over sizes. `None` if no pictures were drawn.
    /// Characters with more than 65,536 vertices are not drawn.
    pub at_equal_rmse: Option<f64>,
}

/// Splits the clips of a file: the bake gets the first part.
fn split(clips: Vec<Clip>) -> [Vec<Clip>; 2] {
    if clips.len() > MANY_CLIPS {
        let (even, odd): (Vec<_>, Vec<_>) = clips
            .into_iter()
            .enumerate()
            .partition(|(index, _)| index % 2 == 0);
        return [even, odd].map(|part| part.into_iter().map(|(_, clip)| clip).collect());
    }
    [false, true].map(|is_second| clips.iter().map(|clip| half(clip, is_second)).collect())
}

/// The keyframes of a clip in its first or second half.
fn half(clip: &Clip, is_second: bool) -> Clip {
    let times = clip.channels.iter().flat_map(|channel| &channel.times);
    let middle = times.copied().fold(0.0, f32::max) * 0.5;
    let cut = |channel: &Channel| {
        let stride = channel.values.len() / channel.times.len();
        let keyframes = channel.times.iter().zip(channel.values.chunks(stride));
        let kept = keyframes.filter(|(time, _)| (**time > middle) == is_second);
        let (times, values): (Vec<f32>, Vec<&[f32]>) = kept.unzip();
        let values = values.concat();
        (!times.is_empty()).then_some(Channel {
            times,
            values,
            ..channel.clone()
        })
    };
    Clip {
        name: clip.name.clone(),
        channels: clip.channels.iter().filter_map(cut).collect(),
    }
}

/// Bakes the characters of a file with half of its clips, and measures them in the other half. Primitives that
/// could not be baked are added to `failed`, a line for each; their characters are not measured.
///
/// # Errors
/// The errors of [`Renderer::draw`].
pub fn measure(
    name: &str,
    mut import: Import,
    drawing: Option<(&Renderer, &PictureOptions)>,
    failed: &mut Vec<String>,
) -> Result<Vec<CharacterResult>, RenderError> {
    let [baked, held_out] = split(std::mem::take(&mut import.clips));
    import.clips = baked;
    let mut hierarchies: Vec<Option<Hierarchy>> = vec![None; import.primitives.len()];
    let rigged = import.primitives.iter().enumerate();
    let rigged = rigged.filter(|(_, primitive)| primitive.rig.is_some());
    let baked = bake_rigged(&import, &BakeConfig::default());
    for ((index, _), (place, result)) in rigged.zip(baked) {
        match result {
            Ok((hierarchy, _)) => hierarchies[index] = Some(hierarchy),
            Err(fault) => failed.push(format!(
                "{name}: could not bake {place}: {fault}; skipping its character"
            )),
        }
    }
    let characters = Character::all_of(&import).into_iter();
    let measured = characters.filter_map(|character| {
        let hierarchies = character
            .parts
            .iter()
            .map(|part| hierarchies[part.index].as_ref());
        let hierarchies: Vec<&Hierarchy> = hierarchies.collect::<Option<_>>()?;
        let poses = clip_poses(&character, &import, &held_out);
        let step = poses.len().div_ceil(MOST_POSES).max(1);
        let poses: Vec<Pose> = poses.into_iter().step_by(step).collect();
        // Only characters that a held-out clip moves are measured.
        if poses.is_empty() {
            return None;
        }
        let subject = Subject::of(&character, &hierarchies, poses);
        Some(subject.measure(name, drawing))
    });
    measured.collect()
}

/// A baked character with its baseline, and the poses in which both are measured.
struct Subject<'a> {
    character: &'a Character<'a>,
    /// Held-out poses.
    poses: Vec<Pose>,
    /// The triangles of all levels, the source first.
    levels: Vec<Vec<[u32; 3]>>,
    /// The stated deviation of each level except the source.
    stated: Vec<f32>,
    /// The triangles of the baseline's levels, without the source.
    plain: Vec<Vec<[u32; 3]>>,
    /// The radius of the character in all poses of the bake.
    radius: f32,
}

impl<'a> Subject<'a> {
    fn of(character: &'a Character<'a>, baked: &[&'a Hierarchy], poses: Vec<Pose>) -> Self {
        let first = baked[0];
        let count = first.groups.len();
        let levels = (0..count).map(|level| character.triangles_at(baked, level));
        Self {
            levels: levels.collect(),
            stated: first
                .groups
                .iter()
                .map(|group| group.deviation_in_local)
                .collect(),
            // At least six halvings, so that short chains also have an equal error on the baseline.
            plain: plain_levels(character, 0.5, count.max(6)),
            radius: first.groups[0].bounds.radius,
            character,
            poses,
        }
    }

    fn measure(
        &self,
        name: &str,
        drawing: Option<(&Renderer, &PictureOptions)>,
    ) -> Result<CharacterResult, RenderError> {
        let vertices = self.character.mesh.positions.len();
        let drawing = drawing.filter(|_| vertices <= MOST_DRAWN_VERTICES);
        let coarser = &self.levels[1..];
        let own = deviations(self.character, &self.poses, coarser);
        let plain = deviations(self.character, &self.poses, &self.plain);
        let in_bind = deviations(self.character, &[Pose::default()], &self.plain);
        let largest_share = |found: &[f32], stated: &[f32]| {
            let shares = found.iter().zip(stated).filter(|(found, _)| **found != 0.0);
            greatest(shares.map(|(found, stated)| f64::from(found / stated)))
        };
        let points = |levels: &[Vec<[u32; 3]>], deviations: &[f32]| -> Vec<(usize, f32)> {
            let counts = levels.iter().map(Vec::len);
            let relative = deviations.iter().map(|deviation| deviation / self.radius);
            counts.zip(relative).collect()
        };
        let (levels, plain_points) = (points(coarser, &own), points(&self.plain, &plain));
        let at_equal_rmse = drawing.map(|drawing| {
            let own_and_plain = [coarser, &self.plain[..]];
            at_equal_rmse(drawing, self.character, &self.poses, own_and_plain)
        });
        Ok(CharacterResult {
            name: name.to_owned(),
            parts: self.character.parts.len(),
            triangles: self.character.triangles().len(),
            poses: self.poses.len(),
            of_promise: largest_share(&own, &self.stated),
            plain_of_bind: largest_share(&plain, &in_bind),
            at_equal_deviation: relative(&levels, &plain_points),
            levels,
            plain: plain_points,
            at_equal_rmse: at_equal_rmse.transpose()?.flatten(),
        })
    }
}

/// The geometric mean ratio of triangles of levels to those of the baseline at equal errors. `None` if no error is between
/// levels of the baseline.
fn relative(levels: &[(usize, f32)], baseline: &[(usize, f32)]) -> Option<f64> {
    let baseline = || {
        baseline
            .iter()
            .map(|&(count, error)| (count as f64, error.into()))
    };
    let ratio =
        |&(count, error): &(usize, f32)| Some(count as f64 / at_error(baseline(), error.into())?);
    geometric_mean(levels.iter().filter_map(ratio))
}

/// A row for each character, and the means.
#[must_use]
pub fn table(results: &[CharacterResult]) -> String {
    let mut text = String::from(
        "held-out clips; triangles relative to plain simplification in the bind pose\n\
         character         parts  triangles  poses   of stated  plain, of bind  at equal deviation  at equal RMSE\n",
    );
    let or_none = |ratio: Option<f64>| ratio.map_or("-".to_owned(), |ratio| format!("{ratio:.2}"));
    for result in results {
        let _ = writeln!(
            text,
            "{:<16}  {:>5}  {:>9}  {:>5}  {:>10.2}  {:>14.2}  {:>18}  {:>13}",
            result.name,
            result.parts,
            result.triangles,
            result.poses,
            result.of_promise,
            result.plain_of_bind,
            or_none(result.at_equal_deviation),
            or_none(result.at_equal_rmse),
        );
    }
    let mean = |ratio: fn(&CharacterResult) -> Option<f64>| {
        or_none(geometric_mean(results.iter().filter_map(ratio)))
    };
    let _ = writeln!(
        text,
        "mean: {} at equal deviation, {} at equal RMSE",
        mean(|result| result.at_equal_deviation),
        mean(|result| result.at_equal_rmse),
    );
    text
}
