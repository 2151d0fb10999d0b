//! Meshes with the flaws of real files: rounded positions and texture coordinates, two-sided sheets.

use fieldlod_bake::{BakeConfig, SourceMesh, bake_mesh, bake_mesh_with_report, fixtures};
use fieldlod_hierarchy::{Hierarchy, WholeMeshCut};
use glam::Vec3;

fn bake(mesh: &SourceMesh) -> Hierarchy {
    bake_mesh(mesh, &BakeConfig::fine_grained()).unwrap()
}

fn counts(baked: &Hierarchy) -> Vec<usize> {
    let cuts = baked.whole_mesh_cuts();
    cuts.iter().map(|cut| cut.triangles.len()).collect()
}

fn area(baked: &Hierarchy, cut: &WholeMeshCut) -> f32 {
    let triangles = cut.triangles.iter().map(|triangle| {
        let [a, b, c] = triangle.map(|v| baked.vertices.positions[v as usize]);
        (b - a).cross(c - a).length() * 0.5
    });
    triangles.sum()
}

/// Asserts that two bakes have equally many levels. In simplified levels of over 200 triangles, triangles and area
/// differ by at most `share`. Deviations may be larger by four times `share`, or smaller.
fn assert_similar_levels(baked: &Hierarchy, of: &Hierarchy, share: f32) {
    let [own, wanted] = [baked, of].map(Hierarchy::whole_mesh_cuts);
    assert_eq!(
        own.len(),
        wanted.len(),
        "{:?} {:?}",
        counts(baked),
        counts(of)
    );
    for (own, wanted) in own
        .iter()
        .zip(&wanted)
        .skip(1)
        .filter(|cuts| cuts.0.triangles.len() > 200)
    {
        let triangles = own.triangles.len() as f32 / wanted.triangles.len() as f32;
        let areas = area(baked, own) / area(of, wanted);
        let error = |baked: &Hierarchy, cut: &WholeMeshCut| {
            baked.largest_below(cut.group_level, |group| group.deviation_in_local)
        };
        let errors = error(baked, own) / error(of, wanted);
        assert!(
            (triangles - 1.0).abs() <= share,
            "{triangles} of the triangles"
        );
        assert!((areas - 1.0).abs() <= share, "{areas} of the area");
        assert!(errors <= 1.0 + 4.0 * share, "{errors} of the deviation");
    }
}

#[test]
fn rounded_soup_is_baked_as_welded_mesh() {
    for mesh in [fixtures::rock(4, 3), fixtures::torus_knot(96, 16)] {
        let welded = bake(&fixtures::soup(&mesh, 0.0));
        for rounding in [1e-8, 1e-7] {
            let soup = fixtures::soup(&mesh, rounding);
            let (baked, report) =
                bake_mesh_with_report(&soup, &BakeConfig::fine_grained()).unwrap();
            assert!(!report.has_aggregates);
            assert_similar_levels(&baked, &welded, 0.08);
        }
    }
}

#[test]
fn rounded_texture_coordinates_create_no_seams() {
    let mesh = fixtures::soup(&fixtures::torus_knot(96, 16), 0.0);
    let clean = bake(&mesh);
    for noise in [1e-7, 1e-5, 1e-4] {
        let noisy = bake(&fixtures::with_uv_noise(mesh.clone(), noise));
        assert_similar_levels(&noisy, &clean, 0.08);
    }
}

#[test]
fn finest_level_is_unchanged_by_welding() {
    let soup = fixtures::soup(&fixtures::rock(3, 3), 1e-7);
    let baked = bake(&soup);
    let count = soup.positions.len();
    assert_eq!(baked.vertices.positions[..count], soup.positions);
    let mut drawn = baked.whole_mesh_cuts()[0].triangles.clone();
    let mut source = soup.indices.as_chunks::<3>().0.to_vec();
    drawn.sort_unstable();
    source.sort_unstable();
    assert_eq!(drawn, source);
}

#[test]
fn both_sides_of_sheets_are_simplified_alike() {
    let cloth = fixtures::height_field(48);
    let one_side = bake(&cloth);
    for shares_vertices in [true, false] {
        let both = bake(&fixtures::both_sides(&cloth, shares_vertices));
        let doubled: Vec<usize> = counts(&one_side).iter().map(|count| 2 * count).collect();
        assert_eq!(counts(&both), doubled);
        for (both_cut, one_cut) in both
            .whole_mesh_cuts()
            .iter()
            .zip(one_side.whole_mesh_cuts())
        {
            let share = area(&both, both_cut) / area(&one_side, &one_cut);
            assert!((share - 2.0).abs() < 1e-3, "{share}");
            assert_faces_cancel(&both, both_cut);
        }
    }
}

/// Asserts that every triangle has a twin with the same corners in the opposite order.
fn assert_faces_cancel(baked: &Hierarchy, cut: &WholeMeshCut) {
    let key = |triangle: &[u32; 3], order: [usize; 3]| {
        let bits = order.map(|corner| {
            let position = baked.vertices.positions[triangle[corner] as usize];
            position.to_array().map(f32::to_bits)
        });
        let first = (0..3).min_by_key(|&at| bits[at]).unwrap_or(0);
        [bits[first], bits[(first + 1) % 3], bits[(first + 2) % 3]]
    };
    let mut fronts: Vec<_> = cut.triangles.iter().map(|t| key(t, [0, 1, 2])).collect();
    let mut backs: Vec<_> = cut.triangles.iter().map(|t| key(t, [0, 2, 1])).collect();
    fronts.sort_unstable();
    backs.sort_unstable();
    assert_eq!(fronts, backs);
}

#[test]
fn normals_of_backs_are_opposite_on_all_levels() {
    let cloth = fixtures::height_field(48);
    let both = bake(&fixtures::both_sides(&cloth, false));
    for cut in both.whole_mesh_cuts() {
        for triangle in &cut.triangles {
            let [a, b, c] = triangle.map(|v| both.vertices.positions[v as usize]);
            let facing = (b - a).cross(c - a);
            let normals = triangle.map(|v| both.vertices.normals[v as usize]);
            let mean: Vec3 = normals.iter().sum();
            assert!(mean.dot(facing) > 0.0, "{mean} {facing}");
        }
    }
}
