//! The order of instances in columns: instances that are added together follow a Morton curve, so that 64 consecutive
//! instances are neighbours.

use glam::Vec3;

/// Bits of a coordinate in a code: three coordinates fit into 64 bits.
const BITS: u32 = 21;

/// Sorts items by their places on a Morton curve through the box of all items, and items at the same place by value.
pub(super) fn sort_along_curve<T: Copy + Ord>(items: &mut Vec<T>, place: impl Fn(T) -> Vec3) {
    let places = items.iter().map(|&item| place(item));
    let finite = places.filter(|place| place.is_finite());
    let corners = finite.map(|place| (place, place));
    let Some((min, max)) = corners.reduce(|a, b| (a.0.min(b.0), a.1.max(b.1))) else {
        return items.sort_unstable();
    };
    let cells_per_unit = (1u32 << BITS) as f32 / (max - min).max_element();
    let code = |item: T| {
        // Casts saturate, and take NaN to 0.
        let cell = (place(item) - min) * cells_per_unit;
        let [x, y, z] = cell.to_array().map(|at| spread(at as u64));
        x | y << 1 | z << 2
    };
    let mut coded: Vec<(u64, T)> = items.iter().map(|&item| (code(item), item)).collect();
    coded.sort_unstable();
    items.clear();
    items.extend(coded.into_iter().map(|(_, item)| item));
}

/// The low bits of a number with two zeros between each.
fn spread(number: u64) -> u64 {
    let mut bits = number.min((1 << BITS) - 1);
    // Each step halves the runs of bits and moves the upper halves, until every run is one bit.
    for (shift, mask) in [
        (32, 0x001f_0000_0000_ffff),
        (16, 0x001f_0000_ff00_00ff),
        (8, 0x100f_00f0_0f00_f00f),
        (4, 0x10c3_0c30_c30c_30c3),
        (2, 0x1249_2492_4924_9249),
    ] {
        bits = (bits | bits << shift) & mask;
    }
    bits
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn chunks_of_sorted_items_hold_neighbours() {
        let place = |index: u32| Vec3::new((index % 64) as f32, 0.0, (index / 64) as f32);
        let mut sorted: Vec<u32> = (0..64 * 64).rev().collect();
        sort_along_curve(&mut sorted, place);
        for chunk in sorted.chunks(64) {
            let places = chunk.iter().map(|&index| place(index));
            let (min, max) = places.fold((Vec3::INFINITY, Vec3::NEG_INFINITY), |(min, max), at| {
                (min.min(at), max.max(at))
            });
            assert!((max - min).max_element() <= 8.0);
        }
    }

    #[test]
    fn places_of_nan_are_sorted() {
        let mut items = vec![2, 1, 0];
        sort_along_curve(&mut items, |_| Vec3::NAN);
        assert_eq!(items, [0, 1, 2]);
        sort_along_curve(&mut items, |item| {
            Vec3::splat([f32::NAN, 1.0, f32::INFINITY][item])
        });
        assert_eq!(items.len(), 3);
    }
}
