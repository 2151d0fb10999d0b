//! Levels of cards and their picture, which come before all sections.
//!
//! ```text
//! level count u32
//! errors, card counts, cards of all levels                 (see `numbers`, `records`)
//! texels a side u32 | tint 3 x f32 | 1 if normals turn over, or 0, u32
//! length u32 | colours as PNG, RGBA of 8 bits
//! length u32 | normals as PNG, RGB of 8 bits
//! zeros, so that no byte stands for more than MAX_PER_BYTE bytes of memory
//! ```
//! Nothing at all, if there are no cards. Of a picture only its texels are read; the checksum of all these bytes is
//! in the directory, so that those in the picture go unread.

use std::io::Cursor;
use std::sync::Arc;

use glam::Vec3;
use png::{BitDepth, ColorType, Filter};

use super::coded::MAX_PER_BYTE;
use super::error::FileError;
use super::numbers::{self, Kind};
use super::reader::Reader;
use super::records;
use super::section_reader::Budget;
use crate::cards::{Card, CardLevel, CardPicture, Cards};

const WHAT: &str = "the cards";
const PICTURE: &str = "the picture of cards";
/// What a level claims beside its cards: not its size here, so that files are the same on machines of 32 bits.
const LEVEL_BYTES: usize = 32;
/// What a texel claims: its colour and its normal.
const TEXEL_BYTES: usize = 4 + 3;
/// What decoding a picture may take beside its texels: rows of the largest, and chunks that are not texels.
const DECODER_BYTES: usize = 1 << 20;

/// The bytes of valid cards.
pub(super) fn write(cards: Option<&Cards>) -> Vec<u8> {
    let mut bytes = Vec::new();
    let Some(cards) = cards else {
        return bytes;
    };
    // The levels.
    let levels = cards.levels.iter();
    let errors: Vec<u32> = levels.clone().map(|l| l.error_in_local.to_bits()).collect();
    let counts: Vec<u32> = levels
        .clone()
        .map(|level| level.cards.len() as u32)
        .collect();
    let all: Vec<Card> = levels.flat_map(|level| &level.cards).copied().collect();
    bytes.extend_from_slice(&(cards.levels.len() as u32).to_le_bytes());
    numbers::write(&mut bytes, &errors, Kind::Plain);
    numbers::write(&mut bytes, &counts, Kind::Plain);
    records::write(&mut bytes, &all);
    // The picture.
    let picture = &cards.picture;
    bytes.extend_from_slice(&picture.side_texels.to_le_bytes());
    bytes.extend_from_slice(bytemuck::bytes_of(&picture.tint));
    bytes.extend_from_slice(&u32::from(picture.turns_over).to_le_bytes());
    let pictures = [
        (ColorType::Rgba, picture.colors.as_flattened()),
        (ColorType::Rgb, picture.normals.as_flattened()),
    ];
    for (color, texels) in pictures {
        let png = to_png(picture.side_texels, color, texels);
        let png = png.expect("a picture has as many texels as its sides say");
        bytes.extend_from_slice(&(png.len() as u32).to_le_bytes());
        bytes.extend_from_slice(&png);
    }
    let of_levels = cards.levels.len() * LEVEL_BYTES + size_of_val(&*all);
    let claimed = of_levels + picture.colors.len() * TEXEL_BYTES;
    let least = claimed.div_ceil(MAX_PER_BYTE as usize);
    bytes.resize(bytes.len().max(least), 0);
    bytes
}

/// The shorter of filtered rows and rows as they are, which suit flat leaves and empty texels.
fn to_png(side: u32, color: ColorType, texels: &[u8]) -> Result<Vec<u8>, png::EncodingError> {
    let filtered = to_png_with(Filter::Adaptive, side, color, texels)?;
    let plain = to_png_with(Filter::NoFilter, side, color, texels)?;
    Ok(if plain.len() < filtered.len() {
        plain
    } else {
        filtered
    })
}

fn to_png_with(
    filter: Filter,
    side: u32,
    color: ColorType,
    texels: &[u8],
) -> Result<Vec<u8>, png::EncodingError> {
    let mut bytes = Vec::new();
    let mut encoder = png::Encoder::new(&mut bytes, side, side);
    encoder.set_color(color);
    encoder.set_depth(BitDepth::Eight);
    encoder.set_compression(png::Compression::High);
    encoder.set_filter(filter);
    let mut writer = encoder.write_header()?;
    writer.write_image_data(texels)?;
    writer.finish()?;
    Ok(bytes)
}

/// Reads what [`write`] wrote.
pub(super) fn read(bytes: &[u8]) -> Result<Option<Cards>, FileError> {
    if bytes.is_empty() {
        return Ok(None);
    }
    let mut reader = Reader { rest: bytes };
    let mut budget = Budget::of(bytes);
    let levels = read_levels(&mut reader, &mut budget)?;
    let picture = Arc::new(read_picture(&mut reader, &mut budget)?);
    match reader.rest.iter().all(|&byte| byte == 0) {
        true => Ok(Some(Cards { levels, picture })),
        false => Err(FileError::Corrupt {
            what: "the end of the cards",
        }),
    }
}

fn read_levels(reader: &mut Reader<'_>, budget: &mut Budget) -> Result<Vec<CardLevel>, FileError> {
    let count: u32 = reader.value(WHAT)?;
    let count = budget.claim(u64::from(count), LEVEL_BYTES)?;
    let errors = numbers::read(reader, count, WHAT)?;
    let counts = numbers::read(reader, count, WHAT)?;
    let all = budget.claim_all(counts.iter().copied(), size_of::<Card>())?;
    let mut all = records::read(reader, all, WHAT)?.into_iter();
    let levels = errors.into_iter().zip(counts);
    let levels = levels.map(|(error, count)| CardLevel {
        error_in_local: f32::from_bits(error),
        cards: all.by_ref().take(count as usize).collect(),
    });
    Ok(levels.collect())
}

fn read_picture(reader: &mut Reader<'_>, budget: &mut Budget) -> Result<CardPicture, FileError> {
    let side_texels: u32 = reader.value(PICTURE)?;
    if !CardPicture::is_side(side_texels) {
        return Err(FileError::Corrupt { what: PICTURE });
    }
    let texels = budget.claim(u64::from(side_texels).pow(2), TEXEL_BYTES)?;
    let tint = Vec3::from_array(reader.value(PICTURE)?);
    let turns_over = match reader.value::<u32>(PICTURE)? {
        0 => false,
        1 => true,
        _ => return Err(FileError::Corrupt { what: PICTURE }),
    };
    Ok(CardPicture {
        side_texels,
        colors: read_texels(reader, side_texels, texels, ColorType::Rgba)?,
        normals: read_texels(reader, side_texels, texels, ColorType::Rgb)?,
        turns_over,
        tint,
    })
}

fn read_texels<const N: usize>(
    reader: &mut Reader<'_>,
    side_texels: u32,
    count: usize,
    color: ColorType,
) -> Result<Vec<[u8; N]>, FileError> {
    let length: u32 = reader.value(PICTURE)?;
    let png = reader.take(PICTURE, u64::from(length))?;
    let mut texels = vec![[0; N]; count];
    let read = read_png(png, side_texels, color, texels.as_flattened_mut());
    read.ok_or(FileError::Corrupt { what: PICTURE })?;
    Ok(texels)
}

/// `None` if it is none of this size and kind.
fn read_png(png: &[u8], side: u32, color: ColorType, texels: &mut [u8]) -> Option<()> {
    let bytes = DECODER_BYTES;
    let mut decoder = png::Decoder::new_with_limits(Cursor::new(png), png::Limits { bytes });
    decoder.set_ignore_text_chunk(true);
    decoder.set_ignore_iccp_chunk(true);
    decoder.ignore_checksums(true);
    let mut reader = decoder.read_info().ok()?;
    let is_right = reader.info().size() == (side, side)
        && reader.output_color_type() == (color, BitDepth::Eight)
        && reader.output_buffer_size() == Some(texels.len());
    if !is_right {
        return None;
    }
    let read = reader.next_frame(texels).ok()?;
    (read.buffer_size() == texels.len()).then_some(())
}
