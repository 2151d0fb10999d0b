//! Leaves, blades, gravel: what levels of many small pieces keep.

mod common;

use common::{open_edges, weld};
use fieldlod_bake::{BakeConfig, SourceMesh, VerifySettings, bake_mesh, fixtures, verify};
use fieldlod_hierarchy::{Hierarchy, fixtures::Random};
use glam::{Vec3, Vec4};

fn bake(mesh: &SourceMesh) -> Hierarchy {
    bake_mesh(mesh, &BakeConfig::default()).unwrap()
}

/// The triangles of each level of the whole mesh, finest first.
fn levels(hierarchy: &Hierarchy) -> Vec<Vec<[u32; 3]>> {
    let level = |level: u32| {
        let mut refined: Vec<bool> = hierarchy.groups.iter().map(|g| g.level >= level).collect();
        hierarchy.close_refinement(&mut refined);
        let units = hierarchy.drawn_units(&refined);
        let triangles = units.flat_map(|unit| hierarchy.triangles_of(&hierarchy.units[unit]));
        triangles.collect()
    };
    (0..hierarchy.level_count()).map(level).collect()
}

/// The share of sight rays through a ball of radius 1.2 that hit a triangle.
fn covered(hierarchy: &Hierarchy, triangles: &[[u32; 3]]) -> f32 {
    const SIDE: usize = 48;
    let mut hit = 0;
    for axis in [Vec3::X, Vec3::Y, Vec3::new(0.6, 0.5, -0.62)] {
        let right = axis.any_orthonormal_vector();
        let up = axis.cross(right);
        let mut picture = [[false; SIDE]; SIDE];
        for triangle in triangles {
            let corners = triangle.map(|vertex| {
                let p = hierarchy.vertices.positions[vertex as usize];
                [right, up].map(|along| (p.dot(along) / 1.2 + 1.0) * 0.5 * SIDE as f32)
            });
            draw(corners, &mut picture);
        }
        hit += picture.as_flattened().iter().filter(|hit| **hit).count();
    }
    hit as f32
}

fn draw<const N: usize>([a, b, c]: [[f32; 2]; 3], picture: &mut [[bool; N]; N]) {
    let range = |axis: usize| {
        let low = a[axis].min(b[axis]).min(c[axis]).max(0.0) as usize;
        let high = a[axis].max(b[axis]).max(c[axis]).max(0.0) as usize;
        low..(high + 1).min(N)
    };
    let side = |p: [f32; 2], q: [f32; 2], x: f32, y: f32| {
        (q[0] - p[0]) * (y - p[1]) - (q[1] - p[1]) * (x - p[0])
    };
    for row in range(1) {
        for column in range(0) {
            let (x, y) = (column as f32 + 0.5, row as f32 + 0.5);
            let sides = [side(a, b, x, y), side(b, c, x, y), side(c, a, x, y)];
            let is_inside =
                sides.iter().all(|side| *side >= 0.0) || sides.iter().all(|side| *side <= 0.0);
            picture[row][column] |= is_inside;
        }
    }
}

#[test]
fn levels_of_plants_keep_the_area_that_they_cover() {
    for (name, mesh) in [
        ("crown", fixtures::crown(3_000, 3)),
        ("cards", fixtures::cards(3_000, 3)),
    ] {
        let hierarchy = bake(&mesh);
        let levels = levels(&hierarchy);
        let source = covered(&hierarchy, &levels[0]);
        for triangles in &levels {
            let share = covered(&hierarchy, triangles) / source;
            println!("{name}, {} triangles: {share:.3}", triangles.len());
            let least = if triangles.len() > 100 { 0.95 } else { 0.89 };
            assert!(share > least && share < 1.05, "{name}: {share}");
        }
    }
}

#[test]
fn levels_of_plants_keep_their_mean_colour() {
    let mut mesh = fixtures::cards(3_000, 5);
    let mut random = Random::new(2);
    for _ in 0..3_000 {
        let color = Vec4::new(random.unit(), random.unit(), 0.2, 1.0);
        mesh.colors.extend([color; 4]);
    }
    let hierarchy = bake(&mesh);
    let mean = |triangles: &[[u32; 3]]| {
        let (mut sum, mut whole) = (Vec4::ZERO, 0.0);
        for triangle in triangles {
            let [a, b, c] = triangle.map(|v| hierarchy.vertices.positions[v as usize]);
            let area = (b - a).cross(c - a).length();
            let colors = triangle.map(|v| hierarchy.vertices.colors[v as usize]);
            sum += colors.into_iter().sum::<Vec4>() * area;
            whole += area * 3.0;
        }
        sum / whole
    };
    let levels = levels(&hierarchy);
    let source = mean(&levels[0]);
    for triangles in levels.iter().filter(|triangles| triangles.len() > 300) {
        let share = mean(triangles).y / source.y;
        assert!((0.9..1.1).contains(&share), "{}: {share}", triangles.len());
    }
}

#[test]
fn plants_are_verified() {
    for mesh in [
        fixtures::crown(1_500, 1),
        fixtures::cards(3_000, 2),
        fixtures::islands(2_000),
    ] {
        let verified = verify(&mesh, &bake(&mesh), &VerifySettings::default());
        assert!(verified.is_ok(), "{verified:?}");
    }
}

#[test]
fn closed_plants_stay_closed() {
    let hierarchy = bake(&fixtures::crown(2_000, 7));
    let weld = weld(&hierarchy.vertices.positions);
    for triangles in levels(&hierarchy) {
        assert!(open_edges(&triangles, &weld).is_empty());
    }
}

#[test]
fn vertices_of_elements_stay_finite() {
    let mut random = Random::new(9);
    let mut mesh = fixtures::cards(400, 4);
    // Cards without area, and some of one point.
    for corner in mesh.positions.chunks_mut(4).step_by(3).flatten() {
        corner.y = 0.0;
        corner.x = if random.unit() < 0.5 { 0.0 } else { corner.x };
        corner.z = 0.0;
    }
    let hierarchy = bake(&mesh);
    assert_eq!(hierarchy.validate(), Ok(()));
    assert!(hierarchy.vertices.normals.iter().all(|n| n.is_finite()));
}
