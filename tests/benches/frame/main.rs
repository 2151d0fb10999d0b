//! Frame times with many props: full detail, full detail culled on the GPU alone, three hand-made levels, and the
//! plugin.
//!
//! `cargo bench -p fieldlod_tests --features no_device --bench frame -- 100000` prints medians of the main world, the
//! extraction and the render world for 100,000 props, on a device that does nothing. `-- trees 100000` has trees in
//! place of rocks. `-- kinds` compares the kinds of levels at several sizes of mesh.

mod field;
mod no_device;

use std::time::Duration;

use bevy_fieldlod::LodKind;
use field::{Field, Method};
use fieldlod_bake::SourceMesh;
use fieldlod_tests::frame_times::{FrameTimes, median};
use fieldlod_tests::{crown, rock};

/// Numbers of props, if the command line has none.
const SIZES: [u32; 3] = [1_000, 10_000, 100_000];
/// Fields of this size do not fit side by side into 24 GB of memory.
const ALONE_FROM: u32 = 1_000_000;
const METHODS: [(&str, Method); 5] = [
    ("full detail", Method::Full),
    ("NoCpuCulling", Method::FullNoCpuCulling),
    ("VisibilityRange", Method::Ranges),
    ("AutoLod", Method::AutoLod(LodKind::Auto)),
    ("AutoLod, CPU culling", Method::AutoLodCpuCulling),
];
const KINDS: [(&str, Method); 3] = [
    ("Plain", Method::AutoLod(LodKind::Plain)),
    ("WholeMesh", Method::AutoLod(LodKind::WholeMesh)),
    ("Clusters", Method::AutoLod(LodKind::Clusters)),
];
/// Rounds in which each field runs some timed frames, in turn.
const ROUNDS: usize = 8;
const FRAMES: usize = 6;
/// Frames of a walk on which some level must change.
const WALK: u32 = 60;

fn main() {
    let args: Vec<String> = std::env::args().collect();
    let has = |name: &str| args.iter().any(|arg| arg == name);
    if has("kinds") {
        return compare_kinds();
    }
    let mut sizes: Vec<u32> = args.iter().filter_map(|arg| arg.parse().ok()).collect();
    if sizes.is_empty() {
        sizes.extend(SIZES);
    }
    // A mesh and two hand-made levels.
    let shapes = if has("trees") {
        [crown(2_500, 1), rock(3, 1), rock(2, 1)]
    } else {
        [4, 3, 2].map(|subdivisions| rock(subdivisions, 1))
    };
    for size in sizes {
        for has_sun in [false, true] {
            let light = if has_sun { "a sun" } else { "no sun" };
            println!("{size} props, {light}");
            let field = |(name, method)| (name, checked_field(method, &shapes, size, has_sun));
            if size >= ALONE_FROM {
                for method in METHODS {
                    print_times(&mut [field(method)]);
                }
            } else {
                print_times(&mut METHODS.map(field));
            }
        }
    }
}

/// The measurement behind the thresholds of `FieldLodAppConfig` between the kinds of levels.
fn compare_kinds() {
    for (count, subdivisions) in [(10_000, 2), (10_000, 3), (10_000, 5), (1_000, 6)] {
        let shape = [rock(subdivisions, 1)];
        let triangles = shape[0].triangle_count();
        println!("{count} props of {triangles} triangles, a sun");
        let field = |(name, method)| (name, Field::new(method, &shape, count, true));
        print_times(&mut KINDS.map(field));
    }
}

/// A field that draws fewer triangles and changes levels on a walk, if the plugin draws it.
fn checked_field(method: Method, shapes: &[SourceMesh], count: u32, has_sun: bool) -> Field {
    let mut field = Field::new(method, shapes, count, has_sun);
    if let Method::AutoLod(_) = method {
        let before = field.levels();
        for _ in 0..WALK {
            field.walk();
        }
        let stats = field.stats();
        let (drawn, full) = (stats.triangles_drawn, stats.triangles_full);
        assert!(drawn * 2 < full, "{stats:?}");
        assert_ne!(field.levels(), before, "a walk changes no level");
        field.rewind();
    }
    field
}

/// Prints the times of each field. The fields run in turn.
fn print_times(fields: &mut [(&str, Field)]) {
    let mut times = vec![[const { Vec::new() }; 2]; fields.len()];
    for _ in 0..ROUNDS {
        for ((_, field), [still, walking]) in fields.iter_mut().zip(&mut times) {
            // The first frame of a field runs with cold caches.
            field.still();
            still.extend((0..FRAMES).map(|_| field.still()));
            field.walk();
            walking.extend((0..FRAMES).map(|_| field.walk()));
        }
    }
    println!("medians in ms       | standing: main extract render | walking: main extract render");
    for ((name, field), times) in fields.iter_mut().zip(&times) {
        let [still, walking] = times.each_ref().map(|times| parts_in_ms(times));
        println!("{name:<20}{still}{walking}");
        let stats = field.stats();
        if stats.triangles_drawn > 0 {
            let (drawn, full) = (stats.triangles_drawn, stats.triangles_full);
            let entities = field.levels().len();
            println!("{:<20}{drawn} of {full} triangles, {entities} entities", "");
        }
    }
}

/// Medians of the parts of frames, as columns.
fn parts_in_ms(times: &[FrameTimes]) -> String {
    let parts: [fn(&FrameTimes) -> Duration; 3] = [|t| t.main, |t| t.extract, |t| t.render];
    let column = |part| median(times.iter().map(part)).as_secs_f64() * 1e3;
    parts.map(|part| format!("{:>9.3}", column(part))).concat()
}
