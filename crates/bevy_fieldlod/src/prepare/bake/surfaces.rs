//! The surfaces of materials, for bakes.

use std::sync::Arc;

use bevy::asset::{AssetId, AssetServer, Assets, RenderAssetUsages};
use bevy::color::ColorToComponents;
use bevy::ecs::system::SystemParam;
use bevy::image::Image;
use bevy::material::AlphaMode;
use bevy::math::{UVec2, Vec4};
use bevy::mesh::UvChannel;
use bevy::pbr::StandardMaterial;
use bevy::platform::collections::HashMap;
use bevy::prelude::Res;
use bevy::render::render_resource::{TextureDimension, TextureFormat};
use fieldlod_bake::{Surface, SurfaceAlpha, TextureMapping};

use crate::prepare::lookup::NotStarted;

/// Caches the surfaces of materials while meshes are being prepared.
#[derive(Default)]
pub(in crate::prepare) struct Surfaces(HashMap<AssetId<StandardMaterial>, Option<Arc<Surface>>>);

/// The materials and images of the app, if it has any.
#[derive(SystemParam)]
pub(in crate::prepare) struct Materials<'w> {
    materials: Option<Res<'w, Assets<StandardMaterial>>>,
    images: Option<Res<'w, Assets<Image>>>,
}

impl Surfaces {
    /// The surface of a material; `None` if it is unknown.
    pub(in crate::prepare) fn find(
        &mut self,
        material: AssetId<StandardMaterial>,
        materials: &Materials<'_>,
        assets: &AssetServer,
    ) -> Result<Option<Arc<Surface>>, NotStarted> {
        if let Some(surface) = self.0.get(&material) {
            return Ok(surface.clone());
        }
        let surface = materials.surface(material, assets)?.map(Arc::new);
        self.0.insert(material, surface.clone());
        Ok(surface)
    }
}

impl Materials<'_> {
    fn surface(
        &self,
        id: AssetId<StandardMaterial>,
        assets: &AssetServer,
    ) -> Result<Option<Surface>, NotStarted> {
        let material = self.materials.as_ref().and_then(|all| all.get(id));
        let Some(material) = material else {
            return unless_loading(assets.load_state(id).is_loading());
        };
        let Some(alpha) = alpha_of(material.alpha_mode) else {
            return Ok(None);
        };
        let color = Vec4::from_array(material.base_color.to_linear().to_f32_array());
        let plain = Surface::new(color, alpha);
        let Some(texture) = &material.base_color_texture else {
            return Ok(Some(plain));
        };
        let Some(image) = self.images.as_ref().and_then(|all| all.get(texture)) else {
            return unless_loading(assets.load_state(texture).is_loading());
        };
        let mapping = TextureMapping {
            uses_uvs_1: material.base_color_channel == UvChannel::Uv1,
            transform: material.uv_transform,
        };
        Ok(with_image(plain, mapping, image))
    }
}

/// No surface, or an error while an asset is being loaded.
fn unless_loading(is_loading: bool) -> Result<Option<Surface>, NotStarted> {
    if is_loading {
        Err(NotStarted::NotYet)
    } else {
        Ok(None)
    }
}

/// The alpha mode of a surface; `None` for additive and multiplicative blending, which cover nothing.
fn alpha_of(mode: AlphaMode) -> Option<SurfaceAlpha> {
    match mode {
        AlphaMode::Opaque => Some(SurfaceAlpha::Opaque),
        AlphaMode::Mask(cutoff) => Some(SurfaceAlpha::Mask { cutoff }),
        AlphaMode::Blend | AlphaMode::Premultiplied | AlphaMode::AlphaToCoverage => {
            Some(SurfaceAlpha::Blend)
        }
        AlphaMode::Add | AlphaMode::Multiply => None,
    }
}

/// The surface with a texture; `None` unless the image has two dimensions, is in main memory, and has four bytes per
/// texel.
fn with_image(plain: Surface, mapping: TextureMapping, image: &Image) -> Option<Surface> {
    // Without this usage, the data is present only until the renderer takes it, and the result would depend on timing.
    if !image.asset_usage.contains(RenderAssetUsages::MAIN_WORLD)
        || image.texture_descriptor.dimension != TextureDimension::D2
    {
        return None;
    }
    use TextureFormat::{Bgra8Unorm, Bgra8UnormSrgb, Rgba8Unorm, Rgba8UnormSrgb};
    let is_bgra = match image.texture_descriptor.format {
        Rgba8UnormSrgb | Rgba8Unorm => false,
        Bgra8UnormSrgb | Bgra8Unorm => true,
        _ => return None,
    };
    let (texels, _) = image.data.as_ref()?.as_chunks::<4>();
    let size = UVec2::new(image.width(), image.height());
    let width = size.x as usize;
    // The data of smaller mip levels follows.
    let texels = texels.get(..width * size.y as usize)?;
    let texel = |x: u32, y: u32| {
        let [first, green, third, alpha] = texels[y as usize * width + x as usize];
        if is_bgra {
            [third, green, first, alpha]
        } else {
            [first, green, third, alpha]
        }
    };
    Some(plain.with_texture(size, mapping, texel))
}
