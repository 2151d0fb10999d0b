//! Deviations at independent random samples.

use fieldlod_hierarchy::Random;
use glam::Vec3;
use rayon::prelude::*;

use super::report::{Verified, VerifyError};
use super::subject::{CutTriangle, ROUNDING, Subject};
use crate::mesh::triangle_tree::triangle::exact_distance;
use crate::mesh::triangle_tree::{NearestTriangle, TriangleTree};

/// Triangles per parallel task. Fewer triangles cost scheduling time; more triangles leave threads idle at the end.
const TRIANGLES_PER_TASK: usize = 512;

pub(super) fn check(subject: &Subject<'_>, verified: &mut Verified) -> Result<(), VerifyError> {
    check_simplified_to_source(subject, verified)?;
    for level in 1..subject.hierarchy.level_count() {
        check_source_to_cut(subject, level, verified)?;
    }
    Ok(())
}

/// Points per triangle: at most `most_samples` on all `triangles`, but at least 1 on each.
fn points_per_triangle(subject: &Subject<'_>, wanted: u32, triangles: usize) -> u32 {
    let affordable = subject.settings.most_samples as usize / triangles.max(1);
    wanted.min(affordable as u32).max(1)
}

/// A distance as a share of the stated deviation, without rounding errors.
fn share_of_stated(distance: f32, stated: f32) -> f32 {
    let beyond_rounding = (distance - ROUNDING).max(0.0);
    if beyond_rounding > 0.0 {
        beyond_rounding / stated
    } else {
        0.0
    }
}

/// Checks that every point of simplified surfaces is within the stated deviation of the source.
fn check_simplified_to_source(
    subject: &Subject<'_>,
    verified: &mut Verified,
) -> Result<(), VerifyError> {
    let hierarchy = subject.hierarchy;
    let tree = TriangleTree::new(subject.source_corners());
    // All simplified triangles with their groups.
    let units = hierarchy.units.iter();
    let simplified = units.filter_map(|unit| Some((unit.producer()?, unit)));
    let triangles: Vec<(u32, [u32; 3])> = simplified
        .flat_map(|(group, unit)| {
            let triangles = hierarchy.triangles_of(unit);
            triangles.map(move |triangle| (group, triangle))
        })
        .collect();
    let wanted = 4 * subject.settings.samples_per_triangle;
    let density = points_per_triangle(subject, wanted, triangles.len());
    let tasks = triangles.par_chunks(TRIANGLES_PER_TASK).enumerate();
    // The largest share of the stated deviation, and its group. Seeds depend on the task, not on the thread.
    let worst = tasks.map(|(task, triangles)| {
        let mut random = Random::new(task as u64);
        let mut worst = (0.0f32, 0);
        let mut start = None;
        for &(group, triangle) in triangles {
            let stated = subject.deviation_in_scaled(Some(group));
            for _ in 0..density {
                let point = point_on(subject.corners(triangle), &mut random);
                // A triangle within half of the stated deviation ends the search: only larger shares must be exact.
                start = tree.near_enough(point, (stated * 0.5).powi(2), start);
                let distance = start.map_or(0.0, |near| near.distance_squared.sqrt());
                let share = share_of_stated(distance, stated);
                if share > worst.0 {
                    worst = (share, group as usize);
                }
            }
        }
        worst
    });
    let (share, group) = worst.reduce(|| (0.0, 0), |a, b| if b.0 > a.0 { b } else { a });
    verified.samples += triangles.len() as u64 * u64::from(density);
    verified.simplified_to_source = share;
    if share > 1.0 + subject.settings.tolerance {
        return Err(VerifyError::SimplifiedTooFar { group, share });
    }
    Ok(())
}

/// Checks that every point of the source is within the stated deviation of the cut at `level`.
fn check_source_to_cut(
    subject: &Subject<'_>,
    level: u32,
    verified: &mut Verified,
) -> Result<(), VerifyError> {
    let mut drawn = subject.triangles_of(&subject.hierarchy.units_at_level(level));
    // The tree keeps the first of equal triangles. It must be the one with the largest stated deviation.
    let stated = |triangle: &CutTriangle| subject.deviation_in_scaled(triangle.produced_by);
    drawn.sort_by(|a, b| stated(b).total_cmp(&stated(a)));
    let corners = drawn
        .iter()
        .map(|triangle| subject.corners(triangle.corners));
    let tree = TriangleTree::new(corners);
    let source = subject.source_corners();
    let density = points_per_triangle(subject, subject.settings.samples_per_triangle, source.len());
    let tasks = source.par_chunks(TRIANGLES_PER_TASK).enumerate();
    let worst = tasks.map(|(task, triangles)| {
        let mut random = Random::new((u64::from(level) << 32) + task as u64);
        let mut search = WorstSearch::new(subject, &tree, &drawn);
        for &corners in triangles {
            for _ in 0..density {
                search.visit(point_on(corners, &mut random));
            }
        }
        search.worst
    });
    let share = worst.reduce(|| 0.0, f32::max);
    verified.samples += source.len() as u64 * u64::from(density);
    verified.source_to_simplified = verified.source_to_simplified.max(share);
    if share > 1.0 + subject.settings.tolerance {
        return Err(VerifyError::SourceTooFar { level, share });
    }
    Ok(())
}

/// Finds the point that is farthest from a cut, relative to the deviation stated there.
struct WorstSearch<'a> {
    subject: &'a Subject<'a>,
    tree: &'a TriangleTree,
    drawn: &'a [CutTriangle],
    /// The result for the previous point.
    last: Option<NearestTriangle>,
    /// The largest share so far.
    worst: f32,
}

impl<'a> WorstSearch<'a> {
    fn new(subject: &'a Subject<'a>, tree: &'a TriangleTree, drawn: &'a [CutTriangle]) -> Self {
        Self {
            subject,
            tree,
            drawn,
            last: None,
            worst: 0.0,
        }
    }

    fn stated(&self, near: NearestTriangle) -> f32 {
        let triangle = &self.drawn[near.triangle as usize];
        self.subject.deviation_in_scaled(triangle.produced_by)
    }

    fn share_of(&self, near: NearestTriangle) -> f32 {
        share_of_stated(near.distance_squared.sqrt(), self.stated(near))
    }

    fn visit(&mut self, point: Vec3) {
        // A triangle that is near enough ends the search, usually the triangle of the previous point. A search for the
        // nearest of thousands of triangles with a common edge would visit all of them.
        let stated = self.last.map_or(0.0, |last| self.stated(last));
        let enough = (self.worst * stated + ROUNDING).powi(2);
        self.last = self.tree.near_enough(point, enough, self.last);
        if self
            .last
            .is_none_or(|near| self.share_of(near) <= self.worst)
        {
            return;
        }
        self.last = self.tree.near_enough(point, ROUNDING * ROUNDING, self.last);
        let mut share = self.last.map_or(0.0, |nearest| self.share_of(nearest));
        if share > 1.0 {
            // A triangle that is farther away may have a larger stated deviation.
            share = self.least_share(point, share);
        }
        self.worst = self.worst.max(share);
    }

    /// The least share over all triangles of the cut, up to `most`. Ends early at a share that is not the worst.
    fn least_share(&self, point: Vec3, most: f32) -> f32 {
        let mut least = most;
        let stated =
            |triangle: &CutTriangle| self.subject.deviation_in_scaled(triangle.produced_by);
        // Triangles farther away have a larger share, whatever they state. The first one states the most.
        let reach = self.drawn.first().map_or(0.0, stated) * most + ROUNDING;
        self.tree.none_within(point, reach, |index, corners| {
            // In double precision, because rounding errors of needles are larger than rounding errors of points.
            let distance = exact_distance(point.as_dvec3(), corners.map(Vec3::as_dvec3));
            let stated = stated(&self.drawn[index as usize]);
            least = least.min(share_of_stated(distance as f32, stated));
            least <= self.worst
        });
        least
    }
}

/// A random point of the triangle, uniformly distributed.
fn point_on([a, b, c]: [Vec3; 3], random: &mut Random) -> Vec3 {
    let (mut u, mut v) = (random.unit(), random.unit());
    if u + v > 1.0 {
        (u, v) = (1.0 - u, 1.0 - v);
    }
    a + (b - a) * u + (c - a) * v
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::used_vertices::Compact;
    use crate::{BakeConfig, VerifySettings, bake_mesh, fixtures};

    /// Compares searches that end early with exhaustive searches.
    #[test]
    fn worst_share_is_at_least_the_exhaustive_share() {
        for mesh in [fixtures::rock(3, 1), fixtures::non_manifold_fan(300)] {
            let hierarchy = bake_mesh(&mesh, &BakeConfig::default()).unwrap();
            let (settings, compact) = (VerifySettings::default(), Compact::of(&mesh).unwrap());
            let subject = Subject::new(&mesh, &compact, &hierarchy, &settings);
            let mut drawn = subject.triangles_of(&hierarchy.units_at_level(1));
            let stated = |t: &CutTriangle| subject.deviation_in_scaled(t.produced_by);
            drawn.sort_by(|a, b| stated(b).total_cmp(&stated(a)));
            let tree = TriangleTree::new(drawn.iter().map(|t| subject.corners(t.corners)));
            let mut random = Random::new(1);
            let mut search = WorstSearch::new(&subject, &tree, &drawn);
            let source = subject.source_triangles().iter();
            let points = source.map(|&triangle| point_on(subject.corners(triangle), &mut random));
            let points: Vec<Vec3> = points.collect();
            points.iter().for_each(|&point| search.visit(point));
            let shares = points.iter().map(|&point| {
                let shares = drawn.iter().map(|triangle| {
                    let corners = subject.corners(triangle.corners).map(Vec3::as_dvec3);
                    let distance = exact_distance(point.as_dvec3(), corners);
                    share_of_stated(distance as f32, stated(triangle))
                });
                shares.fold(f32::INFINITY, f32::min)
            });
            let worst = shares.fold(0.0, f32::max);
            // The exact distances are in double precision, those of the search are not.
            assert!(
                worst > 0.1 && worst <= search.worst * 1.0001,
                "{worst} {}",
                search.worst
            );
        }
    }

    /// Every point exceeds what is stated. Distances to all triangles from each point would take minutes.
    #[test]
    fn many_exceeding_points_are_found() {
        let mesh = fixtures::rock(6, 1);
        let mut hierarchy = bake_mesh(&mesh, &BakeConfig::fast()).unwrap();
        let groups = hierarchy
            .groups
            .iter_mut()
            .filter(|group| !group.is_terminal());
        groups.for_each(|group| group.deviation_in_local = 1e-5);
        let (settings, compact) = (VerifySettings::default(), Compact::of(&mesh).unwrap());
        let subject = Subject::new(&mesh, &compact, &hierarchy, &settings);
        let found = check_source_to_cut(&subject, 1, &mut Verified::default());
        assert!(matches!(
            found,
            Err(VerifyError::SourceTooFar { level: 1, .. })
        ));
    }
}
