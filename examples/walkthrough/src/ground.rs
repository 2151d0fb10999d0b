//! The picture painted on the terrain, with its mipmaps.

use bevy::asset::RenderAssetUsages;
use bevy::image::{Image, ImageAddressMode, ImageFilterMode, ImageSampler, ImageSamplerDescriptor};
use bevy::render::render_resource::{Extent3d, TextureDimension, TextureFormat};
use glam::{Vec2, Vec3};

use crate::shapes::terrain;

/// Texels along a side: one for every 3 cm across the avenue, for every 20 cm in the hills.
const SIDE_IN_TEXELS: usize = 2048;

/// Paints the ground, on all cores.
pub(crate) fn paint() -> Image {
    let slopes = terrain::Slopes::new();
    let mut texels = vec![Vec3::ZERO; SIDE_IN_TEXELS * SIDE_IN_TEXELS];
    let threads = std::thread::available_parallelism().map_or(1, usize::from);
    let rows_per_thread = SIDE_IN_TEXELS.div_ceil(threads);
    std::thread::scope(|scope| {
        let bands = texels.chunks_mut(rows_per_thread * SIDE_IN_TEXELS);
        for (band, rows) in bands.enumerate() {
            let (slopes, first_row) = (&slopes, band * rows_per_thread);
            scope.spawn(move || {
                for (index, texel) in rows.iter_mut().enumerate() {
                    let row = first_row + index / SIDE_IN_TEXELS;
                    let at = Vec2::new((index % SIDE_IN_TEXELS) as f32, row as f32) + 0.5;
                    let p = terrain::point_at(at / SIDE_IN_TEXELS as f32);
                    *texel = terrain::color(p, slopes.at(p));
                }
            });
        }
    });
    image(texels)
}

fn image(mut texels: Vec<Vec3>) -> Image {
    let mut data = Vec::with_capacity(texels.len() * 4 * 4 / 3);
    let mut side = SIDE_IN_TEXELS;
    let mut levels = 0;
    loop {
        data.extend(texels.iter().flat_map(|texel| to_srgb(*texel)));
        levels += 1;
        if side == 1 {
            break;
        }
        texels = halve(&texels, side);
        side /= 2;
    }
    let mut image = Image {
        data: Some(data),
        ..Image::default()
    };
    image.texture_descriptor.size = Extent3d {
        width: SIDE_IN_TEXELS as u32,
        height: SIDE_IN_TEXELS as u32,
        depth_or_array_layers: 1,
    };
    image.texture_descriptor.dimension = TextureDimension::D2;
    image.texture_descriptor.format = TextureFormat::Rgba8UnormSrgb;
    image.texture_descriptor.mip_level_count = levels;
    image.asset_usage = RenderAssetUsages::RENDER_WORLD;
    image.sampler = ImageSampler::Descriptor(ImageSamplerDescriptor {
        address_mode_u: ImageAddressMode::ClampToEdge,
        address_mode_v: ImageAddressMode::ClampToEdge,
        mag_filter: ImageFilterMode::Linear,
        min_filter: ImageFilterMode::Linear,
        mipmap_filter: ImageFilterMode::Linear,
        anisotropy_clamp: 4,
        ..ImageSamplerDescriptor::default()
    });
    image
}

/// Takes the anisotropic filter away. Mesa's software adapter walks all texels under a pixel one by one,
/// however far it stretches, and where a large triangle meets the horizon it seems to hang.
pub(crate) fn filter_evenly(image: &mut Image) {
    if let ImageSampler::Descriptor(sampler) = &mut image.sampler {
        sampler.anisotropy_clamp = 1;
    }
}

/// The next mipmap: means of two by two texels.
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
    let encode = |value: f32| {
        let value = value.clamp(0.0, 1.0);
        let encoded = if value <= 0.003_130_8 {
            value * 12.92
        } else {
            1.055 * value.powf(1.0 / 2.4) - 0.055
        };
        (encoded * 255.0).round() as u8
    };
    [encode(linear.x), encode(linear.y), encode(linear.z), 255]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_mipmap_keeps_the_mean() {
        let texels: Vec<_> = (0..16).map(|i| Vec3::splat(i as f32)).collect();
        let half = halve(&texels, 4);
        assert_eq!(half[0], Vec3::splat((0.0 + 1.0 + 4.0 + 5.0) / 4.0));
        assert_eq!(halve(&half, 2), vec![Vec3::splat(7.5)]);
    }

    #[test]
    fn srgb_ends_at_black_and_white() {
        assert_eq!(to_srgb(Vec3::ZERO), [0, 0, 0, 255]);
        assert_eq!(to_srgb(Vec3::ONE), [255; 4]);
    }
}
