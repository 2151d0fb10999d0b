//! Codes sequences of 32-bit numbers.
//!
//! ```text
//! 0 | value u32            all numbers are equal
//! 1, 2, 4 | numbers        1, 2 or 4 bytes per number
//! 8 | length u32 | bytes   compressed by pco, in chunks of 2¹⁸ numbers
//! ```
//! The length of the sequence is stored elsewhere. Pco stores differences of neighbours, or distances to repeated
//! numbers, if either makes the sequence shorter.

use pco::metadata::DeltaEncoding;
use pco::wrapped::{FileCompressor, FileDecompressor};
use pco::{ChunkConfig, ModeSpec, PagingSpec};

use crate::file::error::FileError;
use crate::file::reader::Reader;

const EQUAL: u8 = 0;
const PCO: u8 = 8;

/// Numbers of a chunk, as pco's default. A larger chunk has one statistic for more different numbers; smaller chunks
/// store more statistics.
const CHUNK: usize = 1 << 18;
/// First bits of a chunk of plain integers.
const CLASSIC: u8 = 0;
/// Binary logarithm of the largest distance to a repeated number that pco writes. Readers allocate as many numbers.
const MAX_WINDOW_LOG: u32 = 15;

/// Appends `numbers`: as one value if all are equal, otherwise in the shortest coding.
pub(crate) fn write(bytes: &mut Vec<u8>, numbers: &[u32]) {
    let first = numbers.first().copied().unwrap_or(0);
    if numbers.iter().all(|&number| number == first) {
        bytes.push(EQUAL);
        bytes.extend_from_slice(&first.to_le_bytes());
        return;
    }
    // The union of all bits is as wide as the largest number.
    let used_bits = numbers.iter().fold(0, |used, &number| used | number);
    let width = match used_bits {
        0..=0xff => 1,
        0x100..=0xffff => 2,
        _ => 4,
    };
    match compress(numbers) {
        Some(packed) if packed.len() + 4 < numbers.len() * width => {
            bytes.push(PCO);
            bytes.extend_from_slice(&(packed.len() as u32).to_le_bytes());
            bytes.extend_from_slice(&packed);
        }
        _ => {
            bytes.push(width as u8);
            for number in numbers {
                bytes.extend_from_slice(&number.to_le_bytes()[..width]);
            }
        }
    }
}

fn compress(numbers: &[u32]) -> Option<Vec<u8>> {
    // Other modes are for multiples of a number, floating-point values, and a dictionary of few values.
    let config = ChunkConfig::default().with_mode_spec(ModeSpec::Classic);
    let compressor = FileCompressor::default();
    let mut bytes = compressor.write_header(Vec::new()).ok()?;
    for numbers in numbers.chunks(CHUNK) {
        let one_page = PagingSpec::Exact(vec![numbers.len()]);
        let config = config.clone().with_paging_spec(one_page);
        let mut chunk = compressor.chunk_compressor(numbers, &config).ok()?;
        bytes = chunk.write_meta(bytes).ok()?;
        bytes = chunk.write_page(0, bytes).ok()?;
    }
    Some(bytes)
}

/// Reads `count` numbers that [`write`] wrote.
pub(crate) fn read(
    reader: &mut Reader<'_>,
    count: usize,
    what: &'static str,
) -> Result<Vec<u32>, FileError> {
    let mut numbers = Vec::new();
    read_into(reader, count, what, &mut numbers)?;
    Ok(numbers)
}

/// Like [`read`], but replaces the contents of `numbers` and reuses its memory.
pub(crate) fn read_into(
    reader: &mut Reader<'_>,
    count: usize,
    what: &'static str,
    numbers: &mut Vec<u32>,
) -> Result<(), FileError> {
    let coding: u8 = reader.value(what)?;
    // `decompress` overwrites all numbers, so they need no zeros first.
    if coding != PCO {
        numbers.clear();
    }
    match coding {
        EQUAL => numbers.resize(count, reader.value(what)?),
        1 => numbers.extend(reader.array::<u8>(count, what)?.map(u32::from)),
        2 => numbers.extend(reader.array::<u16>(count, what)?.map(u32::from)),
        4 => numbers.extend(reader.array::<u32>(count, what)?),
        PCO => {
            let length: u32 = reader.value(what)?;
            let packed = reader.take(what, u64::from(length))?;
            numbers.resize(count, 0);
            decompress(packed, numbers).ok_or(FileError::Corrupt { what })?;
        }
        _ => return Err(FileError::Corrupt { what }),
    }
    Ok(())
}

fn decompress(packed: &[u8], numbers: &mut [u32]) -> Option<()> {
    let (decompressor, mut rest) = FileDecompressor::new(packed).ok()?;
    for numbers in numbers.chunks_mut(CHUNK) {
        // The first four bits name the mode. A dictionary, which `compress` does not use, would be allocated at once.
        if rest.first()? & 15 != CLASSIC {
            return None;
        }
        let (mut chunk, pages) = decompressor.chunk_decompressor(rest).ok()?;
        if !has_small_window(&chunk.meta().delta_encoding) {
            return None;
        }
        let mut page = chunk.page_decompressor(pages, numbers.len()).ok()?;
        // Reads all numbers, or fails.
        page.read(numbers).ok()?;
        rest = page.into_src();
    }
    rest.is_empty().then_some(())
}

fn has_small_window(encoding: &DeltaEncoding) -> bool {
    match encoding {
        DeltaEncoding::Lookback { config, .. } => config.window_n_log <= MAX_WINDOW_LOG,
        _ => true,
    }
}

/// Maps signed differences near 0 to small numbers.
pub(crate) fn zigzag(difference: u32) -> u32 {
    difference << 1 ^ ((difference as i32) >> 31) as u32
}

/// Undoes [`zigzag`].
pub(crate) fn unzigzag(number: u32) -> u32 {
    number >> 1 ^ (number & 1).wrapping_neg()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_of_several_chunks_round_trip() {
        let numbers: Vec<u32> = (0..CHUNK as u32 + 3).map(|number| number / 3).collect();
        let mut bytes = Vec::new();
        write(&mut bytes, &numbers);
        let mut reader = Reader { rest: &bytes };
        assert_eq!(read(&mut reader, numbers.len(), "numbers"), Ok(numbers));
    }

    #[test]
    fn rejects_other_modes_of_pco() {
        let numbers: Vec<u32> = (0..1000).map(|number| number % 9 * 1_000_003).collect();
        for (mode, is_accepted) in [
            (ModeSpec::Classic, true),
            (ModeSpec::TryIntMult(1_000_003), false),
            (ModeSpec::TryDict, false),
        ] {
            let config = ChunkConfig::default().with_mode_spec(mode);
            let compressor = FileCompressor::default();
            let mut bytes = compressor.write_header(Vec::new()).unwrap();
            let mut chunk = compressor.chunk_compressor(&numbers, &config).unwrap();
            bytes = chunk.write_meta(bytes).unwrap();
            bytes = chunk.write_page(0, bytes).unwrap();
            let mut read = vec![0; numbers.len()];
            assert_eq!(decompress(&bytes, &mut read).is_some(), is_accepted);
            assert_eq!(read == numbers, is_accepted);
        }
    }
}
