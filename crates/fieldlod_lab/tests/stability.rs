//! Ours passes every case of the stability suite, and who was reported to fail one does fail it.

use std::collections::HashSet;
use std::sync::LazyLock;

use fieldlod_lab::method::Method;
use fieldlod_lab::stability::{self, CaseResult, Fault, METHODS, Report, Verdict};

static REPORT: LazyLock<Report> = LazyLock::new(|| stability::run(&[], &|_, _| ()));

fn cases() -> impl Iterator<Item = &'static CaseResult> {
    REPORT.objects.iter().flat_map(|object| &object.cases)
}

fn verdict(case: &'static CaseResult, method: Method) -> &'static Verdict {
    let mut verdicts = case.verdicts.iter();
    verdicts.find(|verdict| verdict.method == method).unwrap()
}

fn verdict_in(case: &str, method: Method) -> &'static Verdict {
    let case = cases().find(|result| result.case == case);
    verdict(case.unwrap(), method)
}

#[test]
fn guaranteed_passes_every_case_within_the_threshold_itself() {
    for case in cases() {
        let verdict = verdict(case, Method::Guaranteed);
        let name = case.case;
        assert_eq!(verdict.faults, [], "{name}: {verdict:?}");
        assert!(
            verdict.max_px <= f64::from(REPORT.threshold_px),
            "{name}: {verdict:?}"
        );
    }
}

/// Quality is RMS-like: it promises no greatest displacement, and draws more than the guarantee where
/// deviations are measured tightly. All else it is held to.
#[test]
fn quality_is_closed_and_calm_in_every_case() {
    for case in cases() {
        let verdict = verdict(case, Method::Quality);
        let faults = verdict.faults.iter();
        let others = faults.filter(|fault| !matches!(fault, Fault::Displaced | Fault::Wastes));
        let others: Vec<&Fault> = others.collect();
        assert!(others.is_empty(), "{}: {verdict:?}", case.case);
        assert!(
            verdict.mean_px <= f64::from(REPORT.threshold_px) * 0.5,
            "{}",
            case.case
        );
    }
}

/// Not in every case: calibrated to the picture of other metrics at 1 px, quality draws more than the
/// guarantee where deviations are measured tightly and a surface turns all its sides to the camera.
#[test]
fn quality_draws_fewer_triangles_than_the_guarantee_over_all_cases() {
    let triangles = |method| {
        let chosen = cases().map(|case| verdict(case, method).triangles_chosen);
        chosen.sum::<f64>()
    };
    let (quality, guaranteed) = (triangles(Method::Quality), triangles(Method::Guaranteed));
    assert!(quality < 0.95 * guaranteed, "{quality} {guaranteed}");
}

/// One row for each failure under "reported by users": case, system, how it fails.
#[test]
fn reported_failures_happen_to_whom_they_were_reported_for() {
    let reported = [
        ("rotate only", Method::Godot40, Fault::Displaced),
        ("inside the box", Method::Godot40, Fault::Displaced),
        ("inside the box", Method::Godot43, Fault::Wastes),
        ("cull margin", Method::Godot40, Fault::Displaced),
        ("orthographic", Method::Godot40, Fault::Displaced),
        ("scaled bones", Method::Godot40, Fault::Displaced),
        ("zoom ignored", Method::VisibilityRange, Fault::Displaced),
        ("flicker", Method::ThreeLod, Fault::Flips),
        ("window size", Method::Cesium, Fault::Displaced),
        ("narrow fov", Method::Cesium, Fault::Wastes),
        ("shadow view", Method::VisibilityRange, Fault::Displaced),
        ("non-nested", Method::ClusterlodUnclosed, Fault::Holes),
    ];
    for (case, method, fault) in reported {
        let verdict = verdict_in(case, method);
        assert!(verdict.faults.contains(&fault), "{case}: {verdict:?}");
    }
    let shown: HashSet<&str> = reported.iter().map(|(case, ..)| *case).collect();
    let told = cases().filter(|case| !case.reported.is_empty());
    for case in told {
        assert!(
            shown.contains(case.case),
            "{} shows nobody failing",
            case.case
        );
    }
}

/// What peers leave out, where nobody had to report it.
#[test]
fn what_a_rule_leaves_out_shows() {
    let left_out = [
        ("scaled mesh", Method::Meshlets, Fault::Displaced),
        ("scaled mesh", Method::Nanite, Fault::Displaced),
        ("scales", Method::VisibilityRange, Fault::Displaced),
        ("rotate only", Method::ProjectedSize, Fault::Displaced),
    ];
    for (case, method, fault) in left_out {
        let verdict = verdict_in(case, method);
        assert!(verdict.faults.contains(&fault), "{case}: {verdict:?}");
    }
    // Towards the corner clusterlod exceeds its pixel, if not by enough to count as a fault.
    let clusterlod = verdict_in("rotate only", Method::Clusterlod);
    assert!(clusterlod.max_px > 1.2, "{clusterlod:?}");
}

/// The comparison is one of criteria: baselines that close or nest their cuts have no holes, and those
/// that were mended pass the case they were mended for.
#[test]
fn baselines_are_written_well() {
    for case in cases() {
        for verdict in &case.verdicts {
            let whole = !verdict.faults.contains(&Fault::Holes);
            let unclosed = verdict.method == Method::ClusterlodUnclosed;
            assert!(whole || unclosed, "{}: {verdict:?}", case.case);
        }
    }
    let mended = [
        ("rotate only", Method::Nanite),
        ("orthographic", Method::Godot43),
        ("scaled bones", Method::Godot43),
        ("zoom ignored", Method::ThreeLod),
    ];
    for (case, method) in mended {
        let verdict = verdict_in(case, method);
        assert_eq!(verdict.faults, [], "{case}: {verdict:?}");
    }
}

#[test]
fn the_table_has_a_row_for_each_case_and_a_column_for_each_method() {
    let table = stability::table(&REPORT.objects[0]);
    let mut lines = table.lines();
    let head = lines.next().unwrap();
    assert!(
        METHODS.iter().all(|method| head.contains(method.name())),
        "{head}"
    );
    assert_eq!(lines.count(), stability::cases().count());
}
