//! Measures on pictures at which size each level of a plant or a torn texture looks like the source.
//!
//! The deviation of a crown is the deviation of its worst leaf, but a viewer notices outline, light and colours. Each
//! level is therefore drawn beside the source from [`DIRECTIONS`] directions. The mesh has a radius of [`LARGEST_PX`]
//! in the largest picture, and each other picture is half as large as the previous picture.
//!
//! Pictures are compared as FLIP does in its first two steps: encoded, then blurred (P. Andersson et al., FLIP: A
//! Difference Evaluator for Alternating Images, HPG 2020). Differences are relative to the detail of the source's
//! picture at that size, because detail masks differences. A level is good at a size if its difference is at most that
//! of smooth meshes at 1 px of error. The largest good size gives a sampling density, which is the strength `c` of the
//! field. The level's error is then `1 / √c`, a length.

use fieldlod_hierarchy::{Hierarchy, SILHOUETTE_WEIGHT, Sphere, VISIBLE_WEIGHT, WholeMeshCut};
use rayon::prelude::*;

use crate::mesh::surfaces::Surfaces;
use crate::plants::picture::{Model, Picture, Viewpoint};

/// Number of views of a mesh. The time grows with the number; few views miss sides of the mesh.
const DIRECTIONS: usize = 12;
/// Radius of the mesh in the largest picture, in pixels, and the number of sizes.
const LARGEST_PX: f32 = 64.0;
const SIZES: usize = 5;
/// Samples per pixel along each axis in the largest pictures. Smaller pictures have more.
const SAMPLES: usize = 2;
/// Allowed difference at each size: a root mean square, relative to the detail of the source. Smooth meshes at 1 px of
/// error have 0.8 to 1.6; this is their mean.
const ALLOWED: [f32; SIZES] = [1.25; SIZES];
/// The same for plants. Where leaves are smaller than pixels, the renderer's own picture of the source is farther from
/// the truth, a picture with 64 samples per pixel, than its picture of a coarse level with the right mean (bench
/// `truth`). In Bevy's pictures of a forest with its default of four samples, errors from the truth are 0.82, 0.57, 0.88
/// and 0.80 of the source's at radii of 3, 6, 12 and 24 px.
///
/// Near plants have the balance of other meshes: with 2.5 from 16 to 64 px, the walkthrough has 0.72 of its triangles and
/// an error of 9.0 instead of 8.6, and a threshold of 1.3 px saves more at that error. With 0.9 at 32 px, trees of 24 px
/// have 1.2 times the triangles, and with one sample 1.05 instead of 1.08 of the source's error.
const ALLOWED_FOR_PLANTS: [f32; SIZES] = [1.25, 1.25, 1.5, 3.75, 7.5];
/// Largest spread of the covered area over the directions, a standard deviation relative to the area. Few large leaves
/// cover more from one side than from another. Next to levels of a crown with a spread of 0.006, 0.024 and 0.06, the area
/// seen from one side changes by 1, 2 and 6 %.
const MAX_AREA_SPREAD: f32 = 0.022;
/// A spread of so many pixels is allowed, too: 8 % of a disc with a radius of 3 px. Trees of 6 px have 0.8 of the triangles
/// that they have with 2 pixels, at the same error. With 2.5, changes of level on approach show.
const MAX_AREA_SPREAD_PX: f32 = 2.25;
/// Lower limit for the detail of a picture, from 0 to 1. Differences are divided by the detail, and pictures of a
/// uniform colour have almost none.
const MIN_DETAIL: f32 = 0.002;
/// Larger meshes are never drawn as whole meshes, which have 16-bit indices.
pub(crate) const MAX_VERTICES: u32 = 1 << 16;

/// Measures the levels that can be drawn as whole meshes.
///
/// If `has_aggregates`, each group gets the error of the next coarser level as its whole-mesh error. From the level of
/// the group `torn` on, errors are raised to those of pictures: the simplifier compares texture coordinates only at
/// vertices, and a coarse checker shows up to three times the simplifier's error.
pub(crate) fn measure_levels(
    hierarchy: &mut Hierarchy,
    surfaces: &Surfaces,
    has_aggregates: bool,
    torn: Option<u32>,
) {
    if hierarchy.source_vertex_count > MAX_VERTICES {
        return;
    }
    let cuts = hierarchy.whole_mesh_cuts();
    let looks = looks_of(hierarchy, &cuts, surfaces);
    let of_plant = errors_of_levels(hierarchy, &cuts, &looks, Look::plant_radius);
    let of_torn = errors_of_levels(hierarchy, &cuts, &looks, |look| {
        largest_good_radius(&look.differences, &ALLOWED)
    });
    let torn_level = torn.map(|group| hierarchy.groups[group as usize].level);
    for group in hierarchy.groups.iter_mut().filter(|g| !g.is_terminal()) {
        // A group's error is that of its simplification, which is drawn from the next level on.
        let level = group.level as usize + 1;
        if has_aggregates {
            group.whole_mesh_error_in_local = of_plant[level];
        }
        if torn_level.is_some_and(|level| group.level >= level) {
            group.error_in_local = group.error_in_local.max(of_torn[level]);
        }
    }
}

/// The error of each level on pictures, given the largest radius in pixels at which it looks right. It does not shrink
/// towards coarser levels: where a coarser level looks right, no finer level is needed.
fn errors_of_levels(
    hierarchy: &Hierarchy,
    cuts: &[WholeMeshCut],
    looks: &[Look],
    good_radius_px: impl Fn(&Look) -> f32,
) -> Vec<f32> {
    let radius = sphere_of(hierarchy).radius;
    let mut errors = vec![0.0f32; hierarchy.level_count() as usize + 1];
    let mut least = f32::MAX;
    for (cut, look) in cuts.iter().skip(1).zip(looks).rev() {
        let good_until_px = good_radius_px(look);
        let seen = error_at_radius(radius, good_until_px);
        let simplifier_error =
            hierarchy.largest_below(cut.group_level, |group| group.error_in_local);
        // If a level looks right even in the largest picture, the simplifier's error may be smaller.
        let is_good_at_every_size = good_until_px >= LARGEST_PX;
        let error = if is_good_at_every_size {
            seen.min(simplifier_error)
        } else {
            seen
        };
        least = least.min(error);
        errors[cut.group_level as usize] = least;
    }
    // Levels that are no cut have the error of the finer cut.
    for level in 1..errors.len() {
        errors[level] = errors[level].max(errors[level - 1]);
    }
    errors
}

/// Error of a level that looks right while the radius of the mesh is at most `good_until_px` pixels.
fn error_at_radius(radius: f32, good_until_px: f32) -> f32 {
    // What the criterion of `fieldlod_select` multiplies errors by, if normals point everywhere: a quarter is visible.
    let factor = (0.25 * VISIBLE_WEIGHT + SILHOUETTE_WEIGHT).sqrt();
    radius / (good_until_px * factor)
}

fn sphere_of(hierarchy: &Hierarchy) -> Sphere {
    let count = hierarchy.source_vertex_count as usize;
    Sphere::around(hierarchy.vertices.positions.iter().take(count).copied())
}

/// How a level differs from the source.
struct Look {
    /// At each size, the largest first: a root mean square over all directions, relative to the detail of the source.
    differences: [f32; SIZES],
    /// Standard deviation over all directions of the covered area as a share of the source's, relative to the mean. The
    /// mean says little: if the opacity of leaves is unknown, these pictures show them opaque.
    area_spread: f32,
    /// Mean covered area of the source in the largest pictures.
    area_px: f32,
}

impl Look {
    /// Largest radius in pixels at which the level of a plant looks right.
    fn plant_radius(&self) -> f32 {
        let radius = largest_good_radius(&self.differences, &ALLOWED_FOR_PLANTS);
        if self.area_spread <= MAX_AREA_SPREAD {
            return radius;
        }
        let spread_px = self.area_spread * self.area_px;
        let steady_until_px = LARGEST_PX * (MAX_AREA_SPREAD_PX / spread_px).sqrt();
        let least = largest_good_radius(&self.differences, &ALLOWED);
        radius.min(steady_until_px).max(least)
    }
}

/// Sums over the pixels of the pictures of the source and of a level.
#[derive(Clone, Copy, Default)]
struct Squares {
    squares: f32,
    /// Pixels that either covers, and those that each covers.
    covered: f32,
    covered_by: [f32; 2],
}

/// How each cut differs from the first cut.
fn looks_of(hierarchy: &Hierarchy, cuts: &[WholeMeshCut], surfaces: &Surfaces) -> Vec<Look> {
    let Some((source, levels)) = cuts.split_first() else {
        return Vec::new();
    };
    let vertices = &hierarchy.vertices;
    let count = hierarchy.source_vertex_count as usize;
    let sphere = sphere_of(hierarchy);
    let of_vertices = surfaces.vertex_surfaces(hierarchy);
    let model = Model {
        positions: &vertices.positions,
        normals: &vertices.normals,
        colors: &vertices.colors,
        surfaces: &of_vertices.surfaces,
        uvs: &of_vertices.uvs,
        alphas: &vertices
            .colors
            .iter()
            .map(|color| color.w)
            .collect::<Vec<_>>(),
        sphere,
        exposure: surfaces.exposure(vertices.colors.get(..count).unwrap_or(&[])),
    };
    let side = (2.0 * LARGEST_PX) as usize * SAMPLES;
    let views = (0..DIRECTIONS).into_par_iter();
    // The first entry is the detail of the source; the differences of each level follow.
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
            let Squares {
                squares, covered, ..
            } = levels[index][size];
            // At least a pixel: seen from the side, a plane covers none.
            squares / covered.max(1.0)
        };
        by_view.iter().map(mean_of).sum::<f32>() / DIRECTIONS as f32
    };
    let relative = |level: usize, size: usize| {
        let detail = mean(0, size).max(MIN_DETAIL * MIN_DETAIL);
        (mean(level, size) / detail).sqrt()
    };
    let area_px = |levels: &Vec<[Squares; SIZES]>| levels[0][0].covered_by[0];
    let area_px = by_view.iter().map(area_px).sum::<f32>() / DIRECTIONS as f32;
    let area_spread = |level: usize| {
        let of_view = by_view.iter().map(|levels| {
            let [source, level] = levels[level][0].covered_by;
            level / source.max(1.0)
        });
        let mean = of_view.clone().sum::<f32>() / DIRECTIONS as f32;
        let squares = of_view.map(|share| (share / mean - 1.0) * (share / mean - 1.0));
        (squares.sum::<f32>() / DIRECTIONS as f32).sqrt()
    };
    let of_level = |level: usize| Look {
        differences: std::array::from_fn(|size| relative(level, size)),
        area_spread: area_spread(level),
        area_px,
    };
    (1..=levels.len()).map(of_level).collect()
}

/// The encoded and blurred picture at each size, the largest first.
fn sizes_of(mut picture: Picture) -> [Picture; SIZES] {
    std::array::from_fn(|_| {
        picture = picture.halved();
        picture.encoded().blurred()
    })
}

/// Sums the squared differences of two pictures, and the pixels that either covers.
fn squares_of(a: &Picture, b: &Picture) -> Squares {
    let pixels = a.pixels.iter().zip(&b.pixels);
    pixels.fold(Squares::default(), |sum, (a, b)| Squares {
        // The mean of three colour channels.
        squares: sum.squares + (*a - *b).truncate().length_squared() / 3.0,
        covered: sum.covered + a.w.max(b.w),
        covered_by: [sum.covered_by[0] + a.w, sum.covered_by[1] + b.w],
    })
}

/// Largest radius of the mesh in pixels at which a level looks right, given its differences and the allowed ones from
/// the largest size to the smallest. [`LARGEST_PX`] if it looks right at the largest size.
fn largest_good_radius(by_size: &[f32; SIZES], allowed: &[f32; SIZES]) -> f32 {
    let radius_px = |size: usize| LARGEST_PX / (1u32 << size) as f32;
    // Very bright colours may give infinite differences or NaN; treat these as bad.
    let relative = |size: usize| match by_size[size] / allowed[size] {
        relative if relative.is_finite() => relative,
        _ => f32::MAX,
    };
    match (0..SIZES).find(|&size| relative(size) <= 1.0) {
        Some(0) => LARGEST_PX,
        // Between two sizes, the difference is interpolated.
        Some(size) => {
            let (good, bad) = (relative(size), relative(size - 1));
            radius_px(size) * (1.0 + (1.0 - good) / (bad - good))
        }
        // Beyond the smallest size, the difference is assumed to be proportional to the radius.
        None => radius_px(SIZES - 1) / relative(SIZES - 1),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn unknown_differences_are_bad() {
        for bad in [f32::NAN, f32::INFINITY] {
            let radius = |by_size| largest_good_radius(&by_size, &ALLOWED);
            assert!(error_at_radius(1.0, radius([bad; SIZES])) > 1e30);
            assert_eq!(radius([0.0, bad, bad, bad, bad]), LARGEST_PX);
            let in_between = radius([bad, bad, 1.0, 1.0, 1.0]);
            assert!((16.0..16.1).contains(&in_between), "{in_between}");
        }
    }

    #[test]
    fn a_coarser_level_that_looks_right_spares_finer_ones() {
        let crown = crate::fixtures::crown(200, 1);
        let hierarchy = crate::bake_mesh(&crown, &crate::BakeConfig::default()).unwrap();
        let cuts = hierarchy.whole_mesh_cuts();
        let look = |good_until_px| Look {
            differences: [0.0; SIZES],
            area_spread: 0.0,
            area_px: good_until_px,
        };
        let looks = [20.0, 5.0, 10.0, 2.0].map(look);
        assert!(cuts.len() > looks.len());
        let cuts = &cuts[..=looks.len()];
        let errors = errors_of_levels(&hierarchy, cuts, &looks, |look| look.area_px);
        let radius = sphere_of(&hierarchy).radius;
        for (cut, good_until_px) in cuts[1..].iter().zip([20.0, 10.0, 10.0, 2.0]) {
            let error = errors[cut.group_level as usize];
            assert_eq!(error, error_at_radius(radius, good_until_px));
        }
    }
}
