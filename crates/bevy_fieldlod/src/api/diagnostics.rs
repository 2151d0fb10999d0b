//! Numbers in Bevy's diagnostics, under `field_lod/…`: sums over all active cameras.
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
use crate::pages::FieldLodMemory;

/// Triangles drawn of meshes with levels of detail.
pub const TRIANGLES_DRAWN: DiagnosticPath = DiagnosticPath::const_new("field_lod/triangles_drawn");
/// Triangles that would have been drawn at full detail.
pub const TRIANGLES_FULL: DiagnosticPath = DiagnosticPath::const_new("field_lod/triangles_full");
/// Units and whole meshes drawn.
pub const UNITS_DRAWN: DiagnosticPath = DiagnosticPath::const_new("field_lod/units_drawn");
/// Triangles drawn on the CPU to tell what is hidden.
pub const OCCLUDER_TRIANGLES: DiagnosticPath =
    DiagnosticPath::const_new("field_lod/occluder_triangles");
/// Bytes on the GPU of meshes that are read in parts ([`FieldLodMemory`]).
pub const RESIDENT_BYTES: DiagnosticPath = DiagnosticPath::const_new("field_lod/resident_bytes");
/// Bytes on the GPU of all that views want of those.
pub const WANTED_BYTES: DiagnosticPath = DiagnosticPath::const_new("field_lod/wanted_bytes");
/// Bytes of main memory of what of those is being loaded.
pub const LOADING_BYTES: DiagnosticPath = DiagnosticPath::const_new("field_lod/loading_bytes");
/// Pages of those that are wanted and not there.
pub const MISSING_PAGES: DiagnosticPath = DiagnosticPath::const_new("field_lod/missing_pages");
/// Time that selection took, in milliseconds.
pub const SELECTION_MS: DiagnosticPath = DiagnosticPath::const_new("field_lod/selection_ms");

/// Measures at the end of each frame.
pub(crate) fn plugin(app: &mut App) {
    app.register_diagnostic(Diagnostic::new(TRIANGLES_DRAWN))
        .register_diagnostic(Diagnostic::new(TRIANGLES_FULL))
        .register_diagnostic(Diagnostic::new(UNITS_DRAWN))
        .register_diagnostic(Diagnostic::new(OCCLUDER_TRIANGLES))
        .register_diagnostic(Diagnostic::new(SELECTION_MS).with_suffix("ms"))
        .register_diagnostic(Diagnostic::new(RESIDENT_BYTES))
        .register_diagnostic(Diagnostic::new(WANTED_BYTES))
        .register_diagnostic(Diagnostic::new(LOADING_BYTES))
        .register_diagnostic(Diagnostic::new(MISSING_PAGES))
        .add_systems(
            Last,
            (
                measure_views,
                measure_memory.run_if(resource_changed::<FieldLodMemory>),
            ),
        );
}

fn measure_memory(mut diagnostics: Diagnostics, memory: Res<FieldLodMemory>) {
    diagnostics.add_measurement(&RESIDENT_BYTES, || memory.resident_bytes as f64);
    diagnostics.add_measurement(&WANTED_BYTES, || memory.wanted_bytes as f64);
    diagnostics.add_measurement(&LOADING_BYTES, || memory.loading_bytes as f64);
    diagnostics.add_measurement(&MISSING_PAGES, || f64::from(memory.missing_pages));
}

fn measure_views(mut diagnostics: Diagnostics, cameras: Query<(&Camera, &FieldLodViewStats)>) {
    let active = || cameras.iter().filter(|(camera, _)| camera.is_active);
    let sum = |value: fn(&FieldLodViewStats) -> f64| active().map(|(_, stats)| value(stats)).sum();
    diagnostics.add_measurement(&TRIANGLES_DRAWN, || sum(|s| s.triangles_drawn as f64));
    diagnostics.add_measurement(&TRIANGLES_FULL, || sum(|s| s.triangles_full as f64));
    diagnostics.add_measurement(&UNITS_DRAWN, || sum(|s| f64::from(s.units_drawn)));
    diagnostics.add_measurement(&OCCLUDER_TRIANGLES, || {
        sum(|s| f64::from(s.occluder_triangles))
    });
    diagnostics.add_measurement(&SELECTION_MS, || {
        sum(|s| s.selection_time.as_secs_f64() * 1e3)
    });
}
