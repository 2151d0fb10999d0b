//! The pages of the guide and the tests that they name.

use std::collections::HashSet;
use std::fs;
use std::path::{Path, PathBuf};

/// The folder of the workspace.
fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..")
}

fn collect_functions(folder: &Path, names: &mut HashSet<String>) {
    for entry in fs::read_dir(folder).unwrap().flatten() {
        let path = entry.path();
        if path.is_dir() {
            if path.file_name() != Some("target".as_ref()) {
                collect_functions(&path, names);
            }
        } else if path.extension() == Some("rs".as_ref()) {
            let source = fs::read_to_string(&path).unwrap();
            // Tests stand at the beginning of a line, or of one in a module.
            let names_of = source.lines().filter_map(|line| {
                let name = line
                    .trim_start()
                    .strip_prefix("fn ")?
                    .split(['(', '<'])
                    .next()?;
                Some(name.to_string())
            });
            names.extend(names_of);
        }
    }
}

/// What stands in backticks in a line.
fn quoted(line: &str) -> impl Iterator<Item = &str> {
    line.split('`').skip(1).step_by(2)
}

#[test]
fn every_line_of_the_compatibility_page_names_tests_that_exist() {
    let mut functions = HashSet::new();
    for folder in ["crates", "tests"] {
        collect_functions(&root().join(folder), &mut functions);
    }
    let page = root().join("crates/bevy_fieldlod/docs/compatibility.md");
    let page = fs::read_to_string(page).unwrap();
    let is_test = |name: &&str| functions.contains(*name);
    // Names of tests are sentences.
    let is_named_like_test = |name: &&str| name.matches('_').count() > 2 && !name.contains("::");
    // From the list of what works on, behind the versions and adapters.
    let rows = page
        .lines()
        .skip_while(|line| !line.starts_with("| of Bevy"));
    let rows = rows.filter(|line| line.starts_with("| ") && !line.ends_with("tests |"));
    let mut count = 0;
    for row in rows.filter(|line| !line.ends_with("state |")) {
        assert!(quoted(row).any(|name| is_test(&name)), "no test: {row}");
        for name in quoted(row).filter(is_named_like_test) {
            assert!(is_test(&name), "there is no {name}");
        }
        count += 1;
    }
    assert!(count > 40, "{count} rows");
}
