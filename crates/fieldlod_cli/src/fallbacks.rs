//! What a bake had to do to get to the coarse end, in words and numbers.

use std::fmt::Write;

use fieldlod_bake::{BakeReport, Fallback, FallbackKind};
use fieldlod_cli::output::thousands;
use serde::Serialize;

/// Course of the bake of one primitive.
#[derive(Debug, Serialize)]
pub(crate) struct PrimitiveBake {
    mesh: u32,
    primitive: u32,
    stuck_groups: usize,
    tail_levels: usize,
    coarsest_triangles: usize,
    /// Whether the coarsest level has more triangles than it should, whatever was tried.
    stuck: bool,
    fallbacks: Vec<Step>,
}

#[derive(Debug, Serialize)]
struct Step {
    what: String,
    group: u32,
    from: usize,
    to: usize,
}

impl PrimitiveBake {
    pub(crate) fn of(mesh: u32, primitive: u32, report: &BakeReport) -> Self {
        let step = |fallback: &Fallback| Step {
            what: fallback.kind.to_string(),
            group: fallback.group,
            from: fallback.from,
            to: fallback.to,
        };
        Self {
            mesh,
            primitive,
            stuck_groups: report.stuck_groups,
            tail_levels: report.whole_mesh_levels,
            coarsest_triangles: report.coarsest_triangles,
            stuck: report.is_stuck(),
            fallbacks: report.fallbacks.iter().map(step).collect(),
        }
    }
}

/// One line for each kind of step that was taken, and one if all was in vain; each begins with a
/// line break.
pub(crate) fn fallback_lines(title: &str, report: &BakeReport) -> String {
    let mut text = String::new();
    for kind in [
        FallbackKind::Pruned,
        FallbackKind::AttributesIgnored,
        FallbackKind::Sloppy,
    ] {
        // From where its first step began to where its last one ended.
        let mut steps = report.fallbacks.iter().filter(|step| step.kind == kind);
        let Some(first) = steps.next() else {
            continue;
        };
        let last = steps.next_back().unwrap_or(first);
        let (from, to) = (thousands(first.from as u64), thousands(last.to as u64));
        let _ = write!(
            text,
            "\nfallback: {title}: {kind} from {from} to {to} triangles"
        );
    }
    if report.is_stuck() {
        let left = thousands(report.coarsest_triangles as u64);
        let _ = write!(
            text,
            "\nstuck: {title}: {left} triangles at its coarsest: no means got on from there",
        );
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_was_done_is_told_step_by_step_and_in_vain_at_the_end() {
        let step = |kind, from, to| Fallback {
            kind,
            group: 7,
            from,
            to,
        };
        let mut report = BakeReport {
            coarsest_triangles: 512,
            fallbacks: vec![
                step(FallbackKind::Pruned, 9_000, 4_000),
                step(FallbackKind::Sloppy, 4_000, 2_000),
                step(FallbackKind::Sloppy, 2_000, 512),
            ],
            ..BakeReport::default()
        };
        let lines = "\nfallback: m: small components left out from 9,000 to 4,000 triangles\
            \nfallback: m: vertices merged on a grid from 4,000 to 512 triangles";
        assert_eq!(fallback_lines("m", &report), lines);
        report.coarsest_triangles = 513;
        let said = fallback_lines("m", &report);
        assert!(said.starts_with(lines), "{said}");
        assert!(
            said.ends_with("\nstuck: m: 513 triangles at its coarsest: no means got on from there")
        );
    }
}
