//! The threads that prepare meshes.
//!
//! A bake takes seconds and all cores that it is given. Bevy compiles pipelines on the pool that it has for
//! long tasks, and games use that of rayon: neither is for bakes.

#[cfg(feature = "bake")]
use std::sync::Arc;
use std::thread::available_parallelism;

#[cfg(feature = "bake")]
use bevy::log::error;
use bevy::tasks::{TaskPool, TaskPoolBuilder};

use crate::config::FieldLodConfig;

/// The threads that prepare meshes. A task that bakes waits for those that bake, so that no more of them
/// work than were asked for, but for the rest of the work on a mesh.
pub(super) struct PrepareThreads {
    pub(super) tasks: TaskPool,
    #[cfg(feature = "bake")]
    pub(super) bakes: BakeThreads,
}

/// The pool that bakes run in; without it they run on their task's own thread.
#[cfg(feature = "bake")]
#[derive(Clone)]
pub(super) struct BakeThreads(Option<Arc<rayon::ThreadPool>>);

impl PrepareThreads {
    pub(super) fn new(config: &FieldLodConfig) -> Self {
        let half = || available_parallelism().map_or(1, |cores| cores.get() / 2);
        let count = config.bake_threads.unwrap_or_else(half).max(1);
        Self {
            tasks: TaskPoolBuilder::new()
                .num_threads(count)
                .thread_name("FieldLod task".into())
                .build(),
            #[cfg(feature = "bake")]
            bakes: BakeThreads::new(count),
        }
    }
}

#[cfg(feature = "bake")]
impl BakeThreads {
    fn new(count: usize) -> Self {
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(count)
            .thread_name(|index| format!("FieldLod bake {index}"))
            .build();
        let pool = pool.inspect_err(|error| error!("no threads to bake on: {error}"));
        Self(pool.ok().map(Arc::new))
    }

    /// Runs `bake` on these threads, and waits for it.
    pub(super) fn run<T: Send>(&self, bake: impl FnOnce() -> T + Send) -> T {
        match &self.0 {
            Some(pool) => pool.install(bake),
            None => bake(),
        }
    }
}
