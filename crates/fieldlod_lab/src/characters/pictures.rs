//! Pictures of posed levels.

use fieldlod_bake::{Character, Pose, Surface};
use fieldlod_hierarchy::{Group, Hierarchy, Sphere, Vertices};

use super::relative;
use crate::measure::{geometric_mean, image_error};
use crate::props::{direction, eye};
use crate::render::{RenderError, Renderer};

/// Numbers and sizes of the pictures.
#[derive(Clone, Debug)]
pub struct PictureOptions {
    /// Number of view directions.
    pub directions: u32,
    /// Largest number of poses.
    pub poses: usize,
    /// Radii on screen in pixels.
    pub radii_px: Vec<f32>,
}

/// Draws the levels of the bake and of the baseline in several poses, and compares them with the source.
/// Returns the triangles relative to the baseline at equal RMSE.
pub(super) fn at_equal_rmse(
    (renderer, options): (&Renderer, &PictureOptions),
    character: &Character<'_>,
    poses: &[Pose],
    [own, plain]: [&[Vec<[u32; 3]>]; 2],
) -> Result<Option<f64>, RenderError> {
    let counts: Vec<usize> = own.iter().chain(plain).map(Vec::len).collect();
    let sizes = options.radii_px.len();
    let mut sums = vec![vec![0.0f64; counts.len()]; sizes];
    // Successive poses are nearly equal, so the pictures use poses from all over the clips.
    let step = poses.len().div_ceil(options.poses).max(1);
    let poses: Vec<&Pose> = poses.iter().step_by(step).collect();
    let surface = common_surface(character);
    for pose in &poses {
        let posed = posed(character, pose, own.iter().chain(plain));
        let model = renderer.upload(&posed, surface);
        let sphere = Sphere::around(posed.vertices.positions.iter().copied());
        for (size, &radius_px) in options.radii_px.iter().enumerate() {
            for index in 0..options.directions {
                let eye = eye(&sphere, direction(index, options.directions), radius_px);
                let reference = renderer.draw(&model, &eye, &[0])?;
                for (level, sum) in sums[size].iter_mut().enumerate() {
                    let picture = renderer.draw(&model, &eye, &[level as u32 + 1])?;
                    *sum += image_error(&reference, &picture, false).rmse;
                }
            }
        }
    }
    let drawn = (poses.len() * options.directions as usize).max(1) as f64;
    let ratios = sums.iter().filter_map(|sums| {
        let means = sums.iter().map(|sum| (sum / drawn) as f32);
        let points: Vec<(usize, f32)> = counts.iter().copied().zip(means).collect();
        let (own, plain) = points.split_at(own.len());
        relative(own, plain)
    });
    Ok(geometric_mean(ratios))
}

/// The surface that all parts share. `None` if they differ: a model is drawn with one texture.
pub(super) fn common_surface<'a>(character: &Character<'a>) -> Option<&'a Surface> {
    let mut surfaces = character
        .parts
        .iter()
        .map(|part| &part.primitive.mesh.surface);
    let first = surfaces.next()?;
    let is_common = surfaces.all(|surface| surface == first);
    first.as_deref().filter(|_| is_common)
}

/// A hierarchy with one unit for the source and one for each level, in a pose.
pub(super) fn posed<'a>(
    character: &'a Character<'_>,
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
    for triangles in std::iter::once(character.triangles()).chain(levels.map(Vec::as_slice)) {
        let pushed = posed.push_whole_mesh(triangles, Group::default());
        pushed.expect("drawn characters have at most 65,536 vertices");
    }
    posed
}
