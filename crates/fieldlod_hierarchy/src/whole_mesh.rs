//! The mesh as a whole at one level: cuts that keep nothing finer than a level, also known as discrete LODs.
//!
//! A prop is drawn with one command at one level. Its levels are a hierarchy too, of one group and one
//! unit for each level, so that the same selection decides for both kinds.

use std::ops::Range;

use glam::{Vec3, Vec4};

use crate::bounds::{Aabb, Sphere};
use crate::cards::{CardLevel, Cards};
use crate::hierarchy::{Group, Hierarchy, NO_GROUP, Unit, Vertices};

/// The whole mesh at one level.
#[derive(Clone, Debug, PartialEq)]
pub struct WholeMeshCut {
    /// Groups below this level are refined no more.
    pub group_level: u32,
    /// Triangles as indices into [`Hierarchy::vertices`].
    pub triangles: Vec<[u32; 3]>,
}

impl WholeMeshCut {
    /// A level that keeps more than this share of the triangles of the one before is left out.
    pub const MOST_KEPT: f32 = 0.75;
}

impl Hierarchy {
    /// The levels of the mesh as a whole, finest first, each with three quarters of the triangles of
    /// the one before at most.
    #[must_use]
    pub fn whole_mesh_cuts(&self) -> Vec<WholeMeshCut> {
        let mut kept: Vec<WholeMeshCut> = Vec::new();
        for group_level in 0..self.level_count() {
            let triangles = self.triangles_from_level(group_level);
            let most = kept
                .last()
                .map(|last| last.triangles.len() as f32 * WholeMeshCut::MOST_KEPT);
            if most.is_none_or(|most| triangles.len() as f32 <= most) {
                kept.push(WholeMeshCut {
                    group_level,
                    triangles,
                });
            }
        }
        kept
    }

    /// The levels of the whole mesh, one unit each, finest first; `None` if a level has more vertices
    /// than 16-bit indices reach.
    ///
    /// The result is a hierarchy itself, to be selected from like any other, which always draws exactly
    /// one unit: for props, of which one command draws all instances at a level. A level with more than
    /// three quarters of the triangles of the one before is left out. A level errs as much as
    /// [pictures of it](Group::whole_mesh_error_in_local) look, and without pictures as the worst of the
    /// groups that it simplifies. Its deviation is that of the worst in any case, but no more than the diameter of the
    /// sphere around all vertices, if deviations were measured. Of what is such a hierarchy already nothing changes.
    ///
    /// Levels of [cards](Cards) take the place of the first level of triangles that one of them beats, with no more
    /// error and no more triangles, and of all coarser ones.
    #[must_use]
    pub fn whole_mesh_levels(&self) -> Option<Self> {
        if self.is_of_whole_meshes() {
            return Some(self.clone());
        }
        let mut whole = Self {
            source: self.source,
            vertices: self.vertices.clone(),
            source_vertex_count: self.source_vertex_count,
            moved_from: self.moved_from.clone(),
            ..Self::default()
        };
        let mut levels = self.levels_of_triangles();
        let cards = self.cards.clone();
        whole.cards = cards.and_then(|cards| cards.instead_of(&mut levels));
        let facing = self.chain_sphere().and(levels.last());
        let facing = facing.map(|last| last.mean_normal);
        for level in whole.cards.iter().flat_map(|cards| &cards.levels) {
            let side_texels = whole.cards.as_ref().map_or(1, |c| c.picture.side_texels);
            let triangles = whole.vertices.push_cards(level, side_texels);
            levels.push(Level {
                error_in_local: level.error_in_local,
                deviation_in_local: f32::INFINITY,
                mean_normal: facing.unwrap_or_else(|| mean_normal(&whole.vertices, &triangles)),
                triangles,
            });
        }
        let moved_count = whole.vertices.positions.len() - whole.source_vertex_count as usize;
        if !whole.moved_from.is_empty() {
            whole.moved_from.resize(moved_count, 0);
        }
        let positions = whole.vertices.positions.iter().copied();
        let is_around_all = |sphere: &Sphere| sphere.contains_all(positions.clone());
        let own = self.chain_sphere().filter(is_around_all);
        let bounds = own.unwrap_or_else(|| Sphere::around(positions.clone()));
        // Of cards it is not known, but no point is further from any other.
        let most_in_local = match self.is_measured() {
            true => 2.0 * bounds.radius,
            false => f32::INFINITY,
        };
        // One unit and one group for each level that is kept.
        for (index, level) in levels.iter().enumerate() {
            // The coarsest level has no step to a next one.
            let next = levels.get(index + 1);
            let group = Group {
                bounds,
                error_in_local: next.map_or(f32::INFINITY, |next| next.error_in_local),
                deviation_in_local: next.map_or(f32::INFINITY, |next| {
                    next.deviation_in_local.min(most_in_local)
                }),
                mean_normal: level.mean_normal,
                ..Group::default()
            };
            whole.push_whole_mesh(&level.triangles, group)?;
        }
        Some(whole)
    }

    /// The levels of the mesh as triangles, finest first.
    fn levels_of_triangles(&self) -> Vec<Level> {
        let levels = self.whole_mesh_cuts().into_iter();
        let is_chain = self.chain_sphere().is_some();
        let level = |cut: WholeMeshCut| Level {
            error_in_local: self.largest_below(cut.group_level, seen_error),
            deviation_in_local: self
                .largest_below(cut.group_level, |group| group.deviation_in_local),
            mean_normal: match is_chain {
                true => self.groups[cut.group_level as usize].mean_normal,
                false => mean_normal(&self.vertices, &cut.triangles),
            },
            triangles: cut.triangles,
        };
        levels.map(level).collect()
    }

    /// Adds the next coarser level of the mesh as a whole: its triangles of [`Hierarchy::vertices`], and the group
    /// that simplifies them, which is as good as its error says. `None`, with nothing added, if it has more
    /// vertices than 16-bit indices reach.
    pub fn push_whole_mesh(&mut self, triangles: &[[u32; 3]], group: Group) -> Option<()> {
        let finer = (self.groups.len() as u32).checked_sub(1);
        // The vertices that are used, and where in that list each corner is.
        let mut used: Vec<u32> = triangles.as_flattened().to_vec();
        used.sort_unstable();
        used.dedup();
        let index_of = |vertex: &u32| u16::try_from(used.binary_search(vertex).ok()?).ok();
        let corners = triangles.as_flattened().iter();
        let indices: Vec<u16> = corners.map(index_of).collect::<Option<_>>()?;
        let position = |&vertex: &u32| self.vertices.positions[vertex as usize];
        let aabb = Aabb::around(used.iter().map(position)).unwrap_or_default();
        self.push_unit(finer.unwrap_or(NO_GROUP), aabb, used, indices);
        let seen = group.error_in_local;
        let group = Group {
            whole_mesh_error_in_local: if seen.is_finite() { seen } else { 0.0 },
            ..group
        };
        self.push_group(group, finer);
        Some(())
    }

    /// Whether this is a chain of levels of the mesh as a whole, with those of cards if it has some.
    pub(crate) fn is_of_whole_meshes(&self) -> bool {
        let levels = self.cards.as_ref().map_or(&[][..], |cards| &cards.levels);
        self.chain_sphere().is_some() && self.ends_with(levels)
    }

    /// The sphere of a chain of levels of the mesh as a whole, each as good as it looks, under that one.
    fn chain_sphere(&self) -> Option<Sphere> {
        let first = self.groups.first()?;
        let is_level = |(index, group): (usize, &Group)| {
            let is_seen = group.whole_mesh_error_in_local == group.error_in_local;
            let is_alone = group.unit_count == 1 && group.level as usize == index;
            is_alone && group.bounds == first.bounds && (is_seen || group.is_terminal())
        };
        let is_chain = self.groups.iter().enumerate().all(is_level);
        is_chain.then_some(first.bounds)
    }

    /// Whether the last units are so many levels of cards.
    fn ends_with(&self, levels: &[CardLevel]) -> bool {
        let last = self.units.len().checked_sub(levels.len());
        let is_of = |(unit, level): (&Unit, &CardLevel)| {
            let counts = [unit.vertex_count, unit.triangle_count];
            let group = unit.producer().map(|group| &self.groups[group as usize]);
            group.is_none_or(|group| group.error_in_local == level.error_in_local)
                && counts.map(|count| count as usize) == [4, 2].map(|each| each * level.cards.len())
        };
        last.is_some_and(|first| self.units[first..].iter().zip(levels).all(is_of))
    }

    /// Takes away the finest cards of a chain of whole meshes of which only coarse levels were read, none of them
    /// finer than its cards.
    pub(crate) fn remove_cards_left_out(&mut self) {
        let Some(mut cards) = self.cards.take() else {
            return;
        };
        let left_out = cards.levels.len().saturating_sub(self.units.len());
        if self.ends_with(&cards.levels[left_out..]) {
            cards.levels.drain(..left_out);
        }
        self.cards = Some(cards);
    }

    /// The largest of the groups that are refined no more from `group_level` on; 0 of none.
    #[must_use]
    pub fn largest_below(&self, group_level: u32, length: impl Fn(&Group) -> f32) -> f32 {
        let simplified = self.groups.iter();
        simplified
            .filter(|group| group.level < group_level && !group.is_terminal())
            .map(length)
            .fold(0.0, f32::max)
    }

    /// The cut that keeps nothing finer than `group_level`, unless there is nothing coarser.
    fn triangles_from_level(&self, group_level: u32) -> Vec<[u32; 3]> {
        let is_coarse = |group: &Group| group.level >= group_level;
        let mut refined: Vec<bool> = self.groups.iter().map(is_coarse).collect();
        self.close_refinement(&mut refined);
        let units = self.drawn_units(&refined);
        units
            .flat_map(|unit| self.triangles_of(&self.units[unit]))
            .collect()
    }

    /// The units that are levels of cards, one each: the last of a
    /// [hierarchy of whole meshes](Hierarchy::whole_mesh_levels), none of any other. All are, if only
    /// [coarse sections](crate::BakedFile::from_bytes_coarse) were read.
    #[must_use]
    pub fn card_units(&self) -> Range<usize> {
        let end = self.units.len();
        let cards = self.cards.as_ref().filter(|_| self.is_of_whole_meshes());
        end - cards.map_or(0, |cards| cards.levels.len())..end
    }

    /// The hierarchy without units that are cards; `None` if none are.
    #[must_use]
    pub fn without_card_units(&self) -> Option<Self> {
        let cards = self.card_units();
        if cards.is_empty() {
            return None;
        }
        let mut left = Self {
            cards: None,
            ..self.clone()
        };
        left.units.truncate(cards.start);
        left.groups.truncate(cards.start);
        let first = &self.units[cards.start];
        left.unit_vertices.truncate(first.first_vertex as usize);
        left.indices.truncate(first.first_triangle as usize * 3);
        left.finer
            .truncate(self.groups[cards.start].first_finer as usize);
        // Nothing is coarser any more.
        if let Some(last) = left.groups.last_mut() {
            (last.error_in_local, last.deviation_in_local) = (f32::INFINITY, f32::INFINITY);
            last.whole_mesh_error_in_local = 0.0;
        }
        Some(left)
    }
}

/// A level of the mesh as a whole.
#[derive(Debug)]
struct Level {
    triangles: Vec<[u32; 3]>,
    /// Against the source.
    error_in_local: f32,
    deviation_in_local: f32,
    mean_normal: Vec3,
}

impl Cards {
    /// Takes levels of triangles away, from the first on of which a level of cards errs no more with no more triangles.
    /// Returns the levels of cards that follow what is left; `None` if none are of use. No triangles come after cards:
    /// if one of the levels taken away beats all cards, it is lost.
    fn instead_of(mut self, levels: &mut Vec<Level>) -> Option<Self> {
        let beats = |level: &CardLevel, other: &Level| {
            level.error_in_local <= other.error_in_local
                && 2 * level.cards.len() <= other.triangles.len()
        };
        let beaten = levels
            .iter()
            .position(|other| self.levels.iter().any(|level| beats(level, other)));
        levels.truncate(beaten.unwrap_or(levels.len()).max(1));
        let last = levels.last()?;
        let mut most = last.triangles.len() as f32 * WholeMeshCut::MOST_KEPT;
        let mut least_error = last.error_in_local;
        self.levels.retain(|level| {
            let triangles = 2.0 * level.cards.len() as f32;
            let is_coarser = triangles <= most && level.error_in_local >= least_error;
            if is_coarser {
                most = triangles * WholeMeshCut::MOST_KEPT;
                least_error = level.error_in_local;
            }
            is_coarser
        });
        (!self.levels.is_empty()).then_some(self)
    }
}

impl Vertices {
    /// Adds the corners of cards, and returns their triangles.
    fn push_cards(&mut self, level: &CardLevel, side_texels: u32) -> Vec<[u32; 3]> {
        let mut triangles = Vec::with_capacity(level.cards.len() * 2);
        for card in &level.cards {
            let a = self.positions.len() as u32;
            triangles.extend([[a, a + 1, a + 2], [a, a + 2, a + 3]]);
            let [tangent, _, normal] = card.axes();
            self.positions.extend(card.corners());
            let uvs = card.uvs(side_texels);
            push_if_any(&mut self.normals, [normal; 4]);
            push_if_any(&mut self.uvs, uvs);
            push_if_any(&mut self.tangents, [tangent.extend(1.0); 4]);
            push_if_any(&mut self.uvs_1, uvs);
            push_if_any(&mut self.colors, [Vec4::ONE; 4]);
        }
        triangles
    }
}

fn push_if_any<T>(values: &mut Vec<T>, four: [T; 4]) {
    if !values.is_empty() {
        values.extend(four);
    }
}

/// What the step to a level errs by: as pictures of it look, if some were drawn.
fn seen_error(group: &Group) -> f32 {
    match group.whole_mesh_error_in_local {
        0.0 => group.error_in_local,
        seen => seen,
    }
}

/// Area-weighted mean of the unit normals.
fn mean_normal(vertices: &Vertices, triangles: &[[u32; 3]]) -> Vec3 {
    let corner = |vertex: u32| vertices.positions[vertex as usize];
    let crosses = triangles.iter().map(|&[a, b, c]| {
        let (a, b, c) = (corner(a), corner(b), corner(c));
        (b - a).cross(c - a)
    });
    let (sum, area) = crosses.fold((Vec3::ZERO, 0.0f32), |(sum, area), cross| {
        (sum + cross, area + cross.length())
    });
    if area > 0.0 {
        (sum / area).clamp_length_max(1.0)
    } else {
        Vec3::ZERO
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fixtures;

    #[test]
    fn whole_mesh_levels_are_a_valid_hierarchy_of_one_unit_a_level() {
        for levels in 1..4 {
            let baked = fixtures::grid_pyramid(levels);
            let whole = baked.whole_mesh_levels().unwrap();
            assert_eq!(whole.validate(), Ok(()));
            assert_eq!(whole.units.len(), whole.groups.len());
            assert_eq!(whole.source_triangle_count(), baked.source_triangle_count());
            assert_eq!(whole.whole_mesh_levels().as_ref(), Some(&whole));
        }
    }

    #[test]
    fn levels_shrink_and_errors_grow() {
        let whole = fixtures::grid_pyramid(3).whole_mesh_levels().unwrap();
        let counts: Vec<u32> = whole.units.iter().map(|u| u.triangle_count).collect();
        assert!(counts.len() > 2, "{counts:?}");
        for pair in counts.windows(2) {
            assert!(pair[1] * 4 <= pair[0] * 3, "{counts:?}");
        }
        assert!(whole.groups.is_sorted_by_key(|g| g.error_in_local));
    }

    /// Even where the mesh has a single level, where nothing was measured, and where cards reach beyond.
    #[test]
    fn cards_follow_the_levels_of_triangles() {
        let mut unmeasured = fixtures::grid_pyramid(2);
        for group in &mut unmeasured.groups {
            group.deviation_in_local = f32::INFINITY;
        }
        for baked in [
            fixtures::grid_pyramid(0),
            fixtures::grid_pyramid(2),
            unmeasured,
        ] {
            let (levels, is_measured) = (baked.level_count(), baked.is_measured());
            let cards = Some(fixtures::leafy_cards(4));
            let whole = Hierarchy { cards, ..baked }.whole_mesh_levels().unwrap();
            assert_eq!(whole.validate(), Ok(()));
            assert_eq!(whole.level_count(), levels + 2);
            assert_eq!(whole.is_measured(), is_measured);
            assert_eq!(whole.whole_mesh_levels().as_ref(), Some(&whole));
        }
    }

    #[test]
    fn nothing_has_no_levels_of_cards() {
        let cards = Some(fixtures::leafy_cards(4));
        let baked = Hierarchy {
            cards,
            ..Hierarchy::default()
        };
        assert_eq!(baked.whole_mesh_levels(), Some(Hierarchy::default()));
    }

    #[test]
    fn refuses_levels_that_need_wider_indices() {
        let mut baked = fixtures::two_level_strip();
        let far = 70_000u32;
        baked.vertices.positions = (0..=far).map(|i| Vec3::splat(i as f32)).collect();
        baked.unit_vertices = (0..=far).collect();
        // One unit of the strip's source that uses them all cannot be indexed by 16 bits; the
        // level would have to.
        let triangles: Vec<[u32; 3]> = (0..far - 1).map(|i| [i, i + 1, i + 2]).collect();
        assert!(
            baked
                .push_whole_mesh(&triangles, Group::default())
                .is_none()
        );
    }
}
