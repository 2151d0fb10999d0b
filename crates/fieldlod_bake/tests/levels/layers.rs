//! Thin layers: labels, decals, posters and shirts just in front of another surface.

use std::f32::consts::TAU;

use fieldlod_bake::{
    BakeConfig, SourceMesh, VerifyError, VerifySettings, bake_file, bake_mesh, bake_together,
    fixtures, import_gltf, swallowed_share, verify, verify_layers,
};
use fieldlod_hierarchy::Hierarchy;
use glam::{Vec2, Vec3};
use serde_json::json;

use crate::common::gltf_file::GltfFile;

/// Sides of pictures: radii of 25, 50, 100 and 200 pixels.
const SIDES: [usize; 4] = [50, 100, 200, 400];

/// A square of `2 · cells²` triangles, bent by a function of its texture coordinates.
fn bent(cells: u32, place: impl Fn(Vec2) -> Vec3) -> SourceMesh {
    let mut mesh = fixtures::plane(cells);
    mesh.positions = mesh.uvs.iter().map(|uv| place(*uv)).collect();
    fixtures::with_smooth_normals(mesh)
}

/// A part of the wall of a tube: all of it for turns from 0 to 1.
fn wall(cells: u32, turns: [f32; 2], heights: [f32; 2], radius: impl Fn(f32) -> f32) -> SourceMesh {
    bent(cells, |uv| {
        let y = heights[0] + (heights[1] - heights[0]) * uv.y;
        let turn = TAU * (turns[0] + (turns[1] - turns[0]) * uv.x);
        Vec3::new(turn.cos() * radius(y), y, turn.sin() * radius(y))
    })
}

fn waist(y: f32) -> f32 {
    0.3 + 0.04 * (5.0 * y).sin()
}

/// A patch on top of a ball.
fn cap(cells: u32, radius: f32) -> SourceMesh {
    bent(cells, |uv| {
        let at = (uv - 0.5) * 0.7;
        Vec3::new(at.x, 1.0, at.y).normalize() * radius
    })
}

/// A square with waves, and how high they are. It faces up.
fn waves(cells: u32, height: f32) -> SourceMesh {
    bent(cells, |uv| {
        let wave = (uv.x * 21.0).sin() * (uv.y * 17.0).cos();
        Vec3::new(uv.x, wave * height, uv.y)
    })
}

/// Objects with layers, the lowest mesh first.
fn layered() -> Vec<(&'static str, Vec<SourceMesh>)> {
    let barrel = || wall(40, [0.0, 1.0], [0.0, 3.0], |_| 1.0);
    let label = |gap: f32, heights| wall(16, [0.1, 0.4], heights, move |_| 1.0 + gap);
    let poster = bent(1, |uv| Vec3::new(0.3 + 0.4 * uv.x, 0.003, 0.3 + 0.4 * uv.y));
    vec![
        (
            "label on a barrel",
            vec![barrel(), label(0.003, [0.8, 2.0])],
        ),
        (
            "label on a label",
            vec![barrel(), label(0.005, [0.8, 2.0]), label(0.01, [1.0, 1.7])],
        ),
        (
            "shirt on a body",
            vec![
                wall(48, [0.0, 1.0], [0.0, 2.0], waist),
                wall(40, [0.0, 1.0], [0.71, 1.52], |y| waist(y) + 0.004),
            ],
        ),
        (
            "decal on a ball",
            vec![fixtures::icosphere(4), cap(12, 1.008)],
        ),
        ("poster on a wall", vec![waves(48, 0.002), poster]),
    ]
}

type Parts<'a> = Vec<(&'a SourceMesh, &'a Hierarchy)>;

fn pairs<'a>(meshes: &'a [SourceMesh], baked: &'a [Hierarchy]) -> Parts<'a> {
    meshes.iter().zip(baked).collect()
}

fn bake_all(meshes: &[SourceMesh]) -> Vec<Hierarchy> {
    let meshes: Vec<&SourceMesh> = meshes.iter().collect();
    let baked = bake_together(&meshes, &BakeConfig::default());
    baked.into_iter().map(|baked| baked.unwrap().0).collect()
}

fn bake(mesh: &SourceMesh) -> Hierarchy {
    bake_mesh(mesh, &BakeConfig::default()).unwrap()
}

/// Checks the pictures of an object, and that it loses triangles with its size.
fn assert_in_front(name: &str, parts: &Parts<'_>) {
    let shares = SIDES.map(|side| swallowed_share(parts, side));
    println!("{name}: {shares:?}");
    assert!(
        shares.iter().all(|share| *share <= 0.02),
        "{name}: {shares:?}"
    );
    verify_layers(parts).unwrap();
    for (mesh, baked) in parts {
        verify(mesh, baked, &VerifySettings::default()).unwrap();
        let coarsest = baked.units.last().unwrap().triangle_count;
        assert!(
            mesh.triangle_count() < 20 || coarsest < 100,
            "{name}: {coarsest}"
        );
    }
}

#[test]
fn layers_of_several_meshes_stay_in_front() {
    for (name, meshes) in layered() {
        let baked = bake_all(&meshes);
        assert!(
            baked
                .iter()
                .all(|own| own.groups[0].bounds == baked[0].groups[0].bounds)
        );
        assert_in_front(name, &pairs(&meshes, &baked));
    }
}

#[test]
fn layers_of_one_mesh_stay_in_front() {
    for (name, meshes) in layered() {
        let mesh = fixtures::joined(&meshes);
        let baked = bake(&mesh);
        assert_eq!(baked.validate(), Ok(()));
        assert_in_front(name, &vec![(&mesh, &baked)]);
    }
}

#[test]
fn layers_of_several_gltf_meshes_stay_in_front() {
    let (name, meshes) = layered().swap_remove(0);
    let mut file = GltfFile::empty();
    meshes.iter().for_each(|mesh| file.add_mesh(mesh));
    file.json["nodes"] = json!([{ "mesh": 0 }, { "mesh": 1 }]);
    let path = file.glb();
    let shares_sphere = || {
        let baked = bake_file(&path, &BakeConfig::default(), &|_| ()).unwrap();
        let baked = baked.file.primitives.into_iter();
        let baked: Vec<Hierarchy> = baked.map(|baked| baked.hierarchy).collect();
        (
            baked[0].groups[0].bounds == baked[1].groups[0].bounds,
            baked,
        )
    };
    let (shares, baked) = shares_sphere();
    assert!(shares);
    let sources = import_gltf(&path).unwrap().primitives.into_iter();
    let sources: Vec<SourceMesh> = sources.map(|primitive| primitive.mesh).collect();
    assert_in_front(name, &pairs(&sources, &baked));
    // Apart, they are baked separately.
    file.json["nodes"][1]["translation"] = json!([4, 0, 0]);
    file.glb();
    assert!(!shares_sphere().0);
}

#[test]
fn verify_rejects_swallowed_layers() {
    for (name, meshes) in layered() {
        let apart: Vec<Hierarchy> = meshes.iter().map(bake).collect();
        let fault = verify_layers(&pairs(&meshes, &apart));
        // The waves of the wall are lower than its poster at all levels.
        let is_safe = name == "poster on a wall";
        let is_found = matches!(fault, Err(VerifyError::Layer { .. }));
        assert!(is_found != is_safe, "{name}: {fault:?}");
    }
}

#[test]
fn verify_rejects_one_mesh_with_a_lowered_layer() {
    let mesh = fixtures::joined(&[fixtures::icosphere(4), cap(12, 1.008)]);
    let mut baked = bake(&mesh);
    verify(&mesh, &baked, &VerifySettings::default()).unwrap();
    // Undo the lift: lifted vertices return to the positions that they were lifted from.
    let ball = fixtures::icosphere(4).positions.len() as u32;
    let source = mesh.positions.len();
    for vertex in source..baked.vertices.positions.len() {
        if baked.moved_from[vertex - source] >= ball {
            baked.vertices.positions[vertex] *= 0.95;
        }
    }
    let parts = [(&mesh, &baked)];
    let fault = verify_layers(&parts).unwrap_err();
    assert!(matches!(fault, VerifyError::Layer { .. }), "{fault}");
}

#[test]
fn other_meshes_keep_their_levels() {
    let reversed = |mut mesh: SourceMesh, offset: f32| {
        mesh.indices
            .as_chunks_mut::<3>()
            .0
            .iter_mut()
            .for_each(|t| t.swap(1, 2));
        mesh.positions.iter_mut().for_each(|p| p.y -= offset);
        fixtures::with_smooth_normals(mesh)
    };
    let scaled = |mut mesh: SourceMesh, scale: f32| {
        mesh.positions.iter_mut().for_each(|p| *p *= scale);
        mesh
    };
    let ball = || fixtures::icosphere(4);
    let pairs = [
        (
            "a thin wall",
            [waves(32, 0.01), reversed(waves(32, 0.01), 0.004)],
        ),
        (
            "both sides of a sheet",
            [waves(32, 0.01), reversed(waves(32, 0.01), 0.0)],
        ),
        ("a ball in a ball", [scaled(ball(), 0.9), ball()]),
        ("leaves", [fixtures::cards(300, 2), fixtures::cards(200, 5)]),
        (
            "a ball in a room",
            [ball(), scaled(reversed(ball(), 0.0), 1.01)],
        ),
    ];
    for (name, meshes) in &pairs {
        let apart: Vec<Hierarchy> = meshes.iter().map(bake).collect();
        // Leaves, and sides that meet at their borders, change levels together.
        if !["leaves", "both sides of a sheet"].contains(name) {
            assert!(bake_all(meshes) == apart, "{name}");
        }
        // Only lifted vertices have an origin without other attributes.
        let mesh = fixtures::joined(meshes);
        assert!(bake(&mesh).moved_from.is_empty(), "{name}");
        assert!(apart.iter().all(|own| own.moved_from.is_empty()), "{name}");
    }
}

#[test]
fn lifts_do_not_depend_on_threads() {
    for (name, meshes) in layered().into_iter().take(2) {
        let one = rayon::ThreadPoolBuilder::new()
            .num_threads(1)
            .build()
            .unwrap();
        let mesh = fixtures::joined(&meshes);
        assert!(one.install(|| bake(&mesh)) == bake(&mesh), "{name}");
        assert!(
            one.install(|| bake_all(&meshes)) == bake_all(&meshes),
            "{name}"
        );
    }
}
