//! The limit: a choice by the true error that each group's simplification makes in the picture.
//!
//! Each level is drawn as a whole, and the squared differences from the reference are given to the
//! groups whose simplifications show there. A group is then refined if that error is worth its
//! triangles,
//!
//! ```text
//! Σ squared difference / triangles saved > λ
//! ```
//! the greedy answer to "least error for a number of triangles". It knows occlusion, lights and
//! textures; no criterion without pictures can.

use std::collections::HashMap;

use crate::object_view::ObjectView;
use crate::render::{Picture, RenderError, SUPERSAMPLING, UnitMap};

/// The distance, in texels, at which a difference beside a silhouette may lie from the surface that made it.
const SEARCH_TEXELS: i64 = 6;

/// The units that are drawn of each object, in the order of the views.
pub(crate) type UnitsOfAll = Vec<Vec<u32>>;

/// The error that each group's simplification makes in the picture.
pub(crate) struct Oracle {
    /// Sum of squared differences of levels per triangle saved, by object and group.
    errors: Vec<Vec<f32>>,
}

impl Oracle {
    /// Of objects in one view, with the picture of their sources. `draw` draws units of all of them; in its
    /// map the units of an object come after those of the objects before it ([`first_ids`]).
    pub(crate) fn new(
        reference: &Picture,
        views: &[ObjectView],
        mut draw: impl FnMut(&UnitsOfAll) -> Result<(Picture, UnitMap), RenderError>,
    ) -> Result<Self, RenderError> {
        // What the simplification of each group changes in the picture, level by level.
        let levels = views.iter().map(|view| view.object.hierarchy.level_count());
        let mut squares = HashMap::new();
        for level in 0..levels.max().unwrap_or(0) {
            // The cut that simplifies every group up to the level.
            let drawn = draw(&cut_at_level(views, level))?;
            attribute(reference, views, level, &drawn, &mut squares);
        }
        // Over the triangles that it saves.
        let errors_of = |(object, view): (usize, &ObjectView)| {
            let saved = saved_in_view(view);
            let error = |(group, &saved): (usize, &i64)| match squares.get(&(object, group)) {
                Some(squares) if saved > 0 => (squares / saved as f64) as f32,
                _ => 0.0,
            };
            saved.iter().enumerate().map(error).collect()
        };
        Ok(Self {
            errors: views.iter().enumerate().map(errors_of).collect(),
        })
    }

    /// Thresholds from the finest to the coarsest, evenly over the groups that matter.
    pub(crate) fn thresholds(&self, count: usize) -> Vec<f32> {
        let errors = self.errors.iter().flatten().copied();
        let mut sorted: Vec<f32> = errors.filter(|error| *error > 0.0).collect();
        sorted.sort_by(f32::total_cmp);
        let at = |share: f64| {
            sorted
                .get((share * (sorted.len() as f64 - 1.0)) as usize)
                .copied()
        };
        // Few groups are coarse, and those decide the coarse cuts: the finer steps are at the end.
        let shares = (0..count).map(|step| 1.0 - 0.75f64.powi(step as i32));
        shares.filter_map(at).collect()
    }

    /// The units of the cuts that refine the groups whose error per triangle is above a threshold.
    pub(crate) fn choose(&self, views: &[ObjectView], threshold: f32) -> UnitsOfAll {
        let objects = views.iter().zip(&self.errors);
        let units =
            objects.map(|(view, errors)| view.units_refined_by(|it| errors[it] > threshold));
        units.collect()
    }
}

/// The cuts that refine nothing up to a level of groups.
fn cut_at_level(views: &[ObjectView], level: u32) -> UnitsOfAll {
    let cut = |view: &ObjectView| {
        let groups = &view.object.hierarchy.groups;
        view.units_refined_by(|group| groups[group].level > level)
    };
    views.iter().map(cut).collect()
}

/// By how much the numbers of each object's units grow, so that no two units have the same.
pub(crate) fn first_ids(views: &[ObjectView]) -> Vec<u32> {
    let mut next = 0;
    let first = |view: &ObjectView| {
        let first = next;
        next += view.object.hierarchy.units.len() as u32;
        first
    };
    views.iter().map(first).collect()
}

/// Triangles in view that each group's simplification saves.
fn saved_in_view(view: &ObjectView) -> Vec<i64> {
    let hierarchy = &view.object.hierarchy;
    let mut saved = vec![0i64; hierarchy.groups.len()];
    let units = hierarchy.units.iter();
    for unit in units.filter(|unit| view.touches_box(&unit.aabb)) {
        // What a group consumes is saved, what it produces is not.
        let triangles = i64::from(unit.triangle_count);
        saved[unit.consumed_by as usize] += triangles;
        if let Some(producer) = unit.producer() {
            saved[producer as usize] -= triangles;
        }
    }
    saved
}

/// Gives the differences of a level's picture to the groups of that level, by object and group.
fn attribute(
    reference: &Picture,
    views: &[ObjectView],
    level: u32,
    (picture, map): &(Picture, UnitMap),
    squares: &mut HashMap<(usize, usize), f64>,
) {
    let first_ids = first_ids(views);
    let group_at = |x: i64, y: i64| {
        let id = unit_at(map, x, y)?;
        let object = first_ids.partition_point(|&first| first <= id) - 1;
        let hierarchy = &views[object].object.hierarchy;
        let unit = &hierarchy.units[(id - first_ids[object]) as usize];
        let group = unit.producer()? as usize;
        (hierarchy.groups[group].level == level).then_some((object, group))
    };
    let width = i64::from(picture.size_px.x);
    let pixels = reference.colors.iter().zip(&picture.colors).zip(0..);
    for ((a, b), index) in pixels {
        let difference: f64 = (0..3).map(|c| f64::from(a[c] - b[c]).powi(2)).sum();
        // Each difference counts for the group that shows nearest to it.
        if difference > 0.0 {
            let n = i64::from(SUPERSAMPLING);
            let (x, y) = (index % width * n, index / width * n);
            if let Some(group) = nearest(x, y, group_at) {
                *squares.entry(group).or_default() += difference;
            }
        }
    }
}

fn unit_at(map: &UnitMap, x: i64, y: i64) -> Option<u32> {
    let (width, height) = (i64::from(map.size_texels.x), i64::from(map.size_texels.y));
    let inside = (0..width).contains(&x) && (0..height).contains(&y);
    inside.then(|| map.units[(y * width + x) as usize])?
}

/// What is at a texel, or at one of the rings around it.
fn nearest<T>(x: i64, y: i64, at: impl Fn(i64, i64) -> Option<T>) -> Option<T> {
    (0..=SEARCH_TEXELS).find_map(|ring| {
        let span = -ring..=ring;
        span.clone().find_map(|dx| {
            let mut rows = span.clone().filter(|dy| dx.abs().max(dy.abs()) == ring);
            rows.find_map(|dy| at(x + dx, y + dy))
        })
    })
}
