//! Measures on pictures from which distance each level of a plant looks like the source.
//!
//! The deviation of a crown's level is that of its worst leaf, but what is seen of a crown is its
//! outline, its light and its colours. So each level is drawn beside the source from [`DIRECTIONS`]
//! directions, at sizes from [`LARGEST_PX`] down by halves, and the pictures are compared as an eye sees
//! them: encoded, and blurred as pixel and eye do (the first two steps of P. Andersson et al., FLIP: A
//! Difference Evaluator for Alternating Images, HPG 2020). Differences count relative to the detail that
//! the source's own picture has at that size, which masks them. The largest sampling density at which
//! they are no more than those of smooth meshes at 1 px of error is the field's strength `c` up to which
//! the level is as good as 1 px. The error by which it is chosen is then `1 / √c`, a length.

use fieldlod_hierarchy::{Hierarchy, Sphere, WholeMeshCut};
use rayon::prelude::*;

use crate::mesh::surfaces::Surfaces;
use crate::plants::picture::{Model, Picture, Viewpoint};

/// From how many directions a mesh is seen.
const DIRECTIONS: usize = 12;
/// The largest radius of the mesh in a picture, in pixels, and how many sizes there are.
const LARGEST_PX: f32 = 64.0;
const SIZES: usize = 5;
/// Samples of a pixel along each axis in the largest pictures; smaller ones have more.
const SAMPLES: usize = 2;
/// The root of the mean squared difference, relative to the source's detail, that is as good as 1 px: the
/// mean of what smooth meshes have at 1 px of error, which is 0.8 to 1.6.
const AS_GOOD_AS_1_PX: f32 = 1.25;
/// No picture has less detail than this, of 1.
const LEAST_DETAIL: f32 = 0.002;
/// The factor that the criterion applies to the error of a mesh that faces all ways: √(1 + 0.4).
const FACING_ALL_WAYS: f32 = 1.183_216;
/// Levels with more vertices are never drawn as whole meshes: 16 bits do not count them.
pub(crate) const MOST_VERTICES: u32 = 1 << 16;

/// Measures the levels of a mesh that can be drawn as a whole, and states in each group the error of the level that it
/// is simplified to.
pub(crate) fn measure_levels(hierarchy: &mut Hierarchy, surfaces: &Surfaces) {
    if hierarchy.source_vertex_count > MOST_VERTICES {
        return;
    }
    let cuts = hierarchy.whole_mesh_cuts();
    let radius = sphere_of(hierarchy).radius;
    let differences = differences(hierarchy, &cuts, surfaces);
    let mut errors = vec![0.0f32; hierarchy.level_count() as usize + 1];
    for (cut, by_size) in cuts.iter().skip(1).zip(differences) {
        let good_until_px = good_until(by_size);
        let seen = seen_error(radius, good_until_px);
        let told = hierarchy.largest_below(cut.group_level, |group| group.error_in_local);
        // If the largest picture shows no difference, the error of the simplifier may be smaller.
        let is_good_at_all = good_until_px >= LARGEST_PX;
        errors[cut.group_level as usize] = if is_good_at_all { seen.min(told) } else { seen };
    }
    // No level looks better than a finer one.
    for level in 1..errors.len() {
        errors[level] = errors[level].max(errors[level - 1]).min(f32::MAX);
    }
    for group in hierarchy.groups.iter_mut().filter(|g| !g.is_terminal()) {
        group.whole_mesh_error_in_local = errors[group.level as usize + 1];
    }
}

/// The error by which a level is chosen that is good enough up to such a radius of the mesh.
fn seen_error(radius: f32, good_until_px: f32) -> f32 {
    radius / (good_until_px * FACING_ALL_WAYS)
}

fn sphere_of(hierarchy: &Hierarchy) -> Sphere {
    let count = hierarchy.source_vertex_count as usize;
    Sphere::around(hierarchy.vertices.positions.iter().take(count).copied())
}

/// Sums of squares over the pixels of a picture.
#[derive(Clone, Copy, Default)]
struct Squares {
    squares: f32,
    covered: f32,
}

/// How each cut but the first differs from the first, relative to the detail of the first: a root mean square over all
/// directions, at each size, the largest first.
fn differences(
    hierarchy: &Hierarchy,
    cuts: &[WholeMeshCut],
    surfaces: &Surfaces,
) -> Vec<[f32; SIZES]> {
    let Some((source, levels)) = cuts.split_first() else {
        return Vec::new();
    };
    let vertices = &hierarchy.vertices;
    let count = hierarchy.source_vertex_count as usize;
    let sphere = sphere_of(hierarchy);
    let looks = surfaces.looks_of(hierarchy);
    let model = Model {
        positions: &vertices.positions,
        normals: &vertices.normals,
        colors: &vertices.colors,
        surfaces: &looks.surfaces,
        uvs: &looks.uvs,
        sphere,
        exposure: surfaces.exposure(vertices.colors.get(..count).unwrap_or(&[])),
    };
    let side = (2.0 * LARGEST_PX) as usize * SAMPLES;
    let views = (0..DIRECTIONS).into_par_iter();
    // The detail first, and then the differences of each level.
    let by_view = views.map(|index| {
        let view = Viewpoint::around(index, DIRECTIONS);
        let source = sizes_of(model.draw(&source.triangles, &view, side));
        let detail = std::array::from_fn(|size| {
            let picture = &source[size];
            squares_of(picture, &picture.blurred().blurred())
        });
        let triangles = levels.iter();
        let triangles = triangles.map(|level| model.draw(&level.triangles, &view, side));
        let differences = triangles.map(|level| {
            let level = sizes_of(level);
            std::array::from_fn(|size| squares_of(&source[size], &level[size]))
        });
        std::iter::once(detail).chain(differences).collect()
    });
    let by_view: Vec<Vec<[Squares; SIZES]>> = by_view.collect();
    let mean = |index: usize, size: usize| {
        let mean_of = |levels: &Vec<[Squares; SIZES]>| {
            let Squares { squares, covered } = levels[index][size];
            squares / covered.max(1.0)
        };
        by_view.iter().map(mean_of).sum::<f32>() / DIRECTIONS as f32
    };
    let relative = |level: usize, size: usize| {
        let detail = mean(0, size).max(LEAST_DETAIL * LEAST_DETAIL);
        (mean(level, size) / detail).sqrt()
    };
    let of_level = |level: usize| std::array::from_fn(|size| relative(level, size));
    (1..=levels.len()).map(of_level).collect()
}

/// The picture at each size, the largest first, as an eye sees it.
fn sizes_of(mut picture: Picture) -> [Picture; SIZES] {
    std::array::from_fn(|_| {
        picture = picture.halved();
        picture.encoded().blurred()
    })
}

/// The squared differences of two pictures, and what is covered in either.
fn squares_of(a: &Picture, b: &Picture) -> Squares {
    let pixels = a.pixels.iter().zip(&b.pixels);
    pixels.fold(Squares::default(), |sum, (a, b)| Squares {
        squares: sum.squares + (*a - *b).truncate().length_squared() / 3.0,
        covered: sum.covered + a.w.max(b.w),
    })
}

/// The largest radius of the mesh in pixels at which a level is good enough, given its difference at all
/// sizes, the largest first; [`LARGEST_PX`] if it is at all of them.
fn good_until(by_size: [f32; SIZES]) -> f32 {
    let radius_px = |size: usize| LARGEST_PX / (1u32 << size) as f32;
    // Colours may be too bright for finite differences: count them as bad.
    let by_size = by_size.map(|d| if d.is_finite() { d } else { f32::MAX });
    match by_size.iter().position(|&d| d <= AS_GOOD_AS_1_PX) {
        Some(0) => LARGEST_PX,
        Some(size) => {
            let (good, bad) = (by_size[size], by_size[size - 1]);
            radius_px(size) * (1.0 + (AS_GOOD_AS_1_PX - good) / (bad - good))
        }
        // Further away it shrinks as the mesh does.
        None => radius_px(SIZES - 1) * AS_GOOD_AS_1_PX / by_size[SIZES - 1],
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn unknown_differences_are_bad() {
        for bad in [f32::NAN, f32::INFINITY] {
            assert!(seen_error(1.0, good_until([bad; SIZES])) > 1e30);
            assert_eq!(good_until([0.0, bad, bad, bad, bad]), LARGEST_PX);
            let in_between = good_until([bad, bad, 1.0, 1.0, 1.0]);
            assert!((16.0..16.1).contains(&in_between), "{in_between}");
        }
    }
}
