//! Shapes of the generated worlds, in metres. They stand at the origin.

use std::f32::consts::TAU;

use fieldlod_bake::SourceMesh;
use fieldlod_bake::fixtures::{joined, plane, rock, with_smooth_normals};
use fieldlod_hierarchy::fixtures::Random;
use glam::{Vec2, Vec3};

/// Cells per metre of the longer side of a sheet. Slopes of windows are 0.25 m wide: a coarser grid skips them, a
/// finer one has more triangles.
const CELLS_PER_M: f32 = 5.0;

/// A house with a flat roof. The windows are recesses in its four walls.
pub(super) fn house(size: Vec3) -> SourceMesh {
    let Vec3 { x, y, z } = size;
    let corner = |i: f32, j: f32| Vec3::new(i * x * 0.5, 0.0, j * z * 0.5);
    let wall = |from: Vec3, to: Vec3| sheet(from, to - from, Vec3::Y * y, window_depth);
    joined(&[
        wall(corner(-1.0, 1.0), corner(1.0, 1.0)),
        wall(corner(1.0, 1.0), corner(1.0, -1.0)),
        wall(corner(1.0, -1.0), corner(-1.0, -1.0)),
        wall(corner(-1.0, -1.0), corner(-1.0, 1.0)),
        sheet(
            corner(-1.0, 1.0) + Vec3::Y * y,
            Vec3::X * x,
            Vec3::NEG_Z * z,
            |_, _| 0.0,
        ),
    ])
}

/// A tree `height` metres high: a stem, and a crown of clumps with gaps between them.
pub(super) fn tree(height: f32, clumps: u32, seed: u32) -> SourceMesh {
    let mut random = Random::new(seed.into());
    let stem = sheet(Vec3::ZERO, Vec3::X, Vec3::Y * height * 0.8, |_, _| 0.0);
    let mut parts = vec![with_smooth_normals(rolled(stem, height * 0.025))];
    for clump in 0..clumps {
        let out = random.vector().normalize_or(Vec3::Y);
        let middle = Vec3::Y * height * 0.68 + out * height * Vec3::new(0.22, 0.28, 0.22);
        let radius = height * (0.06 + 0.05 * random.unit());
        let mut rock = rock(2, seed * 100 + clump);
        for position in &mut rock.positions {
            *position = *position * radius + middle;
        }
        rock.uvs = vec![Vec2::ZERO; rock.positions.len()];
        parts.push(rock);
    }
    joined(&parts)
}

/// A rectangular sheet from a corner along two sides. `depth` gets a place in metres along both sides, and returns how
/// far the sheet is displaced against its normal. The border is not displaced.
fn sheet(from: Vec3, along: Vec3, up: Vec3, depth: impl Fn(f32, f32) -> f32) -> SourceMesh {
    let size = Vec2::new(along.length(), up.length());
    let cells = (size.max_element() * CELLS_PER_M) as u32;
    let mut mesh = plane(cells);
    let normal = along.cross(up).normalize();
    for vertex in 0..mesh.positions.len() {
        // The rows of `plane` go along x, and its front is +Y.
        let at = Vec2::new(mesh.uvs[vertex].y, mesh.uvs[vertex].x);
        // Sheets of a house share their borders. Displaced borders would leave gaps at its edges.
        let is_inside = at.min_element() > 0.0 && at.max_element() < 1.0;
        let depth = if is_inside {
            depth(at.x * size.x, at.y * size.y)
        } else {
            0.0
        };
        mesh.positions[vertex] = from + along * at.x + up * at.y - normal * depth;
        // The renderer's pattern has 24 waves per unit: one wave per metre.
        mesh.uvs[vertex] = at * size / 24.0;
    }
    // Swapping rows and columns made `along × up` the front.
    with_smooth_normals(mesh)
}

/// Windows of 1.2 × 1.6 m in a grid of 2.4 × 3 m, and joints between stones.
fn window_depth(across: f32, up: f32) -> f32 {
    let (x, y) = ((across % 2.4 - 1.2).abs(), (up % 3.0 - 1.6).abs());
    let frame = ((0.6 - x).min(0.8 - y) / 0.25).clamp(0.0, 1.0);
    let joints = (across * TAU / 0.8).sin() * (up * TAU / 0.6).sin();
    frame * 0.35 + (1.0 - frame) * (0.02 + 0.02 * joints)
}

/// Rolls a sheet along x into a tapered stem.
fn rolled(mut mesh: SourceMesh, radius: f32) -> SourceMesh {
    let height = mesh
        .positions
        .iter()
        .fold(0.0, |height: f32, at| height.max(at.y));
    for position in &mut mesh.positions {
        let angle = position.x * TAU;
        // A tip without a radius would have degenerate triangles.
        let radius = radius * (1.05 - position.y / height);
        let out = Vec3::new(angle.sin(), 0.0, angle.cos());
        *position = out * radius + Vec3::Y * position.y;
    }
    mesh
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Six times the signed volume, positive if the surface faces outwards.
    fn six_volumes(mesh: &SourceMesh) -> f32 {
        let (triangles, _) = mesh.indices.as_chunks::<3>();
        let volume = |triangle: &[u32; 3]| {
            let [a, b, c] = triangle.map(|it| mesh.positions[it as usize]);
            a.dot(b.cross(c))
        };
        triangles.iter().map(volume).sum()
    }

    #[test]
    fn shapes_face_outwards() {
        let house = house(Vec3::new(10.0, 8.0, 6.0));
        let volume = six_volumes(&house) / 6.0;
        // The floor, at height 0, adds nothing.
        assert!((400.0..=480.0).contains(&volume), "{volume}");
        assert!(six_volumes(&tree(8.0, 0, 1)) > 0.0);
        assert!(six_volumes(&tree(8.0, 12, 1)) > six_volumes(&tree(8.0, 0, 1)));
    }
}
