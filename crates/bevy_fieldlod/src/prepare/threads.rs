//! The threads that prepare meshes.
//!
//! A bake takes seconds on all cores of its pool. Bevy compiles pipelines on its pool for long tasks, and games use
//! rayon's global pool, so bakes have their own threads.

use std::num::NonZero;
#[cfg(feature = "bake")]
use std::sync::{Arc, OnceLock};
use std::thread::available_parallelism;

#[cfg(feature = "bake")]
use bevy::log::error;
use bevy::tasks::{TaskPool, TaskPoolBuilder};
#[cfg(feature = "bake")]
use thread_priority::{ThreadPriority, ThreadPriorityValue, set_current_thread_priority};

use crate::api::config::{FieldLodAppConfig, LodPriority};

/// The threads of each priority, started with their first task.
#[derive(Default)]
pub(super) struct PrepareThreads([Option<Threads>; 2]);

/// Threads of one priority. A task waits for its bake, so about as many threads work as were configured.
pub(super) struct Threads {
    pub(super) tasks: TaskPool,
    #[cfg(feature = "bake")]
    pub(super) bakes: BakeThreads,
}

impl PrepareThreads {
    /// The threads of a priority.
    pub(super) fn of(&mut self, priority: LodPriority, config: &FieldLodAppConfig) -> &Threads {
        self.0[priority as usize].get_or_insert_with(|| Threads::new(priority, config))
    }

    /// Ends the threads of loading screens.
    pub(super) fn end_loading_screen(&mut self) {
        let Some(threads) = self.0[LodPriority::LoadingScreen as usize].take() else {
            return;
        };
        // The drop waits for the threads, and a cancelled bake may run for seconds. A browser has no threads.
        if cfg!(target_arch = "wasm32") {
            drop(threads);
        } else {
            std::thread::spawn(move || drop(threads));
        }
    }
}

impl Threads {
    fn new(priority: LodPriority, config: &FieldLodAppConfig) -> Self {
        let cores = available_parallelism().map_or(1, NonZero::get);
        let count = match priority {
            LodPriority::Background => config.advanced.bake_threads.unwrap_or(cores / 2).max(1),
            LodPriority::LoadingScreen => cores,
        };
        Self {
            tasks: TaskPoolBuilder::new()
                .num_threads(count)
                .thread_name("FieldLod task".into())
                .on_thread_spawn(move || set_priority(priority))
                .build(),
            #[cfg(feature = "bake")]
            bakes: BakeThreads {
                pool: Arc::default(),
                priority,
                count,
            },
        }
    }
}

/// Priority of background threads, from 0 to 99: "below normal" on Windows, niceness 10 on Linux. On a core that a game
/// uses all the time, the Linux scheduler gives a tenth to a bake (weights 110 and 1024). With the lowest priority,
/// bakes starve beside a game without a frame limit; with the normal one, its frames take up to twice as long.
#[cfg(feature = "bake")]
const BACKGROUND_PRIORITY: u8 = 22;

/// Sets the priority of a thread.
fn set_priority(priority: LodPriority) {
    // If the system refuses, bakes compete with the game.
    #[cfg(feature = "bake")]
    if priority == LodPriority::Background
        && let Ok(below_normal) = ThreadPriorityValue::try_from(BACKGROUND_PRIORITY)
    {
        let _ = set_current_thread_priority(ThreadPriority::Crossplatform(below_normal));
    }
    #[cfg(not(feature = "bake"))]
    let _ = priority;
}

/// The pool of bakes, started with the first bake. Without it, a bake runs on the thread of its task.
#[cfg(feature = "bake")]
#[derive(Clone)]
pub(super) struct BakeThreads {
    pool: Arc<OnceLock<Option<rayon::ThreadPool>>>,
    priority: LodPriority,
    count: usize,
}

#[cfg(feature = "bake")]
impl BakeThreads {
    fn new_pool(&self) -> Option<rayon::ThreadPool> {
        let priority = self.priority;
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(self.count)
            .thread_name(|index| format!("FieldLod bake {index}"))
            .start_handler(move |_| set_priority(priority))
            .build();
        let pool = pool.inspect_err(|error| {
            error!("could not create the bake thread pool: {error}; baking on the task threads");
        });
        pool.ok()
    }

    /// Runs `bake` on these threads and waits for it.
    pub(super) fn run<T: Send>(&self, bake: impl FnOnce() -> T + Send) -> T {
        match self.pool.get_or_init(|| self.new_pool()) {
            Some(pool) => pool.install(bake),
            None => bake(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn loading_screens_use_all_cores() {
        let mut config = FieldLodAppConfig::default();
        config.advanced.bake_threads = Some(3);
        let mut threads = PrepareThreads::default();
        let background = threads.of(LodPriority::Background, &config);
        assert_eq!(background.tasks.thread_num(), 3);
        let cores = available_parallelism().map_or(1, NonZero::get);
        let loading_screen = threads.of(LodPriority::LoadingScreen, &config);
        assert_eq!(loading_screen.tasks.thread_num(), cores);
    }
}
