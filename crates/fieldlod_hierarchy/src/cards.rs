//! Cards: levels below the mesh, rectangles with pictures of what they stand for.

mod mips;

use std::sync::Arc;

use bytemuck::{Pod, Zeroable};
use glam::{Vec3, Vec4};

use crate::srgb::{linear_of, srgb_of};

/// Levels of cards of a mesh, and their pictures.
///
/// What [whole meshes](crate::Hierarchy::whole_mesh_levels) are made of them ends with those that it draws. Before that, no
/// unit is one.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Cards {
    /// Finest first, with errors that grow and fewer cards each.
    pub levels: Vec<CardLevel>,
    /// The pictures of all levels.
    pub picture: Arc<CardPicture>,
}

/// The whole mesh as cards.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct CardLevel {
    /// Its error in local units, as pictures of it look; see
    /// [`Group::whole_mesh_error_in_local`](crate::Group::whole_mesh_error_in_local).
    pub error_in_local: f32,
    /// What is drawn.
    pub cards: Vec<Card>,
}

/// A rectangle in local space that shows a part of the picture. Seen from its back, it shows the same, with
/// normals as [`CardPicture::turns_over`] says.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct Card {
    /// The corner at its first texel.
    pub corner: Vec3,
    /// The edge along the rows of texels.
    pub across: Vec3,
    /// The edge along the columns, at right angles to that.
    pub down: Vec3,
    /// Its first texel: column and row.
    pub first_texel: [u16; 2],
    /// Texels along both edges.
    pub size_texels: [u16; 2],
}

/// A square picture of what cards stand for.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct CardPicture {
    /// Texels along each side: a power of two, [`MOST_SIDE_TEXELS`](Self::MOST_SIDE_TEXELS) at most.
    pub side_texels: u32,
    /// By rows: red, green and blue in sRGB, and the opacity. What is less opaque than half
    /// ([`DRAWN_FROM`](Self::DRAWN_FROM)) is not part of the card. What is drawn are [`mips`](Self::mips), whose colours go
    /// on where nothing is, and whose opacities keep the area.
    pub colors: Vec<[u8; 4]>,
    /// By rows: the unit normal `n` as `127.5 + 127.5 n`, along the card's edges and its normal.
    pub normals: Vec<[u8; 3]>,
    /// Whether normals are turned over where a card is seen from its back, as those of most things are. Otherwise both
    /// sides have the same, as leaves with the normals of a crown.
    pub turns_over: bool,
    /// What the colours are multiplied with, in linear light, beside the base colour of the mesh's material: those of
    /// vertices may be brighter than 1.
    pub tint: Vec3,
}

impl CardPicture {
    /// The side of the largest picture.
    pub const MOST_SIDE_TEXELS: u32 = 1024;
    /// Texels at least as opaque as this, of 255, are drawn.
    pub const DRAWN_FROM: u8 = 128;
    /// How opaque a place is at least, from 0 to 1, that is made to be drawn where that keeps the area.
    pub const LEAST_OPACITY: f32 = 0.02;

    /// A texel of [`colors`](Self::colors) from linear red, green and blue, and the opacity, from 0 to 1.
    #[must_use]
    pub fn color_texel(color: Vec4) -> [u8; 4] {
        let [red, green, blue] = color.truncate().to_array().map(srgb_of);
        [red, green, blue, byte_of(color.w)]
    }

    /// The linear red, green and blue of a texel, and its opacity, from 0 to 1.
    #[must_use]
    pub fn color_of([red, green, blue, opacity]: [u8; 4]) -> Vec4 {
        let color = [red, green, blue].map(linear_of);
        Vec3::from(color).extend(f32::from(opacity) / 255.0)
    }

    /// A texel of [`normals`](Self::normals) from a unit vector.
    #[must_use]
    pub fn normal_texel(normal: Vec3) -> [u8; 3] {
        normal.to_array().map(|part| byte_of(0.5 + 0.5 * part))
    }

    /// The normal of a texel, about of length 1.
    #[must_use]
    pub fn normal_of(texel: [u8; 3]) -> Vec3 {
        Vec3::from(texel.map(|part| f32::from(part) - 127.5)) / 127.5
    }

    /// Whether a picture may have so many texels along each side.
    pub(crate) fn is_side(side_texels: u32) -> bool {
        side_texels.is_power_of_two() && side_texels <= Self::MOST_SIDE_TEXELS
    }
}

fn byte_of(share: f32) -> u8 {
    (share.clamp(0.0, 1.0) * 255.0).round() as u8
}

impl Card {
    /// The corners, counterclockwise as seen from the front.
    #[must_use]
    pub fn corners(&self) -> [Vec3; 4] {
        let (far, down) = (self.corner + self.across, self.corner + self.down);
        [self.corner, far, far + self.down, down]
    }

    /// The texture coordinates of the corners in a picture of so many texels a side.
    #[must_use]
    pub fn uvs(&self, side_texels: u32) -> [glam::Vec2; 4] {
        let side = side_texels as f32;
        let [x, y] = self.first_texel.map(|texel| f32::from(texel) / side);
        let [width, height] = self.size_texels.map(|texels| f32::from(texels) / side);
        [
            [x, y],
            [x + width, y],
            [x + width, y + height],
            [x, y + height],
        ]
        .map(Into::into)
    }

    /// The unit vectors along the edges, and the normal, to the front.
    #[must_use]
    pub fn axes(&self) -> [Vec3; 3] {
        let (tangent, bitangent) = (
            self.across.normalize_or(Vec3::X),
            self.down.normalize_or(Vec3::Y),
        );
        [tangent, bitangent, tangent.cross(bitangent)]
    }
}
