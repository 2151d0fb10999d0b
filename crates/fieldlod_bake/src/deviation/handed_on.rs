//! Samples that the next level uses.

use super::seen::Seen;
use crate::levels::clusters::Place;

/// For each cluster, the samples whose nearest triangle it contains.
pub(super) fn handed_on(seen: &[Seen], clusters: &[Vec<u32>]) -> Vec<Vec<Place>> {
    let mut ends = Vec::with_capacity(clusters.len());
    let mut end = 0;
    for corners in clusters {
        end += corners.len() as u32 / 3;
        ends.push(end);
    }
    let mut places = vec![Vec::new(); clusters.len()];
    for seen in seen {
        let cluster = ends.partition_point(|&end| end <= seen.nearest.triangle);
        places[cluster].push(seen.place);
    }
    places
}
