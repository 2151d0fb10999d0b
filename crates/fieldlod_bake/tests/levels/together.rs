//! Meshes that are baked together, such as the bark and the leaves of a tree.

use crate::common::gltf_file::GltfFile;
use fieldlod_bake::{
    BakeConfig, MeshError, SourceMesh, VerifySettings, bake_file, bake_mesh, bake_together,
    fixtures, verify,
};
use fieldlod_hierarchy::{Hierarchy, fixtures::Random};
use glam::{Vec2, Vec3};

fn bake(meshes: &[&SourceMesh]) -> Vec<Hierarchy> {
    let baked = bake_together(meshes, &BakeConfig::default());
    baked.into_iter().map(|baked| baked.unwrap().0).collect()
}

/// Error and deviation of each level, which decide when it is drawn.
fn errors_and_deviations(levels: &Hierarchy) -> Vec<(f32, f32)> {
    let groups = levels.groups.iter();
    groups
        .map(|group| (group.error_in_local, group.deviation_in_local))
        .collect()
}

#[test]
fn meshes_of_a_tree_share_their_levels() {
    let [bark, leaves] = fixtures::tree_in_parts(1500, 1);
    let one = bake_mesh(
        &fixtures::joined(&[bark.clone(), leaves.clone()]),
        &BakeConfig::default(),
    )
    .unwrap();
    let one = one.whole_mesh_levels().unwrap();
    let both = bake(&[&bark, &leaves]);
    // Each part is a chain of whole-mesh levels with the same bounds.
    for (part, source) in both.iter().zip([&bark, &leaves]) {
        assert_eq!(part.validate(), Ok(()));
        assert_eq!(part.source, source.source_hash());
        assert!(part.whole_mesh_levels().as_ref() == Some(part));
        assert!(
            part.groups
                .iter()
                .all(|group| group.bounds == both[0].groups[0].bounds)
        );
        let verified = verify(source, part, &VerifySettings::default());
        verified.unwrap();
    }
    // Parts change at the same errors. A part may skip levels with little change, and leaves vanish first.
    let [bark, leaves] = [&both[0], &both[1]].map(errors_and_deviations);
    let same = bark.iter().filter(|step| leaves.contains(step)).count();
    assert!(same > 6 && same + 2 >= leaves.len(), "{bark:?}, {leaves:?}");
    // At each error of the joined bake, both parts together have about as many triangles. Errors of the last levels
    // differ little: 300 triangles have 0.9 of the error of 100. There, the parts are compared at an error that is a
    // tenth larger.
    let mut ratios = Vec::new();
    for group in &one.groups {
        let drawn = |levels: &Hierarchy, share: f32| {
            let mut groups = levels.groups.iter();
            let index = groups.position(|own| own.error_in_local >= group.error_in_local * share);
            levels.units[index.unwrap()].triangle_count as f32
        };
        let both_at = |share: f32| both.iter().map(|mesh| drawn(mesh, share)).sum::<f32>();
        let whole = drawn(&one, 0.99);
        let together = both_at(if whole < 300.0 { 1.1 } else { 0.99 });
        println!("{together} for {whole}");
        assert!(together < whole * 1.35 + 8.0, "{together} for {whole}");
        ratios.push(both_at(0.99) / whole);
    }
    let mean = ratios
        .iter()
        .product::<f32>()
        .powf((ratios.len() as f32).recip());
    assert!(mean < 1.1, "{mean}: {ratios:?}");
}

#[test]
fn other_meshes_are_baked_separately() {
    let config = BakeConfig::default();
    let bark = fixtures::rock(2, 1).without_shared_vertices();
    let leaves = without_uvs(fixtures::cards(300, 2));
    let rock = fixtures::rock(2, 1);
    let alone = |mesh: &SourceMesh| bake_mesh(mesh, &config).unwrap();
    // The following cases differ from this one, whose meshes are baked together.
    assert!(bake(&[&bark, &leaves])[0] != alone(&bark));
    let small = BakeConfig {
        together_below_triangles: bark.triangle_count() + leaves.triangle_count(),
        ..config.clone()
    };
    let mut without_normals = bark.clone();
    without_normals.normals.clear();
    let apart: [(&[&SourceMesh], _); 5] = [
        (&[&bark, &leaves, &rock, &rock, &rock], &config),
        (&[&rock, &fixtures::rock(3, 2)], &config),
        (&[&bark, &leaves], &small),
        (&[&without_normals, &leaves], &config),
        (&[&leaves], &config),
    ];
    for (meshes, config) in apart {
        for (baked, mesh) in bake_together(meshes, config).into_iter().zip(meshes) {
            // assert_eq! would print whole hierarchies.
            assert!(baked.unwrap().0 == alone(mesh));
        }
    }
}

fn without_uvs(mut mesh: SourceMesh) -> SourceMesh {
    mesh.uvs.clear();
    mesh
}

#[test]
fn broken_mesh_leaves_others_intact() {
    let [mut broken, leaves] = fixtures::tree_in_parts(600, 2);
    broken.positions.fill(Vec3::NAN);
    let baked = bake_together(&[&broken, &leaves], &BakeConfig::default());
    assert!(matches!(
        baked[0],
        Err(MeshError::BadPosition { vertex: 0, .. })
    ));
    let alone = bake_mesh(&leaves, &BakeConfig::default()).unwrap();
    assert!(baked[1].as_ref().unwrap().0 == alone);
    assert!(bake_together(&[], &BakeConfig::default()).is_empty());
}

/// One mesh has texture coordinates, the other has colours, and some of their vertices share positions.
#[test]
fn meshes_keep_their_own_attributes_and_vertices() {
    let [bark, mut leaves] = fixtures::tree_in_parts(1500, 3);
    leaves.colors.clear();
    leaves.uvs = vec![Vec2::splat(0.25); leaves.positions.len()];
    leaves.has_other_attributes = true;
    for leaf in leaves.positions.chunks_mut(4) {
        let distance = |p: &Vec3| p.distance_squared(leaf[0]);
        let nearest = bark
            .positions
            .iter()
            .min_by(|a, b| distance(a).total_cmp(&distance(b)));
        leaf[0] = *nearest.unwrap();
    }
    let both = bake(&[&bark, &leaves]);
    for (part, source) in both.iter().zip([&bark, &leaves]) {
        let vertices = &part.vertices;
        let count = vertices.positions.len();
        assert!(count > source.positions.len() && part.units.len() > 3);
        let lengths = |present: bool| if present { count } else { 0 };
        assert_eq!(vertices.colors.len(), lengths(!source.colors.is_empty()));
        assert_eq!(vertices.uvs.len(), lengths(!source.uvs.is_empty()));
        assert_eq!(vertices.normals.len(), count);
        assert!(
            vertices
                .uvs
                .iter()
                .all(|uv| uv.distance(Vec2::splat(0.25)) < 1e-3)
        );
        let moved = count - source.positions.len();
        assert_eq!(
            part.moved_from.len(),
            if source.has_other_attributes {
                moved
            } else {
                0
            }
        );
        let origins = part.moved_from.iter();
        assert!(
            origins
                .clone()
                .all(|&v| (v as usize) < source.positions.len())
        );
        verify(source, part, &VerifySettings::default()).unwrap();
    }
}

/// Closed fruits are flattened beside open leaves, and the bark has seams.
#[test]
fn closed_meshes_stay_closed_beside_open_ones() {
    let mut random = Random::new(1);
    let fruits = (0..60).map(|_| {
        let (mut fruit, at) = (fixtures::icosphere(1), random.vector());
        fruit.positions.iter_mut().for_each(|p| *p = at + *p * 0.05);
        fruit
    });
    let fruits = fixtures::joined(&fruits.collect::<Vec<_>>());
    let leaves = without_uvs(fixtures::cards(1000, 2));
    let bark = fixtures::rock(3, 1).without_shared_vertices();
    let meshes = [&leaves, &fruits, &bark];
    for (part, source) in bake(&meshes).iter().zip(meshes) {
        assert!(part.whole_mesh_levels().as_ref() == Some(part));
        assert!(part.units.len() > 3);
        verify(source, part, &VerifySettings::default()).unwrap();
    }
}

#[test]
fn duplicate_and_degenerate_meshes_bake() {
    let leaves = fixtures::cards(400, 1);
    let mut nothing = fixtures::coincident_points(100);
    nothing.uvs = vec![Vec2::ZERO; 300];
    nothing.normals = vec![Vec3::Y; 300];
    assert_eq!(nothing.positions.len(), 300);
    for meshes in [[&leaves, &leaves], [&leaves, &nothing]] {
        for (part, source) in bake(&meshes).iter().zip(meshes) {
            assert_eq!(part.validate(), Ok(()));
            assert_eq!(
                part.source_triangle_count() as usize,
                source.triangle_count()
            );
        }
    }
}

/// Small primitives of a plant in a file are baked together. Large ones are baked separately.
#[test]
fn small_plant_primitives_of_files_bake_together() {
    for (leaves, is_together) in [(300, true), (5_000, false)] {
        let [bark, leaves] = fixtures::tree_in_parts(leaves, 1);
        let mut file = GltfFile::of(&bark);
        file.add_mesh(&leaves);
        file.join_meshes();
        let baked = bake_file(&file.glb(), &BakeConfig::default(), &|_| ()).unwrap();
        assert_eq!(baked.file.primitives.len(), 2);
        for primitive in &baked.file.primitives {
            let is_chain =
                primitive.hierarchy.whole_mesh_levels().as_ref() == Some(&primitive.hierarchy);
            assert!(is_chain == is_together);
        }
    }
}
