//! Samples that the next level uses.

use super::measured_sample::MeasuredSample;
use crate::levels::clusters::Sample;

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
