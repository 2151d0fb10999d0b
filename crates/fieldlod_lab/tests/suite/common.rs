//! The graphics adapter of rendering tests. Without an adapter, these tests are skipped.

use std::io::Write;
use std::sync::{Mutex, MutexGuard};

use fieldlod_lab::render::{RenderError, Renderer};

/// Held while a test draws: software adapters use all cores, so tests that draw run one by one.
static DRAWING: Mutex<()> = Mutex::new(());

/// A renderer, or `None` without an adapter. With the environment variable `FIELDLOD_REQUIRE_ADAPTER`, a missing
/// adapter fails the test.
pub(crate) fn renderer() -> Option<(Renderer, MutexGuard<'static, ()>)> {
    let guard = DRAWING
        .lock()
        .unwrap_or_else(std::sync::PoisonError::into_inner);
    match Renderer::new() {
        Ok(renderer) => Some((renderer, guard)),
        Err(error @ RenderError::NoAdapter) => {
            assert!(
                std::env::var_os("FIELDLOD_REQUIRE_ADAPTER").is_none(),
                "{error}"
            );
            // The test harness hides `eprintln!` of tests that pass.
            let line = format!("SKIPPED: {error}\n");
            std::io::stderr().write_all(line.as_bytes()).unwrap();
            None
        }
        Err(error) => panic!("{error}"),
    }
}
