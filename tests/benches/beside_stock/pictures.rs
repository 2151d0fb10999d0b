//! Errors of pictures, as the lab measures them.

use std::path::{Path, PathBuf};

use fieldlod_lab::measure::image_error;
use fieldlod_lab::render::{Picture, SUPERSAMPLING};
use image::{Rgba, RgbaImage};

/// The file of a picture.
pub(crate) fn path(folder: &Path, scene: &str, radii: f32, has_plugin: bool) -> PathBuf {
    let by = if has_plugin { "plugin" } else { "stock" };
    folder.join(format!("{scene}-{radii}-{by}.png"))
}

/// RMSE and mean FLIP of the plugin's picture against that of stock Bevy; zeros without pictures.
pub(crate) fn compare(folder: &Path, scene: &str, radii: f32) -> (f64, f64) {
    let read = |has_plugin| image::open(path(folder, scene, radii, has_plugin));
    let (Ok(stock), Ok(plugin)) = (read(false), read(true)) else {
        return (0.0, 0.0);
    };
    let [stock, plugin] = [stock, plugin].map(|picture| lab_picture(&picture.into_rgba8()));
    let error = image_error(&stock, &plugin, true);
    (error.rmse, error.flip.unwrap_or(0.0))
}

/// Pixels with another colour than the corner show a surface.
fn lab_picture(picture: &RgbaImage) -> Picture {
    let background = *picture.get_pixel(0, 0);
    let (width, height) = picture.dimensions();
    let color = |&Rgba([red, green, blue, _]): &Rgba<u8>| [red, green, blue].map(f32::from);
    let texels =
        (0..height * SUPERSAMPLING).flat_map(|y| (0..width * SUPERSAMPLING).map(move |x| (x, y)));
    let pixel = |(x, y): (u32, u32)| picture.get_pixel(x / SUPERSAMPLING, y / SUPERSAMPLING);
    Picture {
        size_px: glam::UVec2::new(width, height),
        colors: picture.pixels().map(color).collect(),
        covered: texels.map(|texel| *pixel(texel) != background).collect(),
    }
}
