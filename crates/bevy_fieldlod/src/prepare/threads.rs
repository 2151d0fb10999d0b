//! The threads that prepare meshes.
//!
//! A bake takes seconds and all cores that it is given. Bevy compiles pipelines on the pool that it has for
//! long tasks, and games use that of rayon: neither is for bakes. Threads of ours have a low priority, where the
//! system lets them.

#[cfg(feature = "bake")]
use std::sync::Arc;
use std::thread::available_parallelism;

#[cfg(feature = "bake")]
use bevy::log::error;
use bevy::tasks::{TaskPool, TaskPoolBuilder};
#[cfg(feature = "bake")]
use thread_priority::{ThreadPriority, ThreadPriorityValue, set_current_thread_priority};

use crate::api::config::FieldLodConfig;

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
                .on_thread_spawn(lower_priority)
                .build(),
            #[cfg(feature = "bake")]
            bakes: BakeThreads::new(count),
        }
    }
}

/// Lets the other threads of the program go first, and get nine tenths where all have work: with the lowest
/// priority of all, nothing would ever be baked beside a game that uses all cores.
fn lower_priority() {
    // Where the system does not let us, bakes compete: no reason to have none.
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
