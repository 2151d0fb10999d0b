//! Levels of cards: their pictures as textures, and cards as meshes.

use std::ops::Range;
use std::sync::OnceLock;

use bevy::asset::{AssetId, Assets, Handle, RenderAssetUsages};
use bevy::image::{Image, ImageAddressMode, ImageFilterMode, ImageSampler, ImageSamplerDescriptor};
use bevy::math::Vec3;
use bevy::mesh::{Indices, Mesh, PrimitiveTopology};
use bevy::render::render_resource::{Extent3d, TextureDimension, TextureFormat};
use fieldlod_hierarchy::{Card, CardPicture, Cards};

/// The levels of a mesh that are cards.
#[derive(Debug)]
pub(crate) struct CardLevels {
    /// The finest of them; all coarser levels are cards, too.
    first_level: u32,
    /// For each of them the piece of triangles that is drawn in its place while cards cannot be.
    stand_ins: Vec<u32>,
    pub(crate) colors: Handle<Image>,
    pub(crate) normals: Handle<Image>,
    /// Whether normals are turned over at the backs of cards.
    pub(crate) turns_over: bool,
    pub(crate) tint: Vec3,
    /// The texture that the colours come from; while that is not known, as of pictures from a file, that of the first
    /// material that they are to stand for.
    pub(crate) texture: OnceLock<Option<AssetId<Image>>>,
}

impl CardLevels {
    pub(crate) fn levels(&self) -> Range<u32> {
        self.first_level..self.first_level + self.stand_ins.len() as u32
    }

    /// The piece that stands in for a level; `None` if that is none of cards.
    pub(crate) fn stand_in(&self, level: u32) -> Option<u32> {
        let index = level.checked_sub(self.first_level)?;
        self.stand_ins.get(index as usize).copied()
    }
}

/// The levels of a mesh that are cards, whose textures are not among the assets yet.
pub(crate) struct PreparedPicture {
    first_level: u32,
    stand_ins: Vec<u32>,
    colors: Image,
    normals: Image,
    turns_over: bool,
    tint: Vec3,
    texture: OnceLock<Option<AssetId<Image>>>,
}

impl PreparedPicture {
    /// Of a mesh whose levels from `first_level` on are cards, for each of which one of the pieces `stand_ins` stands in.
    /// They were baked with the texture `texture`, if that is known.
    pub(crate) fn of(
        cards: &Cards,
        first_level: u32,
        stand_ins: Vec<u32>,
        texture: Option<Option<AssetId<Image>>>,
    ) -> Self {
        let mips = cards.picture.mips();
        let colors = mips.iter().flat_map(|mip| mip.colors.as_flattened());
        let normals = mips.iter().flat_map(|mip| &mip.normals);
        let normals = normals.flat_map(|&[x, y, z]| [x, y, z, u8::MAX]);
        Self {
            first_level,
            stand_ins,
            colors: image(
                &mips,
                colors.copied().collect(),
                TextureFormat::Rgba8UnormSrgb,
            ),
            normals: image(&mips, normals.collect(), TextureFormat::Rgba8Unorm),
            turns_over: cards.picture.turns_over,
            tint: cards.picture.tint,
            texture: texture.map(OnceLock::from).unwrap_or_default(),
        }
    }

    pub(crate) fn add_to(self, images: &mut Assets<Image>) -> CardLevels {
        CardLevels {
            first_level: self.first_level,
            stand_ins: self.stand_ins,
            colors: images.add(self.colors),
            normals: images.add(self.normals),
            turns_over: self.turns_over,
            tint: self.tint,
            texture: self.texture,
        }
    }
}

/// A texture of all sizes.
fn image(mips: &[CardPicture], bytes: Vec<u8>, format: TextureFormat) -> Image {
    let side = mips.first().map_or(1, |mip| mip.side_texels);
    let size = Extent3d {
        width: side,
        height: side,
        depth_or_array_layers: 1,
    };
    // The renderer may lose its device, and ask for it again.
    let usage = RenderAssetUsages::default();
    let mut image = Image::new_uninit(size, TextureDimension::D2, format, usage);
    image.texture_descriptor.mip_level_count = mips.len() as u32;
    image.data = Some(bytes);
    image.sampler = ImageSampler::Descriptor(ImageSamplerDescriptor {
        address_mode_u: ImageAddressMode::ClampToEdge,
        address_mode_v: ImageAddressMode::ClampToEdge,
        mag_filter: ImageFilterMode::Linear,
        min_filter: ImageFilterMode::Linear,
        mipmap_filter: ImageFilterMode::Linear,
        ..ImageSamplerDescriptor::default()
    });
    image
}

/// Two triangles for each card.
pub(crate) fn card_mesh(cards: &[Card], side_texels: u32, usage: RenderAssetUsages) -> Mesh {
    let corners = |values: fn(&Card, u32) -> [Vec3; 4]| -> Vec<Vec3> {
        let all = cards.iter().flat_map(|card| values(card, side_texels));
        all.collect()
    };
    let tangents = cards
        .iter()
        .flat_map(|card| [card.axes()[0].extend(1.0).to_array(); 4]);
    let uvs = cards.iter().flat_map(|card| card.uvs(side_texels));
    let first = (0..cards.len() as u16).map(|card| 4 * card);
    let indices = first.flat_map(|a| [a, a + 1, a + 2, a, a + 2, a + 3]);
    Mesh::new(PrimitiveTopology::TriangleList, usage)
        .with_inserted_attribute(Mesh::ATTRIBUTE_POSITION, corners(|card, _| card.corners()))
        .with_inserted_attribute(
            Mesh::ATTRIBUTE_NORMAL,
            corners(|card, _| [card.axes()[2]; 4]),
        )
        .with_inserted_attribute(Mesh::ATTRIBUTE_UV_0, uvs.collect::<Vec<_>>())
        .with_inserted_attribute(Mesh::ATTRIBUTE_TANGENT, tangents.collect::<Vec<_>>())
        .with_inserted_indices(Indices::U16(indices.collect()))
}
