//! Codes arrays of plain structs field by field, because the same field has similar values in neighbouring structs.

use bytemuck::Pod;

use crate::file::error::FileError;
use crate::file::reader::Reader;
use crate::file::sections::numbers;

pub(crate) fn write<T: Pod>(bytes: &mut Vec<u8>, records: &[T]) {
    let fields = const { fields_of::<T>() };
    let words: &[u32] = bytemuck::cast_slice(records);
    for field in 0..fields {
        let column: Vec<u32> = words.iter().skip(field).step_by(fields).copied().collect();
        numbers::write(bytes, &column);
    }
}

pub(crate) fn read<T: Pod>(
    reader: &mut Reader<'_>,
    count: usize,
    what: &'static str,
) -> Result<Vec<T>, FileError> {
    let fields = const { fields_of::<T>() };
    let mut records = vec![T::zeroed(); count];
    let words: &mut [u32] = bytemuck::cast_slice_mut(&mut records);
    for field in 0..fields {
        let column = numbers::read(reader, count, what)?;
        let places = words.iter_mut().skip(field).step_by(fields);
        for (place, number) in places.zip(column) {
            *place = number;
        }
    }
    Ok(records)
}

const fn fields_of<T>() -> usize {
    // Records are read as 32-bit words. Another size or alignment fails at compile time.
    assert!(size_of::<T>().is_multiple_of(4) && align_of::<T>() == 4);
    size_of::<T>() / 4
}
