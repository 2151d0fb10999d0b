//! Deviation of simplified surfaces from the source: the two-sided Hausdorff distance, measured at samples.
//!
//! Source to simplified: clusters carry samples on the source, at first all vertices. A group measures the distances
//! between the samples of its clusters and its simplified triangles. All samples are carried on: with only the farthest
//! eighth of them, the true deviation of a bumpy sphere is 1.37 times the stated deviation.
//!
//! Simplified to source: moved vertices and the centre of each triangle are measured against the whole source.
//!
//! In both directions, triangles that may contain a farther point are sampled more densely. A point on a source
//! triangle counts only if it is no farther from the consumed surface than the deviation of the finer groups. Other
//! points belong to other groups.

mod borders;
mod refine;
mod samples;

use fieldlod_hierarchy::NO_GROUP;
use glam::Vec3;
use rustc_hash::{FxHashMap, FxHashSet};

use self::borders::sample_borders;
use self::refine::{
    AGGREGATE_MARGIN, Candidate, MARGIN_SQUARED, SAMPLING_MARGIN, Target, refine_candidates,
};
use self::samples::{MeasuredSample, samples_by_cluster};
use crate::levels::clusters::{Cluster, Sample};
use crate::levels::simplify::{Method, Simplified};
use crate::levels::vertices::{LevelVertices, NORMAL_WEIGHT, power_of_two_below};
use crate::mesh::SourceMesh;
use crate::mesh::bounds::offset_of;
use crate::mesh::surfaces::Surfaces;
use crate::mesh::topology::Topology;
use crate::mesh::triangle_tree::TriangleTree;

/// Distances below this share of the largest coordinate are rounding errors: three steps of an `f32` between 1 and 2.
const ROUNDING: f32 = 4e-7;
/// Squared distances below this share of the largest need not be exact, on simplified triangles and on the source of
/// large meshes. At 0.05 and 0.2, times differ by 4 %.
const EXACT_ABOVE: f32 = 0.1;
/// Meshes with at most this many triangles are refined everywhere. At 65,536, the bake of a mesh of 46,704 triangles
/// takes 1.5 times as long. At 16,384, deviations of a mesh of 26,648 are up to 2 % less exact, in three quarters of
/// the time.
const SMALL_MESH: usize = 1 << 15;
/// Meshes with more welded vertices per triangle are also refined everywhere. A closed surface has half a vertex per
/// triangle. Many small components have more vertices, and a few samples miss their farthest points.
const MANY_COMPONENTS: f32 = 0.7;
/// Maximum number of splits into quarters. Each split halves the distance between samples. At 4, true deviations use up
/// the margin; at 6, stated ones are 1 % more exact. Times do not differ.
const SPLITS: u32 = 5;
/// Maximum number of splits for triangles of a large source, which are small. Of 41 groups of a ball, 4 exceed their
/// stated deviation at 2, by up to 4 %, and 1 at 3. At 5, bakes take 4 % longer.
const SOURCE_SPLITS: u32 = 3;

/// The source surface to which simplified surfaces are compared.
pub(crate) struct SourceSurface {
    target: Target,
    /// Positions minus `offset`.
    positions: Vec<Vec3>,
    /// Keeps the digits of distances far from the origin.
    offset: Vec3,
    /// Smaller distances are rounding errors.
    rounding_in_scaled: f32,
    has_borders: bool,
    /// Whether the whole source is refined.
    refines_all: bool,
}

/// How densely triangles are sampled.
#[derive(Clone, Copy)]
struct Effort {
    /// Source samples below this share of the largest squared distance need no exact distance.
    exact_above: f32,
    /// Maximum number of splits, and the number of last splits that skip low parts.
    source_splits: [u32; 2],
    simplified_splits: [u32; 2],
}

/// Measured deviation of a group.
pub(crate) struct Measured {
    pub(crate) deviation_in_scaled: f32,
    /// For each cluster of the simplified group, the samples for the next level.
    pub(crate) samples: Vec<Vec<Sample>>,
}

/// Deviation of each level of a whole mesh, in local units. Levels are triangles of `positions`, which start with the
/// positions of the mesh. Deviations never shrink towards coarser levels.
pub(crate) fn deviation_in_local(
    mesh: &SourceMesh,
    positions: &[Vec3],
    levels: &[&[[u32; 3]]],
) -> Vec<f32> {
    let source_count = mesh.positions.len();
    let vertices = LevelVertices::of(
        mesh,
        Topology::exact(mesh),
        Surfaces::default(),
        NORMAL_WEIGHT,
    );
    let source = SourceSurface::of(mesh, &vertices);
    let consumed = [Cluster {
        produced_by: NO_GROUP,
        corners: mesh.indices.clone(),
        samples: Vec::new(),
    }];
    let scaled_from_local = vertices.local_from_scaled.recip();
    let scaled = positions
        .iter()
        .map(|p| (*p * scaled_from_local).to_array());
    let mut simplified = Simplified {
        corners: Vec::new(),
        error_in_scaled: 0.0,
        least_deviation_in_scaled: 0.0,
        method: Method::Elements,
        is_pruned: false,
        positions: scaled.collect(),
        rows: Vec::new(),
        is_new: (0..positions.len()).map(|v| v >= source_count).collect(),
    };
    let mut finer_in_scaled = 0.0;
    let level = |triangles: &&[[u32; 3]]| {
        simplified.corners = triangles.as_flattened().to_vec();
        let clusters = [simplified.corners.clone()];
        let measured = source.measure(
            &consumed,
            &vertices,
            &simplified,
            &clusters,
            finer_in_scaled,
        );
        finer_in_scaled = measured.deviation_in_scaled;
        (finer_in_scaled * vertices.local_from_scaled).min(f32::MAX)
    };
    levels.iter().map(level).collect()
}

/// Whether the mesh has an open edge, or a triangle that is used twice.
fn has_borders(mesh: &SourceMesh, vertices: &LevelVertices) -> bool {
    let (triangles, _) = mesh.indices.as_chunks::<3>();
    let mut sorted = triangles.iter().map(|triangle| {
        let mut places = triangle.map(|v| vertices.same_position[v as usize]);
        places.sort_unstable();
        places
    });
    let mut seen = FxHashSet::default();
    vertices.is_border.contains(&true) || !sorted.all(|places| seen.insert(places))
}

/// Distances below the returned length are rounding errors.
fn rounding_of(positions: &[Vec3]) -> f32 {
    // Squares of the least distance must not underflow if all positions are equal.
    ROUNDING * power_of_two_below(positions).clamp(f32::EPSILON, 1.0)
}

impl SourceSurface {
    pub(crate) fn of(mesh: &SourceMesh, vertices: &LevelVertices) -> Self {
        let (triangles, _) = mesh.indices.as_chunks::<3>();
        let positions = vertices.positions.iter().copied().map(Vec3::from);
        let offset = offset_of(positions.clone());
        let positions: Vec<Vec3> = positions.map(|p| p - offset).collect();
        let corners = triangles.iter().map(|t| t.map(|v| positions[v as usize]));
        let firsts = vertices.same_position.iter().zip(0..);
        let places = firsts.filter(|&(&first, vertex)| first == vertex).count() as f32;
        Self {
            target: Target {
                surface: TriangleTree::new(corners),
                consumed: None,
                range_in_scaled: 0.0,
            },
            rounding_in_scaled: rounding_of(&positions),
            positions,
            offset,
            has_borders: has_borders(mesh, vertices),
            refines_all: triangles.len() <= SMALL_MESH
                || places > MANY_COMPONENTS * triangles.len() as f32,
        }
    }

    /// Measures the simplification of `part` into `clusters`. The result is at least `finer_in_scaled`, the deviation
    /// of the finer groups.
    pub(crate) fn measure(
        &self,
        part: &[Cluster],
        vertices: &LevelVertices,
        simplified: &Simplified,
        clusters: &[Vec<u32>],
        finer_in_scaled: f32,
    ) -> Measured {
        let least_in_scaled = finer_in_scaled.max(simplified.least_deviation_in_scaled);
        let position = |own: u32| self.position(simplified, own);
        let triangles = clusters
            .iter()
            .flat_map(|corners| corners.as_chunks::<3>().0);
        let triangles: Vec<[u32; 3]> = triangles.copied().collect();
        let corners: Vec<[Vec3; 3]> = triangles.iter().map(|t| t.map(position)).collect();
        let surface = TriangleTree::new(corners.iter().copied());
        let margin = match simplified.method {
            Method::Elements | Method::Pieces => AGGREGATE_MARGIN,
            _ => SAMPLING_MARGIN,
        };
        // The result gets the margin, which must not raise the deviation of the finer groups.
        let farthest = (least_in_scaled / margin).max(self.rounding_in_scaled);
        let mut farthest = farthest * farthest;
        let effort = self.effort();
        let target = Target {
            consumed: self.consumed_surface(part, vertices),
            range_in_scaled: finer_in_scaled + self.rounding_in_scaled,
            surface,
        };
        let measured = self.measure_source(part, &target, effort, &mut farthest);
        let mut of_triangles = vec![0.0f32; triangles.len()];
        for measured in &measured {
            let of_triangle = &mut of_triangles[measured.nearest.triangle as usize];
            *of_triangle = of_triangle.max(measured.nearest.distance_squared);
        }
        self.measure_simplified(
            &triangles,
            &corners,
            simplified,
            &of_triangles,
            effort,
            &mut farthest,
        );
        if self.has_borders {
            sample_borders(&self.target.surface, &corners, &mut farthest);
        }
        Measured {
            deviation_in_scaled: (farthest.sqrt() * margin).max(least_in_scaled),
            samples: samples_by_cluster(&measured, clusters),
        }
    }

    /// The two-sided distance at vertices: the largest distance of the corners and centres of the simplified triangles
    /// from the source, and of the vertices of the consumed surface from the simplified triangles.
    pub(crate) fn distance_at_vertices(
        &self,
        part: &[Cluster],
        vertices: &LevelVertices,
        simplified: &Simplified,
    ) -> f32 {
        let (triangles, _) = simplified.corners.as_chunks::<3>();
        let corners = triangles.iter();
        let corners = corners.map(|triangle| triangle.map(|own| self.position(simplified, own)));
        let corners: Vec<[Vec3; 3]> = corners.collect();
        let simplified = TriangleTree::new(corners.iter().copied());
        let points = corners.iter();
        let points = points.flat_map(|&[a, b, c]| [a, b, c, (a + b + c) / 3.0]);
        let consumed: FxHashSet<u32> = part
            .iter()
            .flat_map(|cluster| cluster.corners.iter().copied())
            .collect();
        let consumed = consumed
            .iter()
            .map(|&vertex| Vec3::from(vertices.positions[vertex as usize]) - self.offset);
        let to_source = points.filter_map(|point| self.target.surface.nearest(point));
        let to_simplified = consumed.filter_map(|point| simplified.nearest(point));
        let distances = to_source.chain(to_simplified);
        // The largest of them does not depend on their order.
        distances
            .map(|found| found.distance_squared)
            .fold(0.0, f32::max)
            .sqrt()
    }

    fn position(&self, simplified: &Simplified, own: u32) -> Vec3 {
        Vec3::from(simplified.positions[own as usize]) - self.offset
    }

    /// Share of a simplified surface's area that faces away from the source. A triangle faces away if no source
    /// triangle within `reach` of its centre has a normal within 90° of its own.
    pub(crate) fn flipped_share(&self, simplified: &Simplified, reach: f32) -> f32 {
        let area_vector = |[a, b, c]: [Vec3; 3]| (b - a).cross(c - a);
        let (mut flipped, mut whole) = (0.0, 0.0);
        let (triangles, _) = simplified.corners.as_chunks::<3>();
        for triangle in triangles {
            let corners = triangle.map(|own| self.position(simplified, own));
            let own = area_vector(corners);
            let middle = (corners[0] + corners[1] + corners[2]) / 3.0;
            let faces_alike = |_, corners| area_vector(corners).dot(own) >= 0.0;
            whole += own.length();
            if self
                .target
                .surface
                .none_within(middle, reach + self.rounding_in_scaled, faces_alike)
            {
                flipped += own.length();
            }
        }
        if whole > 0.0 { flipped / whole } else { 0.0 }
    }

    fn effort(&self) -> Effort {
        if self.refines_all {
            let splits = [SPLITS, SPLITS - 3];
            return Effort {
                exact_above: 0.0,
                source_splits: splits,
                simplified_splits: splits,
            };
        }
        // Larger meshes skip low parts of simplified triangles after fewer splits, to save time.
        Effort {
            exact_above: EXACT_ABOVE,
            source_splits: [SOURCE_SPLITS, 0],
            simplified_splits: [SPLITS, SPLITS - 1],
        }
    }

    /// Measures from the source, and raises the largest squared distance.
    fn measure_source(
        &self,
        part: &[Cluster],
        target: &Target,
        effort: Effort,
        farthest: &mut f32,
    ) -> Vec<MeasuredSample> {
        let mut measured: Vec<MeasuredSample> = Vec::new();
        let surface = &target.surface;
        let mut start = None;
        let mut look = |sample: Sample, measured: &mut Vec<MeasuredSample>| {
            start = surface.near_enough(sample.point, *farthest * effort.exact_above, start);
            if let Some(nearest) = start {
                *farthest = farthest.max(nearest.distance_squared);
                measured.push(MeasuredSample { sample, nearest });
            }
        };
        let mut candidates: Vec<Candidate> = Vec::new();
        for cluster in part {
            for &sample in &cluster.samples {
                look(sample, &mut measured);
            }
            if cluster.produced_by != NO_GROUP {
                continue;
            }
            // Source geometry: sample its vertices, and refine its triangles.
            let mut at: FxHashMap<u32, usize> = FxHashMap::default();
            let (triangles, _) = cluster.corners.as_chunks::<3>();
            for &triangle in triangles {
                let of_corners = triangle.map(|vertex| {
                    let next = measured.len();
                    let at = *at.entry(vertex).or_insert(next);
                    if at == next {
                        let point = self.positions[vertex as usize];
                        look(Sample { point, triangle }, &mut measured);
                    }
                    measured[at]
                });
                if self.refines_all {
                    let [a, b, c] = of_corners.map(|measured| measured.sample.point);
                    let point = (a + b + c) / 3.0;
                    look(Sample { point, triangle }, &mut measured);
                }
                candidates.push(self.candidate(surface, triangle, &of_corners));
            }
        }
        let of_one = |measured: &MeasuredSample| {
            self.candidate(surface, measured.sample.triangle, &[*measured])
        };
        let produced = measured.iter().filter(|_| target.consumed.is_some());
        candidates.extend(produced.map(of_one));
        candidates.retain(|candidate| candidate.priority > *farthest * MARGIN_SQUARED);
        refine_candidates(target, candidates, effort.source_splits, farthest);
        measured
    }

    /// The surface that a group consumes. `None` if it is the source: all points of its triangles then belong to the
    /// group.
    fn consumed_surface(&self, part: &[Cluster], vertices: &LevelVertices) -> Option<TriangleTree> {
        let is_source = part.iter().all(|cluster| cluster.produced_by == NO_GROUP);
        if is_source {
            return None;
        }
        let corners = part
            .iter()
            .flat_map(|cluster| cluster.corners.as_chunks::<3>().0);
        let positions =
            corners.map(|corners| corners.map(|vertex| vertices.position(vertex) - self.offset));
        Some(TriangleTree::new(positions))
    }

    /// A source triangle with some measured samples.
    fn candidate(
        &self,
        surface: &TriangleTree,
        triangle: [u32; 3],
        measured: &[MeasuredSample],
    ) -> Candidate {
        let corners = triangle.map(|vertex| self.positions[vertex as usize]);
        let bounds = measured
            .iter()
            .map(|measured| surface.bound_squared(measured.nearest, corners));
        Candidate {
            corners,
            priority: bounds.fold(f32::INFINITY, f32::min),
            start: measured.first().map(|measured| measured.nearest),
        }
    }

    /// Measures from the simplified surface, and raises the largest squared distance.
    fn measure_simplified(
        &self,
        triangles: &[[u32; 3]],
        corners: &[[Vec3; 3]],
        simplified: &Simplified,
        of_triangles: &[f32],
        effort: Effort,
        farthest: &mut f32,
    ) {
        let mut distances = vec![f32::NAN; simplified.is_new.len()];
        let mut candidates = Vec::with_capacity(triangles.len());
        let mut start = None;
        for (index, (triangle, &corners)) in triangles.iter().zip(corners).enumerate() {
            // A source point far from this triangle means that the triangle may be far from the source.
            let mut priority = of_triangles[index];
            let mut look = |point: Vec3| {
                start = self
                    .target
                    .surface
                    .near_enough(point, *farthest * EXACT_ABOVE, start);
                let squared = start.map_or(0.0, |near| near.distance_squared);
                *farthest = farthest.max(squared);
                squared
            };
            for (own, point) in triangle.iter().map(|&own| own as usize).zip(corners) {
                if simplified.is_new[own] {
                    if distances[own].is_nan() {
                        distances[own] = look(point);
                    }
                    priority = priority.max(distances[own]);
                }
            }
            let middle = (corners[0] + corners[1] + corners[2]) / 3.0;
            priority = priority.max(look(middle));
            candidates.push(Candidate {
                corners,
                priority,
                start,
            });
        }
        // All triangles are refined: the samples of a triangle that crosses a steep wall may all be near the source.
        let splits = effort.simplified_splits;
        refine_candidates(&self.target, candidates, splits, farthest);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fixtures;

    #[test]
    fn equal_levels_have_equal_deviations() {
        let mesh = fixtures::icosphere(3);
        let (triangles, _) = mesh.indices.as_chunks::<3>();
        let half = &triangles[..triangles.len() / 2];
        let deviations = deviation_in_local(&mesh, &mesh.positions, &[half, half]);
        assert!(deviations[0] > 0.5, "{deviations:?}");
        assert!(deviations[1] < deviations[0] * 1.001, "{deviations:?}");
    }
}
