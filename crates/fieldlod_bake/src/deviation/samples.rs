//! Measured samples, which the next level uses.

use crate::levels::clusters::Sample;
use crate::mesh::triangle_tree::NearestTriangle;

/// A sample on the source, and the nearest triangle of the simplified surface.
#[derive(Clone, Copy)]
pub(super) struct MeasuredSample {
    pub(super) sample: Sample,
    pub(super) nearest: NearestTriangle,
}

/// For each cluster, the samples whose nearest triangle it contains.
pub(super) fn samples_by_cluster(
    measured: &[MeasuredSample],
    clusters: &[Vec<u32>],
) -> Vec<Vec<Sample>> {
    let mut ends = Vec::with_capacity(clusters.len());
    let mut end = 0;
    for corners in clusters {
        end += corners.len() as u32 / 3;
        ends.push(end);
    }
    let mut samples = vec![Vec::new(); clusters.len()];
    for sample in measured {
        let cluster = ends.partition_point(|&end| end <= sample.nearest.triangle);
        samples[cluster].push(sample.sample);
    }
    samples
}
