//! Whether rounded positions are fine enough for the triangles.

use fieldlod_hierarchy::{BakedFile, BakedPrimitive, Hierarchy};

use crate::summary::PrimitiveSummary;

/// A grid is too coarse above this share of the median edge.
const COARSE: f32 = 1e-3;

/// The median length of the edges of each primitive's source.
pub(crate) fn median_edges(file: &BakedFile) -> Vec<f32> {
    let primitives = file.primitives.iter();
    primitives.map(|p| median_edge(&p.hierarchy)).collect()
}

fn median_edge(hierarchy: &Hierarchy) -> f32 {
    let units = hierarchy.units.iter();
    let source = units.filter(|unit| unit.producer().is_none());
    let triangles = source.flat_map(|unit| hierarchy.triangles_of(unit));
    let mut lengths: Vec<f32> = triangles
        .flat_map(|triangle| {
            let [a, b, c] = triangle.map(|v| hierarchy.vertices.positions[v as usize]);
            [a.distance(b), b.distance(c), c.distance(a)]
        })
        .collect();
    let middle = lengths.len() / 2;
    if lengths.is_empty() {
        return f32::INFINITY;
    }
    *lengths.select_nth_unstable_by(middle, f32::total_cmp).1
}

/// A line for each primitive whose positions are rounded to a grid that is coarse beside its `edges`.
pub(crate) fn coarse_grids(file: &BakedFile, edges: &[f32]) -> impl Iterator<Item = String> {
    let pairs = file.primitives.iter().zip(edges);
    let line = |(primitive, edge): (&BakedPrimitive, &f32)| {
        // A position moves by half the diagonal of a cell at most.
        let step = primitive.position_error_in_local * 2.0 / 3f32.sqrt();
        let title = PrimitiveSummary::of(primitive).title();
        (step > edge * COARSE).then(|| {
            let share = step / edge;
            format!("{title}: positions are rounded to {share:.2e} of the median edge; bake without --quantize")
        })
    };
    pairs.filter_map(line).collect::<Vec<_>>().into_iter()
}
