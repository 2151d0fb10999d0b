//! The figures in the README's prose are those of the committed measurements.

use std::fs;
use std::path::{Path, PathBuf};

use serde_json::Value;

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..")
}

/// Without line ends.
fn prose(path: &str) -> String {
    let text = fs::read_to_string(root().join(path)).unwrap();
    text.split_whitespace().collect::<Vec<_>>().join(" ")
}

fn report() -> Value {
    let text = fs::read(root().join("assets/pictures/chart.json")).unwrap();
    serde_json::from_slice(&text).unwrap()
}

fn rows<'a>(list: &'a Value, wanted: &'a [(&str, Value)]) -> impl Iterator<Item = &'a Value> {
    let all = list.as_array().unwrap().iter();
    all.filter(move |row| wanted.iter().all(|(key, value)| &row[key] == value))
}

fn number(list: &Value, wanted: &[(&str, Value)], key: &str) -> f64 {
    let row = rows(list, wanted).next();
    let row = row.unwrap_or_else(|| panic!("nothing measured for {wanted:?}"));
    row[key].as_f64().unwrap()
}

/// Triangles relative to clusterlod's at the error of its 1 px.
fn ratio(ratios: &Value, method: &str, measure: &str, key: &str) -> f64 {
    let wanted = [
        ("method", method.into()),
        ("measure", measure.into()),
        ("at_px", 1.0.into()),
    ];
    number(ratios, &wanted, key)
}

fn worst_px(report: &Value, method: &str) -> f64 {
    let wanted = [("method", method.into()), ("requested_px", 1.0.into())];
    let worst = rows(&report["promise"], &wanted).map(|row| row["max_px"].as_f64().unwrap());
    worst.fold(0.0, f64::max)
}

#[test]
fn the_readme_says_what_was_measured() {
    let (readme, report) = (prose("README.md"), report());
    let rmse = |method, key| 100.0 * ratio(&report["ratios"], method, "rmse", key);
    let of_models: Vec<f64> = report["models"]
        .as_array()
        .unwrap()
        .iter()
        .map(|model| 100.0 * ratio(&model["ratios"], "quality", "rmse", "mean"))
        .collect();
    let threshold = [("method", "quality".into()), ("at_px", 1.0.into())];
    let sentences = [
        format!(
            "fieldlod draws {:.0} % of clusterlod's triangles ({:.0} % to {:.0} % by model, {:.0} % in the worst pose)",
            rmse("quality", "mean"),
            of_models.iter().copied().fold(f64::INFINITY, f64::min),
            of_models.iter().copied().fold(0.0, f64::max),
            rmse("quality", "greatest"),
        ),
        format!("as near as {:.0} %", rmse("oracle", "mean")),
        format!(
            "without the projection factor it would be {:.0} %, without the silhouette's term {:.0} %",
            rmse("no_projection", "mean"),
            rmse("no_silhouette", "mean"),
        ),
        format!(
            "({:.0} % with the field at its centre); at a threshold of 1 px it keeps displacements towards \
             the picture's corner to {:.1} px, in place of {:.1} px",
            rmse("no_bound", "mean"),
            worst_px(&report, "quality"),
            worst_px(&report, "no_bound"),
        ),
        format!(
            "at {:.2} px of its own",
            number(&report["costs"], &threshold, "threshold_px")
        ),
        format!(
            "no more than {:.2} px where 1 px is asked for; clusterlod's reach {:.1} px",
            worst_px(&report, "guaranteed"),
            worst_px(&report, "clusterlod"),
        ),
    ];
    for sentence in sentences {
        assert!(readme.contains(&sentence), "the README lacks: {sentence}");
    }
}

/// The table that `fieldlod-lab chart` writes, of the committed measurements.
#[test]
fn the_record_holds_the_table_of_terms() {
    let text = fs::read(root().join("assets/pictures/chart.json")).unwrap();
    let report: fieldlod_lab::chart::Report = serde_json::from_slice(&text).unwrap();
    let record = fs::read_to_string(root().join("crates/fieldlod_lab/RECORD.md")).unwrap();
    let table = report.ablation_table();
    assert!(table.lines().count() > 5);
    assert!(
        record.contains(&table),
        "the record lacks the table:\n{table}"
    );
}
