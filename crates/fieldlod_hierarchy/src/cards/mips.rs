//! Smaller sizes of a picture, for those who draw its cards.

use glam::{Vec3, Vec4};

use super::CardPicture;

/// Sizes of a picture with its own: in smaller ones too much of a card would be its neighbours'.
const SIZES: usize = 4;
/// How often opacities are multiplied, as none can be more than 1.
const ROUNDS: usize = 4;

/// A picture with linear colours, before its opacities keep the area.
struct Linear {
    side: usize,
    /// The opacity is the last part.
    colors: Vec<Vec4>,
    normals: Vec<Vec3>,
}

impl CardPicture {
    /// The picture in its size and up to three smaller ones, each half as large along its sides, as those who draw
    /// cards need it: textures mix neighbouring texels and sizes.
    ///
    /// Colours and normals are means by opacity, and go on over texels where nothing is. Opacities are multiplied so that
    /// as large a share of the whole picture is half opaque or more, where neighbours are mixed, as of the texels here: in
    /// the mean, crowns do not grow thin far away (I. Castaño: Computing Alpha Mipmaps, 2010), nor blades of a
    /// texel's width near by. Single cards may, as one factor serves all.
    #[must_use]
    pub fn mips(&self) -> Vec<Self> {
        let drawn = self.colors.iter();
        let drawn = drawn.filter(|color| color[3] >= Self::DRAWN_FROM);
        let share = drawn.count() as f32 / self.colors.len().max(1) as f32;
        let is_even = |side: usize| side.is_multiple_of(2) && side > 0;
        let sizes = std::iter::successors(Some(Linear::of(self)), |large| {
            is_even(large.side).then(|| large.halved())
        });
        // Down to a texel: there is a colour for all.
        let mut sizes: Vec<Linear> = sizes.collect();
        for size in (1..sizes.len()).rev() {
            let (larger, smaller) = sizes.split_at_mut(size);
            larger[size - 1].spread(&smaller[0]);
        }
        let sizes = sizes.iter().take(SIZES);
        sizes.map(|linear| linear.encoded(share, self)).collect()
    }
}

impl Linear {
    fn of(picture: &CardPicture) -> Self {
        let colors = picture.colors.iter().copied();
        let normals = picture.normals.iter().copied();
        Self {
            side: picture.side_texels as usize,
            colors: colors.map(CardPicture::color_of).collect(),
            normals: normals.map(CardPicture::normal_of).collect(),
        }
    }

    /// Half as large along each side.
    fn halved(&self) -> Self {
        let side = self.side / 2;
        let mut half = Self {
            side,
            colors: Vec::with_capacity(side * side),
            normals: Vec::with_capacity(side * side),
        };
        for index in 0..side * side {
            let first = index / side * 2 * self.side + index % side * 2;
            let four = [first, first + 1, first + self.side, first + self.side + 1];
            let (color, normal) = self.mean(four);
            half.colors.push(color.truncate().extend(color.w / 4.0));
            half.normals.push(normal);
        }
        half
    }

    /// The mean colour and normal of texels by their opacities, with the sum of these.
    fn mean(&self, texels: impl IntoIterator<Item = usize>) -> (Vec4, Vec3) {
        let (mut color, mut normal) = (Vec4::ZERO, Vec3::ZERO);
        for texel in texels {
            let own = self.colors[texel];
            color += (own.truncate() * own.w).extend(own.w);
            normal += self.normals[texel] * own.w;
        }
        let mean = color.truncate() / color.w.max(f32::MIN_POSITIVE);
        (mean.extend(color.w), normal.normalize_or(Vec3::Z))
    }

    /// Lets colours and normals go on over texels where nothing is: those of neighbours or, where there are none, of
    /// the `smaller` size.
    fn spread(&mut self, smaller: &Self) {
        let side = self.side;
        let last = side - 1;
        for texel in 0..side * side {
            if self.colors[texel].w > 0.0 {
                continue;
            }
            let (x, y) = (texel % side, texel / side);
            let rows = y.saturating_sub(1)..=(y + 1).min(last);
            let columns = x.saturating_sub(1)..=(x + 1).min(last);
            let around = rows.flat_map(|row| columns.clone().map(move |at| row * side + at));
            let (mut color, mut normal) = self.mean(around);
            if color.w <= 0.0 {
                let below = y / 2 * smaller.side + x / 2;
                (color, normal) = (smaller.colors[below], smaller.normals[below]);
            }
            self.colors[texel] = color.truncate().extend(0.0);
            self.normals[texel] = normal;
        }
    }

    /// By what opacities are multiplied so that about such a share of the area is drawn where texels are mixed with
    /// their neighbours.
    fn gain(&self, share: f32) -> f32 {
        let mut gain = 1.0;
        for _ in 0..ROUNDS {
            let opacity = |color: &Vec4| (color.w * gain).min(1.0);
            let opacities: Vec<f32> = self.colors.iter().map(opacity).collect();
            let mut between = between(&opacities, self.side);
            let drawn = (share * between.len() as f32).round() as usize;
            let Some(last) = drawn.checked_sub(1).filter(|&last| last < between.len()) else {
                break;
            };
            let (_, least, others) = between.select_nth_unstable_by(last, |a, b| b.total_cmp(a));
            // Amid what is drawn and what is not: borders stay where they are.
            let most = others.iter().copied().fold(0.0, f32::max);
            gain *= 0.5 / (0.5 * (*least + most)).max(CardPicture::LEAST_OPACITY);
        }
        gain
    }

    /// With opacities of which about such a share is drawn.
    fn encoded(&self, share: f32, of: &CardPicture) -> CardPicture {
        let gain = self.gain(share);
        let color =
            |color: &Vec4| CardPicture::color_texel(color.truncate().extend(color.w * gain));
        let normals = self.normals.iter().copied();
        CardPicture {
            side_texels: self.side as u32,
            colors: self.colors.iter().map(color).collect(),
            normals: normals.map(CardPicture::normal_texel).collect(),
            turns_over: of.turns_over,
            tint: of.tint,
        }
    }
}

/// The values at four places of each texel, mixed as those who draw do it.
fn between(values: &[f32], side: usize) -> Vec<f32> {
    let mut mixed = Vec::with_capacity(4 * values.len());
    for (y, x) in (0..side).flat_map(|y| (0..side).map(move |x| (y, x))) {
        let row = |dy: usize| (y + dy).saturating_sub(1).min(side - 1) * side;
        let column = |dx: usize| (x + dx).saturating_sub(1).min(side - 1);
        let own = values[row(1) + x];
        for (dy, dx) in [(0, 0), (0, 2), (2, 0), (2, 2)] {
            let (above, beside) = (values[row(dy) + x], values[row(1) + column(dx)]);
            let corner = values[row(dy) + column(dx)];
            mixed.push((9.0 * own + 3.0 * (above + beside) + corner) / 16.0);
        }
    }
    mixed
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fixtures::{self, Random};

    /// A picture of a color wherever something is.
    fn picture(side: u32, mut opacity: impl FnMut(u32, u32) -> u8) -> CardPicture {
        let texels = (0..side).flat_map(|y| (0..side).map(move |x| (x, y)));
        let colors = texels.map(|(x, y)| match opacity(x, y) {
            0 => [0; 4],
            opacity => [200, 100, 50, opacity],
        });
        CardPicture {
            side_texels: side,
            colors: colors.collect(),
            normals: vec![[128, 128, 255]; (side * side) as usize],
            turns_over: true,
            tint: Vec3::new(1.0, 2.0, 3.0),
        }
    }

    fn drawn_share(opacities: &[f32]) -> f32 {
        let drawn = opacities.iter().filter(|opacity| **opacity >= 0.5);
        drawn.count() as f32 / opacities.len() as f32
    }

    fn opacities(picture: &CardPicture) -> Vec<f32> {
        let colors = picture.colors.iter();
        colors.map(|color| f32::from(color[3]) / 255.0).collect()
    }

    #[test]
    fn sizes_halve_down_to_an_eighth_or_one_texel() {
        let sides = |side| {
            let mips = picture(side, |_, _| 255).mips();
            for mip in &mips {
                let count = (mip.side_texels * mip.side_texels) as usize;
                assert_eq!((mip.colors.len(), mip.normals.len()), (count, count));
                assert_eq!(mip.tint, Vec3::new(1.0, 2.0, 3.0));
            }
            let sides = mips.iter().map(|mip| mip.side_texels);
            sides.collect::<Vec<u32>>()
        };
        assert_eq!(sides(64), [64, 32, 16, 8]);
        assert_eq!(sides(2), [2, 1]);
        assert_eq!(sides(1), [1]);
        assert_eq!(sides(0), [0]);
    }

    /// Disks with soft borders, as leaves have that were drawn with several samples a texel.
    #[test]
    fn leaves_cover_as_much_in_all_sizes() {
        for (count, radius) in [(400, 1.5), (100, 4.0), (600, 3.0), (20, 30.0)] {
            let mut random = Random::new(count);
            let mut place = || Vec3::new(random.unit(), random.unit(), 0.0) * 256.0;
            let leaves: Vec<Vec3> = (0..count).map(|_| place()).collect();
            let picture = picture(256, |x, y| {
                let at = Vec3::new(x as f32, y as f32, 0.0) + 0.5;
                let outside = |leaf: &Vec3| leaf.distance(at) - radius * (0.5 + leaf.x / 512.0);
                let outside = leaves.iter().map(outside).fold(f32::INFINITY, f32::min);
                ((0.5 - outside).clamp(0.0, 1.0) * 255.0) as u8
            });
            let share = drawn_share(&opacities(&picture));
            assert!((0.01..0.9).contains(&share), "{share}");
            for mip in picture.mips() {
                let side = mip.side_texels as usize;
                let ratio = drawn_share(&between(&opacities(&mip), side)) / share;
                println!("{count} {side}: {ratio}");
                assert!((0.97..1.03).contains(&ratio), "{count} {side}: {ratio}");
            }
        }
    }

    #[test]
    fn what_is_not_opaque_does_not_darken_what_is() {
        let mips = picture(16, |x, y| if (x + y) % 3 == 0 { 255 } else { 0 }).mips();
        for mip in &mips[1..] {
            let drawn = mip.colors.iter().filter(|color| color[3] >= 128);
            let drawn: Vec<&[u8; 4]> = drawn.collect();
            assert!(!drawn.is_empty());
            for color in drawn {
                assert_eq!(color[..3], [200, 100, 50]);
            }
        }
    }

    /// Where textures mix it with what is not.
    #[test]
    fn colours_and_normals_go_on_where_nothing_is() {
        let mut one = picture(64, |x, y| if (x, y) == (20, 41) { 255 } else { 0 });
        one.normals[41 * 64 + 20] = [255, 128, 128];
        for mip in one.mips() {
            for (color, normal) in mip.colors.iter().zip(&mip.normals) {
                assert_eq!(color[..3], [200, 100, 50]);
                assert_eq!(*normal, [255, 128, 128]);
            }
        }
        // Beside two of them, the nearer one.
        let mut two = picture(64, |x, _| if x == 7 || x == 20 { 255 } else { 0 });
        for row in two.colors.chunks_mut(64) {
            row[20] = [9, 90, 40, 255];
        }
        let mips = two.mips();
        let row = &mips[0].colors[..64];
        assert_eq!([6, 8].map(|x: usize| row[x]), [[200, 100, 50, 0]; 2]);
        assert_eq!([19, 21].map(|x: usize| row[x]), [[9, 90, 40, 0]; 2]);
    }

    /// Nothing at all, and what cards of nothing have.
    #[test]
    fn empty_pictures_stay_empty() {
        for mip in picture(16, |_, _| 0).mips() {
            assert!(mip.colors.iter().all(|color| *color == [0; 4]));
        }
    }

    #[test]
    fn cards_are_drawn_in_their_colours_to_their_borders() {
        let picture = fixtures::leafy_cards(64).picture;
        let known = picture.colors.iter().filter(|color| color[3] > 0);
        let darkest = known.map(|color| color[1]).min();
        for color in picture.mips().iter().flat_map(|mip| &mip.colors) {
            assert!(Some(color[1] + 1) >= darkest, "{color:?}");
        }
    }

    #[test]
    fn normals_are_means_by_opacity() {
        let mut two = picture(2, |x, _| if x == 0 { 255 } else { 0 });
        two.normals = vec![
            [255, 128, 128],
            [128, 255, 128],
            [128, 128, 255],
            [0, 128, 128],
        ];
        let normal = CardPicture::normal_of(two.mips()[1].normals[0]);
        let expected = Vec3::new(1.0, 0.0, 1.0).normalize();
        assert!(normal.normalize().abs_diff_eq(expected, 0.02), "{normal}");
    }
}
