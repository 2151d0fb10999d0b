//! The plugin beside stock Bevy: the same scenes from the same poses, each in a process of its own.
//!
//! `cargo bench -p fieldlod_tests --bench beside_stock -- FOLDER` draws every `.glb` file of the folder and generated
//! scenes at 1, 2.5 and 10 radii. It prints triangles, image errors, resident memory, slabs of Bevy's mesh allocator, and
//! seconds until the levels are ready. RMSE and FLIP are from stock Bevy, over the pixels that show a surface; then follow
//! the errors of stock Bevy and of the plugin from the truth, over the picture, as in the bench `truth`. Levels come from
//! a cache, so that no bake runs in a measured process. Resident memory is that of Linux; with a software adapter it
//! contains the GPU memory. `--only NAME` selects scenes. `--pictures OUT` keeps the pictures, and `--cache DIR` the bakes.

#[path = "../truth/measure.rs"]
#[expect(dead_code, reason = "the bench `truth` uses more of it")]
mod measure;
mod pictures;
#[path = "../process.rs"]
mod process;
mod scene;

use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use scene::{Measured, SCENES};

/// Environment variable of a measuring process: its [`Case`].
const CASE: &str = "FIELDLOD_BESIDE_STOCK";

/// What draws the pictures.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
enum By {
    Plugin,
    Stock,
    /// Stock Bevy with 64 samples per pixel.
    Truth,
}

/// The input of a measuring process.
#[derive(serde::Serialize, serde::Deserialize)]
struct Case {
    /// A generated scene, or the path of a `.glb` file.
    scene: String,
    by: By,
    /// Whether the process only fills the cache.
    only_bakes: bool,
    cache: PathBuf,
    /// The folder for pictures.
    pictures: PathBuf,
}

fn main() {
    if let Ok(case) = std::env::var(CASE) {
        let measured = scene::measure(&serde_json::from_str(&case).unwrap());
        return println!("{}", serde_json::to_string(&measured).unwrap());
    }
    let args: Vec<String> = std::env::args().skip(1).collect();
    let value = |name: &str| {
        let at = args.iter().position(|arg| arg == name)?;
        args.get(at + 1)
    };
    let folder = tempfile::tempdir().unwrap();
    let cache = value("--cache").map_or(folder.path().join("cache"), PathBuf::from);
    let pictures = value("--pictures").map_or(folder.path().join("pictures"), PathBuf::from);
    std::fs::create_dir_all(&pictures).unwrap();
    let input = args.first().filter(|arg| !arg.starts_with("--"));
    let mut scenes: Vec<String> = SCENES.map(String::from).into();
    scenes.extend(
        input
            .into_iter()
            .flat_map(|input| unpacked(input, folder.path())),
    );
    println!(
        "{:<24}{:>7}{:>10} {:>10} {:>6}{:>7} |{:>6}{:>7} |{:>7}{:>7}{:>7} |{:>7}{:>7} |{:>6}{:>6} |{:>6}{:>6}",
        "",
        "radii",
        "triangles",
        "of",
        "RMSE",
        "FLIP",
        "stock",
        "plugin",
        "MB",
        "stock",
        "%",
        "slabs",
        "stock",
        "mesh",
        "stock",
        "ready",
        "stock"
    );
    for scene in scenes {
        if value("--only").is_some_and(|only| !scene.contains(only)) {
            continue;
        }
        let case = |by, only_bakes| Case {
            scene: scene.clone(),
            by,
            only_bakes,
            cache: cache.clone(),
            pictures: pictures.clone(),
        };
        // The first run bakes.
        run(&case(By::Plugin, true));
        if !scene.starts_with("menu") {
            run(&case(By::Truth, false));
        }
        let [stock, plugin] = [By::Stock, By::Plugin].map(|by| run(&case(by, false)));
        print(&scene, &stock, &plugin, &pictures);
    }
}

/// Unpacks the `.glb` files of `input` into `folder`, because Bevy reads no compressed ones. Returns the new paths.
fn unpacked(input: &str, folder: &Path) -> Vec<String> {
    let files = std::fs::read_dir(input)
        .unwrap()
        .map(|file| file.unwrap().path());
    let mut files: Vec<PathBuf> = files
        .filter(|file| file.extension().is_some_and(|ext| ext == "glb"))
        .collect();
    files.sort();
    let unpack = |file: PathBuf| {
        let bytes = std::fs::read(&file).unwrap();
        let bytes =
            fieldlod_bake::unpack_gltf(&bytes, &|name| std::fs::read(Path::new(input).join(name)));
        let copy = folder.join(file.file_name().unwrap());
        std::fs::write(&copy, bytes.unwrap().to_glb().unwrap()).unwrap();
        copy.to_str().unwrap().to_owned()
    };
    files.into_iter().map(unpack).collect()
}

fn run(case: &Case) -> Vec<Measured> {
    let mut command = Command::new(std::env::current_exe().unwrap());
    command.env(CASE, serde_json::to_string(case).unwrap());
    let output = command.stderr(Stdio::inherit()).output().unwrap();
    assert!(output.status.success());
    let text = String::from_utf8_lossy(&output.stdout).into_owned();
    serde_json::from_str(text.lines().last().unwrap()).unwrap()
}

fn print(scene: &str, stock: &[Measured], plugin: &[Measured], pictures: &Path) {
    let name = Path::new(scene)
        .file_stem()
        .unwrap()
        .to_string_lossy()
        .into_owned();
    for (stock, plugin) in stock.iter().zip(plugin) {
        let error = pictures::compare(pictures, &name, plugin.radii);
        let percent = 100.0 * (plugin.resident_mb / stock.resident_mb - 1.0);
        println!(
            "{name:<24}{:>7}{:>10} {:>10} {:>6.2}{:>7.4} |{:>6.2}{:>7.2} |{:>7.1}{:>7.1}{percent:>7.1} |{:>7.1}{:>7.1} |{:>6}{:>6} |{:>6.1}{:>6.1}",
            plugin.radii,
            plugin.triangles,
            plugin.triangles_full,
            error.rmse,
            error.flip,
            error.stock,
            error.plugin,
            plugin.resident_mb,
            stock.resident_mb,
            plugin.slabs_mb,
            stock.slabs_mb,
            plugin.meshes,
            stock.meshes,
            plugin.ready_s,
            stock.ready_s,
        );
    }
}
