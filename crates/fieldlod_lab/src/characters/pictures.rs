//! Pictures of posed levels.

use fieldlod_bake::{Character, Pose};
use fieldlod_hierarchy::{Group, Hierarchy, Sphere, Vertices};
use serde::Serialize;

use super::curve::{Curve, geometric_mean};
use crate::measure::image_error;
use crate::props::{direction, eye};
use crate::render::{Picture, RenderError, Renderer, SUPERSAMPLING};

/// How much is drawn.
#[derive(Clone, Debug)]
pub struct PictureOptions {
    /// View directions.
    pub directions: u32,
    /// Poses.
    pub poses: usize,
    /// Radii on screen in pixels.
    pub radii_px: Vec<f32>,
}

/// Differences of pictures from those of the source.
#[derive(Clone, Debug, Serialize)]
pub struct Pictures {
    /// Triangles relative to the baseline at equal RMSE: the mean over sizes.
    pub at_equal_rmse: Option<f64>,
    /// Texels of background in cracks of a level, inside the outline of the source: the largest sum over the pictures of a
    /// level.
    pub gaps: u64,
    /// For each size, triangles and RMSE of the levels.
    pub rmse: Vec<Vec<(usize, f32)>>,
    /// The same of the baseline.
    pub plain_rmse: Vec<Vec<(usize, f32)>>,
}

impl Pictures {
    /// Draws two chains of levels.
    pub(super) fn of(
        renderer: &Renderer,
        options: &PictureOptions,
        character: &Character<'_>,
        poses: &[Pose],
        [own, plain]: [&[Vec<[u32; 3]>]; 2],
    ) -> Result<Self, RenderError> {
        let counts: Vec<usize> = own.iter().chain(plain).map(Vec::len).collect();
        let sizes = options.radii_px.len();
        let mut sums = vec![vec![0.0f64; counts.len()]; sizes];
        let mut gaps = vec![0u64; counts.len()];
        let step = poses.len().div_ceil(options.poses).max(1);
        let poses: Vec<&Pose> = poses.iter().step_by(step).collect();
        let surface = character
            .parts
            .first()
            .and_then(|part| part.primitive.mesh.surface.clone());
        let is_common = character
            .parts
            .iter()
            .all(|part| part.primitive.mesh.surface == surface);
        for pose in &poses {
            let posed = posed(character, pose, own.iter().chain(plain));
            let model = renderer.upload_textured(&posed, surface.as_deref().filter(|_| is_common));
            let sphere = Sphere::around(posed.vertices.positions.iter().copied());
            for (size, &radius_px) in options.radii_px.iter().enumerate() {
                for index in 0..options.directions {
                    let eye = eye(&sphere, direction(index, options.directions), radius_px);
                    let reference = renderer.draw(&model, &eye, &[0])?;
                    for level in 0..counts.len() {
                        let picture = renderer.draw(&model, &eye, &[level as u32 + 1])?;
                        sums[size][level] += image_error(&reference, &picture, false).rmse;
                        gaps[level] += gaps_of(&reference, &picture);
                    }
                }
            }
        }
        let drawn = (poses.len() * options.directions as usize).max(1) as f64;
        let points = |sums: &Vec<f64>| -> Vec<(usize, f32)> {
            let means = sums.iter().map(|sum| (sum / drawn) as f32);
            counts.iter().copied().zip(means).collect()
        };
        let points: Vec<Vec<(usize, f32)>> = sums.iter().map(points).collect();
        let rmse: Vec<_> = points
            .iter()
            .map(|points| points[..own.len()].to_vec())
            .collect();
        let plain_rmse: Vec<_> = points
            .iter()
            .map(|points| points[own.len()..].to_vec())
            .collect();
        let pairs = rmse.iter().zip(&plain_rmse);
        let ratios = pairs.filter_map(|(own, plain)| Curve::of(plain).relative(own));
        Ok(Self {
            at_equal_rmse: geometric_mean(ratios),
            gaps: gaps[..own.len()].iter().copied().max().unwrap_or(0),
            rmse,
            plain_rmse,
        })
    }
}

/// The source and the levels in a pose, a unit each.
fn posed<'a>(
    character: &Character<'_>,
    pose: &Pose,
    levels: impl Iterator<Item = &'a Vec<[u32; 3]>>,
) -> Hierarchy {
    let mesh = &character.mesh;
    let mut posed = Hierarchy {
        vertices: Vertices {
            positions: pose.positions(character),
            normals: pose.normals(character),
            ..mesh.vertices.clone()
        },
        source_vertex_count: mesh.positions.len() as u32,
        ..Hierarchy::default()
    };
    posed.push_whole_mesh(character.triangles(), Group::default());
    for level in levels {
        posed.push_whole_mesh(level, Group::default());
    }
    posed
}

/// Texels of background where the source is covered all around, with the level on both sides, at most two texels away.
fn gaps_of(reference: &Picture, picture: &Picture) -> u64 {
    let width = (picture.size_px.x * SUPERSAMPLING) as usize;
    let height = (picture.size_px.y * SUPERSAMPLING) as usize;
    let is_drawn = |x: usize, y: usize| picture.covered[y * width + x];
    let is_inside = |x: usize, y: usize| {
        (y - 2..=y + 2).all(|y| {
            reference.covered[y * width + x - 2..=y * width + x + 2]
                .iter()
                .all(|covered| *covered)
        })
    };
    let is_between = |x: usize, y: usize, dx: usize, dy: usize| {
        let before = is_drawn(x - dx, y - dy) || is_drawn(x - 2 * dx, y - 2 * dy);
        before && (is_drawn(x + dx, y + dy) || is_drawn(x + 2 * dx, y + 2 * dy))
    };
    let inner = (2..height - 2).flat_map(|y| (2..width - 2).map(move |x| (x, y)));
    let is_gap = |&(x, y): &(usize, usize)| {
        !is_drawn(x, y) && (is_between(x, y, 1, 0) || is_between(x, y, 0, 1)) && is_inside(x, y)
    };
    inner.filter(is_gap).count() as u64
}
