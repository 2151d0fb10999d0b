//! Invariants of every bake, for any mesh and cut.

use std::collections::HashSet;

use crate::common::{cut, error_criterion, open_edges, random_criterion, weld};
use fieldlod_bake::{
    BakeConfig, BakeReport, FallbackKind, MeshError, SourceMesh, bake_mesh, bake_mesh_with_report,
    fixtures,
};
use fieldlod_hierarchy::{Hierarchy, Vertices};
use glam::{Vec2, Vec3};
use proptest::prelude::*;

/// Small clusters, so that small meshes have many groups and levels.
fn many_groups() -> BakeConfig {
    BakeConfig {
        cluster_triangles: 32,
        group_clusters: 8,
        ..BakeConfig::default()
    }
}

fn bake(mesh: &SourceMesh, config: &BakeConfig) -> Hierarchy {
    let hierarchy = bake_mesh(mesh, config).unwrap();
    hierarchy.validate().unwrap();
    hierarchy
}

/// Cuts at up to 23 errors of groups, and random cuts, as triangles.
fn cuts_of(hierarchy: &Hierarchy, seed: u64) -> Vec<Vec<[u32; 3]>> {
    let mut errors: Vec<f32> = hierarchy.groups.iter().map(|g| g.error_in_local).collect();
    errors.sort_by(f32::total_cmp);
    let step = (errors.len() / 12).max(1);
    let by_error = errors.iter().step_by(step);
    let mut cuts: Vec<_> = by_error
        .map(|&error| cut(hierarchy, error_criterion(hierarchy, error)))
        .collect();
    for percent in [1, 5, 20, 60] {
        cuts.push(cut(hierarchy, random_criterion(seed, percent)));
    }
    cuts
}

/// Asserts that every edge of a cut has an opposite edge, as in the closed source.
fn assert_closed(hierarchy: &Hierarchy, seed: u64) {
    let weld = weld(&hierarchy.vertices.positions);
    for (index, triangles) in cuts_of(hierarchy, seed).iter().enumerate() {
        let open = open_edges(triangles, &weld);
        let count = open.len();
        assert!(
            count == 0,
            "cut {index} of {} triangles has {count} open edges",
            triangles.len()
        );
    }
}

/// Asserts that open edges of a cut connect only vertices on open edges of the source.
fn assert_borders_stay(mesh: &SourceMesh, hierarchy: &Hierarchy, seed: u64) {
    let weld = weld(&hierarchy.vertices.positions);
    let (source, _) = mesh.indices.as_chunks::<3>();
    let border: HashSet<u32> = open_edges(source, &weld)
        .into_keys()
        .flat_map(|(a, b)| [a, b])
        .collect();
    for triangles in cuts_of(hierarchy, seed) {
        for (a, b) in open_edges(&triangles, &weld).into_keys() {
            assert!(
                border.contains(&a) && border.contains(&b),
                "edge {a}-{b} opened"
            );
        }
    }
}

fn closed_meshes() -> Vec<(&'static str, SourceMesh)> {
    vec![
        ("icosphere", fixtures::icosphere(4)),
        ("rock", fixtures::rock(4, 1)),
        ("shells", fixtures::shells(4, 3)),
        ("torus knot", fixtures::torus_knot(100, 16)),
        (
            "flat-shaded rock",
            fixtures::rock(4, 2).without_shared_vertices(),
        ),
    ]
}

#[test]
fn closed_meshes_stay_closed_in_every_cut() {
    for (name, mesh) in closed_meshes() {
        for config in [
            BakeConfig::default(),
            BakeConfig::fast(),
            BakeConfig::max_quality(),
            many_groups(),
        ] {
            let weld = weld(&mesh.positions);
            let (source, _) = mesh.indices.as_chunks::<3>();
            assert!(open_edges(source, &weld).is_empty(), "{name} is not closed");
            assert_closed(&bake(&mesh, &config), 3);
        }
    }
}

#[test]
fn stuck_groups_stay_joined_to_their_neighbours() {
    let mesh = fixtures::rock(4, 610);
    let config = BakeConfig {
        cluster_triangles: 16,
        group_clusters: 2,
        ..BakeConfig::default()
    };
    let (hierarchy, report) = bake_mesh_with_report(&mesh, &config).unwrap();
    hierarchy.validate().unwrap();
    assert!(report.stuck_groups > 0, "the test needs stuck groups");
    assert_closed(&hierarchy, 610);
}

#[test]
fn coarsest_level_has_about_a_dozen_triangles() {
    for (name, mesh) in [
        ("rock", fixtures::rock(6, 1)),
        ("icosphere", fixtures::icosphere(4)),
        ("height field", fixtures::height_field(100)),
        ("plane", fixtures::plane(30)),
        (
            "two-sided plane",
            fixtures::both_sides(&fixtures::plane(30), true),
        ),
    ] {
        let (hierarchy, report) = bake_mesh_with_report(&mesh, &BakeConfig::default()).unwrap();
        let triangles = cut(&hierarchy, |_| false).len();
        assert!((1..=18).contains(&triangles), "{name}: {triangles}");
        assert_eq!(report.coarsest_triangles, triangles);
        assert!(
            report.whole_mesh_levels >= 3 && report.fallbacks.is_empty(),
            "{name}: {report:?}"
        );
    }
}

#[test]
fn fallbacks_simplify_stuck_groups() {
    for (name, mesh) in [
        ("islands", fixtures::islands(20_000)),
        ("fan", fixtures::non_manifold_fan(5_000)),
        ("coincident", fixtures::coincident_points(5_000)),
    ] {
        let (hierarchy, report) = bake_mesh_with_report(&mesh, &BakeConfig::default()).unwrap();
        hierarchy.validate().unwrap();
        assert!(report.coarsest_triangles <= 512, "{name}: {report:?}");
    }
}

/// A mesh with a separate texture area for every triangle.
fn mesh_of_seams() -> SourceMesh {
    let mut mesh = fixtures::rock(2, 3).without_shared_vertices();
    let corners = [Vec2::ZERO, Vec2::X, Vec2::Y];
    let tiles = (0..mesh.positions.len()).map(|v| {
        let (triangle, corner) = (v / 3, v % 3);
        let tile = Vec2::new((triangle % 32) as f32, (triangle / 32) as f32);
        (tile + corners[corner] * 0.8) / 32.0
    });
    mesh.uvs = tiles.collect();
    mesh
}

#[test]
fn stated_error_covers_torn_textures() {
    let mesh = mesh_of_seams();
    assert!(mesh.triangle_count() <= BakeReport::MOST_COARSEST);
    let (hierarchy, report) = bake_mesh_with_report(&mesh, &BakeConfig::default()).unwrap();
    hierarchy.validate().unwrap();
    assert!(report.coarsest_triangles <= 24, "{report:?}");
    let torn = report.fallbacks.iter();
    let torn: Vec<_> = torn
        .filter(|step| step.kind == FallbackKind::TexturesTorn)
        .collect();
    assert!(!torn.is_empty(), "{report:?}");
    for step in torn {
        let group = &hierarchy.groups[step.group as usize];
        let units = hierarchy.units.iter();
        let units = units.filter(|unit| unit.producer() == Some(step.group));
        for [a, b, c] in units.flat_map(|unit| hierarchy.triangles_of(unit)) {
            for (from, to) in [(a, b), (b, c), (c, a)] {
                let [from, to] = [from, to].map(|v| hierarchy.vertices.positions[v as usize]);
                assert!(from.distance(to) <= group.deviation_in_local * 1.0001);
                assert!(from.distance(to) <= group.error_in_local * 1.0001);
            }
        }
    }
}

#[test]
fn open_meshes_open_only_at_their_borders() {
    for mesh in [fixtures::plane(48), fixtures::height_field(64)] {
        for config in [
            BakeConfig::default(),
            BakeConfig::fine_grained(),
            many_groups(),
        ] {
            assert_borders_stay(&mesh, &bake(&mesh, &config), 5);
        }
    }
}

/// Surface that is drawn twice or not at all would change the volume.
#[test]
fn every_cut_covers_the_surface_once() {
    let mesh = fixtures::rock(5, 1);
    let (source, _) = mesh.indices.as_chunks::<3>();
    let hierarchy = bake(&mesh, &many_groups());
    assert!(
        hierarchy.level_count() > 6,
        "the test needs more than six levels"
    );
    for triangles in cuts_of(&hierarchy, 11) {
        let positions = &hierarchy.vertices.positions;
        let share = volume(positions, &triangles) / volume(positions, source);
        // A dozen triangles have about half the volume of a rock.
        let least = if triangles.len() < 250 { 0.4 } else { 0.9 };
        assert!(
            (least..1.02).contains(&share),
            "{} triangles: {share}",
            triangles.len()
        );
    }
}

fn volume(positions: &[Vec3], triangles: &[[u32; 3]]) -> f32 {
    let corners = triangles.iter().map(|t| t.map(|v| positions[v as usize]));
    corners.map(|[a, b, c]| a.dot(b.cross(c)) / 6.0).sum()
}

#[test]
fn texture_seams_are_not_torn() {
    let mesh = fixtures::torus_knot(200, 24);
    let hierarchy = bake(&mesh, &many_groups());
    for triangles in cuts_of(&hierarchy, 13) {
        let count = triangles.len();
        // A dozen triangles around a tube need one that spans the whole texture.
        if count <= 12 {
            continue;
        }
        for triangle in triangles {
            let [a, b, c] = triangle.map(|v| hierarchy.vertices.uvs[v as usize]);
            // A torn triangle would span the texture from v = 0 to v = 1.
            let low = a.y.min(b.y).min(c.y);
            let high = a.y.max(b.y).max(c.y);
            assert!(
                high - low < 0.95,
                "of {count}, a triangle spans v from {low} to {high}"
            );
        }
    }
}

#[test]
fn bake_is_independent_of_the_unit_of_length() {
    let mesh = fixtures::rock(4, 9);
    let mut scaled = mesh.clone();
    for position in &mut scaled.positions {
        *position *= 2.0f32.powi(-40);
    }
    let large = bake(&mesh, &many_groups());
    let small = bake(&scaled, &many_groups());
    assert_eq!(large.indices, small.indices);
    for (large, small) in large.groups.iter().zip(&small.groups) {
        assert_eq!(large.error_in_local, small.error_in_local * 2.0f32.powi(40));
    }
}

#[test]
fn tiny_mesh_is_one_terminal_group() {
    let hierarchy = bake(&fixtures::one_triangle(), &BakeConfig::default());
    assert_eq!((hierarchy.groups.len(), hierarchy.units.len()), (1, 1));
    assert!(hierarchy.groups[0].is_terminal());
}

#[test]
fn bake_is_independent_of_the_thread_count() {
    let mesh = fixtures::rock(5, 3);
    let with = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
        pool.unwrap().install(|| bake(&mesh, &many_groups()))
    };
    let one = with(1);
    assert!(one == with(2) && one == with(5));
}

#[test]
fn degenerate_meshes_bake() {
    for (name, mesh) in [
        ("one triangle", fixtures::one_triangle()),
        ("coincident points", fixtures::coincident_points(10_000)),
        ("fan", fixtures::non_manifold_fan(3_000)),
        ("islands", fixtures::islands(100_000)),
        ("doubled", fixtures::doubled(fixtures::rock(4, 4))),
        (
            "no vertices shared",
            fixtures::plane(40).without_shared_vertices(),
        ),
    ] {
        let hierarchy = bake(&mesh, &many_groups());
        assert_eq!(
            hierarchy.source_triangle_count(),
            mesh.triangle_count() as u64,
            "{name}"
        );
    }
}

fn soup(positions: Vec<Vec3>, corners: u32) -> SourceMesh {
    SourceMesh {
        vertices: Vertices {
            positions,
            ..Vertices::default()
        },
        indices: (0..corners).collect(),
        ..SourceMesh::default()
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(12))]

    #[test]
    fn any_rock_stays_closed(seed in 0u32..1000, cluster in 16usize..128, group in 4usize..24) {
        let config = BakeConfig { cluster_triangles: cluster, group_clusters: group, ..BakeConfig::default() };
        let mesh = fixtures::rock(4, seed);
        assert_closed(&bake(&mesh, &config), u64::from(seed));
    }

    #[test]
    fn any_knot_stays_closed(along in 3u32..160, around in 3u32..32, seed in 0u64..1000) {
        let mesh = fixtures::torus_knot(along, around);
        assert_closed(&bake(&mesh, &many_groups()), seed);
    }

    #[test]
    fn any_field_opens_only_at_its_border(cells in 8u32..80, cluster in 16usize..128, group in 4usize..24) {
        let config = BakeConfig { cluster_triangles: cluster, group_clusters: group, ..BakeConfig::default() };
        let mesh = fixtures::height_field(cells);
        assert_borders_stay(&mesh, &bake(&mesh, &config), u64::from(cells));
    }

    #[test]
    fn any_soup_bakes(coordinates in prop::collection::vec(-8i8..8, 9..900)) {
        let (points, _) = coordinates.as_chunks::<3>();
        let points: Vec<Vec3> = points.iter().map(|p| Vec3::from_array(p.map(f32::from))).collect();
        let corners = points.len() as u32 / 3 * 3;
        let mesh = soup(points, corners);
        bake(&mesh, &BakeConfig { cluster_triangles: 8, group_clusters: 4, ..BakeConfig::default() });
    }

    /// Coordinates from denormal to very large ones.
    #[test]
    fn any_coordinates_bake_or_are_rejected(bits in prop::collection::vec(any::<u32>(), 9..400), largest in -126i32..62) {
        let usable = |bits: &u32| (f32::from_bits(*bits) % 2.0f32.powi(largest)).clamp(-1e18, 1e18);
        let (points, _) = bits.as_chunks::<3>();
        let points: Vec<Vec3> = points.iter().map(|p| Vec3::from_array(p.map(|b| usable(&b)))).collect();
        let corners = points.len() as u32 / 3 * 3;
        let mesh = soup(points, corners);
        let config = BakeConfig { cluster_triangles: 8, group_clusters: 4, ..BakeConfig::default() };
        match bake_mesh(&mesh, &config) {
            Ok(hierarchy) => prop_assert_eq!(hierarchy.validate(), Ok(())),
            Err(fault) => prop_assert!(matches!(fault, MeshError::BadPosition { .. }), "{}", fault),
        }
    }
}
