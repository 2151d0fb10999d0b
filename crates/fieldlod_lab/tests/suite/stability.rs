//! The guarantee passes all cases of the stability suite, quality has neither holes nor flips, and other systems fail the
//! cases that their users reported.

use std::sync::LazyLock;

use fieldlod_lab::method::Method;
use fieldlod_lab::stability::{self, CaseResult, Fault, METHODS, THRESHOLD_PX, Verdict};

static CASES: LazyLock<Vec<CaseResult>> = LazyLock::new(|| stability::run(&|_, _| ()));

fn cases() -> impl Iterator<Item = &'static CaseResult> {
    CASES.iter()
}

fn verdict(case: &'static CaseResult, method: Method) -> &'static Verdict {
    let mut verdicts = case.verdicts.iter();
    verdicts.find(|verdict| verdict.method == method).unwrap()
}

#[test]
fn guaranteed_passes_every_case_within_the_threshold() {
    for case in cases() {
        let verdict = verdict(case, Method::Guaranteed);
        let (name, threshold_px) = (case.case, f64::from(THRESHOLD_PX));
        assert_eq!(verdict.faults, [], "{name}: {verdict:?}");
        assert!(verdict.max_px <= threshold_px, "{name}: {verdict:?}");
    }
}

/// Quality does not limit displacements, and may draw more triangles than the guarantee if measured deviations are small.
#[test]
fn quality_is_closed_and_does_not_flip() {
    for case in cases() {
        let verdict = verdict(case, Method::Quality);
        let mut faults = verdict.faults.iter();
        let is_allowed = |fault: &Fault| matches!(fault, Fault::Displaced | Fault::Wastes);
        assert!(faults.all(is_allowed), "{}: {verdict:?}", case.case);
    }
}

/// In each case that users reported, a method of another system has a fault. The case `non-nested` is an exception,
/// because all methods of the suite have nested bounds.
#[test]
fn other_systems_fail_reported_cases() {
    for case in cases().filter(|case| !case.reported.is_empty()) {
        let is_other = |method| !matches!(method, Method::Quality | Method::Guaranteed);
        let mut others = case.verdicts.iter().filter(|it| is_other(it.method));
        let is_shown = others.any(|verdict| !verdict.faults.is_empty());
        assert_eq!(is_shown, case.case != "non-nested", "{case:?}");
    }
}

/// All methods draw closed cuts, so that only the criteria differ.
#[test]
fn cuts_of_all_methods_are_closed() {
    for verdict in cases().flat_map(|case| &case.verdicts) {
        assert!(!verdict.faults.contains(&Fault::Holes), "{verdict:?}");
    }
}

#[test]
fn table_has_a_row_for_each_case() {
    let table = stability::table(&CASES);
    let mut lines = table.lines();
    let head = lines.next().unwrap();
    let mut names = METHODS.iter().map(|method| method.name());
    assert!(names.all(|name| head.contains(name)), "{head}");
    assert_eq!(lines.count(), stability::cases().count());
}
