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

/// The number of pixels of `color` that no path of `color` joins to the picture's edge.
pub(crate) fn enclosed(picture: &RgbaImage, color: image::Rgba<u8>) -> usize {
    let (width, height) = picture.dimensions();
    let (width, height) = (width as usize, height as usize);
    let pixels = picture.pixels();
    let mut unreached: Vec<bool> = pixels.map(|pixel| !differs(*pixel, color)).collect();
    let on_edge = |at: &usize| {
        let (x, y) = (at % width, at / width);
        x == 0 || y == 0 || x == width - 1 || y == height - 1
    };
    let mut open: Vec<usize> = (0..unreached.len()).filter(on_edge).collect();
    while let Some(at) = open.pop() {
        if std::mem::take(&mut unreached[at]) {
            // A step beyond the end of a row leads to an edge, which is reached anyway.
            let steps = [
                at.wrapping_sub(1),
                at + 1,
                at.wrapping_sub(width),
                at + width,
            ];
            open.extend(steps.into_iter().filter(|step| *step < unreached.len()));
        }
    }
    count(&unreached)
}
