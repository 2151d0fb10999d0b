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

use super::pose_view::PoseView;
use crate::method::Method;
use crate::object_view::ObjectView;
use crate::render::{Picture, RenderError, SUPERSAMPLING, UnitMap};

/// The distance, in texels, at which a difference beside a silhouette may lie from the surface that made it.
const SEARCH_TEXELS: i64 = 6;

/// The error that each group's simplification makes in the picture.
pub(super) struct Oracle {
    /// Sum of squared differences of levels per triangle saved, by group.
    errors: Vec<f32>,
}

impl Oracle {
    pub(super) fn new(view: &PoseView) -> Result<Self, RenderError> {
        let scene = view.scene;
        let seen = scene.view(Method::Oracle, &view.eye);
        let hierarchy = &seen.object.hierarchy;
        // What the simplification of each group changes in the picture, level by level.
        let mut squares = vec![0.0f64; hierarchy.groups.len()];
        for level in 0..hierarchy.level_count() {
            // The cut that simplifies every group up to the level.
            let cut = units_refined_by(&seen, |group| hierarchy.groups[group].level > level);
            let (renderer, units) = (scene.renderer, seen.units_in_view(&cut));
            let drawn = renderer.draw_units(&scene.ours.model, &view.eye, &units)?;
            attribute(view, level, &drawn, &mut squares);
        }
        // Over the triangles that it saves.
        let saved = saved_in_view(&seen);
        let errors = squares.iter().zip(&saved).map(|(&squares, &saved)| {
            if saved > 0 {
                (squares / saved as f64) as f32
            } else {
                0.0
            }
        });
        Ok(Self {
            errors: errors.collect(),
        })
    }

    /// Thresholds from the finest to the coarsest, evenly over the groups that matter.
    pub(super) fn thresholds(&self, count: usize) -> Vec<f32> {
        let mut sorted: Vec<f32> = self.errors.iter().copied().filter(|w| *w > 0.0).collect();
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

    /// The units of the cut that refines the groups whose error per triangle is above a threshold.
    pub(super) fn choose(&self, view: &ObjectView, threshold: f32) -> Vec<u32> {
        units_refined_by(view, |group| self.errors[group] > threshold)
    }
}

/// The units of the cut that refines the groups for which a criterion holds.
fn units_refined_by(view: &ObjectView, criterion: impl Fn(usize) -> bool) -> Vec<u32> {
    let hierarchy = &view.object.hierarchy;
    let mut refined = vec![false; hierarchy.groups.len()];
    hierarchy.refine_by(&mut refined, |group, _| criterion(group));
    let drawn = hierarchy.drawn_units(&refined);
    drawn.map(|unit| unit as u32).collect()
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

/// Gives the differences of a level's picture to the groups of that level.
fn attribute(
    view: &PoseView,
    level: u32,
    (picture, map): &(Picture, UnitMap),
    squares: &mut [f64],
) {
    let hierarchy = &view.scene.ours.object.hierarchy;
    let group_at = |x: i64, y: i64| {
        let unit = unit_at(map, x, y)?;
        let group = hierarchy.units[unit as usize].producer()?;
        (hierarchy.groups[group as usize].level == level).then_some(group)
    };
    let width = i64::from(picture.size_px.x);
    let pixels = view.reference.colors.iter().zip(&picture.colors).zip(0..);
    for ((a, b), index) in pixels {
        let difference: f64 = (0..3).map(|c| f64::from(a[c] - b[c]).powi(2)).sum();
        // Each difference counts for the group that shows nearest to it.
        if difference > 0.0 {
            let n = i64::from(SUPERSAMPLING);
            let (x, y) = (index % width * n, index / width * n);
            if let Some(group) = nearest(x, y, group_at) {
                squares[group as usize] += difference;
            }
        }
    }
}

fn unit_at(map: &UnitMap, x: i64, y: i64) -> Option<u32> {
    let (width, height) = (i64::from(map.size_texels.x), i64::from(map.size_texels.y));
    let inside = (0..width).contains(&x) && (0..height).contains(&y);
    inside.then(|| map.units[(y * width + x) as usize])?
}

/// The group at a texel, or at one of the rings around it.
fn nearest(x: i64, y: i64, group_at: impl Fn(i64, i64) -> Option<u32>) -> Option<u32> {
    (0..=SEARCH_TEXELS).find_map(|ring| {
        let span = -ring..=ring;
        span.clone().find_map(|dx| {
            let mut rows = span.clone().filter(|dy| dx.abs().max(dy.abs()) == ring);
            rows.find_map(|dy| group_at(x + dx, y + dy))
        })
    })
}
