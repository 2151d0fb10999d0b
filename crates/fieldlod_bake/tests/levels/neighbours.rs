//! Primitives and meshes with shared borders: no cracks open between any of their levels.

use std::collections::BTreeSet;

use crate::common::gltf_file::GltfFile;
use crate::common::{cut, open_edges, weld};
use fieldlod_bake::{
    BakeConfig, BakeOutcome, SourceMesh, bake_adjacent, bake_file, bake_mesh, bake_together,
    fixtures,
};
use fieldlod_hierarchy::Hierarchy;
use glam::Vec3;
use serde_json::json;

/// Splits a mesh into parts with own vertices. `part_of` maps the centre of a triangle to its part.
fn split(mesh: &SourceMesh, part_of: impl Fn(Vec3) -> i32) -> Vec<SourceMesh> {
    let (triangles, _) = mesh.indices.as_chunks::<3>();
    let number = |triangle: &[u32; 3]| {
        let corners = triangle.map(|v| mesh.positions[v as usize]);
        part_of((corners[0] + corners[1] + corners[2]) / 3.0)
    };
    let numbers: BTreeSet<i32> = triangles.iter().map(number).collect();
    let part = |part: i32| {
        let own = triangles.iter().filter(|triangle| number(triangle) == part);
        let corners: Vec<u32> = own.flatten().copied().collect();
        let used: BTreeSet<u32> = corners.iter().copied().collect();
        let used: Vec<u32> = used.into_iter().collect();
        let place = |v: &u32| used.binary_search(v).unwrap() as u32;
        SourceMesh {
            vertices: mesh.vertices.at(&used),
            indices: corners.iter().map(place).collect(),
            ..SourceMesh::default()
        }
    };
    numbers.into_iter().map(part).collect()
}

type Edge = [[u32; 3]; 2];

/// Open edges as the bits of their ends.
fn border(positions: &[Vec3], triangles: &[[u32; 3]]) -> BTreeSet<Edge> {
    let bits = |v: u32| positions[v as usize].to_array().map(f32::to_bits);
    let open = open_edges(triangles, &weld(positions));
    open.into_keys()
        .map(|(a, b)| {
            let mut edge = [bits(a), bits(b)];
            edge.sort_unstable();
            edge
        })
        .collect()
}

/// Returns `true` if all levels have the open edges of the source.
fn keeps_border(mesh: &SourceMesh, baked: &Hierarchy) -> bool {
    let source = border(&mesh.positions, mesh.indices.as_chunks::<3>().0);
    assert!(baked.level_count() > 2 && !source.is_empty());
    (0..baked.level_count()).all(|level| {
        let drawn = cut(baked, |group| baked.groups[group].level >= level);
        border(&baked.vertices.positions, &drawn) == source
    })
}

fn file_of(parts: &[SourceMesh]) -> GltfFile {
    let mut file = GltfFile::empty();
    parts.iter().for_each(|part| file.add_mesh(part));
    file
}

fn bake(file: &mut GltfFile, config: &BakeConfig) -> BakeOutcome {
    bake_file(&file.glb(), config, &|_| ()).unwrap()
}

fn stripes() -> Vec<SourceMesh> {
    split(&fixtures::rock(5, 3), |p| (p.y * 3.0 + p.x).floor() as i32)
}

fn tiles() -> Vec<SourceMesh> {
    split(&fixtures::height_field(64), |p| {
        (p.x * 2.0).floor() as i32 * 2 + (p.z * 2.0).floor() as i32
    })
}

/// A large part, and a part of many small spots in it. They share more border vertices than the large part can keep.
fn spots() -> Vec<SourceMesh> {
    split(&fixtures::height_field(128), |p| {
        i32::from((p.x * 30.0).sin() * (p.z * 30.0).sin() > 0.3)
    })
}

/// Open edges of all parts together, with each part at its coarsest level within this error.
fn border_at(error: f32, parts: &[Hierarchy]) -> BTreeSet<Edge> {
    let (mut positions, mut triangles) = (Vec::new(), Vec::new());
    for part in parts {
        let first = positions.len() as u32;
        positions.extend(&part.vertices.positions);
        let drawn = cut(part, |group| part.groups[group].error_in_local > error);
        triangles.extend(drawn.iter().map(|triangle| triangle.map(|v| first + v)));
    }
    border(&positions, &triangles)
}

#[test]
fn joined_primitives_have_no_cracks_at_any_error() {
    // Coarser parts may vanish; the last level of a part then stays.
    for (parts, whole, largest_error, groups) in [
        (stripes(), fixtures::rock(5, 3), 0.1, 20),
        (tiles(), fixtures::height_field(64), 0.1, 20),
        (spots(), fixtures::height_field(128), 0.05, 15),
    ] {
        let mut file = file_of(&parts);
        file.join_meshes();
        let outcome = bake(&mut file, &BakeConfig::default());
        let of_file = outcome.file.primitives.into_iter().map(|p| p.hierarchy);
        let meshes: Vec<&SourceMesh> = parts.iter().collect();
        let together = bake_together(&meshes, &BakeConfig::default()).into_iter();
        let together = together.map(|baked| baked.unwrap().0);
        let outside = |bits: &[u32; 3]| {
            let [x, _, z] = bits.map(f32::from_bits);
            [x, z].iter().any(|at| *at == 0.0 || *at == 1.0)
        };
        let is_closed = border(&whole.positions, whole.indices.as_chunks::<3>().0).is_empty();
        for baked in [of_file.collect::<Vec<_>>(), together.collect()] {
            let errors = baked.iter().flat_map(|part| &part.groups);
            let mut errors: Vec<f32> = errors.map(|group| group.error_in_local).collect();
            assert!(errors.len() > groups);
            errors.retain(|error| *error < largest_error);
            errors.sort_by(f32::total_cmp);
            for &error in errors.iter().step_by(errors.len().div_ceil(12)) {
                let open = border_at(error, &baked);
                let is_outside = |edge: &Edge| !is_closed && edge.iter().all(outside);
                assert!(open.iter().all(is_outside), "at an error of {error}");
            }
        }
    }
}

#[test]
fn adjacent_meshes_bake_like_large_primitives() {
    let field = fixtures::height_field(144);
    let halves = split(&field, |p| i32::from(p.x > 0.5));
    for parts in [halves.clone(), spots()] {
        let mut file = file_of(&parts);
        file.join_meshes();
        let of_file = bake(&mut file, &BakeConfig::default()).file.primitives;
        let meshes: Vec<&SourceMesh> = parts.iter().collect();
        let adjacent = bake_adjacent(&meshes, &BakeConfig::default());
        let adjacent = adjacent.into_iter().map(|baked| baked.unwrap().0);
        assert!(of_file.into_iter().map(|p| p.hierarchy).eq(adjacent));
    }
    let meshes: Vec<&SourceMesh> = halves.iter().collect();
    for (mesh, baked) in halves
        .iter()
        .zip(bake_adjacent(&meshes, &BakeConfig::default()))
    {
        assert!(keeps_shared_edges(mesh, &halves, &baked.unwrap().0));
    }
}

/// Returns `true` if all levels keep the open edges that the source shares with other meshes.
fn keeps_shared_edges(mesh: &SourceMesh, all: &[SourceMesh], baked: &Hierarchy) -> bool {
    let border_of = |mesh: &SourceMesh| border(&mesh.positions, mesh.indices.as_chunks::<3>().0);
    let others = all.iter().filter(|other| *other != mesh).map(border_of);
    let others: BTreeSet<Edge> = others.flatten().collect();
    let own: BTreeSet<Edge> = border_of(mesh).intersection(&others).copied().collect();
    assert!(baked.level_count() > 2 && !own.is_empty());
    (0..baked.level_count()).all(|level| {
        let drawn = cut(baked, |group| baked.groups[group].level >= level);
        own.is_subset(&border(&baked.vertices.positions, &drawn))
    })
}

#[test]
fn only_meshes_placed_alike_keep_shared_borders() {
    let parts = tiles();
    let mut file = file_of(&parts);
    let nodes = (0..parts.len()).map(|mesh| json!({ "mesh": mesh, "translation": [3, 0, 0] }));
    file.json["nodes"] = nodes.collect();
    let alike = bake(&mut file, &BakeConfig::default());
    file.json["nodes"][0]["translation"] = json!([4, 0, 0]);
    let apart = bake(&mut file, &BakeConfig::default());
    let [alike, apart] = [alike, apart].map(|outcome| {
        let baked = &outcome.file.primitives[0].hierarchy;
        keeps_shared_edges(&parts[0], &parts, baked)
    });
    assert_eq!([alike, apart], [true, false]);
}

/// Primitives that share too many vertices with each other are joined.
#[test]
fn large_primitives_keep_borders_with_other_meshes() {
    let part_of = |p: Vec3| {
        let is_spot = p.x.max(p.z) < 0.3 && (p.x * 100.0).sin() * (p.z * 100.0).sin() > 0.3;
        i32::from(is_spot) + 2 * i32::from(p.x > 0.9)
    };
    let parts = split(&fixtures::height_field(140), part_of);
    let (large, other) = (&parts[0], &parts[2]);
    assert!(large.triangle_count() >= 20_000);
    let mut file = file_of(&parts[..2]);
    file.join_meshes();
    file.add_mesh(other);
    file.json["nodes"] = json!([{ "mesh": 0 }, { "mesh": 1 }]);
    let beside = bake(&mut file, &BakeConfig::default());
    file.json["nodes"][1]["translation"] = json!([4, 0, 0]);
    let apart = bake(&mut file, &BakeConfig::default());
    let [beside, apart] = [beside, apart].map(|outcome| {
        let baked = &outcome.file.primitives[0].hierarchy;
        assert!(baked.whole_mesh_levels().as_ref() == Some(baked));
        keeps_shared_edges(large, &[large.clone(), other.clone()], baked)
    });
    assert_eq!([beside, apart], [true, false]);
}

/// In the first file, primitives meet only the other mesh. In the second one, they also meet each other.
#[test]
fn small_primitives_keep_borders_with_other_meshes() {
    let parts = split(&fixtures::height_field(96), |p| (p.x * 4.0).floor() as i32);
    for order in [[0, 2, 1, 3], [0, 1, 2, 3]] {
        let parts = order.map(|part: usize| parts[part].clone());
        let mut file = file_of(&parts);
        let last = file.list("meshes").split_off(2);
        file.join_meshes();
        let [mut second, fourth] = <[_; 2]>::try_from(last).unwrap();
        let primitives = second["primitives"].as_array_mut().unwrap();
        primitives.push(fourth["primitives"][0].clone());
        file.list("meshes").push(second);
        file.json["nodes"] = json!([{ "mesh": 0 }, { "mesh": 1 }]);
        let baked = bake(&mut file, &BakeConfig::default()).file.primitives;
        assert!(keeps_shared_edges(
            &parts[1],
            &parts[1..3],
            &baked[1].hierarchy
        ));
        assert!(keeps_shared_edges(
            &parts[2],
            &parts[1..3],
            &baked[2].hierarchy
        ));
    }
}

#[test]
fn locked_borders_stay_and_others_are_simplified() {
    let tile = fixtures::height_field(48);
    let free = bake_mesh(&tile, &BakeConfig::default()).unwrap();
    let config = BakeConfig {
        lock_borders: true,
        ..BakeConfig::default()
    };
    let locked = bake_mesh(&tile, &config).unwrap();
    assert!(keeps_border(&tile, &locked) && !keeps_border(&tile, &free));
    let coarsest = locked.groups.last().unwrap();
    assert!(locked.triangle_count_of(coarsest) < 48 * 12);
}
