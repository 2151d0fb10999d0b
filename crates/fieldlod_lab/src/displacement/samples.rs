//! Points on the triangles of some units.

use fieldlod_hierarchy::Hierarchy;
use glam::Vec3;

/// A point of a surface in local space.
#[derive(Clone, Copy, Debug)]
pub(super) struct Sample {
    pub(super) position: Vec3,
    /// Two edges of the triangle, in winding order. Their cross product is the normal in any space.
    pub(super) edges: [Vec3; 2],
    /// The unit that contains the sample.
    pub(super) unit: u32,
}

/// Corners, centers and edge midpoints of the units' triangles, thinned evenly to about `count`.
pub(super) fn samples_of(hierarchy: &Hierarchy, units: &[u32], count: usize) -> Vec<Sample> {
    let count_of = |&unit: &u32| u64::from(hierarchy.units[unit as usize].triangle_count);
    let triangles: u64 = units.iter().map(count_of).sum();
    // A mesh has twice as many triangles as vertices, so one corner of each triangle covers most vertices.
    let step = (triangles as usize * 2).div_ceil(count.max(1)).max(1);
    let positions = &hierarchy.vertices.positions;
    let mut samples = Vec::new();
    let mut next = 0;
    for &unit in units {
        for triangle in hierarchy.triangles_of(&hierarchy.units[unit as usize]) {
            let corners = triangle.map(|v| positions[v as usize]);
            // Successive samples alternate between corners and other points.
            for _ in 0..2 {
                if next % step == 0 {
                    samples.push(sample(corners, unit, next / step));
                }
                next += 1;
            }
        }
    }
    samples
}

fn sample([a, b, c]: [Vec3; 3], unit: u32, kind: usize) -> Sample {
    let position = match kind % 6 {
        0 => a,
        1 => (a + b + c) / 3.0,
        2 => b,
        3 => (b + c) * 0.5,
        4 => c,
        _ => (a + c) * 0.5,
    };
    Sample {
        position,
        edges: [b - a, c - a],
        unit,
    }
}
