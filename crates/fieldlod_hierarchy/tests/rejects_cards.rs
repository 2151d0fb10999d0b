//! One test for each way in which the cards of a file can be wrong although their checksum fits.

mod common;

use common::{Directory, sealed, strip_file};
use fieldlod_hierarchy::{BakedFile, CardPicture, FileError, InvalidHierarchy, fixtures};
use png::{BitDepth, ColorType};
use proptest::prelude::*;

/// The side of the picture, and so of what stands in its place.
const SIDE: u32 = 8;
const PICTURE: &str = "the picture of cards";

/// The bytes of a file in which `change` was made to those of its cards.
fn with_cards_changed(change: impl FnOnce(&mut Vec<u8>)) -> Vec<u8> {
    let mut bytes = strip_file().to_bytes();
    let place = Directory::of(&bytes).cards.remove(1);
    let mut cards = bytes[place.bytes.clone()].to_vec();
    change(&mut cards);
    bytes[place.entry..place.entry + 8].copy_from_slice(&(cards.len() as u64).to_le_bytes());
    bytes.splice(place.bytes, cards);
    sealed(bytes)
}

fn fault_after(change: impl FnOnce(&mut Vec<u8>)) -> FileError {
    BakedFile::from_bytes(&with_cards_changed(change)).unwrap_err()
}

fn assert_corrupt(fault: &FileError, what: &'static str) {
    assert_eq!(*fault, FileError::Corrupt { what });
}

/// Where the side of the picture stands, which its tint follows, then whether it turns over, and the first PNG with its
/// length.
fn place_of_side(cards: &[u8]) -> usize {
    let tint = fixtures::leafy_cards(SIDE).picture.tint.to_array();
    let tint = tint.map(f32::to_le_bytes);
    let sought = [&SIDE.to_le_bytes(), tint.as_flattened()].concat();
    let place = cards.windows(sought.len()).position(|w| w == sought);
    place.unwrap()
}

/// Puts another in place of the first PNG.
fn replace_png(cards: &mut Vec<u8>, png: &[u8]) {
    let length = place_of_side(cards) + 20;
    let start = length + 4;
    let before: [u8; 4] = cards[length..start].try_into().unwrap();
    let end = start + u32::from_le_bytes(before) as usize;
    assert_eq!(&cards[start + 1..start + 4], b"PNG");
    cards.splice(start..end, png.iter().copied());
    cards[length..start].copy_from_slice(&(png.len() as u32).to_le_bytes());
}

fn png_of(width: u32, height: u32, color: ColorType, depth: BitDepth) -> Vec<u8> {
    let mut bytes = Vec::new();
    let mut encoder = png::Encoder::new(&mut bytes, width, height);
    encoder.set_color(color);
    encoder.set_depth(depth);
    let row_bytes = width as usize * color.samples() * depth as usize / 8;
    let mut writer = encoder.write_header().unwrap();
    let texels = vec![7; row_bytes * height as usize];
    writer.write_image_data(&texels).unwrap();
    writer.finish().unwrap();
    bytes
}

#[test]
fn rejects_sides_that_no_picture_has() {
    for side in [0, 3, 7, 2048, u32::MAX] {
        let fault = fault_after(|cards| {
            let place = place_of_side(cards);
            cards[place..place + 4].copy_from_slice(&side.to_le_bytes());
        });
        assert_corrupt(&fault, PICTURE);
    }
}

#[test]
fn rejects_normals_that_turn_over_in_no_known_way() {
    let fault = fault_after(|cards| {
        let place = place_of_side(cards) + 16;
        assert_eq!(cards[place..place + 4], 1u32.to_le_bytes());
        cards[place] = 2;
    });
    assert_corrupt(&fault, PICTURE);
}

/// Few bytes must not claim much memory, whatever they say.
#[test]
fn rejects_counts_that_the_bytes_cannot_hold() {
    let what = "the number of elements";
    let fault = fault_after(|cards| {
        let place = place_of_side(cards);
        let side = CardPicture::MOST_SIDE_TEXELS;
        cards[place..place + 4].copy_from_slice(&side.to_le_bytes());
    });
    assert_corrupt(&fault, what);
    for count in [1 << 20, u32::MAX] {
        let fault = fault_after(|cards| cards[..4].copy_from_slice(&count.to_le_bytes()));
        assert_corrupt(&fault, what);
    }
}

#[test]
fn accepts_another_picture_of_the_same_size_and_kind() {
    let png = png_of(SIDE, SIDE, ColorType::Rgba, BitDepth::Eight);
    let bytes = with_cards_changed(|cards| replace_png(cards, &png));
    let mut file = BakedFile::from_bytes(&bytes).unwrap();
    let cards = file.primitives.remove(1).hierarchy.cards.unwrap();
    assert_eq!(cards.picture.colors, [[7; 4]; 64]);
}

#[test]
fn rejects_pictures_of_another_size_or_kind() {
    let eight = BitDepth::Eight;
    for png in [
        png_of(4, 4, ColorType::Rgba, eight),
        png_of(SIDE, 16, ColorType::Rgba, eight),
        png_of(16, 4, ColorType::Rgba, eight),
        png_of(1 << 20, 1, ColorType::Rgba, eight),
        png_of(SIDE, SIDE, ColorType::Rgb, eight),
        png_of(SIDE, SIDE, ColorType::GrayscaleAlpha, eight),
        png_of(SIDE, SIDE, ColorType::Grayscale, eight),
        png_of(SIDE, SIDE, ColorType::Rgba, BitDepth::Sixteen),
        // As many bytes.
        png_of(SIDE, SIDE, ColorType::GrayscaleAlpha, BitDepth::Sixteen),
        b"no PNG".to_vec(),
        Vec::new(),
    ] {
        let fault = fault_after(|cards| replace_png(cards, &png));
        assert_corrupt(&fault, PICTURE);
    }
}

#[test]
fn rejects_pictures_that_end_early() {
    let png = png_of(SIDE, SIDE, ColorType::Rgba, BitDepth::Eight);
    let texels = png.windows(4).position(|w| w == b"IDAT").unwrap();
    for length in 1..texels {
        let fault = fault_after(|cards| replace_png(cards, &png[..length]));
        assert_corrupt(&fault, PICTURE);
    }
}

#[test]
fn rejects_cards_cut_short() {
    let bytes = strip_file().to_bytes();
    let length = Directory::of(&bytes).cards[1].bytes.len();
    assert!(length > 100);
    for kept in 1..length {
        let fault = fault_after(|cards| cards.truncate(kept));
        let cut = matches!(
            fault,
            FileError::Truncated { .. } | FileError::Corrupt { .. }
        );
        assert!(cut, "{kept}: {fault}");
    }
}

#[test]
fn rejects_bytes_after_the_end_of_the_cards() {
    let fault = fault_after(|cards| cards.push(1));
    assert_corrupt(&fault, "the end of the cards");
}

#[test]
fn rejects_broken_cards_with_a_right_checksum() {
    // The errors of both levels, after how many there are and how they are stored.
    let fault = fault_after(|cards| cards[5..9].copy_from_slice(&f32::NAN.to_le_bytes()));
    let FileError::Invalid { primitive, fault } = fault else {
        panic!("{fault}");
    };
    let expected = matches!(fault, InvalidHierarchy::BadCardError { level: 0, .. });
    assert!(primitive == 1 && expected, "{fault}");
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(512))]

    /// Whatever was changed: an answer, and never a panic. What is accepted can be written again.
    #[test]
    fn survives_any_change(changes in prop::collection::vec((any::<usize>(), any::<u8>()), 1..4)) {
        let bytes = with_cards_changed(|cards| {
            for (place, value) in changes {
                let place = place % cards.len();
                cards[place] = value;
            }
        });
        if let Ok(file) = BakedFile::from_bytes(&bytes) {
            prop_assert!(BakedFile::from_bytes(&file.to_bytes()) == Ok(file));
        }
    }
}
