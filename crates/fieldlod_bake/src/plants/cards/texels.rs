//! The picture on a card.

use fieldlod_hierarchy::{Card, CardPicture};
use glam::{UVec2, Vec2, Vec3, Vec4};

use super::Source;
use super::frame::Frame;
use super::planes::Facet;
use crate::mesh::surface::Surface;
use crate::mesh::surfaces::Looks;
use crate::plants::picture::Raster;

/// Samples of a texel along each axis.
const SAMPLES: u32 = 4;
/// A normal that points along the normal of the card.
const FLAT: [u8; 3] = [128, 128, 255];

/// By rows.
pub(super) struct Texels {
    size: UVec2,
    /// Linear, and the opacity.
    colors: Vec<Vec4>,
    /// Along the axes of the frame.
    normals: Vec<Vec3>,
}

/// Nothing at all.
pub(super) fn empty_picture(side_texels: u32, turns_over: bool, tint: Vec3) -> CardPicture {
    let count = side_texels as usize * side_texels as usize;
    CardPicture {
        side_texels,
        colors: vec![[0; 4]; count],
        normals: vec![FLAT; count],
        turns_over,
        tint,
    }
}

/// Takes the picture of a card away.
pub(super) fn clear(picture: &mut CardPicture, card: &Card) {
    let [first, size] = [card.first_texel, card.size_texels].map(|two| two.map(usize::from));
    for row in first[1]..first[1] + size[1] {
        let at = row * picture.side_texels as usize + first[0];
        picture.colors[at..at + size[0]].fill([0; 4]);
        picture.normals[at..at + size[0]].fill(FLAT);
    }
}

/// What is seen at one sample.
#[derive(Clone, Copy)]
struct Sample {
    near: f32,
    color: Vec3,
    normal: Vec3,
}

impl Texels {
    /// What is seen of the triangles in a frame from its front.
    pub(super) fn of(source: &Source<'_>, frame: &Frame, size: UVec2) -> Self {
        let samples = Samples::of(source, frame, size);
        let mut texels = Self {
            size,
            colors: Vec::new(),
            normals: Vec::new(),
        };
        for texel in (0..size.y).flat_map(|y| (0..size.x).map(move |x| UVec2::new(x, y))) {
            let (color, normal) = samples.mean(texel);
            texels.colors.push(color);
            texels.normals.push(normal);
        }
        texels
    }

    /// Opacities of which as many are half or more, and so drawn, as the mean is, or `gain` times as many.
    fn opacities(&self, gain: f32) -> Vec<f32> {
        let mut opacities: Vec<f32> = self.colors.iter().map(|color| color.w).collect();
        let drawn = (opacities.iter().sum::<f32>() * gain).round() as usize;
        opacities.sort_by(|a, b| b.total_cmp(a));
        let Some(last) = drawn.min(opacities.len()).checked_sub(1) else {
            return vec![0.0; self.colors.len()];
        };
        let scale = 0.5 / opacities[last].max(CardPicture::LEAST_OPACITY);
        let colors = self.colors.iter();
        colors.map(|color| (color.w * scale).min(1.0)).collect()
    }

    /// Puts it into a larger picture. `gain` times as much of it is drawn as is covered.
    pub(super) fn write(&self, picture: &mut CardPicture, place: UVec2, gain: f32) {
        for (index, opacity) in self.opacities(gain).into_iter().enumerate() {
            let at = index as u32;
            let at = place + UVec2::new(at % self.size.x, at / self.size.x);
            let to = (at.y * picture.side_texels + at.x) as usize;
            let color = CardPicture::color_texel(self.colors[index].truncate().extend(opacity));
            // What is not there should be short in files.
            let is_there = color[3] > 0;
            (picture.colors[to], picture.normals[to]) = match is_there {
                true => (color, CardPicture::normal_texel(self.normals[index])),
                false => ([0; 4], FLAT),
            };
        }
    }
}

/// What is seen in a frame, at several places of each texel.
struct Samples {
    side: usize,
    /// By rows of a square.
    samples: Vec<Option<Sample>>,
}

impl Samples {
    fn of(source: &Source<'_>, frame: &Frame, size: UVec2) -> Self {
        let side = (size.max_element() * SAMPLES) as usize;
        let mut samples = vec![None::<Sample>; side * side];
        let scale = (size * SAMPLES).as_vec2() / (frame.max - frame.min);
        for &facet in &frame.facets {
            let triangle = source.triangles[facet as usize];
            let corners = source.facets[facet as usize].corners.map(|corner| {
                let place = frame.place(corner);
                ((place.truncate() - frame.min) * scale).extend(place.z)
            });
            let Some(raster) = Raster::of(corners, side) else {
                continue;
            };
            let seen = Seen::of(source, &triangle, &source.facets[facet as usize], frame);
            raster.each_pixel(|index, shares, near| {
                let is_nearest = samples[index].is_none_or(|sample| near > sample.near);
                if is_nearest && let Some((color, normal)) = seen.at(shares) {
                    samples[index] = Some(Sample {
                        near,
                        color,
                        normal: frame.axes.transpose() * normal,
                    });
                }
            });
        }
        Self { side, samples }
    }

    /// The mean colour with the opacity, and the mean normal, of a texel.
    fn mean(&self, texel: UVec2) -> (Vec4, Vec3) {
        let (mut color, mut normal) = (Vec4::ZERO, Vec3::ZERO);
        for y in 0..SAMPLES {
            for x in 0..SAMPLES {
                let at = texel * SAMPLES + UVec2::new(x, y);
                if let Some(sample) = self.samples[at.y as usize * self.side + at.x as usize] {
                    color += sample.color.extend(1.0);
                    normal += sample.normal;
                }
            }
        }
        let mean = color.truncate() / color.w.max(1.0);
        let opacity = color.w / (SAMPLES * SAMPLES) as f32;
        (mean.extend(opacity), normal.normalize_or(Vec3::Z))
    }
}

/// What is seen of a triangle from the front of a frame.
struct Seen<'a> {
    surface: Option<&'a Surface>,
    uvs: [Vec2; 3],
    colors: [Vec3; 3],
    normals: [Vec3; 3],
}

impl<'a> Seen<'a> {
    fn of(source: &Source<'a>, triangle: &[u32; 3], facet: &Facet, frame: &Frame) -> Self {
        let Looks { surfaces, uvs } = &source.looks;
        let part = source.surfaces.part_of(triangle[0]);
        let is_back = facet.normal.dot(frame.axes.z_axis) < 0.0;
        // Seen from the back of the card, all is turned over once more, or nothing is.
        let side = match is_back && source.turns_over[part] {
            true => -1.0,
            false => 1.0,
        };
        Self {
            surface: surfaces[triangle[0] as usize],
            uvs: triangle.map(|v| uvs.get(v as usize).copied().unwrap_or_default()),
            colors: triangle.map(|v| source.color(v) / source.tint),
            normals: triangle.map(|v| source.normal(v).unwrap_or(facet.normal) * side),
        }
    }

    /// The colour, without that of the material, and the normal; `None` where nothing is drawn.
    fn at(&self, shares: Vec3) -> Option<(Vec3, Vec3)> {
        let [a, b, c] = self.uvs;
        let uv = a * shares.x + b * shares.y + c * shares.z;
        let tint = match self.surface {
            Some(surface) => surface.texture_at(uv)?,
            None => Vec3::ONE,
        };
        let mixed = |[a, b, c]: [Vec3; 3]| a * shares.x + b * shares.y + c * shares.z;
        Some((
            mixed(self.colors) * tint,
            mixed(self.normals).normalize_or_zero(),
        ))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn as_many_texels_are_drawn_as_there_are_at_most() {
        let texels = |opacity: f32| Texels {
            size: UVec2::splat(4),
            colors: vec![Vec3::ONE.extend(opacity); 16],
            normals: vec![Vec3::Z; 16],
        };
        for (opacity, gain) in [(1.0, 1.0), (1.0, 1.5), (0.9, 1.15), (0.6, 2.0)] {
            let mut picture = empty_picture(8, true, Vec3::ONE);
            texels(opacity).write(&mut picture, UVec2::splat(2), gain);
            let drawn = picture
                .colors
                .iter()
                .filter(|c| c[3] >= CardPicture::DRAWN_FROM);
            assert_eq!(drawn.count(), 16, "{opacity} {gain}");
        }
        let mut picture = empty_picture(8, true, Vec3::ONE);
        texels(0.0).write(&mut picture, UVec2::splat(2), 1.5);
        assert_eq!(picture, empty_picture(8, true, Vec3::ONE));
    }
}
