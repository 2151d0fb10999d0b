//! Surfaces of materials.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

use glam::{Affine2, DVec2, Vec4};
use gltf::json::serialize::to_value;
use gltf::material::AlphaMode;
use gltf::{Document, Material};
use rayon::prelude::*;

use super::ReadBeside;
use super::buffers::Buffers;
use super::images::{self, UnreadImage};
use crate::mesh::surface::{Surface, SurfaceAlpha, TextureMapping};

/// The default alpha cutoff of glTF.
const CUTOFF: f32 = 0.5;

/// Images that are decoded at the same time. Each takes up to a quarter of a gigabyte.
const IMAGES_AT_ONCE: usize = 4;

/// The index of a material, its surface without the texture, and the mapping of the texture.
type Textured = (usize, Surface, TextureMapping);

/// The materials of a file, and the sources of their images.
pub(super) struct Materials<'a> {
    pub(super) document: &'a Document,
    pub(super) buffers: &'a Buffers,
    pub(super) beside: &'a ReadBeside<'a>,
}

impl Materials<'_> {
    /// The surfaces of the `used` materials by their indices, and the images that could not be read. Materials without
    /// an entry are unknown.
    pub(super) fn surfaces(
        &self,
        used: &BTreeSet<usize>,
    ) -> (BTreeMap<usize, Arc<Surface>>, Vec<UnreadImage>) {
        let (mut surfaces, mut unread) = (BTreeMap::new(), Vec::new());
        // An image of several materials is decoded once.
        let mut with_image: BTreeMap<usize, Vec<Textured>> = BTreeMap::new();
        for &index in used {
            match self.look(index) {
                Some((plain, None)) => _ = surfaces.insert(index, Arc::new(plain)),
                Some((plain, Some((image, mapping)))) => {
                    let textured = (index, plain, mapping);
                    with_image.entry(image).or_default().push(textured);
                }
                None => {}
            }
        }
        let with_image: Vec<(usize, Vec<Textured>)> = with_image.into_iter().collect();
        let mut read = Vec::new();
        // Surfaces keep a small copy of the texture, so only the images of one chunk are in memory at full size.
        for few in with_image.chunks(IMAGES_AT_ONCE) {
            let few = few.par_iter();
            read.par_extend(few.map(|(image, textured)| self.of_image(*image, textured)));
        }
        for textured in read {
            match textured {
                Ok(textured) => surfaces.extend(textured),
                Err(image) => unread.push(image),
            }
        }
        (surfaces, unread)
    }

    /// A material without its texture, and the image of the texture. `None` if the mapping is not supported.
    fn look(&self, index: usize) -> Option<(Surface, Option<(usize, TextureMapping)>)> {
        let material = self.document.materials().nth(index)?;
        let pbr = material.pbr_metallic_roughness();
        let plain = Surface::new(Vec4::from(pbr.base_color_factor()), alpha_of(&material));
        let Some(texture) = pbr.base_color_texture() else {
            return Some((plain, None));
        };
        let mapping = self.mapping(index, texture.tex_coord())?;
        // `Texture::source` depends on features of the gltf crate, which other crates may enable.
        let texture = &self.document.as_json().textures[texture.texture().index()];
        Some((plain, Some((texture.source.value(), mapping))))
    }

    /// The surfaces of materials with the same image.
    fn of_image(
        &self,
        image: usize,
        textured: &[Textured],
    ) -> Result<Vec<(usize, Arc<Surface>)>, UnreadImage> {
        let pixels = images::read(self.document, image, self.buffers, self.beside)?;
        let textured = textured.iter().map(|(index, plain, mapping)| {
            let plain = plain.clone();
            let surface = plain.with_texture(pixels.size, *mapping, |x, y| pixels.texel(x, y));
            (*index, Arc::new(surface))
        });
        Ok(textured.collect())
    }

    /// The mapping of the base colour, with `KHR_texture_transform`. `None` for texture coordinates beyond the second
    /// set.
    fn mapping(&self, material: usize, uv_set: u32) -> Option<TextureMapping> {
        // Read the JSON, because support by the gltf crate depends on its features.
        let json = self.document.as_json().materials.get(material)?;
        let json = to_value(&json.pbr_metallic_roughness).ok()?;
        let transform = json.pointer("/baseColorTexture/extensions/KHR_texture_transform");
        let number = |path: &str| transform?.pointer(path)?.as_f64();
        let vector = |name: &str, other: f64| {
            let part = |index| number(&format!("/{name}/{index}")).unwrap_or(other);
            DVec2::new(part(0), part(1)).as_vec2()
        };
        let (sin, cos) = number("/rotation").unwrap_or(0.0).sin_cos();
        let (scale, offset) = (vector("scale", 1.0), vector("offset", 0.0));
        let uv_set = number("/texCoord").map_or(uv_set, |set| set as u32);
        // The same direction of rotation as in Bevy.
        let (across, down) = (DVec2::new(cos, -sin), DVec2::new(sin, cos));
        (uv_set < 2).then(|| TextureMapping {
            uses_uvs_1: uv_set == 1,
            transform: Affine2::from_cols(
                across.as_vec2() * scale.x,
                down.as_vec2() * scale.y,
                offset,
            ),
        })
    }
}

fn alpha_of(material: &Material<'_>) -> SurfaceAlpha {
    match material.alpha_mode() {
        AlphaMode::Opaque => SurfaceAlpha::Opaque,
        AlphaMode::Mask => SurfaceAlpha::Mask {
            cutoff: material.alpha_cutoff().unwrap_or(CUTOFF),
        },
        AlphaMode::Blend => SurfaceAlpha::Blend,
    }
}
