//! Random changes of a world, which is compared with freshly built worlds of the same state.

mod state;
mod surfaces;
mod world;

use std::cell::Cell;
use std::fs;
use std::sync::LazyLock;

use bevy::prelude::*;
use fieldlod_bake::{BakeConfig, bake_mesh};
use fieldlod_hierarchy::{BakedFile, BakedPrimitive, PageOptions, PagedFile};
use proptest::collection::vec;
use proptest::test_runner::{Config, RngAlgorithm, TestError, TestRng, TestRunner};
use tempfile::TempDir;

use crate::rock;
use state::State;
pub use surfaces::{ClosedSurfaces, open_edges};
pub use world::{LOSSES, Loss, restore_camera};
use world::{PAGES, Soak};

/// Largest number of steps in one world.
const STEPS_OF_WORLD: usize = 200;
/// Steps between two comparisons with a fresh world.
const COMPARED_EVERY: usize = 100;

/// A folder with the file of streamed objects, for the asset sources of apps.
pub fn folder() -> &'static std::path::Path {
    static FOLDER: LazyLock<TempDir> = LazyLock::new(|| {
        let rock = bake_mesh(&rock(4, 9), &BakeConfig::fast()).expect("a rock can be baked");
        let file = BakedFile {
            primitives: vec![BakedPrimitive::new(0, 0, "rock", rock)],
        };
        let options = PageOptions {
            page_bytes: 8 << 10,
            ..PageOptions::default()
        };
        let folder = tempfile::tempdir().expect("a folder for temporary files");
        let path = folder.path().join(PAGES);
        fs::write(path, PagedFile::to_bytes(&file, options)).expect("the folder is writable");
        folder
    });
    FOLDER.path()
}

/// Makes about as many random steps as given, in worlds of several apps. Checks each frame, and compares some with a
/// fresh world. With `streams`, there are streamed objects, read from [`folder`]. Cameras meet the first few of
/// [`LOSSES`].
///
/// # Panics
/// If a frame is wrong or differs from a fresh world. The message has the fewest steps that show it.
pub fn soak(steps: usize, streams: bool, losses: usize, app: &dyn Fn() -> App) {
    let config = Config {
        // Worlds have half of the largest number of steps on average.
        cases: (2 * steps).div_ceil(STEPS_OF_WORLD) as u32,
        failure_persistence: None,
        max_shrink_iters: 1_000,
        ..Config::default()
    };
    let rng = TestRng::deterministic_rng(RngAlgorithm::ChaCha);
    let mut runner = TestRunner::new_with_rng(config, rng);
    let strategy = vec(state::step(streams, losses), 1..=STEPS_OF_WORLD);
    let (units_drawn, bare) = (Cell::new(0), Cell::new(None));
    let result = runner.run(&strategy, |steps| {
        let mut soak = Soak::new(app(), &State::default());
        for (index, &step) in (1..).zip(&steps) {
            soak.step(step);
            if index % COMPARED_EVERY == 0 || index == steps.len() {
                compare(&mut soak, app);
            }
        }
        units_drawn.set(units_drawn.get() + soak.units_drawn);
        let left = soak.clear();
        // The first world after its removal stands for a world in which nothing was.
        assert!(
            bare.get().is_none_or(|bare| bare == left),
            "left behind: {left:?}"
        );
        bare.set(Some(left));
        Ok(())
    });
    match result {
        Ok(()) => assert!(units_drawn.get() > 0, "no unit was drawn"),
        Err(TestError::Fail(reason, steps)) => panic!("{reason}\nafter {steps:#?}"),
        Err(TestError::Abort(reason)) => panic!("{reason}"),
    }
}

/// Compares a world, once it has settled, with a fresh one.
fn compare(soak: &mut Soak, app: &dyn Fn() -> App) {
    soak.settle();
    let mut fresh = Soak::new(app(), soak.state());
    fresh.settle();
    assert_eq!(soak.record(), fresh.record(), "left: changed; right: fresh");
}
