//! Selects the places from which the next level is measured.

use super::seen::Seen;
use crate::levels::clusters::Place;

/// For each cluster, at most so many of the places nearest to each of its triangles.
pub(super) fn handed_on(seen: &[Seen], clusters: &[Vec<u32>], most: usize) -> Vec<Vec<Place>> {
    let triangle_of = |at: u32| seen[at as usize].nearest.triangle;
    let mut order: Vec<u32> = (0..seen.len() as u32).collect();
    order.sort_by_key(|&at| triangle_of(at));
    let mut of_triangles = order.chunk_by_mut(|&a, &b| triangle_of(a) == triangle_of(b));
    let mut next = of_triangles.next();
    let mut end = 0;
    let places = clusters.iter().map(|corners| {
        end += corners.len() as u32 / 3;
        let mut places = Vec::new();
        while let Some(of_one) = next.take_if(|of_one| triangle_of(of_one[0]) < end) {
            let picked = pick(seen, of_one, most);
            places.extend(picked.map(|at| seen[at as usize].place));
            next = of_triangles.next();
        }
        places
    });
    places.collect()
}

/// Of the places of a triangle the farthest, and as many of the others, evenly: where all is flat, a
/// later level may stray anywhere.
fn pick<'a>(
    seen: &[Seen],
    of_one: &'a mut [u32],
    most: usize,
) -> impl Iterator<Item = u32> + use<'a> {
    let is_too_many = of_one.len() > most;
    let farthest = if is_too_many {
        most.div_ceil(2)
    } else {
        of_one.len()
    };
    if is_too_many {
        let distance = |at: u32| seen[at as usize].nearest.distance_squared;
        of_one.select_nth_unstable_by(farthest, |&a, &b| {
            let further = distance(b).total_cmp(&distance(a));
            further.then(a.cmp(&b))
        });
    }
    let (first, others) = of_one.split_at_mut(farthest);
    others.sort_unstable();
    let wanted = most.saturating_sub(farthest).min(others.len());
    let evenly = (0..wanted).map(move |k| others[k * others.len() / wanted]);
    first.iter().copied().chain(evenly)
}
