//! Which levels of triangles are drawn in place of levels of cards, while these cannot be.

use fieldlod_hierarchy::Hierarchy;

/// The levels of the mesh as a whole that end with triangles, of what also has `levels` that end with cards; `None` if
/// they do not, or if only they are known of it.
pub(super) fn levels_of_triangles(mut baked: Hierarchy, levels: &Hierarchy) -> Option<Hierarchy> {
    levels.cards.as_ref()?;
    if !baked.card_units().is_empty() {
        return None;
    }
    baked.cards = None;
    baked.whole_mesh_levels()
}

/// For each level of cards the coarsest level of triangles that errs no more, by its index; `None` where all of these err
/// more. Both are told by their errors, finest first.
pub(super) fn stand_ins(cards: &[f32], triangles: &[f32]) -> Vec<Option<usize>> {
    let coarsest = |most: &f32| triangles.iter().rposition(|error| error <= most);
    cards.iter().map(coarsest).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_coarsest_level_stands_in_that_errs_no_more() {
        let triangles = [1.0, 1.5, 2.0, 3.0, 8.0];
        let cards = [0.5, 1.0, 1.9, 2.5, 4.0, 7.9, 9.0];
        let expected = [None, Some(0), Some(1), Some(2), Some(3), Some(3), Some(4)];
        assert_eq!(stand_ins(&cards, &triangles), expected);
        assert_eq!(stand_ins(&cards[..2], &[]), [None; 2]);
    }
}
