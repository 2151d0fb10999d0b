//! How far are levels of detail, hand-made ranges and full detail from the truth, on the adapter at hand?
//!
//! `cargo bench -p fieldlod_tests --bench truth -- forest 60` draws 60 trees with radii of 3, 6, 12 and 24 pixels;
//! `--radii 6,12` selects others. Other scenes are drawn from the start of their paths, or after `--metres 0,40`.
//! `--px 1,2,4` selects the thresholds of the plugin. `--off` draws without multisampling instead of with four samples,
//! Bevy's default, and `--taa` with temporal antialiasing, nine frames of each pose. The distances of hand-made ranges
//! have a common factor, at which their error from the truth is that of the plugin at its first threshold. `--flux` adds
//! visible flux at the threshold with this error. `--large` draws one picture from the path, as large as those of the
//! bench `whole_frame`. `-- walkthrough` draws the walkthrough's path.
//!
//! The truth is full detail in a target with four times the width and height and four samples per pixel, averaged in
//! linear light. Errors of small pictures are means over eight steps of a quarter of a pixel, those of the walkthrough over
//! its pictures. `FIELDLOD_PICTURES=folder` writes pictures.

mod measure;
mod path;
#[path = "../walkthrough.rs"]
mod walkthrough;

use std::path::Path;

use bevy::math::UVec2;
use bevy::prelude::*;
use bevy::render::view::Msaa;
use bevy_fieldlod::FieldLodVisibleFluxPlugin;
use fieldlod_tests::scenes::{Method, Scene, SceneApp};
use fieldlod_tests::stage::Stage;

use measure::{Errors, Linear, SUPERSAMPLED, pictures, rmse};

const SIZE_PX: UVec2 = UVec2::new(320, 180);
const LARGE_PX: UVec2 = UVec2::new(960, 540);
/// Steps of a quarter of a pixel.
const STEPS: u8 = 8;
/// Frames of a pose before its picture, with temporal antialiasing.
const FRAMES_BEFORE: u8 = 8;
/// Pixels per radian at the centre of small pictures, for Bevy's default field of view of π/4.
const FOCAL_PX: f32 = 90.0 / 0.414_213_57;
/// The mean radius of the forest's trees in metres.
const TREE_RADIUS: f32 = 1.3 * 2.5;
/// Steps of the search for the factor of distances. Each halves the interval.
const SEARCH_STEPS: usize = 8;

fn main() -> Result<(), String> {
    let args: Vec<String> = std::env::args().skip(1).collect();
    let size = args.iter().find_map(|arg| arg.parse().ok());
    let scene = args.iter().find_map(|name| Scene::named(name, size));
    let scene = scene.unwrap_or_else(|| Scene::named("forest", Some(60)).expect("a name"));
    let list = |name: &str, default: &str| -> Vec<f32> {
        let at = args.iter().position(|arg| arg == name);
        let list = at
            .and_then(|at| args.get(at + 1))
            .map_or(default, String::as_str);
        list.split(',')
            .filter_map(|number| number.parse().ok())
            .collect()
    };
    let has = |name: &str| args.iter().any(|arg| arg == name);
    let thresholds = list("--px", "1,2");
    if has("walkthrough") {
        return path::compare(&thresholds);
    }
    let msaa = if has("--off") {
        Msaa::Off
    } else {
        Msaa::Sample4
    };
    let (size_px, steps) = if has("--large") {
        (LARGE_PX, 1)
    } else {
        (SIZE_PX, STEPS)
    };
    let places: Vec<(String, Transform)> = if scene.name == "forest" && !has("--large") {
        let radii = list("--radii", "3,6,12,24");
        radii.into_iter().map(tree_at).collect()
    } else {
        let metres = list("--metres", "0").into_iter();
        metres
            .map(|metres| (format!("{metres} m"), scene.pose(metres)))
            .collect()
    };
    let full_detail = Method::Full { gpu: false };
    let supersampled = size_px * SUPERSAMPLED;
    let Some(mut truth) = app(&scene, full_detail, Msaa::Sample4, supersampled) else {
        return Ok(());
    };
    let sampling = if has("--taa") {
        String::from("TAA")
    } else {
        format!("{msaa:?}")
    };
    println!("{}, {sampling}, {}", scene.name, truth.adapter());
    println!(
        "{:<8}{:<16}{:>11}{:>8}{:>8}{:>8}{:>9}",
        "", "", "triangles", "RMSE", "bias", "FLIP", "flicker"
    );
    let app = |method| {
        let mut app = app(&scene, method, msaa, size_px).expect("there was an adapter");
        if has("--taa") {
            app.set_taa(FRAMES_BEFORE);
        }
        app
    };
    let mut full = app(full_detail);
    let mut plugin = app(Method::auto_lod(1.0));
    let mut ranges = app(Method::Ranges { gpu: false });
    for (place, pose) in places {
        let poses = steps_from(pose, steps);
        let (truth, _) = pictures(&mut truth, &poses, SUPERSAMPLED);
        keep(&truth[0], &place, "truth");
        measure("full detail", &place, &mut full, &poses, &truth);
        let mut errors = Vec::new();
        for px in &thresholds {
            plugin.set_error_px(*px);
            let name = format!("plugin, {px} px");
            errors.push(measure(&name, &place, &mut plugin, &poses, &truth).rmse);
        }
        if has("--flux") {
            plugin.set_visible_flux(true);
            let set = SceneApp::set_error_px;
            let px = match_error(&mut plugin, set, errors[0], &poses, &truth);
            let name = format!("flux, {px:.2} px");
            measure(&name, &place, &mut plugin, &poses, &truth);
            plugin.set_visible_flux(false);
        }
        let set = |app: &mut SceneApp, distance: f32| app.scale_ranges(distance.recip());
        let coarser = match_error(&mut ranges, set, errors[0], &poses[..1], &truth[..1]);
        let name = format!("ranges × {:.2}", coarser.recip());
        measure(&name, &place, &mut ranges, &poses, &truth);
    }
    Ok(())
}

fn app(scene: &Scene, method: Method, msaa: Msaa, size_px: UVec2) -> Option<SceneApp> {
    let mut stage = Stage::stock()?;
    if let Method::AutoLod { .. } = method {
        stage.app.add_plugins(FieldLodVisibleFluxPlugin);
    }
    let mut app = SceneApp::new(stage, scene, method, size_px, false);
    app.set_msaa(msaa);
    app.look_up();
    app.wait_for_levels();
    Some(app)
}

/// The forest from the distance at which trees have this radius in pixels.
fn tree_at(radius_px: f32) -> (String, Transform) {
    let distance = FOCAL_PX * TREE_RADIUS / radius_px;
    let eye = Vec3::new(-distance, 0.3 * distance, 0.0);
    let pose = Transform::from_translation(eye).looking_at(Vec3::Y * 2.0, Vec3::Y);
    (format!("{radius_px} px"), pose)
}

/// Poses that turn by a quarter of a pixel each.
fn steps_from(pose: Transform, steps: u8) -> Vec<Transform> {
    let turn = |step: u8| Quat::from_rotation_y(f32::from(step) * 0.25 / FOCAL_PX);
    (0..steps)
        .map(|step| pose.with_rotation(pose.rotation * turn(step)))
        .collect()
}

fn measure(
    name: &str,
    place: &str,
    app: &mut SceneApp,
    poses: &[Transform],
    truth: &[Linear],
) -> Errors {
    let (pictures, triangles) = pictures(app, poses, 1);
    keep(&pictures[0], place, name);
    let errors = Errors::of(&pictures, truth);
    println!(
        "{place:<8}{name:<16}{:>11}{:>8.2}{:>8.2}{:>8.4}{:>9.2}",
        triangles, errors.rmse, errors.bias, errors.flip, errors.flicker
    );
    errors
}

/// Sets the coarsest levels whose error is at most `wanted`. `set` makes levels coarser for larger factors. Returns the
/// factor.
fn match_error(
    app: &mut SceneApp,
    set: impl Fn(&mut SceneApp, f32),
    wanted: f64,
    poses: &[Transform],
    truth: &[Linear],
) -> f32 {
    let (mut fine, mut coarse) = (0.05f32, 50.0f32);
    for _ in 0..SEARCH_STEPS {
        let factor = (fine * coarse).sqrt();
        set(app, factor);
        if rmse(&pictures(app, poses, 1).0, truth) > wanted {
            coarse = factor;
        } else {
            fine = factor;
        }
    }
    set(app, fine);
    fine
}

fn keep(picture: &Linear, place: &str, name: &str) {
    if let Some(folder) = std::env::var_os("FIELDLOD_PICTURES") {
        let file = Path::new(&folder).join(format!("{place} {name}.png"));
        picture.to_image().save(file).expect("the folder exists");
    }
}
