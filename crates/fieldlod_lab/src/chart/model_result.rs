//! All that is measured of a model.

use fieldlod_hierarchy::Hierarchy;
use glam::UVec2;
use serde::{Deserialize, Serialize};
use xxhash_rust::xxh3::Xxh3;

use super::ChartError;
use super::criterion_cost::{CriterionCost, criterion_costs};
use super::curve::{PoseResult, THRESHOLDS_PX};
use super::flicker::{FlickerResult, flicker};
use super::pose::poses;
use super::promise::{PromiseResult, promise};
use super::scene::ChartScene;
use super::store::Store;
use super::sweep::sweep;
use crate::method::Method;
use crate::object::{ErrorSource, LodObject};
use crate::render::Renderer;

/// The methods whose pictures are compared.
pub const CHART_METHODS: [Method; 20] = [
    Method::Quality,
    Method::VisibleFlux,
    Method::Guaranteed,
    Method::Both,
    Method::NoProjection,
    Method::NoOffAxis,
    Method::NoBound,
    Method::NoSilhouette,
    Method::TwoSided,
    Method::ShareInView,
    Method::ClusterlodOnOurLevels,
    Method::Clusterlod,
    Method::Nanite,
    Method::Depth,
    Method::Cesium,
    Method::Godot43,
    Method::Unity,
    Method::VisibilityRange,
    Method::ProjectedSize,
    Method::Oracle,
];

/// Settings by which models are measured.
#[derive(Clone, Debug)]
pub struct Options {
    /// The number of poses.
    pub poses: usize,
    /// The seed of the poses.
    pub seed: u64,
    /// Size of the pictures.
    pub size_px: UVec2,
    /// The methods to compare, clusterlod among them.
    pub methods: Vec<Method>,
    /// Whether promises and a path are measured, too.
    pub with_extras: bool,
}

/// All that was measured of a model.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub struct ModelResult {
    /// The model's name.
    pub name: String,
    /// Triangles of the source.
    pub triangles: u64,
    /// The curves from each pose.
    pub poses: Vec<PoseResult>,
    /// Displacements at thresholds.
    pub promise: Vec<PromiseResult>,
    /// Flicker on a walk.
    pub flicker: Vec<FlickerResult>,
    /// Times that the criteria take for a group.
    pub criterion: Vec<CriterionCost>,
}

impl Options {
    /// The number of steps that a model takes.
    #[must_use]
    pub fn steps(&self) -> usize {
        self.poses + if self.with_extras { 3 } else { 0 }
    }
}

/// A mesh as both systems bake it.
#[derive(Clone, Debug)]
pub struct BakedModel {
    /// The model's name.
    pub name: String,
    /// Our hierarchy.
    pub ours: Hierarchy,
    /// [Clusterlod's own](fieldlod_bake::clusterlod_hierarchy) of the same mesh.
    pub clusterlods: Hierarchy,
}

/// Measures a model, or reads from `store` what was measured before. `step` hears of each step done.
///
/// # Errors
/// [`ChartError`] from an adapter that stops or a folder that takes no files.
pub fn chart_model(
    renderer: &Renderer,
    model: BakedModel,
    options: &Options,
    store: &Store,
    step: &dyn Fn(),
) -> Result<ModelResult, ChartError> {
    let hashes = [hash_of(&model.ours), hash_of(&model.clusterlods)];
    let ours = LodObject::new(model.ours, ErrorSource::Reported);
    let clusterlods = LodObject::new(model.clusterlods, ErrorSource::Reported);
    let scene = ChartScene::new(renderer, &ours, &clusterlods, options.size_px);
    let common = (hashes, options.size_px.to_array(), renderer.adapter());
    let mut result = ModelResult {
        name: model.name,
        triangles: ours.hierarchy.source_triangle_count(),
        ..ModelResult::default()
    };
    // Pictures from all poses.
    for pose in poses(&ours, options.poses, options.seed) {
        let key = ("pose", common, pose, &options.methods, THRESHOLDS_PX);
        let make = || Ok(sweep(&scene, &pose, &options.methods)?);
        result.poses.push(store.get_or_make(&key, make)?);
        step();
    }
    // Promises, times and a walk.
    if options.with_extras {
        let key = ("promise", common, options.seed);
        result.promise = store.get_or_make(&key, || Ok(promise(&scene, options.seed)))?;
        step();
        let key = ("criterion", common, options.seed);
        result.criterion = store.get_or_make(&key, || Ok(criterion_costs(&scene, options.seed)))?;
        step();
        result.flicker = store.get_or_make(&("flicker", common), || flicker(&scene))?;
        step();
    }
    Ok(result)
}

/// All that a choice and its picture depend on.
fn hash_of(hierarchy: &Hierarchy) -> u64 {
    let mut hash = Xxh3::new();
    hash.update(bytemuck::cast_slice(&hierarchy.groups));
    hash.update(bytemuck::cast_slice(&hierarchy.units));
    hash.update(bytemuck::cast_slice(&hierarchy.unit_vertices));
    hash.update(bytemuck::cast_slice(&hierarchy.indices));
    hash.update(bytemuck::cast_slice(&hierarchy.vertices.positions));
    hash.update(bytemuck::cast_slice(&hierarchy.vertices.normals));
    hash.digest()
}
