//! Colour and opacity of a material, as the bake uses them.
//!
//! Textures are small, because pictures of the bake are at most 256 pixels wide.

use glam::{Affine2, UVec2, Vec2, Vec3, Vec4};

use crate::mesh::srgb::{linear_of, srgb_of};

/// Largest side of a stored texture, in texels.
const LARGEST_SIDE: u32 = 256;
/// Each stored texel is the mean of at most this many samples along each axis. It bounds the time for large textures.
const MAX_SAMPLES: u32 = 2;

/// Base colour and alpha of a material.
///
/// The bake uses it to keep the covered area of leaves, and in pictures of plants and torn textures. Without it, leaves
/// with texture coordinates count as half transparent.
#[derive(Clone, Debug, PartialEq)]
pub struct Surface {
    base_color: Vec4,
    alpha: SurfaceAlpha,
    texture: Option<Texture>,
    /// Texels with at least this opacity, from 0 to 1, are drawn in pictures.
    alpha_threshold: f32,
    /// Whether the surface is opaque everywhere.
    is_opaque: bool,
}

/// The alpha mode of a material.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum SurfaceAlpha {
    /// Alpha is ignored.
    Opaque,
    /// Pixels with an alpha below the cutoff are discarded.
    Mask {
        /// Alpha threshold from 0 to 1.
        cutoff: f32,
    },
    /// Pixels are blended by alpha.
    Blend,
}

/// How a texture maps to a mesh. Textures repeat.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct TextureMapping {
    /// Whether the second set of texture coordinates is used.
    pub uses_uvs_1: bool,
    /// Transform of the texture coordinates.
    pub transform: Affine2,
}

/// A texture with its mip chain.
#[derive(Clone, Debug, PartialEq)]
struct Texture {
    mips: Vec<Mip>,
    mapping: TextureMapping,
}

/// Texels in row order: red, green and blue in sRGB, and the opacity. Sides are powers of two.
#[derive(Clone, Debug, PartialEq)]
struct Mip {
    size: UVec2,
    texels: Vec<[u8; 4]>,
}

impl Surface {
    /// Creates a surface of one colour: linear red, green, blue and alpha.
    #[must_use]
    pub fn new(base_color: Vec4, alpha: SurfaceAlpha) -> Self {
        let usable = if base_color.is_finite() {
            base_color
        } else {
            Vec4::ONE
        };
        let mut surface = Self {
            base_color: usable.clamp(Vec4::ZERO, Vec4::ONE),
            alpha,
            texture: None,
            alpha_threshold: 0.0,
            is_opaque: false,
        };
        let opacity = surface.opacity_of(1.0);
        surface.alpha_threshold = opacity * 0.5;
        surface.is_opaque = opacity >= 1.0;
        surface
    }

    /// Adds a texture of `size` texels, which multiplies the base colour. `texel` returns red, green, blue and alpha in
    /// sRGB for column x and row y. It is called for at most 512 × 512 texels. A texture without texels is ignored.
    #[must_use]
    pub fn with_texture(
        mut self,
        size: UVec2,
        mapping: TextureMapping,
        texel: impl Fn(u32, u32) -> [u8; 4],
    ) -> Self {
        if size.min_element() == 0 {
            return self;
        }
        let side = |side: u32| 1 << side.min(LARGEST_SIDE).ilog2();
        let small = UVec2::new(side(size.x), side(size.y));
        let largest = Mip::of(small, |at| self.mean_texel(at, small, size, &texel));
        let opacities = || largest.texels.iter().map(|texel| texel[3]);
        self.alpha_threshold = f32::from(opacities().max().unwrap_or_default()) / 255.0 * 0.5;
        self.is_opaque = opacities().all(|opacity| opacity == u8::MAX);
        let smaller = |mip: &Mip| (mip.size != UVec2::ONE).then(|| mip.halved());
        let mips = std::iter::successors(Some(largest), smaller).collect();
        self.texture = Some(Texture { mips, mapping });
        self
    }

    /// All data that affects a bake, for cache keys.
    #[must_use]
    pub fn to_bytes(&self) -> Vec<u8> {
        let alpha = match self.alpha {
            SurfaceAlpha::Opaque => [0.0; 2],
            SurfaceAlpha::Mask { cutoff } => [1.0, cutoff],
            SurfaceAlpha::Blend => [2.0, 0.0],
        };
        let mut numbers = [&self.base_color.to_array()[..], &alpha].concat();
        let mut texels: &[[u8; 4]] = &[];
        if let Some(Texture { mips, mapping }) = &self.texture {
            numbers.extend(mips[0].size.as_vec2().to_array());
            numbers.extend(mapping.transform.to_cols_array());
            numbers.push(f32::from(mapping.uses_uvs_1));
            texels = &mips[0].texels;
        }
        let bytes = numbers.iter().flat_map(|number| number.to_le_bytes());
        bytes.chain(texels.as_flattened().iter().copied()).collect()
    }

    /// Mean of the source texels that become the texel `at` when a texture is scaled from `size` to `small`.
    fn mean_texel(
        &self,
        at: UVec2,
        small: UVec2,
        size: UVec2,
        texel: &impl Fn(u32, u32) -> [u8; 4],
    ) -> [u8; 4] {
        let first =
            |at: u32, axis: usize| u64::from(at) * u64::from(size[axis]) / u64::from(small[axis]);
        let samples = |axis: usize| {
            let (first, end) = (first(at[axis], axis), first(at[axis] + 1, axis));
            let count = (end - first).min(u64::from(MAX_SAMPLES));
            // Samples are stratified and jittered: samples at regular distances would alias with regular textures. The
            // jitter is a hash of the texel, because bakes must be repeatable.
            (0..count).map(move |index| {
                let [begin, end] =
                    [index, index + 1].map(|part| first + (end - first) * part / count);
                let jitter = hash_of(at, axis as u32 * MAX_SAMPLES + index as u32);
                (begin + u64::from(jitter) % (end - begin)) as u32
            })
        };
        // Weight colours by opacity, because transparent texels may have any colour.
        let (mut color, mut opacity, mut count) = (Vec3::ZERO, 0.0, 0.0);
        for y in samples(1) {
            for x in samples(0) {
                let texel = decoded(texel(x, y));
                let opaque = self.opacity_of(texel.w);
                color += texel.truncate() * opaque;
                opacity += opaque;
                count += 1.0f32;
            }
        }
        let mean = color / f32::max(opacity, f32::MIN_POSITIVE);
        let [red, green, blue] = mean.to_array().map(srgb_of);
        [red, green, blue, (opacity / count * 255.0).round() as u8]
    }

    /// Opacity where the texture has this alpha.
    fn opacity_of(&self, texture_alpha: f32) -> f32 {
        let alpha = self.base_color.w * texture_alpha;
        match self.alpha {
            SurfaceAlpha::Opaque => 1.0,
            SurfaceAlpha::Mask { cutoff } => f32::from(alpha >= cutoff),
            SurfaceAlpha::Blend => alpha,
        }
    }
}

impl Surface {
    /// Whether the surface is opaque everywhere.
    pub(crate) fn is_opaque(&self) -> bool {
        self.is_opaque
    }

    /// Whether any part of the surface is visible.
    pub(crate) fn is_visible(&self) -> bool {
        self.alpha_threshold > 0.0
    }

    /// Whether a texture cuts the surface out.
    pub(crate) fn is_cut_out(&self) -> bool {
        let is_masked = matches!(self.alpha, SurfaceAlpha::Mask { .. });
        is_masked && self.texture.is_some() && self.is_visible() && !self.is_opaque
    }

    /// Whether alpha affects the surface.
    pub(crate) fn uses_alpha(&self) -> bool {
        self.alpha != SurfaceAlpha::Opaque
    }

    /// Whether pixels are blended, so that the order of triangles is visible.
    pub(crate) fn is_blended(&self) -> bool {
        self.alpha == SurfaceAlpha::Blend
    }

    /// Factor for the opacity where the vertex colour has this alpha.
    pub(crate) fn opacity_of_vertex(&self, alpha: f32) -> f32 {
        match self.alpha {
            SurfaceAlpha::Opaque => 1.0,
            SurfaceAlpha::Mask { cutoff } => f32::from(self.base_color.w * alpha >= cutoff),
            SurfaceAlpha::Blend => alpha,
        }
    }

    /// Whether the surface is opaque white without a texture, as a default material. It then has no effect on pictures,
    /// and leaves with texture coordinates count as if their material were unknown.
    pub(crate) fn is_blank(&self) -> bool {
        self.texture.is_none() && self.is_opaque && self.base_color.truncate() == Vec3::ONE
    }

    /// Sizes and texels of the mip chain, largest first; empty without a texture. Texels are in row order: red, green
    /// and blue in sRGB, and the opacity.
    pub fn mips(&self) -> impl Iterator<Item = (UVec2, &[[u8; 4]])> {
        let mips = self.texture.iter().flat_map(|texture| &texture.mips);
        mips.map(|mip| (mip.size, &*mip.texels))
    }

    /// Mapping of the texture; `None` without a texture.
    #[must_use]
    pub fn mapping(&self) -> Option<TextureMapping> {
        self.texture.as_ref().map(|texture| texture.mapping)
    }

    /// Returns a function from texture coordinates to opacity. It samples the mip level that fits a triangle with
    /// texture coordinates `corners` and an area of `area_px` pixels.
    pub(crate) fn opacity(&self, corners: [Vec2; 3], area_px: f32) -> impl Fn(Vec2) -> f32 + '_ {
        let mip = self.texture.as_ref().map(|texture| {
            let [a, b, c] = corners.map(|uv| texture.mapping.transform.transform_point2(uv));
            let area = 0.5 * (b - a).perp_dot(c - a).abs();
            texture.mip(area / area_px)
        });
        let even = self.opacity_of(1.0);
        move |uv| match (mip, &self.texture) {
            (Some(mip), Some(texture)) => decoded(mip.texel_at(uv, &texture.mapping)).w,
            _ => even,
        }
    }

    /// Linear colour at texture coordinates; `None` where the surface counts as transparent.
    pub(crate) fn drawn_at(&self, uv: Vec2) -> Option<Vec3> {
        let Some(texture) = &self.texture else {
            return Some(self.base_color());
        };
        let texel = decoded(texture.mips[0].texel_at(uv, &texture.mapping));
        (texel.w >= self.alpha_threshold).then(|| texel.truncate() * self.base_color())
    }

    /// How opaque the texels around texture coordinates are, up to 4 texels away, from 0 to 1. Nearer texels count more.
    pub(crate) fn opacity_around(&self, uv: Vec2) -> f32 {
        let Some(Texture { mips, mapping }) = &self.texture else {
            return self.opacity_of(1.0);
        };
        let place = mapping.transform.transform_point2(uv);
        let step = mips[0].size.as_vec2().recip();
        let is_opaque = |offset: Vec2| {
            decoded(mips[0].texel_at_place(place + offset * step)).w >= self.alpha_threshold
        };
        // The squares of 3 × 3 texels at these distances.
        let (mut opaque, mut all) = (0.0, 0.0);
        for distance in [1.0f32, 2.0, 4.0] {
            for offset in (0..9u8).map(|at| Vec2::new(f32::from(at % 3), f32::from(at / 3)) - 1.0) {
                opaque += f32::from(is_opaque(offset * distance)) / distance;
                all += distance.recip();
            }
        }
        opaque / all
    }

    /// Linear base colour, which multiplies texture and vertex colours.
    #[must_use]
    pub fn base_color(&self) -> Vec3 {
        self.base_color.truncate()
    }

    /// Mean linear colour, weighted by opacity.
    pub(crate) fn mean_color(&self) -> Vec3 {
        let texels = self
            .texture
            .iter()
            .flat_map(|texture| &texture.mips[0].texels);
        let sums = texels
            .map(|&texel| decoded(texel))
            .fold(Vec4::ZERO, |sums, texel| {
                sums + (texel.truncate() * texel.w).extend(texel.w)
            });
        let mean = if sums.w > 0.0 {
            sums.truncate() / sums.w
        } else {
            Vec3::ONE
        };
        mean * self.base_color()
    }
}

impl Texture {
    /// The finest mip level with at most two texels in `area`, a share of the texture; otherwise the coarsest level.
    /// Mip levels differ by a factor of four, so that a pixel covers half a texel to two texels.
    fn mip(&self, area: f32) -> &Mip {
        let last = &self.mips[self.mips.len() - 1];
        let texels = |mip: &&Mip| area * mip.size.as_vec2().element_product();
        self.mips
            .iter()
            .find(|mip| texels(mip) <= 2.0)
            .unwrap_or(last)
    }
}

impl Mip {
    fn of(size: UVec2, texel: impl Fn(UVec2) -> [u8; 4]) -> Self {
        let rows = (0..size.y).flat_map(|y| (0..size.x).map(move |x| UVec2::new(x, y)));
        Self {
            size,
            texels: rows.map(texel).collect(),
        }
    }

    fn halved(&self) -> Self {
        let size = (self.size / 2).max(UVec2::ONE);
        let last = self.size - 1;
        Self::of(size, |at| {
            let corners = [UVec2::ZERO, UVec2::X, UVec2::Y, UVec2::ONE];
            let four = corners.map(|corner| self.texel((at * 2 + corner).min(last)).map(u32::from));
            std::array::from_fn(|part| {
                ((four.iter().map(|texel| texel[part]).sum::<u32>() + 2) / 4) as u8
            })
        })
    }

    fn texel(&self, at: UVec2) -> [u8; 4] {
        self.texels[(at.y * self.size.x + at.x) as usize]
    }

    fn texel_at(&self, uv: Vec2, mapping: &TextureMapping) -> [u8; 4] {
        self.texel_at_place(mapping.transform.transform_point2(uv))
    }

    fn texel_at_place(&self, place: Vec2) -> [u8; 4] {
        let place = place.fract_gl() * self.size.as_vec2();
        self.texel(place.as_uvec2().min(self.size - 1))
    }
}

/// A hash of a texel position, the same on all machines. Its mixing step is the first of a hash by C. Wellons
/// (Prospecting for Hash Functions, 2018).
fn hash_of(at: UVec2, index: u32) -> u32 {
    let mixed = |seed: u32| (seed ^ (seed >> 15)).wrapping_mul(0x2c1b_3c6d);
    let number = mixed(at.x.wrapping_add(mixed(at.y.wrapping_add(mixed(index + 1)))));
    number ^ (number >> 12)
}

/// Linear colour and opacity of a texel.
fn decoded([red, green, blue, opacity]: [u8; 4]) -> Vec4 {
    let color = [red, green, blue].map(linear_of);
    Vec3::from(color).extend(f32::from(opacity) / 255.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    const MASK: SurfaceAlpha = SurfaceAlpha::Mask { cutoff: 0.5 };

    /// A texture of 1,000 × 600 texels: the left quarter is opaque and red, the rest is transparent and white.
    fn quarter(alpha: SurfaceAlpha) -> Surface {
        let texel = |x: u32, _| {
            if x < 250 {
                [255, 0, 0, 255]
            } else {
                [255, 255, 255, 0]
            }
        };
        let size = UVec2::new(1_000, 600);
        Surface::new(Vec4::ONE, alpha).with_texture(size, TextureMapping::default(), texel)
    }

    #[test]
    fn transparent_texels_are_ignored() {
        for alpha in [MASK, SurfaceAlpha::Blend] {
            let surface = quarter(alpha);
            assert_eq!(surface.drawn_at(Vec2::new(0.2, 0.5)), Some(Vec3::X));
            assert_eq!(surface.drawn_at(Vec2::new(0.3, 0.5)), None);
            // Textures repeat.
            assert_eq!(surface.drawn_at(Vec2::new(-0.9, 7.5)), Some(Vec3::X));
            assert_eq!(surface.mean_color(), Vec3::X);
            assert!(!surface.is_opaque());
        }
        let opaque = quarter(SurfaceAlpha::Opaque);
        assert_eq!(opaque.drawn_at(Vec2::new(0.3, 0.5)), Some(Vec3::ONE));
        assert!(opaque.is_opaque());
    }

    #[test]
    fn alpha_cutoff_is_applied_before_filtering() {
        // Alpha alternates between 0.6 and 0 by columns; the mean is 0.3.
        let texel = |x: u32, _| [255, 255, 255, if x.is_multiple_of(2) { 153 } else { 0 }];
        let plain = Surface::new(Vec4::ONE, MASK);
        let surface = plain.with_texture(UVec2::splat(512), TextureMapping::default(), texel);
        assert_eq!(surface.drawn_at(Vec2::splat(0.3)), Some(Vec3::ONE));
        let corners = [Vec2::ZERO, Vec2::X, Vec2::Y];
        let opacity = surface.opacity(corners, 1.0)(Vec2::splat(0.3));
        assert!((opacity - 0.5).abs() < 0.01, "{opacity}");
    }

    /// Every eighth column of a large texture is opaque.
    #[test]
    fn regular_textures_keep_their_opacity() {
        for phase in 0..8 {
            let texel = |x: u32, _| [255, 255, 255, if x % 8 == phase { 255 } else { 0 }];
            let plain = Surface::new(Vec4::ONE, MASK);
            let size = UVec2::splat(2_048);
            let surface = plain.with_texture(size, TextureMapping::default(), texel);
            let corners = [Vec2::ZERO, Vec2::X, Vec2::Y];
            let opacity = surface.opacity(corners, 0.1)(Vec2::splat(0.3));
            assert!((opacity - 0.125).abs() < 0.02, "{phase}: {opacity}");
        }
    }

    #[test]
    fn odd_sizes_and_coordinates_do_not_panic() {
        let texture = |size| {
            let plain = Surface::new(
                Vec4::splat(f32::NAN),
                SurfaceAlpha::Mask { cutoff: f32::NAN },
            );
            plain.with_texture(size, TextureMapping::default(), |_, _| [9; 4])
        };
        for size in [
            UVec2::ZERO,
            UVec2::ONE,
            UVec2::new(1, 3),
            UVec2::new(u32::MAX, 2),
        ] {
            for uv in [Vec2::ZERO, Vec2::NAN, Vec2::INFINITY, Vec2::splat(-1e30)] {
                let _ = texture(size).drawn_at(uv);
                let _ = texture(size).opacity([uv; 3], 0.0)(uv);
            }
        }
    }
}
