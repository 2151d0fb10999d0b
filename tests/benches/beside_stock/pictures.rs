//! Errors of pictures, as the lab and the bench `truth` measure them.

use std::path::{Path, PathBuf};

use fieldlod_lab::measure::image_error;
use fieldlod_lab::render::{Picture, SUPERSAMPLING};
use image::{Rgba, RgbaImage};

use crate::By;
use crate::measure::{Linear, SUPERSAMPLED, rmse};

/// The file of a picture.
pub(crate) fn path(folder: &Path, scene: &str, radii: f32, by: By) -> PathBuf {
    let by = format!("{by:?}").to_lowercase();
    folder.join(format!("{scene}-{radii}-{by}.png"))
}

/// Errors of pictures, RMSE of 255.
#[derive(Default)]
pub(crate) struct Errors {
    /// Of the plugin, from stock Bevy, over the pixels that show a surface.
    pub(crate) rmse: f64,
    /// Mean FLIP, likewise.
    pub(crate) flip: f64,
    /// Of stock Bevy, from the truth, over the picture.
    pub(crate) stock: f64,
    /// Of the plugin, from the truth, over the picture.
    pub(crate) plugin: f64,
}

/// The errors at a pose; zeros without pictures.
pub(crate) fn compare(folder: &Path, scene: &str, radii: f32) -> Errors {
    let read = |by| image::open(path(folder, scene, radii, by));
    let (Ok(truth), Ok(stock), Ok(plugin)) = (read(By::Truth), read(By::Stock), read(By::Plugin))
    else {
        return Errors::default();
    };
    let [truth, stock, plugin] = [truth, stock, plugin].map(image::DynamicImage::into_rgba8);
    let linear_truth = [Linear::of(&truth, SUPERSAMPLED)];
    let from_truth = |picture| rmse(&[Linear::of(picture, 1)], &linear_truth);
    let error = image_error(&lab_picture(&stock), &lab_picture(&plugin), true);
    Errors {
        rmse: error.rmse,
        flip: error.flip.unwrap_or(0.0),
        stock: from_truth(&stock),
        plugin: from_truth(&plugin),
    }
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
