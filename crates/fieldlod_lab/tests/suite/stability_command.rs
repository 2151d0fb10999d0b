//! Tests of the output and the errors of `fieldlod-lab stability`.

use std::process::{Command, Output};

use fieldlod_lab::stability::METHODS;
use serde_json::Value;

fn stability(arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_fieldlod-lab"))
        .arg("stability")
        .args(arguments)
        .output()
        .unwrap()
}

#[test]
fn prints_a_verdict_for_every_case_and_method() {
    let output = stability(&["--json"]);
    assert!(output.status.success(), "{output:?}");
    let report: Value = serde_json::from_slice(&output.stdout).unwrap();
    let cases = report["objects"][0]["cases"].as_array().unwrap();
    assert!(cases.len() >= 25);
    for case in cases {
        let verdicts = case["verdicts"].as_array().unwrap();
        assert_eq!(verdicts.len(), METHODS.len(), "{}", case["case"]);
    }
}

#[test]
fn rejects_missing_model_in_one_line() {
    let output = stability(&["no_such_model.glb"]);
    assert_eq!(output.status.code(), Some(1));
    let error = String::from_utf8(output.stderr).unwrap();
    assert!(error.contains("no_such_model.glb"), "{error}");
    assert_eq!(error.trim_end().lines().count(), 1, "{error}");
}
