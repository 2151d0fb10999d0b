//! Deviations by independent random samples.

use fieldlod_hierarchy::Hierarchy;
use fieldlod_hierarchy::fixtures::Random;
use glam::{Vec3, Vec3A};
use rayon::prelude::*;

use super::{Verified, VerifyError, VerifySettings, cut};
use crate::SourceMesh;
use crate::triangle::Triangle;
use crate::triangle_tree::{NearestTriangle, TriangleTree};

/// Distances below this, times the largest coordinate, are rounding.
const ROUNDING: f32 = 1e-6;
/// How many samples one task takes.
const TRIANGLES_PER_TASK: usize = 512;

/// What both directions need.
struct Check<'a> {
    hierarchy: &'a Hierarchy,
    settings: &'a VerifySettings,
    positions: Vec<Vec3>,
    /// Scaled lengths per local length: as in a bake, squares must not overflow.
    scaled_from_local: f32,
    rounding_in_scaled: f32,
}

pub(super) fn check(
    mesh: &SourceMesh,
    hierarchy: &Hierarchy,
    settings: &VerifySettings,
    verified: &mut Verified,
) -> Result<(), VerifyError> {
    let local_from_scaled = crate::input::power_of_two_above(&mesh.positions);
    let scaled_from_local = local_from_scaled.recip();
    let check = Check {
        hierarchy,
        settings,
        positions: mesh
            .positions
            .iter()
            .map(|p| *p * scaled_from_local)
            .collect(),
        scaled_from_local,
        rounding_in_scaled: ROUNDING,
    };
    check.simplified_to_source(mesh, verified)?;
    for level in 1..hierarchy.level_count() {
        check.source_to_cut(mesh, level, verified)?;
    }
    Ok(())
}

impl Check<'_> {
    fn corners(&self, triangle: [u32; 3]) -> [Vec3; 3] {
        triangle.map(|v| self.positions[v as usize])
    }

    /// The deviation stated for what `producer` made; source triangles are exact.
    fn stated(&self, producer: Option<u32>) -> f32 {
        let group = producer.map(|group| &self.hierarchy.groups[group as usize]);
        let deviation = group.map_or(0.0, |group| group.deviation_in_local);
        deviation * self.scaled_from_local
    }

    /// How many points per triangle, if all levels together have `triangles`.
    fn density(&self, wanted: u32, triangles: usize) -> u32 {
        let affordable = self.settings.most_samples as usize / triangles.max(1);
        wanted.min(affordable as u32).max(1)
    }

    fn excess(&self, distance: f32, stated: f32) -> f32 {
        let beyond_rounding = (distance - self.rounding_in_scaled).max(0.0);
        if beyond_rounding > 0.0 {
            beyond_rounding / stated
        } else {
            0.0
        }
    }

    fn simplified_to_source(
        &self,
        mesh: &SourceMesh,
        verified: &mut Verified,
    ) -> Result<(), VerifyError> {
        let (source, _) = mesh.indices.as_chunks::<3>();
        let tree = TriangleTree::new(source.iter().map(|&triangle| self.corners(triangle)));
        let made = self
            .hierarchy
            .units
            .iter()
            .filter_map(|unit| Some((unit.producer()?, unit)));
        let triangles: Vec<(u32, [u32; 3])> = made
            .flat_map(|(group, unit)| {
                self.hierarchy
                    .source_triangles_of(unit)
                    .map(move |t| (group, t))
            })
            .collect();
        let density = self.density(4 * self.settings.samples_per_triangle, triangles.len());
        let tasks = triangles.par_chunks(TRIANGLES_PER_TASK).enumerate();
        let worst = tasks.map(|(task, triangles)| {
            let mut random = Random::new(task as u64);
            let mut worst = (0.0f32, 0);
            let mut start = None;
            for &(group, triangle) in triangles {
                let stated = self.stated(Some(group));
                for _ in 0..density {
                    let point = point_on(self.corners(triangle), &mut random);
                    let enough = (stated * 0.5).powi(2);
                    let Some(near) = tree.near_enough(point, enough, start) else {
                        continue;
                    };
                    start = Some(near);
                    let share = self.excess(near.distance_squared.sqrt(), stated);
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
        if share > 1.0 + self.settings.tolerance {
            return Err(VerifyError::SimplifiedTooFar { group, share });
        }
        Ok(())
    }

    /// Every point of the source must lie as near to a triangle of the cut as that one states.
    fn source_to_cut(
        &self,
        mesh: &SourceMesh,
        level: u32,
        verified: &mut Verified,
    ) -> Result<(), VerifyError> {
        let drawn = cut(self.hierarchy, |group| {
            self.hierarchy.groups[group].level >= level
        });
        let tree = TriangleTree::new(drawn.iter().map(|&(_, triangle)| self.corners(triangle)));
        let (source, _) = mesh.indices.as_chunks::<3>();
        let density = self.density(self.settings.samples_per_triangle, source.len());
        let tasks = source.par_chunks(TRIANGLES_PER_TASK).enumerate();
        let worst = tasks.map(|(task, triangles)| {
            let mut random = Random::new((u64::from(level) << 32) + task as u64);
            let mut seeker = Seeker::new(self, &tree, &drawn);
            for &triangle in triangles {
                for _ in 0..density {
                    seeker.see(point_on(self.corners(triangle), &mut random));
                }
            }
            seeker.worst
        });
        let share = worst.reduce(|| 0.0, f32::max);
        verified.samples += source.len() as u64 * u64::from(density);
        verified.source_to_simplified = verified.source_to_simplified.max(share);
        if share > 1.0 + self.settings.tolerance {
            return Err(VerifyError::SourceTooFar { level, share });
        }
        Ok(())
    }
}

/// Looks for the point that is furthest from a cut, as a share of what the cut states there.
struct Seeker<'a> {
    check: &'a Check<'a>,
    tree: &'a TriangleTree,
    drawn: &'a [(Option<u32>, [u32; 3])],
    /// What the last point was near.
    last: Option<NearestTriangle>,
    worst: f32,
}

impl<'a> Seeker<'a> {
    fn new(
        check: &'a Check<'a>,
        tree: &'a TriangleTree,
        drawn: &'a [(Option<u32>, [u32; 3])],
    ) -> Self {
        Self {
            check,
            tree,
            drawn,
            last: None,
            worst: 0.0,
        }
    }

    fn stated(&self, near: NearestTriangle) -> f32 {
        self.check.stated(self.drawn[near.triangle as usize].0)
    }

    fn share_of(&self, near: NearestTriangle) -> f32 {
        let distance = near.distance_squared.sqrt();
        self.check.excess(distance, self.stated(near))
    }

    fn see(&mut self, point: Vec3) {
        // A triangle near enough not to be the worst ends the search, mostly that of the last
        // point. Where thousands share an edge, each search for the nearest is one among all.
        let rounding = self.check.rounding_in_scaled;
        let stated = self.last.map_or(0.0, |last| self.stated(last));
        let enough = (self.worst * stated + rounding).powi(2);
        let Some(near) = self.tree.near_enough(point, enough, self.last) else {
            return;
        };
        self.last = Some(near);
        if self.share_of(near) <= self.worst {
            return;
        }
        let enough = rounding * rounding;
        let nearest = self.tree.near_enough(point, enough, Some(near));
        let nearest = nearest.unwrap_or(near);
        self.last = Some(nearest);
        let mut share = self.share_of(nearest);
        if share > 1.0 {
            // Another piece, not quite as near, may state more.
            share = share.min(self.least_share(point));
        }
        self.worst = self.worst.max(share);
    }

    fn least_share(&self, point: Vec3) -> f32 {
        let point = Vec3A::from(point);
        let shares = self.drawn.iter().map(|&(producer, triangle)| {
            let triangle = Triangle::new(self.check.corners(triangle));
            let distance = triangle.distance_squared(point).sqrt();
            self.check.excess(distance, self.check.stated(producer))
        });
        shares.fold(f32::INFINITY, f32::min)
    }
}

/// A point of the triangle, all equally likely.
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
    use crate::{BakeConfig, bake_mesh, fixtures};

    /// Searches that end early miss nothing: held against every triangle for every point.
    #[test]
    fn no_point_is_worse_than_the_worst_that_is_found() {
        for mesh in [fixtures::rock(3, 1), fixtures::non_manifold_fan(300)] {
            let hierarchy = bake_mesh(&mesh, &BakeConfig::default()).unwrap();
            let scaled_from_local = crate::input::power_of_two_above(&mesh.positions).recip();
            let positions = mesh.positions.iter().map(|p| *p * scaled_from_local);
            let check = Check {
                hierarchy: &hierarchy,
                settings: &VerifySettings::default(),
                positions: positions.collect(),
                scaled_from_local,
                rounding_in_scaled: ROUNDING,
            };
            let drawn = cut(&hierarchy, |group| hierarchy.groups[group].level >= 1);
            let tree = TriangleTree::new(drawn.iter().map(|&(_, t)| check.corners(t)));
            let mut random = Random::new(1);
            let mut seeker = Seeker::new(&check, &tree, &drawn);
            let (source, _) = mesh.indices.as_chunks::<3>();
            let points = source.iter();
            let points: Vec<Vec3> = points
                .map(|&triangle| point_on(check.corners(triangle), &mut random))
                .collect();
            points.iter().for_each(|&point| seeker.see(point));
            let shares = points.iter().map(|&point| seeker.least_share(point));
            let worst = shares.fold(0.0, f32::max);
            assert!(
                worst > 0.1 && worst <= seeker.worst,
                "{worst} {}",
                seeker.worst
            );
        }
    }
}
