//! Pictures read back from the GPU.

use glam::UVec2;

use super::SUPERSAMPLING;

/// The background colour, encoded as sRGB, 0 to 255.
const BACKGROUND: [u8; 3] = [46, 54, 66];

/// The colours of pixels, and the texels that a surface covers.
#[derive(Clone, Debug, PartialEq)]
pub struct Picture {
    /// Width and height in pixels.
    pub size_px: UVec2,
    /// Red, green and blue by rows, encoded as sRGB, 0 to 255 with fractions.
    pub colors: Vec<[f32; 3]>,
    /// Whether each texel shows a surface, by rows. A pixel has [`SUPERSAMPLING`] texels along each axis.
    pub covered: Vec<bool>,
}

impl Picture {
    /// Averages the texels of each pixel. Texels with an alpha above 0 are covered.
    pub(super) fn of_texels(size_texels: UVec2, texels: &[[u8; 4]]) -> Self {
        let size_px = size_texels / SUPERSAMPLING;
        let linear: Vec<f32> = (0..=255u8).map(|level| decoded(f32::from(level))).collect();
        let mut colors = Vec::with_capacity((size_px.x * size_px.y) as usize);
        for y in 0..size_px.y {
            for x in 0..size_px.x {
                // A mean of encoded values would darken edges.
                let mut sum = [0.0f32; 3];
                for texel in 0..SUPERSAMPLING * SUPERSAMPLING {
                    let (dx, dy) = (texel / SUPERSAMPLING, texel % SUPERSAMPLING);
                    let row = y * SUPERSAMPLING + dy;
                    let texel = texels[(row * size_texels.x + x * SUPERSAMPLING + dx) as usize];
                    for (sum, level) in sum.iter_mut().zip(on_background(texel)) {
                        *sum += linear[usize::from(level)];
                    }
                }
                colors.push(sum.map(|sum| encoded(sum / (SUPERSAMPLING * SUPERSAMPLING) as f32)));
            }
        }
        Self {
            size_px,
            colors,
            covered: texels.iter().map(|texel| texel[3] > 0).collect(),
        }
    }

    /// Red, green and blue by rows, 0 to 255.
    #[must_use]
    pub fn to_bytes(&self) -> Vec<u8> {
        let levels = self.colors.as_flattened().iter();
        levels.map(|level| level.round() as u8).collect()
    }
}

/// Replaces the cleared colour by the background. Targets are cleared to transparent, so that alpha shows coverage.
fn on_background([red, green, blue, alpha]: [u8; 4]) -> [u8; 3] {
    if alpha > 0 {
        [red, green, blue]
    } else {
        BACKGROUND
    }
}

/// Decodes sRGB, 0 to 255, to linear light, 0 to 1.
fn decoded(level: f32) -> f32 {
    let share = level / 255.0;
    if share <= 0.04045 {
        share / 12.92
    } else {
        ((share + 0.055) / 1.055).powf(2.4)
    }
}

/// Encodes linear light, 0 to 1, as sRGB, 0 to 255.
fn encoded(linear: f32) -> f32 {
    let share = if linear <= 0.003_130_8 {
        linear * 12.92
    } else {
        1.055 * linear.powf(1.0 / 2.4) - 0.055
    };
    share * 255.0
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn equal_texels_keep_their_colour() {
        let texels = [[200, 100, 7, 255]; 4];
        let picture = Picture::of_texels(UVec2::splat(2), &texels);
        for (level, expected) in picture.colors[0].into_iter().zip([200.0, 100.0, 7.0]) {
            assert!((level - expected).abs() < 1e-3, "{level}");
        }
        assert_eq!(picture.to_bytes(), [200, 100, 7]);
    }

    /// Half of the light of white is 188 in sRGB, not 128.
    #[test]
    fn texels_are_averaged_in_linear_light() {
        let (white, black) = ([255; 4], [0, 0, 0, 255]);
        let picture = Picture::of_texels(UVec2::splat(2), &[white, black, black, white]);
        assert_eq!(picture.to_bytes(), [188; 3]);
    }
}
