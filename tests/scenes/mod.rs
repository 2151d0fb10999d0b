//! Generated scenes for benches, and apps that draw them by the plugin and by stock Bevy.

mod app;
mod forest;
mod levels;
mod rocks;
mod shapes;
mod town;

use std::path::Path;
use std::sync::OnceLock;

use bevy::prelude::*;
use fieldlod_bake::{BakeConfig, SourceMesh, bake_mesh};
use fieldlod_hierarchy::{BakedFile, BakedPrimitive};
use tempfile::TempDir;

pub use app::{Method, SceneApp};
pub use forest::{Wind, WindMaterial, wind_material, wind_plugin};
pub use rocks::rocks;

use levels::PropLevels;

/// Props and their places. They are the same in each run.
#[derive(Debug)]
pub struct Scene {
    /// The name in tables.
    pub name: &'static str,
    props: Vec<Prop>,
    blocks: Vec<Block>,
    paints: Vec<Paint>,
    /// Whether each place is one entity without a parent. Otherwise there is a root and a node for each block.
    is_flat: bool,
    /// Whether the last hand-made level is a box, as in Bevy's `bevy_city`.
    ends_in_box: bool,
    /// The camera after a number of metres.
    path: fn(f32) -> Transform,
    /// Multiplies the distances of hand-made levels. In the town, their image error is then about that of the plugin at
    /// 1 px, measured by the bench `whole_frame`. Other scenes have 1.
    pub range_scale: f32,
    levels: OnceLock<Vec<PropLevels>>,
    /// Keeps bakes for all apps of the process.
    cache: OnceLock<TempDir>,
}

/// An object that stands in many places.
#[derive(Debug)]
struct Prop {
    parts: Vec<Part>,
    /// The radius in the world, for the distances of hand-made levels.
    radius: f32,
    /// Whether the meshes are children of an entity. Several meshes always are.
    has_node: bool,
}

#[derive(Debug)]
struct Part {
    source: SourceMesh,
    paint: usize,
}

#[derive(Debug)]
enum Paint {
    Plain(Color),
    /// Cut out by alpha and moved by wind.
    Leaves,
    /// Moved by wind.
    Bark,
}

#[derive(Debug, Default)]
struct Block {
    at: Vec3,
    places: Vec<Place>,
}

#[derive(Debug)]
struct Place {
    prop: usize,
    at: Transform,
    /// The displacement of a car along its drive, which starts again at the end.
    way: Option<Vec3>,
}

impl Part {
    /// A part with positions, normals and texture coordinates only.
    fn new(mut source: SourceMesh, paint: usize) -> Self {
        source.colors.clear();
        source.tangents.clear();
        let vertices = source.positions.len();
        source.uvs.resize(vertices, Vec2::ZERO);
        Self { source, paint }
    }
}

impl Prop {
    fn new(source: SourceMesh, paint: usize, radius: f32) -> Self {
        Self {
            parts: vec![Part::new(source, paint)],
            radius,
            has_node: false,
        }
    }

    /// Bark and leaves.
    fn tree(parts: [SourceMesh; 2], paints: [usize; 2], radius: f32) -> Self {
        let parts = parts.into_iter().zip(paints);
        Self {
            parts: parts
                .map(|(source, paint)| Part::new(source, paint))
                .collect(),
            radius,
            has_node: true,
        }
    }

    fn entities(&self) -> usize {
        self.parts.len() + usize::from(self.has_node)
    }
}

impl Place {
    fn new(prop: usize, at: Transform) -> Self {
        let way = None;
        Self { prop, at, way }
    }
}

impl Scene {
    /// The scene of this name. `size` is its number of entities, rocks or trees.
    #[must_use]
    pub fn named(name: &str, size: Option<u32>) -> Option<Self> {
        Some(match name {
            "boulders" => rocks::boulders(size.unwrap_or(45)),
            "rocks" => rocks::rocks(size.unwrap_or(100_000), 4),
            "town" => town::town(size.unwrap_or(46_717) as usize),
            "forest" => forest::forest(size.unwrap_or(100_000)),
            _ => return None,
        })
    }

    /// The camera after a number of metres of its path.
    #[must_use]
    pub fn pose(&self, metres: f32) -> Transform {
        (self.path)(metres)
    }

    /// Triangles of all places at full detail, and of the props.
    #[must_use]
    pub fn triangles(&self) -> [usize; 2] {
        let of_prop = |prop: &Prop| {
            let parts = prop.parts.iter();
            parts
                .map(|part| part.source.triangle_count())
                .sum::<usize>()
        };
        let places = self.blocks.iter().flat_map(|block| &block.places);
        let all = places.map(|place| of_prop(&self.props[place.prop])).sum();
        [all, self.props.iter().map(of_prop).sum()]
    }

    /// The levels of all meshes, as a file to ship.
    ///
    /// # Panics
    /// If a mesh cannot be baked.
    #[must_use]
    pub fn bake(&self) -> BakedFile {
        let parts = self.props.iter().flat_map(|prop| &prop.parts);
        let primitives = (0..).zip(parts).map(|(index, part)| {
            let baked = bake_mesh(&part.source, &BakeConfig::default());
            BakedPrimitive::new(index, 0, "", baked.expect("a generated mesh can be baked"))
        });
        BakedFile {
            primitives: primitives.collect(),
        }
    }

    fn cache(&self) -> &Path {
        let make = || tempfile::tempdir().expect("a folder for temporary files");
        self.cache.get_or_init(make).path()
    }

    /// Hand-made levels of all props, made by the first call.
    fn levels(&self) -> &[PropLevels] {
        let make = |prop: &Prop| PropLevels::of(prop, self.ends_in_box);
        self.levels
            .get_or_init(|| self.props.iter().map(make).collect())
    }
}
