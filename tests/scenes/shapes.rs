//! Meshes of the objects in a town.

use bevy::prelude::*;
use fieldlod_bake::{SourceMesh, fixtures};

/// Width and height of a bay of a house, in metres.
pub(super) const BAY: f32 = 3.0;

/// A house of `112 · bays · floors + 2` triangles: each bay has a recessed window and a sill. Hard edges.
pub(super) fn house(bays: u32, floors: u32) -> SourceMesh {
    let mut mesh = SourceMesh::default();
    let half = bays as f32 * BAY * 0.5;
    for side in 0..4u8 {
        let turn = Quat::from_rotation_y(f32::from(side) * std::f32::consts::FRAC_PI_2);
        let to_wall = |at: Vec3| turn * (at + Vec3::new(-half, 0.0, half));
        for (bay, floor) in (0..bays).flat_map(|bay| (0..floors).map(move |floor| (bay, floor))) {
            let corner = Vec3::new(bay as f32, floor as f32, 0.0) * BAY;
            push_bay(&mut mesh, &|at| to_wall(corner + at));
        }
    }
    let top = floors as f32 * BAY;
    let roof = [[-half, half], [half, half], [half, -half], [-half, -half]];
    push_quad(&mut mesh, roof.map(|[x, z]| Vec3::new(x, top, z)));
    mesh
}

/// Adds a wall with a window and a sill.
fn push_bay(mesh: &mut SourceMesh, to_wall: &dyn Fn(Vec3) -> Vec3) {
    let rectangle = |[left, low]: [f32; 2], [right, high]: [f32; 2], z: f32| {
        [[left, low], [right, low], [right, high], [left, high]].map(|[x, y]| Vec3::new(x, y, z))
    };
    let wall = rectangle([0.0, 0.0], [BAY, BAY], 0.0);
    let hole = rectangle([0.8, 0.9], [2.2, 2.5], 0.0);
    let pane = rectangle([0.8, 0.9], [2.2, 2.5], -0.25);
    let sill = rectangle([0.7, 0.8], [2.3, 0.9], 0.1);
    let sill_back = rectangle([0.7, 0.8], [2.3, 0.9], 0.0);
    let mut push = |corners: [Vec3; 4]| push_quad(mesh, corners.map(to_wall));
    for (near, far) in [(wall, hole), (hole, pane), (sill_back, sill)] {
        for corner in 0..4 {
            let next = (corner + 1) % 4;
            push([near[corner], near[next], far[next], far[corner]]);
        }
    }
    push(pane);
    push(sill);
}

/// A fence of boards and two rails.
pub(super) fn fence(boards: u32) -> SourceMesh {
    let mut mesh = SourceMesh::default();
    for board in 0..boards {
        let at = Vec3::new(board as f32 * 0.15, 0.6, 0.0);
        push_box(&mut mesh, at, Vec3::new(0.06, 0.6, 0.01));
    }
    let half = boards as f32 * 0.075;
    for height in [0.3, 0.9] {
        push_box(
            &mut mesh,
            Vec3::new(half, height, -0.03),
            Vec3::new(half, 0.04, 0.02),
        );
    }
    mesh
}

/// A car of `3,456 · detail²` triangles: a rounded body and four wheels.
pub(super) fn car(detail: u32, length: f32) -> SourceMesh {
    let rings = 36 * detail;
    let body = tube(rings, 32 * detail, |along, around| {
        let z = (along - 0.5) * length;
        let end = (4.0 * along * (1.0 - along)).sqrt().sqrt();
        // The cabin.
        let high = 0.75 + 0.6 * (1.0 - (2.4 * (along - 0.55)).powi(2)).max(0.0).sqrt();
        let top = if around.y > 0.0 { high } else { 0.5 };
        Vec3::new(around.x * 0.9 * end, 0.75 + around.y * top * end, z)
    });
    let mut parts = vec![body];
    for (x, z) in [(-0.8, -0.3), (0.8, -0.3), (-0.8, 0.3), (0.8, 0.3)] {
        parts.push(tube(6, 24 * detail * detail, |along, around| {
            let radius = if (along - 0.5).abs() < 0.4 {
                0.35
            } else {
                0.05
            };
            let across = (along - 0.5) * 0.25 + x;
            Vec3::new(
                across,
                0.35 + around.y * radius,
                around.x * radius + z * length,
            )
        }));
    }
    fixtures::joined(&parts)
}

/// A lamp of 800 triangles: a pole and a globe.
pub(super) fn lamp(height: f32) -> SourceMesh {
    let pole = tube(20, 12, |along, around| {
        let radius = 0.06 + 0.1 * (-along * 20.0).exp();
        Vec3::new(around.x * radius, along * height, around.y * radius)
    });
    let mut globe = fixtures::rock(2, 7);
    globe
        .positions
        .iter_mut()
        .for_each(|at| *at = *at * 0.25 + Vec3::Y * height);
    globe.uvs = vec![Vec2::ZERO; globe.positions.len()];
    fixtures::joined(&[pole, globe])
}

/// A tube of `2 · rings · around` triangles with open ends. `at` maps the share of the length, and a point with
/// x⁴ + y⁴ = 1, to a position.
fn tube(rings: u32, around: u32, at: impl Fn(f32, Vec2) -> Vec3) -> SourceMesh {
    let mut mesh = SourceMesh::default();
    for ring in 0..=rings {
        for side in 0..around {
            let along = ring as f32 / rings as f32;
            let turn = Vec2::from_angle(side as f32 / around as f32 * std::f32::consts::TAU);
            let round = turn / turn.powf(4.0).element_sum().powf(0.25);
            mesh.positions.push(at(along, round));
            mesh.uvs.push(Vec2::new(side as f32 / around as f32, along));
            if ring == rings {
                continue;
            }
            let [a, b] = [side, (side + 1) % around].map(|side| ring * around + side);
            let [c, d] = [a, b].map(|corner| corner + around);
            mesh.indices.extend([a, c, b, b, c, d]);
        }
    }
    fixtures::with_smooth_normals(mesh)
}

fn push_box(mesh: &mut SourceMesh, center: Vec3, half: Vec3) {
    for axis in [Vec3::X, Vec3::Y, Vec3::Z, -Vec3::X, -Vec3::Y, -Vec3::Z] {
        let across = axis.any_orthonormal_vector();
        let up = axis.cross(across);
        let corners = [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]];
        push_quad(
            mesh,
            corners.map(|[a, b]| center + (axis + across * a + up * b) * half),
        );
    }
}

/// Adds a quad with its own vertices. The corners are counterclockwise.
fn push_quad(mesh: &mut SourceMesh, corners: [Vec3; 4]) {
    let first = mesh.positions.len() as u32;
    let normal = (corners[1] - corners[0]).cross(corners[3] - corners[0]);
    mesh.positions.extend(corners);
    mesh.normals.extend([normal.normalize_or(Vec3::Y); 4]);
    mesh.uvs.extend([Vec2::ZERO, Vec2::X, Vec2::ONE, Vec2::Y]);
    mesh.indices
        .extend([0, 1, 2, 0, 2, 3].map(|corner| first + corner));
}
