//! Text and JSON for the fallbacks that a bake used.

use std::fmt::Write;

use fieldlod_bake::{BakeReport, Fallback, FallbackKind};
use fieldlod_cli::output::thousands;
use serde::Serialize;

/// Result of the bake of one primitive.
#[derive(Debug, Serialize)]
pub(crate) struct PrimitiveBake {
    mesh: u32,
    primitive: u32,
    stuck_groups: usize,
    tail_levels: usize,
    coarsest_triangles: usize,
    rounded_vertices: usize,
    two_sided_triangles: usize,
    /// Whether no fallback could simplify the mesh far enough.
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
            rounded_vertices: report.rounded_vertices,
            two_sided_triangles: report.two_sided_triangles,
            stuck: report.is_stuck(),
            fallbacks: report.fallbacks.iter().map(step).collect(),
        }
    }
}

/// One line per kind of fallback, per kind of repaired geometry, and for a stuck bake. Each begins with a line break.
pub(crate) fn fallback_lines(title: &str, report: &BakeReport) -> String {
    let mut text = String::new();
    for kind in [
        FallbackKind::Pruned,
        FallbackKind::TexturesTorn,
        FallbackKind::Sloppy,
    ] {
        let steps = report.fallbacks.iter().filter(|step| step.kind == kind);
        let count = steps.count();
        if count > 0 {
            let groups = if count == 1 { "group" } else { "groups" };
            let advice = if kind == FallbackKind::TexturesTorn {
                "; if it shows, join texture islands in the source, or set `displacement_px` to draw these levels \
                 farther away"
            } else {
                ""
            };
            let _ = write!(
                text,
                "\nfallback: {title}: {kind} in {count} {groups}{advice}"
            );
        }
    }
    let found = [
        (
            report.rounded_vertices,
            "vertices differ from others by rounding and were joined",
        ),
        (
            report.two_sided_triangles,
            "triangles lie back to back; one side was simplified",
        ),
    ];
    for (count, what) in found.into_iter().filter(|(count, _)| *count > 0) {
        let _ = write!(text, "\nfound: {title}: {} {what}", thousands(count as u64));
    }
    if report.is_stuck() {
        let left = thousands(report.coarsest_triangles as u64);
        let _ = write!(
            text,
            "\nstuck: {title}: could not simplify below {left} triangles",
        );
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn fallbacks_of_a_kind_share_a_line() {
        let step = |(kind, from, to)| Fallback {
            kind,
            group: 7,
            from,
            to,
        };
        let steps = [
            (FallbackKind::Pruned, 9_000, 4_000),
            (FallbackKind::TexturesTorn, 9_000, 4_000),
            (FallbackKind::Sloppy, 4_000, 2_000),
            (FallbackKind::Sloppy, 2_000, 513),
        ];
        let report = BakeReport {
            coarsest_triangles: 513,
            fallbacks: steps.map(step).to_vec(),
            ..BakeReport::default()
        };
        let expected = "
fallback: m: small components removed in 1 group
fallback: m: textures may be torn in 1 group; if it shows, join texture islands in the source, or set `displacement_px` to draw these levels farther away
fallback: m: vertices merged on a grid in 2 groups
stuck: m: could not simplify below 513 triangles";
        assert_eq!(fallback_lines("m", &report), expected);
    }
}
