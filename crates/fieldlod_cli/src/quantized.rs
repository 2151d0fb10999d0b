//! Warnings for quantized positions that are too coarse for the triangles.

use fieldlod_hierarchy::{BakedFile, BakedPrimitive, Hierarchy};

use crate::summary::PrimitiveSummary;

/// A grid is too coarse if its step is above this share of the median edge. Larger steps visibly change the shapes and
/// normals of triangles. A step of this share is about a pixel if an edge fills the screen.
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

/// A line for each primitive with a step that is too coarse for its median edge in `edges`.
pub(crate) fn coarse_grids(file: &BakedFile, edges: &[f32]) -> Vec<String> {
    let pairs = file.primitives.iter().zip(edges);
    let line = |(primitive, edge): (&BakedPrimitive, &f32)| {
        // The error is at most half the diagonal of a cell.
        let step = primitive.position_error_in_local * 2.0 / 3f32.sqrt();
        let title = PrimitiveSummary::of(primitive).title();
        (step > edge * COARSE).then(|| {
            let share = step / edge;
            format!("{title}: positions are rounded to {share:.2e} of the median edge; bake without --quantize")
        })
    };
    pairs.filter_map(line).collect()
}
