//! Pictures and how they differ.

use image::RgbaImage;

/// Whether two colours differ by more than rounding in any channel.
pub(crate) fn differs(a: image::Rgba<u8>, b: image::Rgba<u8>) -> bool {
    a.0.iter().zip(b.0).any(|(&a, b)| a.abs_diff(b) > 8)
}

/// Whether each pixel of two pictures of the same size differs, by row.
pub(crate) fn difference(a: &RgbaImage, b: &RgbaImage) -> Vec<bool> {
    assert_eq!(a.dimensions(), b.dimensions());
    a.pixels()
        .zip(b.pixels())
        .map(|(a, b)| differs(*a, *b))
        .collect()
}

/// The number of pixels that differ by more than `limit` in some channel.
pub(crate) fn count_beyond(a: &RgbaImage, b: &RgbaImage, limit: u8) -> usize {
    assert_eq!(a.dimensions(), b.dimensions());
    let beyond = |(a, b): &(&image::Rgba<u8>, &image::Rgba<u8>)| {
        let mut channels = a.0.iter().zip(b.0);
        channels.any(|(&a, b)| a.abs_diff(b) > limit)
    };
    a.pixels().zip(b.pixels()).filter(beyond).count()
}

/// The number of set entries of a mask.
pub(crate) fn count(mask: &[bool]) -> usize {
    mask.iter().filter(|&&set| set).count()
}

/// The pixels of `color` that cannot be reached from the picture's edge through pixels of `color`.
pub(crate) fn enclosed(picture: &RgbaImage, color: image::Rgba<u8>) -> usize {
    let (width, height) = picture.dimensions();
    let is_color = |x, y| !differs(*picture.get_pixel(x, y), color);
    let mut reached = vec![false; (width * height) as usize];
    let on_edge = |&(x, y): &(u32, u32)| x == 0 || y == 0 || x == width - 1 || y == height - 1;
    let all = || (0..height).flat_map(|y| (0..width).map(move |x| (x, y)));
    let mut open: Vec<(u32, u32)> = all().filter(on_edge).collect();
    while let Some((x, y)) = open.pop() {
        let index = (y * width + x) as usize;
        if reached[index] || !is_color(x, y) {
            continue;
        }
        reached[index] = true;
        let neighbours = [
            (x.wrapping_sub(1), y),
            (x + 1, y),
            (x, y.wrapping_sub(1)),
            (x, y + 1),
        ];
        open.extend(neighbours.iter().filter(|(x, y)| *x < width && *y < height));
    }
    all()
        .filter(|&(x, y)| is_color(x, y) && !reached[(y * width + x) as usize])
        .count()
}
