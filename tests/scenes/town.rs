//! A town with the counts of Bevy's example `bevy_city`: 46,717 entities, 12,442 of which move.

use std::sync::OnceLock;

use bevy::prelude::*;
use fieldlod_bake::SourceMesh;
use fieldlod_bake::fixtures::{plane, tree_in_parts};
use fieldlod_hierarchy::Random;

use super::shapes::{BAY, car, fence, house, lamp};
use super::{Block, Paint, Place, Prop, Scene};

/// Entities of `bevy_city`, and those of them that move: a node and a mesh for each car.
const ENTITIES: usize = 46_717;
const MOVING: usize = 12_442;
/// Entities for a block of houses with its streets and cars.
const ENTITIES_OF_BLOCK: usize = 52;
/// Sides of a block with its streets, in metres.
const BLOCK: Vec2 = Vec2::new(60.0, 50.0);
/// Size of trees, whose meshes have radius 1.3.
const TREE: f32 = 3.0;

/// Indices of the props of a kind.
type Kind = std::ops::Range<usize>;

struct Kinds {
    houses: Kind,
    trees: Kind,
    cars: Kind,
    lamps: Kind,
    fences: Kind,
    ground: usize,
}

/// The town with this number of entities.
pub(super) fn town(entities: usize) -> Scene {
    let (props, kinds) = props();
    let mut random = Random::new(1);
    let count = (entities / ENTITIES_OF_BLOCK).max(1);
    let side = (count as f32).sqrt().ceil() as usize;
    let mut blocks: Vec<Block> = (0..count)
        .map(|block| {
            let cell = Vec2::new((block % side) as f32, (block / side) as f32);
            let at = (cell - (side / 2) as f32) * BLOCK;
            let places = places(&kinds, &mut random);
            let at = Vec3::new(at.x, 0.0, at.y);
            Block { at, places }
        })
        .collect();
    for index in 0..(entities * MOVING / ENTITIES).div_ceil(2) {
        let place = car_place(&kinds, &mut random);
        blocks[index % count].places.push(place);
    }
    let places = blocks.iter().flat_map(|block| &block.places);
    let used: usize = places.map(|place| props[place.prop].entities()).sum();
    // The root and the blocks are entities too. The remaining entities are fences.
    for index in 0..entities.saturating_sub(used + 1 + count) {
        let place = fence_place(&kinds, &mut random, index / count);
        blocks[index % count].places.push(place);
    }
    Scene {
        name: "town",
        props,
        blocks,
        paints: paints(),
        is_flat: false,
        ends_in_box: true,
        path: |metres| {
            let eye = Vec3::new(3.0, 1.7, -60.0 + metres);
            Transform::from_translation(eye).looking_to(Vec3::new(0.25, -0.02, 1.0), Vec3::Y)
        },
        range_scale: 1.1,
        levels: OnceLock::new(),
        cache: OnceLock::new(),
    }
}

/// 36 props of 200 to 20,000 triangles, and the ground.
fn props() -> (Vec<Prop>, Kinds) {
    let mut props = Vec::new();
    let mut add = |more: Vec<Prop>| {
        let first = props.len();
        props.extend(more);
        first..props.len()
    };
    let house = |index: u32| {
        let (bays, floors) = (2 + index % 5, 2 + index * index % 23);
        let size = Vec2::new(bays as f32, floors as f32) * BAY * 0.5;
        Prop::new(
            house(bays, floors.min(178 / bays)),
            index as usize % 4,
            size.length(),
        )
    };
    let tree = |index: u32| {
        let parts = tree_in_parts(1_000 + 300 * index, index);
        Prop::tree(parts, [4, 5], 1.3 * TREE)
    };
    let car = |index: u32| Prop {
        has_node: true,
        ..Prop::new(
            car(1 + index % 2, 3.8 + 0.2 * index as f32),
            6 + index as usize % 3,
            2.2,
        )
    };
    let lamp = |index: u32| Prop::new(lamp(4.0 + index as f32), 9, 2.5);
    let fence = |index: u32| Prop::new(fence(15 + 5 * index), 4, 1.5);
    let kinds = Kinds {
        houses: add((0..16).map(house).collect()),
        trees: add((0..6).map(tree).collect()),
        cars: add((0..7).map(car).collect()),
        lamps: add((0..3).map(lamp).collect()),
        fences: add((0..4).map(fence).collect()),
        ground: add(vec![Prop::new(ground(), 10, 40.0)]).start,
    };
    (props, kinds)
}

fn ground() -> SourceMesh {
    let mut mesh = plane(1);
    let size = BLOCK.extend(0.0).xzy();
    mesh.positions.iter_mut().for_each(|at| *at *= size);
    mesh
}

fn paints() -> Vec<Paint> {
    let colors = [
        [0.62, 0.45, 0.36],
        [0.75, 0.70, 0.60],
        [0.55, 0.58, 0.62],
        [0.70, 0.60, 0.45],
        [0.35, 0.26, 0.18],
        [0.22, 0.38, 0.14],
        [0.60, 0.12, 0.10],
        [0.15, 0.25, 0.50],
        [0.70, 0.70, 0.72],
        [0.20, 0.22, 0.22],
        [0.40, 0.42, 0.38],
    ];
    let paints = colors.map(|[r, g, b]| Paint::Plain(Color::srgb(r, g, b)));
    paints.into()
}

fn one_of(kind: &Kind, random: &mut Random) -> usize {
    kind.start + random.index(kind.len())
}

/// The objects of a block without cars and fences. Its streets are 6 m wide and begin at its origin.
fn places(kinds: &Kinds, random: &mut Random) -> Vec<Place> {
    let mut places = vec![Place::new(kinds.ground, Transform::IDENTITY)];
    for (x, z) in [(20.0, 17.0), (46.0, 17.0), (20.0, 38.0), (46.0, 38.0)] {
        let house = one_of(&kinds.houses, random);
        places.push(Place::new(house, Transform::from_xyz(x, 0.0, z)));
    }
    for index in 0..5u8 {
        let at = Vec3::new(
            8.0 + 10.0 * f32::from(index),
            1.2 * TREE,
            7.0 + random.unit(),
        );
        let turn = Quat::from_rotation_y(random.unit() * 6.0);
        let at = Transform::from_translation(at).with_rotation(turn);
        let tree = one_of(&kinds.trees, random);
        places.push(Place::new(tree, at.with_scale(Vec3::splat(TREE))));
    }
    for index in 0..3u8 {
        let at = Transform::from_xyz(6.5, 0.0, 8.0 + 14.0 * f32::from(index));
        places.push(Place::new(one_of(&kinds.lamps, random), at));
    }
    places
}

/// A car that drives along the street of a block.
fn car_place(kinds: &Kinds, random: &mut Random) -> Place {
    let (lane, ahead) = if random.unit() < 0.5 {
        (1.2, 1.0)
    } else {
        (4.8, -1.0)
    };
    let from = Vec3::new(lane, 0.0, BLOCK.y * random.unit());
    let car = one_of(&kinds.cars, random);
    Place {
        way: Some(Vec3::Z * ahead * BLOCK.y),
        ..Place::new(
            car,
            Transform::from_translation(from).looking_to(Vec3::Z * -ahead, Vec3::Y),
        )
    }
}

fn fence_place(kinds: &Kinds, random: &mut Random, index: usize) -> Place {
    let (column, row) = ((index % 13) as f32, (index / 13 % 2) as f32);
    let at = Transform::from_xyz(8.0 + 4.0 * column, 0.0, 6.2 + 41.0 * row);
    Place::new(one_of(&kinds.fences, random), at)
}
