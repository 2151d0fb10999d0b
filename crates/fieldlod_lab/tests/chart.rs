//! Charts of a small model: what is measured, what is kept, what is written.

mod common;

use std::cell::Cell;

use fieldlod_bake::{BakeConfig, bake_mesh, clusterlod_hierarchy, fixtures};
use fieldlod_lab::chart::{
    ABLATED, BakedModel, Measure, ModelResult, Options, Report, Store, chart_model, write_charts,
};
use fieldlod_lab::method::Method;
use fieldlod_lab::render::Renderer;
use glam::UVec2;

fn rock() -> BakedModel {
    let (mesh, config) = (fixtures::rock(5, 3), BakeConfig::fine_grained());
    BakedModel {
        name: "rock".to_owned(),
        ours: bake_mesh(&mesh, &config).unwrap(),
        clusterlods: clusterlod_hierarchy(&mesh, &config).unwrap(),
    }
}

fn options(methods: &[Method]) -> Options {
    Options {
        poses: 2,
        seed: 5,
        size_px: UVec2::new(160, 90),
        methods: methods.to_vec(),
        with_extras: false,
    }
}

fn charted(renderer: &Renderer, options: &Options, store: &Store) -> (ModelResult, usize) {
    let steps = Cell::new(0);
    let step = || steps.set(steps.get() + 1);
    let result = chart_model(renderer, rock(), options, store, &step);
    (result.unwrap(), steps.get())
}

#[test]
fn clusterlod_is_its_own_equal_and_the_oracle_needs_no_more() {
    let Some((renderer, _one)) = common::renderer() else {
        return;
    };
    let folder = tempfile::tempdir().unwrap();
    let store = Store::new(folder.path()).unwrap();
    let options = options(&[Method::Quality, Method::Clusterlod, Method::Oracle]);
    let (model, steps) = charted(&renderer, &options, &store);
    assert_eq!(steps, options.steps());
    let report = Report::new(&[model], &options, renderer.adapter());
    let ratio = |method| report.ratio(method, Measure::Rmse, 1.0).unwrap();
    assert!((ratio(Method::Clusterlod).mean - 1.0).abs() < 1e-9);
    assert_eq!(ratio(Method::Clusterlod).poses, 2);
    assert!(
        ratio(Method::Oracle).mean < 1.0,
        "{:?}",
        ratio(Method::Oracle)
    );
    assert!(ratio(Method::Oracle).mean < ratio(Method::Quality).mean);
}

/// What was measured before comes from the folder: the numbers, times included, are the same.
#[test]
fn a_stopped_run_goes_on_where_it_was() {
    let Some((renderer, _one)) = common::renderer() else {
        return;
    };
    let folder = tempfile::tempdir().unwrap();
    let store = Store::new(folder.path()).unwrap();
    let options = options(&[Method::Quality, Method::Clusterlod]);
    let (first, _) = charted(&renderer, &options, &store);
    let files = || std::fs::read_dir(folder.path()).unwrap().count();
    assert_eq!(files(), options.poses);
    let (second, steps) = charted(&renderer, &options, &store);
    assert!(first.poses == second.poses, "other numbers, or other times");
    assert_eq!(steps, options.steps());
    let poses = options.poses;
    let more = Options {
        poses: 3,
        ..options
    };
    charted(&renderer, &more, &store);
    assert!(files() > poses, "other poses are kept beside");
}

#[test]
fn charts_are_written_with_their_numbers() {
    let Some((renderer, _one)) = common::renderer() else {
        return;
    };
    let folder = tempfile::tempdir().unwrap();
    let store = Store::new(&folder.path().join("results")).unwrap();
    let options = Options {
        with_extras: true,
        poses: 1,
        ..options(&[Method::Quality, Method::Clusterlod])
    };
    let (model, _) = charted(&renderer, &options, &store);
    let report = Report::new(&[model], &options, renderer.adapter());
    write_charts(&report, folder.path()).unwrap();
    for name in ["triangles", "selection", "frame", "promise", "flicker"] {
        let picture = image::open(folder.path().join(format!("{name}.png"))).unwrap();
        assert!(picture.width() > 600, "{name}");
    }
    let text = std::fs::read(folder.path().join("report.json")).unwrap();
    let read: Report = serde_json::from_slice(&text).unwrap();
    // The last digits of numbers may differ.
    for (read, reported) in read.ratios.iter().zip(&report.ratios) {
        assert_eq!(
            (read.method, read.measure),
            (reported.method, reported.measure)
        );
        assert!(
            (read.mean - reported.mean).abs() < 1e-12,
            "{read:?} {reported:?}"
        );
    }
    assert_eq!(read.ratios.len(), report.ratios.len());
    // A header of two lines, then each term left out.
    let table = std::fs::read_to_string(folder.path().join("ablation.md")).unwrap();
    assert_eq!(table.lines().count(), 2 + ABLATED.len());
    let unbounded = |method| {
        read.ablation
            .iter()
            .find(|row| row.method == method)
            .unwrap()
    };
    let (bound, centre) = (
        unbounded(Method::Guaranteed),
        unbounded(Method::GuaranteedNoBound),
    );
    assert!(bound.max_px <= 1.0 && bound.max_px <= centre.max_px);
    assert!(bound.triangles_at_1_px >= centre.triangles_at_1_px);
}

#[test]
fn a_file_in_place_of_the_folder_is_named() {
    let file = tempfile::NamedTempFile::new().unwrap();
    let refused = Store::new(file.path()).unwrap_err();
    assert_eq!(refused.path, file.path());
}
