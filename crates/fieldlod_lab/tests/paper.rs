//! The figures as a whole: written, the same each time, and their numbers as claimed.

use std::fs;
use std::path::Path;

use fieldlod_lab::paper::{Comparison, DifferenceAtAngle, PaperNumbers, draw_figures};

const PICTURES: [&str; 6] = [
    "figure_09.png",
    "figure_10.png",
    "figure_11.png",
    "figure_14.png",
    "figure_15.png",
    "figure_18.png",
];

fn draw(folder: &Path) -> (PaperNumbers, Vec<Vec<u8>>) {
    let numbers = draw_figures(folder).unwrap();
    let pictures = PICTURES.map(|name| fs::read(folder.join(name)).unwrap());
    (numbers, pictures.to_vec())
}

/// Two runs give the same bytes; the numbers are checked on the way, as a run takes seconds.
#[test]
fn figures_are_deterministic_and_their_numbers_as_claimed() {
    let folder = tempfile::tempdir().unwrap();
    let (numbers, pictures) = draw(&folder.path().join("once"));
    let (again, pictures_again) = draw(&folder.path().join("again"));
    let json = serde_json::to_string(&numbers).unwrap();
    assert_eq!(json, serde_json::to_string(&again).unwrap());
    for ((name, picture), other) in PICTURES.iter().zip(&pictures).zip(&pictures_again) {
        assert!(picture.len() > 10_000, "{name} is nearly empty");
        assert!(picture == other, "{name} differs between runs");
    }
    curl_is_the_growth_of_the_strength(&numbers);
    level_surfaces_are_level(&numbers);
    patterns_have_the_aspect_ratio_of_the_cosine(&numbers);
    sheared_kernel_is_nearer_to_the_exact_one(&numbers);
    sheared_splats_are_nearer_to_exact_splats(&numbers);
    convergent_points_merge_fewer_samples(&numbers);
}

fn curl_is_the_growth_of_the_strength(numbers: &PaperNumbers) {
    for at in &numbers.figure_9.angles {
        let tolerance = 1e-6 * (1.0 + at.curl_over_strength);
        assert!((at.curl_over_strength - at.growth_over_strength).abs() < tolerance);
    }
}

fn level_surfaces_are_level(numbers: &PaperNumbers) {
    for at in &numbers.figure_10.angles {
        assert!((at.strength_over_level - 1.0).abs() < 1e-12);
        let expected = (1.5 * at.off_axis_deg.to_radians().tan())
            .atan()
            .to_degrees();
        assert!((at.gradient_off_camera_deg - expected).abs() < 1e-5);
    }
}

fn patterns_have_the_aspect_ratio_of_the_cosine(numbers: &PaperNumbers) {
    for at in &numbers.figure_11.angles {
        assert!((at.measured_at_100_px / at.cos_phi - 1.0).abs() < 1e-5);
        assert!((at.measured_at_1000_px / at.cos_phi - 1.0).abs() < 1e-6);
    }
}

/// At every angle and in every position; the curl alone is not, when a disk is turned outwards.
fn sheared_kernel_is_nearer_to_the_exact_one(numbers: &PaperNumbers) {
    let figure = &numbers.figure_14;
    let positions = [
        &figure.across_sight_ray,
        &figure.turned_outwards,
        &figure.turned_inwards,
    ];
    for at in positions.into_iter().flatten() {
        let slack = 1e-9;
        assert!(
            at.sheared <= at.paper + slack && at.sheared <= at.curl_only + slack,
            "{at:?}"
        );
    }
    let at_60 =
        |angles: &[DifferenceAtAngle]| *angles.iter().find(|at| at.off_axis_deg == 60.0).unwrap();
    let across = at_60(&figure.across_sight_ray);
    assert!((across.paper - 0.327).abs() < 1e-3 && (across.sheared - 0.069).abs() < 1e-3);
    assert!(at_60(&figure.turned_outwards).curl_only > at_60(&figure.turned_outwards).paper);
}

fn sheared_splats_are_nearer_to_exact_splats(numbers: &PaperNumbers) {
    let figure = &numbers.figure_15;
    let ours = figure.sheared.rmse_to_exact_splats_of_255;
    assert!(ours < 0.5 * figure.paper.rmse_to_exact_splats_of_255);
    assert!(figure.sheared.rmse_of_255 < figure.paper.rmse_of_255);
    assert_eq!(figure.sheared.missing_px, 0);
}

/// In nearly every parallel pair, and in most that are not parallel or compared at the same density.
fn convergent_points_merge_fewer_samples(numbers: &PaperNumbers) {
    let figure = &numbers.figure_18;
    for result in &figure.parallel {
        assert_fewer(&result.all.same_focal, 0.9, 10.0);
        assert_fewer(&result.all.same_density, 0.9, 5.0);
    }
    for further in &figure.parallel_further {
        assert_fewer(&further.same_focal, 0.9, 10.0);
        assert_fewer(&further.same_density, 0.8, 5.0);
    }
    for further in &figure.not_parallel_further {
        assert_fewer(&further.same_focal, 0.6, 10.0);
        assert_fewer(&further.same_density, 0.7, 4.0);
    }
}

fn assert_fewer(comparison: &Comparison, share: f64, percent: f64) {
    let sets = comparison.sets as f64;
    assert!(comparison.fewer_in as f64 >= share * sets, "{comparison:?}");
    assert!(comparison.mean_fewer_percent > percent, "{comparison:?}");
}

#[test]
fn rejects_folders_that_cannot_be_made() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("file");
    fs::write(&file, b"").unwrap();
    let error = draw_figures(&file.join("inside")).unwrap_err();
    assert!(error.path.ends_with("inside"));
}
