//! Tests of the chart of a small model.

use std::cell::Cell;
use std::fs;
use std::sync::LazyLock;

use fieldlod_bake::{BakeConfig, bake_mesh, clusterlod_hierarchy, fixtures};
use fieldlod_lab::chart::{
    BakedModel, COMPARED_AT_PX, Measure, Options, Report, chart_model, draw_chart,
};
use fieldlod_lab::method::Method;
use fieldlod_lab::render::Renderer;
use glam::UVec2;

use crate::common::renderer;

/// The chart of a small model. `None` without a graphics adapter.
static REPORT: LazyLock<Option<Report>> = LazyLock::new(|| {
    let (renderer, _lock) = renderer()?;
    Some(report(&renderer))
});

fn report(renderer: &Renderer) -> Report {
    let (mesh, config) = (fixtures::rock(5, 3), BakeConfig::fine_grained());
    let rock = BakedModel {
        name: "rock".to_owned(),
        ours: bake_mesh(&mesh, &config).unwrap(),
        clusterlods: clusterlod_hierarchy(&mesh, &config).unwrap(),
        surface: None,
    };
    let options = Options {
        poses: 2,
        seed: 5,
        size_px: UVec2::new(160, 90),
        methods: vec![Method::Quality, Method::Clusterlod],
    };
    let steps = Cell::new(0);
    let step = || steps.set(steps.get() + 1);
    let model = chart_model(renderer, rock, &options, &step).unwrap();
    assert_eq!(steps.get(), options.poses);
    Report::new(&[model], &options, renderer.adapter())
}

/// The ratio of clusterlod is 1, and that of this project is smaller.
#[test]
fn ratios_are_relative_to_clusterlod() {
    let Some(report) = &*REPORT else {
        return;
    };
    let ratio = |method| report.all.ratio(method, Measure::Rmse, 1.0).unwrap();
    assert!((ratio(Method::Clusterlod).mean - 1.0).abs() < 1e-9);
    assert_eq!(ratio(Method::Clusterlod).poses, 2);
    let ours = ratio(Method::Quality);
    assert!(ours.mean < 1.0, "{ours:?}");
}

#[test]
fn chart_is_written_with_its_numbers() {
    let Some(report) = &*REPORT else {
        return;
    };
    let folder = tempfile::tempdir().unwrap();
    draw_chart(report, folder.path()).unwrap();
    let picture = fs::read_to_string(folder.path().join("triangles.svg")).unwrap();
    assert!(picture.contains("fieldlod quality") && picture.contains("clusterlod"));
    let text = fs::read(folder.path().join("report.json")).unwrap();
    let read: serde_json::Value = serde_json::from_slice(&text).unwrap();
    let count = 2 * Measure::ALL.len() * COMPARED_AT_PX.len();
    assert_eq!(read["all"]["ratios"].as_array().unwrap().len(), count);
}

#[test]
fn write_error_names_the_folder() {
    let Some(report) = &*REPORT else {
        return;
    };
    let file = tempfile::NamedTempFile::new().unwrap();
    let refused = draw_chart(report, file.path()).unwrap_err();
    let line = format!("{refused:?}");
    assert!(line.contains(file.path().to_str().unwrap()), "{line}");
}
