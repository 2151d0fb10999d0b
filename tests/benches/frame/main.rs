//! What a frame costs: the scene as Bevy draws it, the same culled on the GPU alone, with three levels by hand,
//! and with the plugin.
//!
//! `cargo bench -p fieldlod_tests --features no_device --bench frame -- 100000` prints the times of both worlds
//! for that many props, on a device that does nothing; without a number it goes through all sizes. Without the
//! feature there is no renderer, and objects are culled on the CPU. `-- unseen 100000` times props that no view
//! sees, `-- trees 100000` a wood; `-- _of_` compares the kinds of levels.
//! Figures are in `benches/RECORD.md`.

mod field;
#[cfg(feature = "no_device")]
mod no_device;

use std::cell::{LazyCell, RefCell};
use std::time::Duration;

use bevy_fieldlod::LodKind;
use criterion::{Criterion, criterion_group};
use field::{Field, Method, Props};
use fieldlod_bake::SourceMesh;
use fieldlod_tests::frame_times::{FrameTimes, median};
use fieldlod_tests::{crown, rock};

/// Sizes of the field, in props.
const SIZES: [u32; 4] = [1_000, 10_000, 100_000, 1_000_000];
/// Fields of so many props do not fit into 24 GB of memory beside each other.
const ALONE_FROM: u32 = 1_000_000;
const METHODS: [(&str, Method); 5] = [
    ("full detail", Method::Full),
    ("NoCpuCulling", Method::FullNoCpuCulling),
    ("VisibilityRange", Method::Ranges),
    ("AutoLod", Method::AutoLod(LodKind::Auto)),
    ("AutoLod, CPU", Method::AutoLodCpuCulling),
];
/// The same where no view sees a prop, beside a world without any.
const UNSEEN: [(&str, Method, Props); 8] = [
    ("nothing", Method::Full, Props::None),
    ("full detail, seen", Method::Full, Props::Seen),
    ("full detail, hidden", Method::Full, Props::Hidden),
    (
        "NoCpuCulling, hidden",
        Method::FullNoCpuCulling,
        Props::Hidden,
    ),
    (
        "AutoLod, hidden",
        Method::AutoLod(LodKind::Auto),
        Props::Hidden,
    ),
    ("full detail, layer", Method::Full, Props::OnOtherLayer),
    (
        "NoCpuCulling, layer",
        Method::FullNoCpuCulling,
        Props::OnOtherLayer,
    ),
    (
        "AutoLod, layer",
        Method::AutoLod(LodKind::Auto),
        Props::OnOtherLayer,
    ),
];
/// Rounds in which each field runs some frames that are timed.
const ROUNDS: usize = 8;
const FRAMES: usize = 6;

fn main() {
    let mut args = std::env::args().skip(1);
    if args.any(|arg| arg.contains("_of_")) {
        kind_benches();
        return;
    }
    let mut sizes: Vec<u32> = std::env::args()
        .filter_map(|arg| arg.parse().ok())
        .collect();
    if sizes.is_empty() {
        sizes.extend(SIZES);
    }
    let asked = |what: &str| std::env::args().any(|arg| arg == what);
    let is_unseen = asked("unseen");
    let shapes = if asked("trees") { trees() } else { rocks() };
    for size in sizes {
        for has_sun in [false, true] {
            let light = if has_sun { "a sun" } else { "no sun" };
            println!("{size} props, {light}: medians in ms, standing and walking");
            if is_unseen {
                let new = |(_, method, props)| Field::new(method, &shapes, size, props, has_sun);
                print_frames(&UNSEEN.map(|(name, ..)| name), UNSEEN.map(new));
            } else if size >= ALONE_FROM {
                for (name, method) in METHODS {
                    print_frames(&[name], [checked_field(method, &shapes, size, has_sun)]);
                }
            } else {
                let new = |(_, method)| checked_field(method, &shapes, size, has_sun);
                print_frames(&METHODS.map(|(name, _)| name), METHODS.map(new));
            }
        }
    }
}

/// A rock of 5 120 triangles and what someone would draw of it further off.
fn rocks() -> [SourceMesh; 3] {
    [4, 3, 2].map(|subdivisions| rock(subdivisions, 1))
}

/// A tree of 15,120 triangles and what someone would draw of it further off.
fn trees() -> [SourceMesh; 3] {
    [crown(2_500, 1), rock(3, 1), rock(2, 1)]
}

/// Frames of the walk on which levels must change.
const WALK: u32 = 60;

/// Prints what frames take in each field, which run in turn.
fn print_frames<const N: usize>(names: &[&str; N], fields: [Field; N]) {
    let header = ["main", "extract", "render", "main", "extract", "render"];
    println!(
        "{:<25}{}",
        "",
        header.map(|name| format!("{name:>9}")).concat()
    );
    let mut runs = fields.map(|field| (field, Vec::new(), Vec::new()));
    for _ in 0..ROUNDS {
        for (field, still, walking) in &mut runs {
            // The first frame of each finds nothing of its own in the processor's caches.
            field.still();
            still.extend((0..FRAMES).map(|_| field.still()));
            field.walk();
            walking.extend((0..FRAMES).map(|_| field.walk()));
        }
    }
    for (name, (_, still, walking)) in names.iter().zip(&runs) {
        let parts: [fn(&FrameTimes) -> Duration; 3] = [|t| t.main, |t| t.extract, |t| t.render];
        let of = |times: &[FrameTimes]| {
            let median_ms = |part| median(times.iter().map(part)).as_secs_f64() * 1e3;
            parts
                .map(|part| format!("{:>9.3}", median_ms(part)))
                .concat()
        };
        println!("{name:<25}{}{}", of(still), of(walking));
    }
    for (name, (field, ..)) in names.iter().zip(&mut runs) {
        let stats = field.stats();
        if stats.triangles_drawn > 0 {
            let (drawn, full) = (stats.triangles_drawn, stats.triangles_full);
            let (entities, select) = (field.levels().len(), stats.selection_time);
            println!(
                "{name}: {drawn} of {full} triangles, {entities} entities, last selection {select:?}"
            );
        }
    }
}

/// A field that does what it is timed for.
fn checked_field(method: Method, shapes: &[SourceMesh], count: u32, sun: bool) -> Field {
    let mut field = Field::new(method, shapes, count, Props::Seen, sun);
    if let Method::AutoLod(_) = method {
        let before = field.levels();
        for _ in 0..WALK {
            field.walk();
        }
        let stats = field.stats();
        assert!(
            stats.triangles_drawn * 2 < stats.triangles_full,
            "{stats:?}"
        );
        assert_ne!(field.levels(), before, "a walk changes no level");
        field.rewind();
    }
    field
}

/// The measurement behind the thresholds between meshes left alone, whole meshes and units.
fn kinds(criterion: &mut Criterion) {
    for count in [1_000, 10_000] {
        for subdivisions in [2, 3, 4, 5, 6] {
            let triangles = 20 * 4usize.pow(subdivisions);
            let mut group = criterion.benchmark_group(format!("{count}_of_{triangles}_triangles"));
            group
                .sample_size(20)
                .warm_up_time(Duration::from_secs(1))
                .measurement_time(Duration::from_secs(2));
            for kind in [LodKind::Plain, LodKind::WholeMesh, LodKind::Clusters] {
                let field = LazyCell::new(|| RefCell::new(walked_field(kind, count, subdivisions)));
                group.bench_function(format!("{kind:?}"), |bencher| {
                    let mut field = field.borrow_mut();
                    bencher.iter(|| field.walk());
                });
            }
        }
    }
}

/// A field of rocks that has been walked through, with what it draws written out.
fn walked_field(kind: LodKind, count: u32, subdivisions: u32) -> Field {
    let rocks = [rock(subdivisions, 1)];
    let mut field = Field::new(Method::AutoLod(kind), &rocks, count, Props::Seen, true);
    for _ in 0..100 {
        field.walk();
    }
    let stats = field.stats();
    let has_levels = kind != LodKind::Plain;
    assert_eq!(stats.triangles_drawn < stats.triangles_full, has_levels);
    let visible = field.visible().len();
    let full = visible * rocks[0].triangle_count();
    eprintln!(
        "{kind:?}: {} triangles, {visible} of {} entities drawn",
        if has_levels {
            stats.triangles_drawn as usize
        } else {
            full
        },
        field.levels().len(),
    );
    field
}

criterion_group!(kind_benches, kinds);
