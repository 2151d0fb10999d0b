//! Props with seams, hard edges and an atlas: texture coordinates stay in place, and tangents create no seams.

use std::sync::Arc;

use fieldlod_bake::{
    BakeConfig, SourceMesh, Surface, SurfaceAlpha, TextureMapping, VerifySettings, bake_mesh,
    fixtures, verify,
};
use fieldlod_hierarchy::Hierarchy;
use glam::{UVec2, Vec2, Vec3, Vec4};

fn bake(mesh: &SourceMesh) -> Hierarchy {
    bake_mesh(mesh, &BakeConfig::fine_grained()).unwrap()
}

/// A machine whose hierarchy stores the source vertex of each moved vertex.
fn machine() -> SourceMesh {
    let mut machine = fixtures::machine(3);
    machine.has_other_attributes = true;
    machine
}

/// Bent cards, as of hair. Each card has a cell of an atlas.
fn hair() -> SourceMesh {
    let cards = (0..600u16).map(|index| {
        let mut card = fixtures::plane(3);
        let angle = f32::from(index) * 2.4;
        let out = Vec3::new(angle.cos(), 0.0, angle.sin());
        let side = Vec3::new(-out.z, 0.0, out.x) * 0.1;
        let cell = Vec2::new(f32::from(index % 8), f32::from(index / 8 % 8));
        let vertices = &mut card.vertices;
        for (position, uv) in vertices.positions.iter_mut().zip(&mut vertices.uvs) {
            let bend = uv.y * uv.y;
            *position =
                out * (1.0 + bend) + side * uv.x + Vec3::Y * (f32::from(index % 11) * 0.2 - uv.y);
            *uv = (cell + 0.02 + *uv * 0.96) / 8.0;
        }
        fixtures::with_smooth_normals(card)
    });
    SourceMesh {
        has_other_attributes: true,
        ..fixtures::joined(&cards.collect::<Vec<_>>())
    }
}

/// Atlas cell at texture coordinates of the machine or the hair.
fn cell(uv: Vec2) -> UVec2 {
    (uv * 8.0).as_uvec2()
}

/// Triangles of levels that keep texture seams. Coarser ones may tear them.
fn untorn_triangles(baked: &Hierarchy) -> impl Iterator<Item = [u32; 3]> {
    let cuts = baked.whole_mesh_cuts().into_iter();
    cuts.filter(|cut| cut.triangles.len() > 500)
        .flat_map(|cut| cut.triangles)
}

#[test]
fn texture_coordinates_stay_in_their_atlas_cell() {
    for mesh in [machine(), hair()] {
        let baked = bake(&mesh);
        let mut moved: Vec<u32> = untorn_triangles(&baked).flatten().collect();
        moved.retain(|&vertex| vertex >= baked.source_vertex_count);
        assert!(moved.len() > 1_000);
        for vertex in moved {
            let origin = baked.origin_of(vertex).unwrap();
            let [uv, of_origin] = [vertex, origin].map(|v| baked.vertices.uvs[v as usize]);
            assert_eq!(cell(uv), cell(of_origin), "{uv} from {of_origin}");
        }
    }
}

#[test]
fn no_triangle_spans_two_atlas_cells() {
    let baked = bake(&machine());
    for triangle in untorn_triangles(&baked) {
        let [a, b, c] = triangle.map(|v| cell(baked.vertices.uvs[v as usize]));
        assert!(a == b && b == c, "{a} {b} {c}");
    }
}

#[test]
fn tangents_create_no_seams() {
    let mut knot = fixtures::torus_knot(96, 24);
    let without = bake(&knot);
    knot.tangents = knot
        .normals
        .iter()
        .map(|n| n.any_orthonormal_vector().extend(1.0))
        .collect();
    let with = bake(&knot);
    assert_eq!(with.vertices.positions, without.vertices.positions);
    assert_eq!(with.indices, without.indices);
    for (tangent, normal) in with.vertices.tangents.iter().zip(&with.vertices.normals) {
        assert!(tangent.truncate().dot(*normal).abs() < 1e-3);
        assert!((tangent.truncate().length() - 1.0).abs() < 1e-3);
    }
}

#[test]
fn game_props_pass_verification() {
    for mesh in [fixtures::machine(3), fixtures::kit(3)] {
        let baked = bake(&mesh);
        verify(&mesh, &baked, &VerifySettings::default()).unwrap();
    }
}

/// A wall of windows behind reveals. Each quad has the whole texture, so each edge is a seam.
fn facade(cells: u16) -> SourceMesh {
    let mut mesh = SourceMesh::default();
    for (x, y) in (0..cells).flat_map(|x| (0..cells).map(move |y| (x, y))) {
        let at = Vec3::new(f32::from(x), f32::from(y), 0.0);
        let ring = |low: f32, high: f32, z: f32| {
            [[low, low], [high, low], [high, high], [low, high]]
                .map(|[x, y]| at + Vec3::new(x, y, z))
        };
        let (wall, hole, pane) = (
            ring(0.0, 1.0, 0.0),
            ring(0.3, 0.7, 0.0),
            ring(0.3, 0.7, -0.1),
        );
        let mut quads = vec![pane];
        for (near, far) in [(wall, hole), (hole, pane)] {
            quads.extend((0..4).map(|corner| {
                let next = (corner + 1) % 4;
                [near[corner], near[next], far[next], far[corner]]
            }));
        }
        for corners in quads {
            let first = mesh.positions.len() as u32;
            let normal = (corners[1] - corners[0]).cross(corners[3] - corners[0]);
            mesh.positions.extend(corners);
            mesh.normals.extend([normal.normalize(); 4]);
            mesh.uvs.extend([Vec2::ZERO, Vec2::X, Vec2::ONE, Vec2::Y]);
            mesh.indices
                .extend([0, 1, 2, 0, 2, 3].map(|corner| first + corner));
        }
    }
    mesh
}

/// The error of the first level with at most a tenth of the triangles.
fn error_of_tenth(mesh: &SourceMesh) -> f32 {
    let levels = bake_mesh(mesh, &BakeConfig::default()).unwrap();
    let cuts = levels.whole_mesh_cuts();
    let tenth = cuts
        .iter()
        .find(|cut| cut.triangles.len() * 10 <= mesh.triangle_count())
        .expect("a level has a tenth of the triangles");
    levels.largest_below(tenth.group_level, |group| group.error_in_local)
}

#[test]
fn seams_on_all_edges_do_not_stop_simplification() {
    let mut mesh = facade(12);
    let unknown = error_of_tenth(&mesh);
    let plain = Surface::new(Vec4::new(0.8, 0.6, 0.5, 1.0), SurfaceAlpha::Opaque);
    mesh.surface = Some(Arc::new(plain.clone()));
    let without_texture = error_of_tenth(&mesh);
    let checker = |x: u32, y: u32| [if (x ^ y) & 1 == 0 { 40 } else { 220 }, 120, 90, 255];
    let mapping = TextureMapping::default();
    mesh.surface = Some(Arc::new(plain.with_texture(
        UVec2::splat(2),
        mapping,
        checker,
    )));
    let with_checker = error_of_tenth(&mesh);
    mesh.surface = None;
    mesh.uvs.clear();
    let without_uvs = error_of_tenth(&mesh);
    let errors = [without_uvs, without_texture, with_checker, unknown];
    assert!(without_texture <= 2.0 * without_uvs, "{errors:?}");
    // Visible tears count. If the texture is unknown, all tears may be visible.
    assert!(without_texture < with_checker, "{errors:?}");
    assert!(with_checker < unknown, "{errors:?}");
}

/// Some programs give no normals to small triangles.
#[test]
fn missing_normals_stay_missing() {
    let mut rock = fixtures::rock(4, 1);
    let positions = rock.positions.clone();
    for (normal, position) in rock.normals.iter_mut().zip(&positions) {
        if position.y + 0.3 * (position.x * 20.0).sin() < 0.0 {
            *normal = Vec3::ZERO;
        }
    }
    let vertices = bake(&rock).vertices;
    let pairs = vertices.normals.iter().zip(&vertices.positions);
    let moved = pairs.skip(rock.positions.len());
    let cosines = moved.map(|(normal, position)| normal.dot(position.normalize()));
    let (missing, present): (Vec<f32>, Vec<f32>) = cosines.partition(|cosine| *cosine == 0.0);
    assert!(missing.len() > 100 && present.len() > 100);
    // The normals of a rock point outwards.
    assert!(present.iter().all(|cosine| *cosine > 0.2), "{present:?}");
}
