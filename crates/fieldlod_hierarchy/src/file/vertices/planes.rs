//! Codes columns of vertex attributes, one after the other.
//!
//! Floating-point numbers are written as integers in the same order, so that numbers of similar size have a small
//! difference. The third coordinate of a unit vector is written as the difference to √(1 − x² − y²), which is mostly a
//! few units of the last place. Its sign is the lowest bit.

use crate::file::error::FileError;
use crate::file::reader::Reader;
use crate::file::sections::numbers::{self, unzigzag, zigzag};
use crate::file::vertices::attribute_columns::Columns;

const SIGN: u32 = 1 << 31;

/// How the numbers of a column are written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Plane {
    /// Integers.
    Integers,
    /// Bits of floating-point numbers.
    Floats,
    /// Bits of the third coordinate of unit vectors. The two columns before hold the other two coordinates.
    ThirdOfUnit,
}

/// Writes the vertices of `columns` from vertex `first` on.
pub(crate) fn write(bytes: &mut Vec<u8>, columns: &Columns, first: usize, planes: &[Plane]) {
    let column = |index: usize| columns.columns[index][first..].iter().copied();
    for (index, plane) in planes.iter().enumerate() {
        let numbers: Vec<u32> = match plane {
            Plane::Integers => column(index).collect(),
            Plane::Floats => column(index).map(ordered).collect(),
            Plane::ThirdOfUnit => {
                let others = column(index - 2).zip(column(index - 1));
                let coordinates = others.zip(column(index));
                let number = |((x, y), z)| difference_to_third([x, y], z);
                coordinates.map(number).collect()
            }
        };
        numbers::write(bytes, &numbers);
    }
}

/// Reads `count` vertices and appends them to `columns`.
pub(crate) fn read(
    reader: &mut Reader<'_>,
    columns: &mut Columns,
    count: usize,
    planes: &[Plane],
) -> Result<(), FileError> {
    let mut numbers = Vec::new();
    for (index, plane) in planes.iter().enumerate() {
        numbers::read_into(reader, count, "the vertices", &mut numbers)?;
        let (before, rest) = columns.columns.split_at_mut(index);
        let column = &mut rest[0];
        let first = column.len();
        let numbers = numbers.iter().copied();
        match plane {
            Plane::Integers => column.extend(numbers),
            Plane::Floats => column.extend(numbers.map(float_of)),
            Plane::ThirdOfUnit => {
                let others = before[index - 2][first..].iter();
                let others = others.zip(&before[index - 1][first..]);
                let third = |((&x, &y), number)| third_with([x, y], number);
                column.extend(others.zip(numbers).map(third));
            }
        }
    }
    Ok(())
}

/// Maps the bits of floating-point numbers to integers in the same order.
fn ordered(bits: u32) -> u32 {
    if bits & SIGN == 0 { bits | SIGN } else { !bits }
}

/// Inverse of [`ordered`].
fn float_of(number: u32) -> u32 {
    if number & SIGN == 0 {
        !number
    } else {
        number & !SIGN
    }
}

fn difference_to_third(others: [u32; 2], third: u32) -> u32 {
    // Rotated, the sign is the lowest bit.
    let size = size_of_third(others).rotate_left(1);
    zigzag(third.rotate_left(1).wrapping_sub(size))
}

/// Inverse of [`difference_to_third`].
fn third_with(others: [u32; 2], difference: u32) -> u32 {
    let size = size_of_third(others).rotate_left(1);
    size.wrapping_add(unzigzag(difference)).rotate_right(1)
}

/// The bits of the absolute third coordinate of a unit vector. It uses basic operations only, because their results are
/// equal on all machines.
fn size_of_third(others: [u32; 2]) -> u32 {
    let [x, y] = others.map(|bits| f64::from(f32::from_bits(bits)));
    let squared = 1.0 - x * x - y * y;
    // Without a size, also for NaN, 0 takes its place: the sign of NaN differs between machines.
    let size = if squared > 0.0 { squared.sqrt() } else { 0.0 };
    (size as f32).to_bits()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fixtures::Random;

    #[test]
    fn any_bits_round_trip() {
        let mut random = Random::new(0);
        for _ in 0..10_000 {
            let [x, y, z] = [(); 3].map(|()| random.next_u64() as u32);
            assert_eq!(float_of(ordered(x)), x);
            let number = difference_to_third([x, y], z);
            assert_eq!(third_with([x, y], number), z);
        }
    }

    #[test]
    fn third_coordinates_of_unit_vectors_are_small_numbers() {
        let mut random = Random::new(0);
        let mut bits = 0;
        for _ in 0..10_000 {
            let [x, y, z] = random.vector().normalize().to_array().map(f32::to_bits);
            bits += u32::BITS - difference_to_third([x, y], z).leading_zeros();
        }
        assert!(bits < 60_000, "{bits}");
    }
}
