//! The output of the program: a window, or pictures and a summary.

pub(crate) mod hud;
pub(crate) mod offscreen;
pub(crate) mod report;
pub(crate) mod windowed;
