//! Where each picture lies in one for all.

use glam::UVec2;

/// Texels between two pictures: smaller sizes of the texture mix neighbours.
const GAP: u32 = 2;

/// Places rectangles on shelves in a square of `side` texels: the first texel of each, or `None` if they do not fit.
pub(super) fn pack(sizes: &[UVec2], side: u32) -> Option<Vec<UVec2>> {
    let mut order: Vec<usize> = (0..sizes.len()).collect();
    order.sort_by_key(|&index| (u32::MAX - sizes[index].y, index));
    let mut places = vec![UVec2::ZERO; sizes.len()];
    let mut at = UVec2::splat(GAP);
    let mut shelf = 0;
    for index in order {
        let size = sizes[index];
        if at.x + size.x + GAP > side {
            at = UVec2::new(GAP, at.y + shelf + GAP);
            shelf = 0;
        }
        if (at + size + GAP).max_element() > side {
            return None;
        }
        places[index] = at;
        at.x += size.x + GAP;
        shelf = shelf.max(size.y);
    }
    Some(places)
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    proptest! {
        #[test]
        fn rectangles_lie_apart_inside(sides in prop::collection::vec((1u32..20, 1u32..20), 1..60)) {
            let sizes: Vec<UVec2> = sides.into_iter().map(UVec2::from).collect();
            let Some(places) = pack(&sizes, 128) else { return Ok(()) };
            let ends: Vec<UVec2> = places.iter().zip(&sizes).map(|(place, size)| place + size).collect();
            for (a, (first, end)) in places.iter().zip(&ends).enumerate() {
                prop_assert!(first.cmpge(UVec2::splat(GAP)).all() && (end + GAP).cmple(UVec2::splat(128)).all());
                for (other, other_end) in places.iter().zip(&ends).skip(a + 1) {
                    let is_apart = (end + GAP).cmple(*other).any() || (other_end + GAP).cmple(*first).any();
                    prop_assert!(is_apart, "{first} {end}, {other} {other_end}");
                }
            }
        }
    }

    #[test]
    fn what_is_too_much_does_not_fit() {
        assert_eq!(pack(&[UVec2::splat(30); 4], 64), None);
        assert_eq!(pack(&[UVec2::new(200, 1)], 64), None);
        assert!(pack(&[UVec2::splat(28); 4], 64).is_some());
    }
}
