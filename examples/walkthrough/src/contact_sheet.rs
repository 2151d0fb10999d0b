//! All pictures of a run on one sheet.

use image::imageops::{self, FilterType};
use image::{Rgb, RgbImage};

const COLUMNS: u32 = 6;
const THUMBNAIL_WIDTH_PX: u32 = 320;
const GAP_PX: u32 = 4;

/// Lays out the pictures, all of one size, in rows from the top left.
pub(crate) struct ContactSheet {
    sheet: RgbImage,
    columns: u32,
    thumbnail: (u32, u32),
}

impl ContactSheet {
    /// An empty sheet for `count` pictures of this size in pixels.
    pub(crate) fn new(count: u32, (width, height): (u32, u32)) -> Self {
        let columns = COLUMNS.min(count.max(1));
        let thumbnail = (
            THUMBNAIL_WIDTH_PX,
            (THUMBNAIL_WIDTH_PX * height / width).max(1),
        );
        let across = |count: u32, side: u32| count * (side + GAP_PX) + GAP_PX;
        let rows = count.div_ceil(columns);
        let (width, height) = (across(columns, thumbnail.0), across(rows, thumbnail.1));
        Self {
            sheet: RgbImage::from_pixel(width, height, Rgb([24; 3])),
            columns,
            thumbnail,
        }
    }

    pub(crate) fn put(&mut self, index: u32, picture: &RgbImage) {
        let (width, height) = self.thumbnail;
        let small = imageops::resize(picture, width, height, FilterType::Triangle);
        let place = |cell: u32, side: u32| i64::from(cell * (side + GAP_PX) + GAP_PX);
        let (column, row) = (index % self.columns, index / self.columns);
        imageops::replace(
            &mut self.sheet,
            &small,
            place(column, width),
            place(row, height),
        );
    }

    pub(crate) fn image(&self) -> &RgbImage {
        &self.sheet
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pictures_fill_the_sheet_row_by_row() {
        let mut sheet = ContactSheet::new(7, (640, 360));
        for index in 0..7 {
            sheet.put(
                index,
                &RgbImage::from_pixel(640, 360, Rgb([index as u8 + 100; 3])),
            );
        }
        let sheet = sheet.image();
        assert_eq!(sheet.dimensions(), (6 * 324 + 4, 2 * 184 + 4));
        assert_eq!(sheet.get_pixel(10, 10), &Rgb([100; 3]));
        assert_eq!(sheet.get_pixel(10, 200), &Rgb([106; 3]));
        assert_eq!(sheet.get_pixel(400, 200), &Rgb([24; 3]));
    }
}
