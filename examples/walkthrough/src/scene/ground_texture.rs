//! The texture painted on the terrain, with its mipmaps.

use bevy::asset::RenderAssetUsages;
use bevy::image::{ImageSampler, ImageSamplerDescriptor};
use bevy::prelude::*;
use bevy::render::render_resource::TextureFormat;

use crate::shapes::terrain;

/// Texels along a side. A texel covers about 4 cm across the avenue, and 23 cm on average. Twice as many texels along a side
/// take four times the memory and time.
const SIDE_IN_TEXELS: u32 = 2048;

/// Paints the ground on all cores. `anisotropy` is the `anisotropy_clamp` of the sampler.
pub(crate) fn paint(anisotropy: u16) -> Image {
    let side = SIDE_IN_TEXELS as usize;
    let slopes = terrain::Slopes::new();
    let mut texels = vec![Vec3::ZERO; side * side];
    let threads = std::thread::available_parallelism().map_or(1, usize::from);
    let rows_per_thread = side.div_ceil(threads);
    std::thread::scope(|scope| {
        let bands = texels.chunks_mut(rows_per_thread * side);
        for (band, rows) in bands.enumerate() {
            let (slopes, first_row) = (&slopes, band * rows_per_thread);
            scope.spawn(move || {
                for (index, texel) in rows.iter_mut().enumerate() {
                    let row = first_row + index / side;
                    let at = Vec2::new((index % side) as f32, row as f32) + 0.5;
                    let p = terrain::point_at(at / side as f32);
                    *texel = terrain::color(p, slopes.at(p));
                }
            });
        }
    });
    image(texels, anisotropy)
}

fn image(mut texels: Vec<Vec3>, anisotropy: u16) -> Image {
    // The data holds all mipmaps in order, down to a single texel.
    let mut data = Vec::with_capacity(texels.len() * 4 * 4 / 3);
    let mut side = SIDE_IN_TEXELS as usize;
    data.extend(texels.iter().flat_map(|texel| to_srgb(*texel)));
    while side > 1 {
        texels = halve(&texels, side);
        side /= 2;
        data.extend(texels.iter().flat_map(|texel| to_srgb(*texel)));
    }

    let mut image = Image {
        data: Some(data),
        asset_usage: RenderAssetUsages::RENDER_WORLD,
        sampler: ImageSampler::Descriptor(ImageSamplerDescriptor {
            // The ground is seen at grazing angles, where trilinear filtering alone blurs.
            anisotropy_clamp: anisotropy,
            ..ImageSamplerDescriptor::linear()
        }),
        ..Image::default()
    };
    let descriptor = &mut image.texture_descriptor;
    descriptor.size.width = SIDE_IN_TEXELS;
    descriptor.size.height = SIDE_IN_TEXELS;
    descriptor.format = TextureFormat::Rgba8UnormSrgb;
    descriptor.mip_level_count = SIDE_IN_TEXELS.ilog2() + 1;
    image
}

/// The next mipmap: each texel is the mean of two by two texels.
fn halve(texels: &[Vec3], side: usize) -> Vec<Vec3> {
    let half = side / 2;
    let mean = |index: usize| {
        let corner = index / half * 2 * side + index % half * 2;
        (texels[corner] + texels[corner + 1] + texels[corner + side] + texels[corner + side + 1])
            * 0.25
    };
    (0..half * half).map(mean).collect()
}

fn to_srgb(linear: Vec3) -> [u8; 4] {
    Srgba::from(LinearRgba::rgb(linear.x, linear.y, linear.z)).to_u8_array()
}
