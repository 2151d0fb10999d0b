//! Pictures compared with the truth: full detail with 64 samples per pixel, each with its own shading and alpha test.

use bevy::prelude::Transform;
use fieldlod_lab::measure::flip_mean;
use fieldlod_lab::render::Picture;
use fieldlod_tests::scenes::SceneApp;
use glam::{UVec2, Vec3};
use image::RgbaImage;

/// Width and height of the target of the truth over those of the pictures. It has four samples per pixel.
pub(crate) const SUPERSAMPLED: u32 = 4;
/// Side of the squares over which bias is measured, in pixels.
const BLOCK: u32 = 4;

/// A picture in linear light.
#[derive(Clone)]
pub(crate) struct Linear {
    width: u32,
    pixels: Vec<Vec3>,
}

impl Linear {
    /// The means over squares of `side` × `side` pixels.
    pub(crate) fn of(picture: &RgbaImage, side: u32) -> Self {
        let channel = |byte: u8| linear_of(f32::from(byte) / 255.0);
        let table: Vec<f32> = (0..=255).map(channel).collect();
        let pixels = picture.pixels().map(|pixel| {
            let [red, green, blue, _] = pixel.0.map(|byte| table[usize::from(byte)]);
            Vec3::new(red, green, blue)
        });
        let whole = Self {
            width: picture.width(),
            pixels: pixels.collect(),
        };
        whole.means(side)
    }

    fn means(&self, side: u32) -> Self {
        let (width, height) = (self.width, self.pixels.len() as u32 / self.width);
        let small = [width / side, height / side];
        let mut pixels = vec![Vec3::ZERO; (small[0] * small[1]) as usize];
        for y in 0..small[1] * side {
            for x in 0..small[0] * side {
                let mean = &mut pixels[(y / side * small[0] + x / side) as usize];
                *mean += self.pixels[(y * width + x) as usize] / (side * side) as f32;
            }
        }
        Self {
            width: small[0],
            pixels,
        }
    }

    fn encoded(&self) -> impl Iterator<Item = Vec3> {
        self.pixels.iter().map(|pixel| pixel.map(encoded_of))
    }

    /// The picture as 8-bit colours.
    pub(crate) fn to_image(&self) -> RgbaImage {
        let bytes = self.encoded().flat_map(|pixel| {
            let [red, green, blue] = (pixel * 255.0).round().to_array().map(|value| value as u8);
            [red, green, blue, 255]
        });
        let height = self.pixels.len() as u32 / self.width;
        RgbaImage::from_raw(self.width, height, bytes.collect()).expect("one colour per pixel")
    }

    fn to_picture(&self) -> Picture {
        let height = self.pixels.len() as u32 / self.width;
        Picture {
            size_px: UVec2::new(self.width, height),
            colors: self
                .encoded()
                .map(|pixel| (pixel * 255.0).to_array())
                .collect(),
            covered: Vec::new(),
        }
    }
}

fn linear_of(encoded: f32) -> f32 {
    if encoded <= 0.04045 {
        encoded / 12.92
    } else {
        ((encoded + 0.055) / 1.055).powf(2.4)
    }
}

fn encoded_of(linear: f32) -> f32 {
    if linear <= 0.003_130_8 {
        12.92 * linear
    } else {
        1.055 * linear.powf(1.0 / 2.4) - 0.055
    }
}

/// Pictures from poses, as means over squares of `scale` × `scale` pixels, and the triangles of the first.
pub(crate) fn pictures(app: &mut SceneApp, poses: &[Transform], scale: u32) -> (Vec<Linear>, u64) {
    let pictures = poses.iter().map(|&pose| app.picture_and_triangles(pose));
    let (pictures, triangles): (Vec<Linear>, Vec<u64>) = pictures
        .map(|(picture, triangles)| (Linear::of(&picture, scale), triangles))
        .unzip();
    (pictures, triangles[0])
}

/// The errors of a sequence of pictures from the truth.
#[derive(Clone, Copy)]
pub(crate) struct Errors {
    /// Root mean square, of 255.
    pub(crate) rmse: f64,
    /// The same after means over squares of 4 × 4 pixels.
    pub(crate) bias: f64,
    /// FLIP of the first picture, from 0 to 1.
    pub(crate) flip: f64,
    /// The standard deviation of the error over the sequence: a root mean square over pixels, of 255.
    pub(crate) flicker: f64,
}

impl Errors {
    /// The errors of pictures of the same poses as `truth`.
    pub(crate) fn of(pictures: &[Linear], truth: &[Linear]) -> Self {
        Self {
            rmse: rmse(pictures, truth),
            bias: bias(pictures, truth),
            flip: flip_mean(&truth[0].to_picture(), &pictures[0].to_picture()),
            flicker: flicker(pictures, truth),
        }
    }
}

fn root_mean(squares: impl Iterator<Item = Vec3>) -> f64 {
    let (mut sum, mut count) = (0.0, 0.0f64);
    for square in squares {
        sum += f64::from(square.element_sum());
        count += 3.0;
    }
    255.0 * (sum / count).sqrt()
}

/// Root mean square of the difference, of 255.
pub(crate) fn rmse(pictures: &[Linear], truth: &[Linear]) -> f64 {
    let pairs = pictures.iter().zip(truth);
    root_mean(pairs.flat_map(|(picture, truth)| {
        let pixels = picture.encoded().zip(truth.encoded());
        pixels.map(|(a, b)| (a - b) * (a - b))
    }))
}

/// The same after means over squares of 4 × 4 pixels.
pub(crate) fn bias(pictures: &[Linear], truth: &[Linear]) -> f64 {
    let [pictures, truth] = [pictures, truth].map(|pictures| -> Vec<Linear> {
        let means = pictures.iter().map(|picture| picture.means(BLOCK));
        means.collect()
    });
    rmse(&pictures, &truth)
}

fn flicker(pictures: &[Linear], truth: &[Linear]) -> f64 {
    let mut sums = vec![(Vec3::ZERO, Vec3::ZERO); truth[0].pixels.len()];
    for (picture, truth) in pictures.iter().zip(truth) {
        for (sum, (a, b)) in sums.iter_mut().zip(picture.encoded().zip(truth.encoded())) {
            *sum = (sum.0 + (a - b), sum.1 + (a - b) * (a - b));
        }
    }
    let count = pictures.len() as f32;
    let variance = |(sum, squares): (Vec3, Vec3)| (squares - sum * sum / count) / count;
    root_mean(
        sums.into_iter()
            .map(variance)
            .map(|variance| variance.max(Vec3::ZERO)),
    )
}
