//! The walkthrough's pictures along its path, compared with the truth.

use glam::UVec2;

use crate::measure::{Linear, bias, rmse};
use crate::walkthrough;

/// The size and number of the pictures. A software adapter draws the reduced scene with one sample per pixel.
const SIZE_PX: UVec2 = UVec2::new(800, 450);
const PICTURES: usize = 12;
/// Width and height of the target of the truth over those of the pictures.
const SUPERSAMPLED: u32 = 8;

/// Prints the errors of full detail and of the plugin at each threshold in pixels.
pub(crate) fn compare(thresholds: &[f32]) -> Result<(), String> {
    let (truth, summary) = pictures(&["--plain"], SUPERSAMPLED)?;
    println!("walkthrough, quality: {}", summary["quality"]);
    println!("{:<16}{:>11}{:>8}{:>8}", "", "triangles", "RMSE", "bias");
    let print = |name: &str, pictures: &[Linear], triangles: f64| {
        let [rmse, bias] = [rmse, bias].map(|error| error(pictures, &truth));
        println!("{name:<16}{triangles:>11.0}{rmse:>8.2}{bias:>8.2}");
    };
    let (full, _) = pictures(&["--plain"], 1)?;
    for (index, px) in thresholds.iter().enumerate() {
        let (of_plugin, summary) = pictures(&["--error-px", &px.to_string()], 1)?;
        let mean = |name: &str| summary[name]["mean"].as_f64().unwrap_or(f64::NAN);
        if index == 0 {
            print("full detail", &full, mean("triangles_full"));
        }
        print(
            &format!("plugin, {px} px"),
            &of_plugin,
            mean("triangles_drawn"),
        );
    }
    Ok(())
}

/// The pictures of the path as means over squares of `scale` × `scale` pixels, and the summary.
fn pictures(options: &[&str], scale: u32) -> Result<(Vec<Linear>, serde_json::Value), String> {
    let folder = tempfile::tempdir().map_err(|error| error.to_string())?;
    let UVec2 { x, y } = SIZE_PX * scale;
    let size = format!("{x}x{y}");
    let frames = PICTURES.to_string();
    let options = [options, &["--size", &size, "--frames", &frames]].concat();
    let summary = walkthrough::draw(folder.path(), &options)?;
    let picture = |number: usize| {
        let file = folder.path().join(format!("frame_{number:03}.png"));
        let picture = image::open(&file);
        let picture = picture.map_err(|error| format!("{}: {error}", file.display()))?;
        Ok(Linear::of(&picture.to_rgba8(), scale))
    };
    let pictures: Result<Vec<Linear>, String> = (0..PICTURES).map(picture).collect();
    Ok((pictures?, summary))
}
