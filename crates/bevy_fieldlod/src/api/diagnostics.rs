//! Diagnostics under `field_lod/…`: sums of [`FieldLodViewStats`] over all cameras.
//!
//! ```
//! use bevy::diagnostic::DiagnosticsStore;
//! use bevy::prelude::*;
//! use bevy_fieldlod::diagnostics;
//!
//! fn show(store: Res<DiagnosticsStore>) {
//!     let drawn = store.get(&diagnostics::TRIANGLES_DRAWN);
//!     if let Some(triangles) = drawn.and_then(|d| d.smoothed()) {
//!         println!("{triangles:.0} triangles");
//!     }
//! }
//! # bevy::ecs::system::assert_is_system(show);
//! ```

use bevy::diagnostic::{Diagnostic, DiagnosticPath, Diagnostics, RegisterDiagnostic};
use bevy::prelude::*;

use crate::api::stats::FieldLodViewStats;

/// Triangles of the selected levels.
pub const TRIANGLES_DRAWN: DiagnosticPath = DiagnosticPath::const_new("field_lod/triangles_drawn");
/// Triangles of the source meshes.
pub const TRIANGLES_FULL: DiagnosticPath = DiagnosticPath::const_new("field_lod/triangles_full");
/// Units and whole meshes that were selected.
pub const UNITS_DRAWN: DiagnosticPath = DiagnosticPath::const_new("field_lod/units_drawn");
/// Time that selection took, in milliseconds.
pub const SELECTION_MS: DiagnosticPath = DiagnosticPath::const_new("field_lod/selection_ms");

/// Registers the diagnostics and updates them at the end of each frame.
pub(crate) fn plugin(app: &mut App) {
    app.register_diagnostic(Diagnostic::new(TRIANGLES_DRAWN))
        .register_diagnostic(Diagnostic::new(TRIANGLES_FULL))
        .register_diagnostic(Diagnostic::new(UNITS_DRAWN))
        .register_diagnostic(Diagnostic::new(SELECTION_MS).with_suffix("ms"))
        .add_systems(Last, measure);
}

fn measure(mut diagnostics: Diagnostics, cameras: Query<&FieldLodViewStats>) {
    let sum = |value: fn(&FieldLodViewStats) -> f64| cameras.iter().map(value).sum();
    diagnostics.add_measurement(&TRIANGLES_DRAWN, || sum(|s| s.triangles_drawn as f64));
    diagnostics.add_measurement(&TRIANGLES_FULL, || sum(|s| s.triangles_full as f64));
    diagnostics.add_measurement(&UNITS_DRAWN, || sum(|s| f64::from(s.units_drawn)));
    diagnostics.add_measurement(&SELECTION_MS, || {
        sum(|s| s.selection_time.as_secs_f64() * 1e3)
    });
}
