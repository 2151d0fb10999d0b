//! The report as text: one row per case, one column per method.

use std::fmt::Write;

use super::METHODS;
use super::case::Fault;
use super::run::{CaseResult, Verdict};
use crate::method::Method;

/// A table of verdicts. A cell is ✓ or the figure of the first fault.
///
/// `px` is the largest displacement, `fl` flips per frame, and `he` open edges (holes). `x` is the number of chosen
/// triangles relative to the guaranteed cut, `xc` relative to the coarsest cut.
#[must_use]
pub fn table(cases: &[CaseResult]) -> String {
    let mut text = format!("{:<18}", "case");
    for method in METHODS {
        let _ = write!(text, "{:>width$}", method.name(), width = width(method));
    }
    text.push('\n');
    for case in cases {
        let _ = write!(text, "{:<18}", case.case);
        for verdict in &case.verdicts {
            let width = width(verdict.method);
            let _ = write!(text, "{:>width$}", cell(verdict));
        }
        text.push('\n');
    }
    text
}

/// Width of a method's column, in characters.
fn width(method: Method) -> usize {
    method.name().len().max(7) + 2
}

fn cell(verdict: &Verdict) -> String {
    match verdict.faults.first() {
        None => "✓".to_owned(),
        Some(Fault::Holes) => format!("{}he", verdict.open_edges.unwrap_or(0)),
        Some(Fault::Displaced) => figure(verdict.max_px, "px"),
        Some(Fault::Flips) => figure(verdict.flips_per_frame, "fl"),
        Some(Fault::Wastes) => figure(verdict.triangles_to_ours, "x"),
        Some(Fault::Idles) => figure(verdict.triangles_to_coarsest, "xc"),
    }
}

/// Formats a value for a narrow column.
fn figure(value: f64, unit: &str) -> String {
    if value < 0.095 {
        format!("{value:.3}{unit}")
    } else if value < 9.95 {
        format!("{value:.1}{unit}")
    } else if value < 1e5 {
        format!("{value:.0}{unit}")
    } else {
        format!("{value:.0e}{unit}")
    }
}
