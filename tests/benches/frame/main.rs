//! CPU time of a frame: full detail, hand-made levels with `VisibilityRange`, and the plugin.
//!
//! `cargo bench -p fieldlod_tests --bench frame -- rocks 100000` prints medians and minima of the main world, the
//! extraction and the render world. `-- town` has a town with the counts of Bevy's `bevy_city`, `-- forest` a forest of
//! 100,000 trees; a number sets another size. `-- kinds` compares the kinds of levels at several sizes of mesh.
//!
//! Bevy's methods have two forms: culled on the CPU, and by the GPU alone with `NoCpuCulling`. Commands for the GPU are
//! recorded and dropped, so that any adapter will do and the GPU is idle.

use std::time::Duration;

use bevy::math::UVec2;
use bevy_fieldlod::LodKind;
use fieldlod_tests::frame_times::{FrameTimes, median};
use fieldlod_tests::scenes::{Method, Scene, SceneApp, rocks};
use fieldlod_tests::stage::Stage;

const KINDS: [(&str, LodKind); 3] = [
    ("Plain", LodKind::Plain),
    ("WholeMesh", LodKind::WholeMesh),
    ("Clusters", LodKind::Clusters),
];
/// Names and metres per frame of a sixtieth of a second.
const PACES: [(&str, f32); 3] = [("standing", 0.0), ("walking", 0.03), ("driving", 0.25)];
/// Rounds in which each app runs some timed frames, in turn.
const ROUNDS: usize = 8;
const FRAMES: usize = 6;

fn methods() -> [(&'static str, Method); 5] {
    [
        ("full detail", Method::Full { gpu: false }),
        ("full, NoCpuCulling", Method::Full { gpu: true }),
        ("ranges", Method::Ranges { gpu: false }),
        ("ranges, NoCpuCulling", Method::Ranges { gpu: true }),
        ("AutoLod", Method::auto_lod(1.0)),
    ]
}

fn main() {
    let args: Vec<String> = std::env::args().skip(1).collect();
    if args.iter().any(|arg| arg == "kinds") {
        return compare_kinds();
    }
    let size = args.iter().find_map(|arg| arg.parse().ok());
    let named = |name: &String| Scene::named(name, size);
    let scene = args.iter().find_map(named);
    let scene = scene.unwrap_or_else(|| rocks(10_000, 4));
    let [triangles, of_props] = scene.triangles();
    println!(
        "{}: {triangles} triangles, {of_props} in its meshes",
        scene.name
    );
    for has_shadows in [false, true] {
        println!("{}", if has_shadows { "shadows" } else { "no shadows" });
        let app = |(name, method)| (name, app(&scene, method, has_shadows));
        print_times(&mut methods().map(app));
    }
}

/// Measures the kinds of levels. The thresholds in `FieldLodAppConfig` between kinds come from this measurement.
fn compare_kinds() {
    for (count, subdivisions) in [
        (10_000, 1),
        (10_000, 2),
        (10_000, 3),
        (10_000, 5),
        (1_000, 6),
    ] {
        let scene = rocks(count, subdivisions);
        println!("{count} rocks of {} triangles, a sun", scene.triangles()[1]);
        let method = |kind| Method::AutoLod {
            kind,
            error_px: 1.0,
        };
        print_times(&mut KINDS.map(|(name, kind)| (name, app(&scene, method(kind), true))));
    }
}

fn app(scene: &Scene, method: Method, has_shadows: bool) -> SceneApp {
    let stage = Stage::stock().expect("there is an adapter");
    let mut app = SceneApp::new(stage, scene, method, UVec2::new(1920, 1080), has_shadows);
    app.drop_commands();
    app.wait_for_levels();
    app
}

/// Prints the times of each app. The apps run in turn.
fn print_times(apps: &mut [(&str, SceneApp)]) {
    let mut times = vec![[const { Vec::new() }; PACES.len()]; apps.len()];
    let mut metres = [0.0; PACES.len()];
    for _ in 0..ROUNDS {
        for (pace, (_, step)) in PACES.iter().enumerate() {
            let from = metres[pace];
            for ((_, app), times) in apps.iter_mut().zip(&mut times) {
                // The first frame of an app runs with cold caches.
                for frame in 0..=FRAMES {
                    app.go_to(from + frame as f32 * step);
                    let frame_times = app.frame();
                    if frame > 0 {
                        times[pace].push(frame_times);
                    }
                }
            }
            metres[pace] += FRAMES as f32 * step;
        }
    }
    println!(
        "{:<22}{:>11}{:>9}{:>9}  medians in ms (minima): main, extract, render",
        "", "triangles", "entities", "mesh MB"
    );
    for ((name, app), times) in apps.iter_mut().zip(&times) {
        if app.has_stopped() {
            println!("{name:<22}the renderer has stopped, for example at a limit of the adapter");
            continue;
        }
        app.go_to(0.0);
        app.frame();
        let (triangles, megabytes) = (app.triangles(), app.mesh_bytes() as f64 * 1e-6);
        print!(
            "{name:<22}{triangles:>11}{:>9}{megabytes:>9.1}",
            app.entities()
        );
        for ((pace, _), times) in PACES.iter().zip(times) {
            print!("  {pace}{}", parts_in_ms(times));
        }
        println!();
    }
}

/// Medians and minima of the parts of frames.
fn parts_in_ms(times: &[FrameTimes]) -> String {
    let parts: [fn(&FrameTimes) -> Duration; 3] = [|t| t.main, |t| t.extract, |t| t.render];
    let ms = |time: Duration| time.as_secs_f64() * 1e3;
    let column = |part| {
        let least = times.iter().map(part).min().unwrap_or_default();
        format!(
            " {:.2} ({:.2})",
            ms(median(times.iter().map(part))),
            ms(least)
        )
    };
    parts.map(column).concat()
}
