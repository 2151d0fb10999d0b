//! The threads that prepare meshes.
//!
//! A bake takes seconds on all cores of its pool. Bevy compiles pipelines on its pool for long tasks, and games use
//! rayon's global pool, so bakes have their own threads. They have a low priority if the system permits it.

#[cfg(feature = "bake")]
use std::sync::Arc;
use std::thread::available_parallelism;

#[cfg(feature = "bake")]
use bevy::log::error;
use bevy::tasks::{TaskPool, TaskPoolBuilder};
#[cfg(feature = "bake")]
use thread_priority::{ThreadPriority, ThreadPriorityValue, set_current_thread_priority};

use crate::api::config::FieldLodAppConfig;

/// The threads that prepare meshes. A task waits for its bake, so about as many threads work as were configured.
pub(super) struct PrepareThreads {
    pub(super) tasks: TaskPool,
    #[cfg(feature = "bake")]
    pub(super) bakes: BakeThreads,
}

/// The pool of bakes. Without it, a bake runs on the thread of its task.
#[cfg(feature = "bake")]
#[derive(Clone)]
pub(super) struct BakeThreads(Option<Arc<rayon::ThreadPool>>);

impl PrepareThreads {
    pub(super) fn new(config: &FieldLodAppConfig) -> Self {
        let half = || available_parallelism().map_or(1, |cores| cores.get() / 2);
        let count = config.advanced.bake_threads.unwrap_or_else(half).max(1);
        Self {
            tasks: TaskPoolBuilder::new()
                .num_threads(count)
                .thread_name("FieldLod task".into())
                .on_thread_spawn(lower_priority)
                .build(),
            #[cfg(feature = "bake")]
            bakes: BakeThreads::new(count),
        }
    }
}

/// Lowers the priority of a thread, so that a busy game gets nine tenths of a shared core. With the lowest priority,
/// bakes would starve beside a game that uses all cores.
fn lower_priority() {
    // If the system refuses, bakes compete with the game.
    #[cfg(feature = "bake")]
    if let Ok(below_normal) = ThreadPriorityValue::try_from(22) {
        let _ = set_current_thread_priority(ThreadPriority::Crossplatform(below_normal));
    }
}

#[cfg(feature = "bake")]
impl BakeThreads {
    fn new(count: usize) -> Self {
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(count)
            .thread_name(|index| format!("FieldLod bake {index}"))
            .start_handler(|_| lower_priority())
            .build();
        let pool = pool.inspect_err(|error| {
            error!("could not create the bake thread pool: {error}; baking on the task threads");
        });
        Self(pool.ok().map(Arc::new))
    }

    /// Runs `bake` on these threads and waits for it.
    pub(super) fn run<T: Send>(&self, bake: impl FnOnce() -> T + Send) -> T {
        match &self.0 {
            Some(pool) => pool.install(bake),
            None => bake(),
        }
    }
}
