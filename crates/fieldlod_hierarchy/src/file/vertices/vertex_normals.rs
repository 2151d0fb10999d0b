//! Computes vertex normals from triangles, to predict the stored normals.
//!
//! The normal of a vertex is the mean normal of its triangles, weighted by their angles (G. Thürmer,
//! C. Wüthrich: Computing Vertex Normals from Polygonal Facets, 1998). Most tools use these weights.

use std::f32::consts::{FRAC_PI_2, PI};

use glam::Vec3;

use crate::file::sections::coded::{Coded, Ends};

/// The normals of the vertices that were added to `coded` after `from`, from the triangles that were
/// added after `from`. Zero without triangles. `position` takes indices in coding order.
pub(crate) fn vertex_normals(
    coded: &Coded,
    from: Ends,
    position: impl Fn(u32) -> Vec3,
) -> Vec<Vec3> {
    let mut sums = vec![Vec3::ZERO; coded.vertex_indices.len() - from.vertices];
    let mut lists = &coded.unit_vertices[from.unit_vertices..];
    let (mut indices, _) = coded.indices[from.indices..].as_chunks::<3>();
    let (mut positions, mut sums_of_unit) = (Vec::new(), Vec::new());
    for unit in &coded.units[from.units..] {
        let (vertices, triangles);
        (vertices, lists) = lists.split_at(unit.vertex_count as usize);
        (triangles, indices) = indices.split_at(unit.triangle_count as usize);
        // Sums per unit stay in the cache.
        positions.clear();
        positions.extend(vertices.iter().map(|&vertex| position(vertex)));
        sums_of_unit.clear();
        sums_of_unit.resize(vertices.len(), Vec3::ZERO);
        for triangle in triangles {
            let [a, b, c] = *triangle;
            let (a, b, c) = (usize::from(a), usize::from(b), usize::from(c));
            let [at_a, at_b, at_c] = weighted_normals([positions[a], positions[b], positions[c]]);
            sums_of_unit[a] += at_a;
            sums_of_unit[b] += at_b;
            sums_of_unit[c] += at_c;
        }
        // Vertices of earlier sections are skipped.
        for (&vertex, &sum) in vertices.iter().zip(&sums_of_unit) {
            if let Some(vertex) = (vertex as usize).checked_sub(from.vertices) {
                sums[vertex] += sum;
            }
        }
    }
    sums.iter().map(|sum| sum.normalize_or_zero()).collect()
}

/// The normal of a triangle times the angle at each corner. Zero if the triangle has no area.
#[inline(always)]
fn weighted_normals([a, b, c]: [Vec3; 3]) -> [Vec3; 3] {
    let [ab, bc, ca] = [b - a, c - b, a - c];
    // The length is the sine at each corner times the lengths of the corner's two edges.
    let cross = ca.cross(ab);
    let area = cross.length();
    if area.is_nan() || area <= 0.0 {
        return [Vec3::ZERO; 3];
    }
    let normal = cross * (1.0 / area);
    // Array `map` is not always inlined.
    let at_a = angle(area, -ca.dot(ab));
    let at_b = angle(area, -ab.dot(bc));
    let at_c = angle(area, -bc.dot(ca));
    [normal * at_a, normal * at_b, normal * at_c]
}

/// The angle with this sine and cosine, which may be scaled by a common factor. The error is at most 1.2e-5 rad.
///
/// The polynomial is 4.4.47 of M. Abramowitz, I. Stegun: Handbook of Mathematical Functions. It uses
/// basic operations only, because their results are equal on all machines.
#[inline(always)]
fn angle(sine: f32, cosine: f32) -> f32 {
    let (least, most) = (sine.min(cosine.abs()), sine.max(cosine.abs()));
    let x = least / most;
    let x2 = x * x;
    let series = 0.180_141 + x2 * (-0.085_133 + x2 * 0.020_835_1);
    let angle = x * (0.999_866 + x2 * (-0.330_299_5 + x2 * series));
    // The polynomial holds up to 45°. Above, the complement is computed.
    let acute = if sine > cosine.abs() {
        FRAC_PI_2 - angle
    } else {
        angle
    };
    if cosine < 0.0 { PI - acute } else { acute }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn angle_error_is_at_most_12_millionths() {
        for step in 0..=3_000 {
            let expected = f64::from(step) * std::f64::consts::PI / 3_000.0;
            let (sine, cosine) = (expected.sin() as f32, expected.cos() as f32);
            let found = angle(sine.max(0.0) * 7.0, cosine * 7.0);
            assert!(
                (f64::from(found) - expected).abs() < 1.2e-5,
                "{step}: {found}"
            );
        }
    }

    #[test]
    fn corner_angles_add_up_to_half_a_turn() {
        let weighted = weighted_normals([Vec3::ZERO, Vec3::X * 3.0, Vec3::new(0.5, 2.0, 0.0)]);
        let sum: Vec3 = weighted.into_iter().sum();
        assert!(sum.distance(Vec3::Z * PI) < 1e-4, "{sum}");
        assert_eq!(weighted_normals([Vec3::X; 3]), [Vec3::ZERO; 3]);
    }
}
