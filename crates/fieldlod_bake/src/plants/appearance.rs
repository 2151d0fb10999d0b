//! How far away each level of an aggregate, drawn as a whole, looks as the source does, measured on pictures.
//!
//! The deviation of a crown's level is that of its worst leaf, but what is seen of a crown is its
//! outline, its light and its colours. So each level is drawn beside the source from [`DIRECTIONS`]
//! directions, at sizes from [`LARGEST_PX`] down by halves, and the pictures are compared as an eye sees
//! them: encoded, and blurred as pixel and eye do (the first two steps of P. Andersson et al., FLIP: A
//! Difference Evaluator for Alternating Images, HPG 2020). Differences count relative to the detail that
//! the source's own picture has at that size, which masks them. The largest sampling density at which
//! they are no more than those of smooth meshes at 1 px of error is the field's strength `c` up to which
//! the level is as good as 1 px. The error by which it is chosen is then `1 / √c`, a length.

use std::sync::Arc;

use fieldlod_hierarchy::{CardLevel, Cards, Hierarchy, Sphere, WholeMeshCut};
use rayon::prelude::*;

use crate::mesh::surfaces::Surfaces;
use crate::plants::cards::{PartCards, cards_of, shown_at};
use crate::plants::picture::{Model, Picture, ShownCards, Viewpoint, exposure_of};

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
/// Cards are kept if they have no more than this share of the triangles that are drawn without them for errors as
/// small, in the mean of their levels that have fewer.
const MOST_OF_TRIANGLES: f32 = 0.5;
/// By what the criterion multiplies the error of a mesh that faces all ways: √(1 + 0.4).
const FACING_ALL_WAYS: f32 = 1.183_216;
/// Levels with more vertices are never drawn as whole meshes: 16 bits do not count them.
pub(crate) const MOST_VERTICES: u32 = 1 << 16;

/// Measures the levels of a mesh that may be drawn as a whole, and states in each group how the level
/// looks that it is simplified to. Returns levels of cards of its parts, if it is to have some, which state how they look
/// together.
pub(crate) fn measure_levels(
    hierarchy: &mut Hierarchy,
    surfaces: &Surfaces,
    with_cards: bool,
) -> Vec<Option<Cards>> {
    if hierarchy.source_vertex_count > MOST_VERTICES {
        return Vec::new();
    }
    let cuts = hierarchy.whole_mesh_cuts();
    let cards = match with_cards {
        true => cards_of(hierarchy, surfaces),
        false => Vec::new(),
    };
    let numbers = numbers_of_levels(&cards);
    let radius = sphere_of(hierarchy).radius;
    let differences = differences(hierarchy, &cuts, &cards, &numbers, surfaces);
    let mut differences = differences.into_iter();
    let mut errors = vec![0.0f32; hierarchy.level_count() as usize + 1];
    for (cut, by_size) in cuts.iter().skip(1).zip(&mut differences) {
        let good_until_px = good_until(by_size);
        let seen = seen_error(radius, good_until_px);
        let told = hierarchy.largest_below(cut.group_level, |group| group.error_in_local);
        // Where the largest picture is not large enough to tell, the simplifier may know better.
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
    let mut finer = 0.0f32;
    let errors = differences.map(|by_size| {
        let seen = seen_error(radius, good_until(by_size));
        finer = finer.max(seen).min(f32::MAX);
        finer
    });
    let errors: Vec<(usize, f32)> = numbers.into_iter().zip(errors).collect();
    if share_of_triangles(&cards, &errors, hierarchy, &cuts) > MOST_OF_TRIANGLES {
        return Vec::new();
    }
    let parts = cards.into_iter().map(|part| with_errors(part, &errors));
    parts.collect()
}

/// Which levels some part has cards of its own in.
fn numbers_of_levels(parts: &[PartCards]) -> Vec<usize> {
    let levels = parts.iter().flat_map(|part| &part.levels);
    let mut numbers: Vec<usize> = levels.map(|(number, _)| *number).collect();
    numbers.sort_unstable();
    numbers.dedup();
    numbers
}

/// How many triangles levels of cards have, relative to those of the coarsest cuts that err no more: the geometric mean
/// of those that have fewer, 1 if none has.
fn share_of_triangles(
    parts: &[PartCards],
    errors: &[(usize, f32)],
    hierarchy: &Hierarchy,
    cuts: &[WholeMeshCut],
) -> f32 {
    let error_of = |cut: &WholeMeshCut| {
        hierarchy.largest_below(cut.group_level, |group| group.whole_mesh_error_in_local)
    };
    let cuts: Vec<(usize, f32)> = cuts
        .iter()
        .map(|c| (c.triangles.len(), error_of(c)))
        .collect();
    let share = |&(number, error): &(usize, f32)| {
        let cards: usize = parts.iter().map(|part| part.at(number).len()).sum();
        let after = cuts.partition_point(|cut| cut.1 <= error);
        (2 * cards) as f32 / cuts[after.saturating_sub(1)].0 as f32
    };
    let shares = errors.iter().map(share).filter(|share| *share < 1.0);
    let shares: Vec<f32> = shares.collect();
    let product: f32 = shares.iter().product();
    product.powf((shares.len().max(1) as f32).recip())
}

/// The cards of a part, as good as the levels of all parts are, of which errors are known by their numbers.
fn with_errors(mut part: PartCards, errors: &[(usize, f32)]) -> Option<Cards> {
    let error = |number: usize| {
        let at = errors.iter().find(|(other, _)| *other == number);
        at.map_or(f32::MAX, |(_, error)| *error)
    };
    part.drop_useless(error);
    let levels = part.levels.into_iter().map(|(number, cards)| CardLevel {
        error_in_local: error(number),
        cards,
    });
    let levels: Vec<CardLevel> = levels.collect();
    (!levels.is_empty()).then(|| Cards {
        levels,
        picture: Arc::new(part.picture),
    })
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

/// How each cut but the first, and then each of some levels of cards, differs from the first cut, relative to that one's detail,
/// as a root mean square over all directions, at each size, the largest first.
fn differences(
    hierarchy: &Hierarchy,
    cuts: &[WholeMeshCut],
    cards: &[PartCards],
    card_levels: &[usize],
    surfaces: &Surfaces,
) -> Vec<[f32; SIZES]> {
    let Some((source, levels)) = cuts.split_first() else {
        return Vec::new();
    };
    let vertices = &hierarchy.vertices;
    let count = hierarchy.source_vertex_count;
    let looks = surfaces.looks_of(hierarchy);
    let model = Model {
        positions: &vertices.positions,
        normals: &vertices.normals,
        colors: &vertices.colors,
        surfaces: &looks.surfaces,
        uvs: &looks.uvs,
        sphere: sphere_of(hierarchy),
        exposure: exposure_of(
            vertices.colors.get(..count as usize).unwrap_or(&[]),
            surfaces,
        ),
    };
    let side = (2.0 * LARGEST_PX) as usize * SAMPLES;
    let shown = card_levels.iter();
    let shown = shown.map(|&level| shown_at(cards, level, |part| surfaces.base_color(part)));
    let shown: Vec<Vec<ShownCards<'_>>> = shown.collect();
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
        let cards = shown.iter();
        let cards = cards.map(|level| model.draw_cards(level, &view, side));
        let differences = triangles.chain(cards).map(|level| {
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
    let count = levels.len() + card_levels.len();
    (1..=count).map(of_level).collect()
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
    // What cannot be told is no good: colours may be too bright for numbers.
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
    use crate::{BakeConfig, bake_mesh, fixtures};

    #[test]
    fn what_cannot_be_told_is_good_nowhere() {
        for bad in [f32::NAN, f32::INFINITY] {
            assert!(seen_error(1.0, good_until([bad; SIZES])) > 1e30);
            assert_eq!(good_until([0.0, bad, bad, bad, bad]), LARGEST_PX);
            let in_between = good_until([bad, bad, 1.0, 1.0, 1.0]);
            assert!((16.0..16.1).contains(&in_between), "{in_between}");
        }
    }

    #[test]
    fn cards_are_weighed_against_the_triangles_of_as_small_errors() {
        let palm = bake_mesh(&fixtures::palm(12, 1), &BakeConfig::default()).unwrap();
        let cuts = palm.whole_mesh_cuts();
        let level = |cut: &WholeMeshCut| {
            let error = palm.largest_below(cut.group_level, |g| g.whole_mesh_error_in_local);
            (cut.triangles.len(), error)
        };
        // The coarsest of each error.
        let mut levels: Vec<(usize, f32)> = cuts.iter().rev().map(level).collect();
        levels.dedup_by_key(|level| level.1);
        levels.reverse();
        let [(most, _), (many, of_many), (few, of_few), ..] = levels[1..] else {
            panic!("{levels:?}")
        };
        let share = |levels: &[(usize, f32)]| {
            let cards = |level: &(usize, f32)| vec![Default::default(); level.0];
            let part = PartCards {
                levels: levels.iter().map(cards).enumerate().collect(),
                picture: Default::default(),
            };
            let errors: Vec<_> = levels.iter().map(|level| level.1).enumerate().collect();
            share_of_triangles(&[part], &errors, &palm, &cuts)
        };
        // Two triangles each, for the error of a level and for hardly less.
        let of = |triangles: usize| (many / 8 * 2) as f32 / triangles as f32;
        assert_eq!(share(&[(many / 8, of_many)]), of(many));
        assert_eq!(share(&[(many / 8, of_many.next_down())]), of(most));
        // The mean of levels that save triangles, whatever others take.
        let of_two = share(&[(many, of_many), (many / 4, of_many), (few / 16, of_few)]);
        let mean =
            ((many / 4 * 2) as f32 / many as f32 * (few / 16 * 2) as f32 / few as f32).sqrt();
        assert!((of_two / mean - 1.0).abs() < 1e-6, "{of_two}, not {mean}");
        assert_eq!(share(&[(many, of_many), (few, of_few)]), 1.0);
        assert_eq!(share(&[]), 1.0);
    }

    /// What is allowed is what pictures of smooth meshes differ by where their error is 1 px.
    #[test]
    fn smooth_meshes_at_1_px_look_as_good_as_is_asked_for() {
        let mut found = Vec::new();
        for mesh in [
            fixtures::rock(5, 3),
            fixtures::torus_knot(256, 24),
            fixtures::icosphere(5),
        ] {
            let hierarchy = bake_mesh(&mesh, &BakeConfig::default()).unwrap();
            let cuts = hierarchy.whole_mesh_cuts();
            let radius = sphere_of(&hierarchy).radius;
            let differences = differences(&hierarchy, &cuts, &[], &[], &Surfaces::default());
            for (cut, by_size) in cuts.iter().skip(1).zip(differences) {
                let error = hierarchy.largest_below(cut.group_level, |g| g.error_in_local);
                let at_1_px = radius / (error * FACING_ALL_WAYS);
                let size = (LARGEST_PX / at_1_px).log2();
                if (0.0..4.0).contains(&size) {
                    let (below, share) = (size as usize, size.fract());
                    let difference = by_size[below] * (1.0 - share) + by_size[below + 1] * share;
                    println!(
                        "{} triangles, {at_1_px} px: {difference}",
                        cut.triangles.len()
                    );
                    found.push(difference);
                }
            }
        }
        let mean = found.iter().sum::<f32>() / found.len() as f32;
        println!("mean {mean}");
        let share = mean / AS_GOOD_AS_1_PX;
        assert!((0.9..1.1).contains(&share), "{mean}");
    }
}
