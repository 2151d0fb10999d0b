//! The adapter, or a skip that is heard.

use std::io::Write;
use std::sync::{Mutex, MutexGuard};

use fieldlod_lab::render::{RenderError, Renderer};

/// One picture at a time: adapters in software use all cores for each.
static ONE: Mutex<()> = Mutex::new(());

/// A renderer; `None`, said loudly, without an adapter, which `FIELDLOD_REQUIRE_ADAPTER` makes a
/// failure.
pub(crate) fn renderer() -> Option<(Renderer, MutexGuard<'static, ()>)> {
    let guard = ONE
        .lock()
        .unwrap_or_else(std::sync::PoisonError::into_inner);
    match Renderer::new() {
        Ok(renderer) => Some((renderer, guard)),
        Err(error @ RenderError::NoAdapter) => {
            assert!(
                std::env::var_os("FIELDLOD_REQUIRE_ADAPTER").is_none(),
                "{error}"
            );
            // Not `eprintln!`, which the test harness keeps to itself when a test passes.
            let line = format!("SKIPPED: {error}\n");
            std::io::stderr().write_all(line.as_bytes()).unwrap();
            None
        }
        Err(error) => panic!("{error}"),
    }
}
