//! The baseline that meshoptimizer's clusterlod builds.

use fieldlod_bake::{
    BakeConfig, SourceMesh, bake_mesh, bare_clusterlod, clusterlod_hierarchy, fixtures,
};
use fieldlod_hierarchy::Hierarchy;
use glam::{Vec2, Vec3};

mod common;
use common::cut;

fn meshes() -> Vec<(&'static str, SourceMesh)> {
    vec![
        ("rock", fixtures::rock(4, 3)),
        ("knot", fixtures::torus_knot(128, 16)),
        ("hills", fixtures::height_field(48)),
        ("islands", fixtures::islands(400)),
        ("fan", fixtures::non_manifold_fan(9)),
        ("doubled", fixtures::doubled(fixtures::icosphere(3))),
        ("one triangle", fixtures::one_triangle()),
    ]
}

#[test]
fn baseline_is_valid_and_unmeasured() {
    for (name, mesh) in meshes() {
        let hierarchy = clusterlod_hierarchy(&mesh, &BakeConfig::fine_grained()).unwrap();
        assert_eq!(hierarchy.validate(), Ok(()), "{name}");
        assert_eq!(hierarchy.vertices.positions, mesh.positions, "{name}");
        let triangles = hierarchy.source_triangle_count();
        assert_eq!(triangles, mesh.triangle_count() as u64, "{name}");
        let mut deviations = hierarchy.groups.iter().map(|g| g.deviation_in_local);
        assert!(deviations.all(f32::is_infinite), "{name}");
    }
}

#[test]
fn only_sizes_of_clusters_and_groups_matter() {
    let mesh = fixtures::rock(5, 3);
    let config = BakeConfig::default();
    let other = BakeConfig {
        simplify_ratio: 0.7,
        ..config.clone()
    };
    let hierarchy = clusterlod_hierarchy(&mesh, &config).unwrap();
    assert_eq!(clusterlod_hierarchy(&mesh, &other).unwrap(), hierarchy);
    let fine = clusterlod_hierarchy(&mesh, &BakeConfig::fine_grained()).unwrap();
    assert!(fine.groups.len() > 2 * hierarchy.groups.len());
    let triangles = hierarchy
        .units
        .iter()
        .map(|unit| unit.triangle_count as usize);
    assert_eq!(bare_clusterlod(&mesh, &config), triangles.sum::<usize>());
}

const ALONG: u32 = 256;
const AROUND: u32 = 32;

/// The place of a knot's surface that has these texture coordinates.
fn place_of(knot: &SourceMesh, uv: Vec2) -> Vec3 {
    let ring = (uv.x / 12.0).clamp(0.0, 1.0) * ALONG as f32;
    let side = uv.y.clamp(0.0, 1.0) * AROUND as f32;
    let (i, j) = ((ring as u32).min(ALONG - 1), (side as u32).min(AROUND - 1));
    let at = |i: u32, j: u32| knot.positions[(i * (AROUND + 1) + j) as usize];
    let across = |i: u32| at(i, j).lerp(at(i, j + 1), side - j as f32);
    across(i).lerp(across(i + 1), ring - i as f32)
}

/// How many triangles there are where nothing finer than `level` is left, and how far their middles
/// lie from where their texture belongs, as a root of the mean square by area.
fn slip(knot: &SourceMesh, hierarchy: &Hierarchy, level: u32) -> (f32, f32) {
    let triangles = cut(hierarchy, |group| hierarchy.groups[group].level >= level);
    let vertices = &hierarchy.vertices;
    let (mut sum, mut area) = (0.0, 0.0);
    for triangle in &triangles {
        let [a, b, c] = triangle.map(|v| vertices.positions[v as usize]);
        let uvs = triangle.map(|v| vertices.uvs[v as usize]);
        let uv = uvs.iter().sum::<Vec2>() / 3.0;
        let weight = (b - a).cross(c - a).length();
        sum += weight * place_of(knot, uv).distance_squared((a + b + c) / 3.0);
        area += weight;
    }
    (triangles.len() as f32, (sum / area).sqrt())
}

/// Of a tube with two texture seams: vertices that move take their texture along.
#[test]
fn textures_slip_less_than_with_clusterlod_at_as_many_triangles() {
    let knot = fixtures::torus_knot(ALONG, AROUND);
    let config = BakeConfig::fast();
    let ours = bake_mesh(&knot, &config).unwrap();
    let theirs = clusterlod_hierarchy(&knot, &config).unwrap();
    for level in 1..=4 {
        let (triangles, ours) = slip(&knot, &ours, level);
        let (as_many, theirs) = slip(&knot, &theirs, level);
        assert!((0.95..1.05).contains(&(triangles / as_many)), "{level}");
        assert!(ours < 0.8 * theirs, "{level}: {ours} {theirs}");
    }
}
