//! Materials of primitives as surfaces.

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

/// The cutoff of a mask that has none of its own.
const CUTOFF: f32 = 0.5;

/// Images that are decoded at the same time, each of a quarter of a gigabyte at most.
const IMAGES_AT_ONCE: usize = 4;

/// The index of a material, what it looks like without its texture, and where that lies.
type Textured = (usize, Surface, TextureMapping);

/// The materials of a file, and where their images are found.
pub(super) struct Materials<'a> {
    pub(super) document: &'a Document,
    pub(super) buffers: &'a Buffers,
    pub(super) beside: &'a ReadBeside<'a>,
}

impl Materials<'_> {
    /// The surfaces of those materials that are `used`, by the index of each, and the images that cannot be read.
    /// Materials without an entry are unknown.
    pub(super) fn surfaces(
        &self,
        used: &BTreeSet<usize>,
    ) -> (BTreeMap<usize, Arc<Surface>>, Vec<UnreadImage>) {
        let (mut surfaces, mut unread) = (BTreeMap::new(), Vec::new());
        // An image that several have is decoded once.
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

    /// A material without its texture, and the image of that; `None` for one that a bake cannot follow.
    fn look(&self, index: usize) -> Option<(Surface, Option<(usize, TextureMapping)>)> {
        let material = self.document.materials().nth(index)?;
        let pbr = material.pbr_metallic_roughness();
        let plain = Surface::new(Vec4::from(pbr.base_color_factor()), alpha_of(&material));
        let Some(texture) = pbr.base_color_texture() else {
            return Some((plain, None));
        };
        let mapping = self.mapping(index, texture.tex_coord())?;
        // Not the texture's own way to its image: that depends on features that other crates may turn on.
        let texture = &self.document.as_json().textures[texture.texture().index()];
        Some((plain, Some((texture.source.value(), mapping))))
    }

    /// The surfaces of materials that have one image.
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

    /// Where the base colour lies, as told by `KHR_texture_transform` if that is there; `None` if by texture
    /// coordinates beyond the second.
    fn mapping(&self, material: usize, uv_set: u32) -> Option<TextureMapping> {
        // By its JSON, whichever extensions the gltf crate knows.
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
        // As Bevy turns it.
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
