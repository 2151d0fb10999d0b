//! All that is measured of a model.

use fieldlod_hierarchy::Hierarchy;
use glam::UVec2;
use serde::{Deserialize, Serialize};
use xxhash_rust::xxh3::Xxh3;

use super::{
    ChartError, CriterionCost, Kept, OnPath, PoseResult, Stage, Store, THRESHOLDS_PX, Way,
    criterion_costs, poses, promise, sweep, temporal,
};
use crate::render::Renderer;
use crate::rivals::{ErrorSource, LodObject};

/// How a model is measured.
#[derive(Clone, Debug)]
pub struct Options {
    /// How many poses.
    pub poses: usize,
    /// What the poses depend on.
    pub seed: u64,
    /// Size of the pictures.
    pub size_px: UVec2,
    /// The ways to compare, clusterlod among them.
    pub ways: Vec<Way>,
    /// Whether promises and a path are measured, too.
    pub with_extras: bool,
}

/// All that was measured of a model.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct ModelResult {
    /// Its name.
    pub name: String,
    /// Triangles of the source.
    pub triangles: u64,
    /// Each pose.
    pub poses: Vec<PoseResult>,
    /// What is kept of promises.
    pub promise: Vec<Kept>,
    /// What flickers.
    pub temporal: Vec<OnPath>,
    /// What the criteria take for a group.
    pub criterion: Vec<CriterionCost>,
}

impl Options {
    /// How many steps a model takes.
    #[must_use]
    pub fn steps(&self) -> usize {
        self.poses + if self.with_extras { 3 } else { 0 }
    }
}

/// Measures a model, or reads from `store` what was measured before. `step` hears of each step done.
///
/// # Errors
/// [`ChartError`] from an adapter that stops or a folder that takes no files.
pub fn chart_model(
    renderer: &Renderer,
    name: &str,
    hierarchy: Hierarchy,
    options: &Options,
    store: &Store,
    step: &dyn Fn(),
) -> Result<ModelResult, ChartError> {
    let hash = hash_of(&hierarchy);
    let object = LodObject::new(hierarchy, ErrorSource::Reported);
    let stage = Stage::new(renderer, &object, options.size_px);
    let common = (hash, options.size_px.to_array(), renderer.adapter());
    let mut results = Vec::new();
    for pose in poses(&object, options.poses, options.seed) {
        let key = ("pose", common, pose, &options.ways, THRESHOLDS_PX);
        results.push(store.get_or_make(&key, || sweep(&stage, &pose, &options.ways))?);
        step();
    }
    let (mut kept, mut on_path, mut criterion) = (Vec::new(), Vec::new(), Vec::new());
    if options.with_extras {
        let key = ("promise", common, options.seed);
        kept = store.get_or_make(&key, || Ok(promise(&stage, options.seed)))?;
        step();
        let key = ("criterion", common, options.seed);
        criterion = store.get_or_make(&key, || Ok(criterion_costs(&stage, options.seed)))?;
        step();
        on_path = store.get_or_make(&("temporal", common), || temporal(&stage))?;
        step();
    }
    Ok(ModelResult {
        name: name.to_owned(),
        triangles: object.hierarchy.source_triangle_count(),
        poses: results,
        promise: kept,
        temporal: on_path,
        criterion,
    })
}

/// All that a choice depends on.
fn hash_of(hierarchy: &Hierarchy) -> u64 {
    let mut hash = Xxh3::new();
    hash.update(bytemuck::cast_slice(&hierarchy.groups));
    hash.update(bytemuck::cast_slice(&hierarchy.units));
    hash.update(bytemuck::cast_slice(&hierarchy.vertices.positions));
    hash.digest()
}
