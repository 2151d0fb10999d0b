//! `fieldlod-lab paper`: pictures, numbers and failures.

use std::fs;
use std::path::Path;
use std::process::{Command, Output};

use serde_json::Value;

fn paper(out: &Path) -> Output {
    Command::new(env!("CARGO_BIN_EXE_fieldlod-lab"))
        .args(["paper", "--json", "--out"])
        .arg(out)
        .output()
        .unwrap()
}

#[test]
fn draws_the_figures_and_prints_their_numbers() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("figures");
    let output = paper(&out);
    assert!(output.status.success(), "{output:?}");
    let printed: Value = serde_json::from_slice(&output.stdout).unwrap();
    let written: Value =
        serde_json::from_slice(&fs::read(out.join("numbers.json")).unwrap()).unwrap();
    assert_eq!(printed, written);
    for number in ["09", "10", "11", "14", "15", "18"] {
        let picture = fs::read(out.join(format!("figure_{number}.png"))).unwrap();
        assert!(picture.starts_with(b"\x89PNG"));
        let key = format!("figure_{}", number.trim_start_matches('0'));
        assert!(printed[&key].is_object(), "{key}");
    }
}

#[test]
fn rejects_a_folder_that_cannot_be_made_in_one_line() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("file");
    fs::write(&file, b"").unwrap();
    let output = paper(&file.join("inside"));
    assert_eq!(output.status.code(), Some(1));
    let message = String::from_utf8(output.stderr).unwrap();
    assert_eq!(message.lines().count(), 1, "{message}");
    assert!(message.contains("inside: cannot be written"), "{message}");
}
