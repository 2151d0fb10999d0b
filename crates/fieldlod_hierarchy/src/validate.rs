//! Every invariant of a hierarchy, one small check each. The loader, the baker's tests and the
//! selection's tests call them all through [`Hierarchy::validate`].

use thiserror::Error;

use crate::{Group, Hierarchy, NO_GROUP};

/// The first broken invariant that was found.
#[derive(Clone, Debug, Error, PartialEq)]
#[non_exhaustive]
#[expect(
    missing_docs,
    reason = "the fields are named by each variant's message"
)]
pub enum InvalidHierarchy {
    /// An attribute array does not have one entry per vertex.
    #[error("{count} {attribute} for {vertices} vertices")]
    AttributeCount {
        attribute: &'static str,
        count: usize,
        vertices: usize,
    },
    /// A position is NaN or infinite.
    #[error("vertex {vertex} has a position that is not finite")]
    PositionNotFinite { vertex: usize },
    /// Sub-ranges must follow each other without gap or overlap and end with the array.
    #[error("the {what} of {owner} {index} do not start where those before end, or end outside")]
    BrokenRange {
        what: &'static str,
        owner: &'static str,
        index: usize,
    },
    /// A reference to something that does not exist.
    #[error("{owner} {index} refers to {what} {target}, which does not exist")]
    DanglingReference {
        owner: &'static str,
        index: usize,
        what: &'static str,
        target: usize,
    },
    /// A finer group must come before the coarser ones.
    #[error("group {group} counts group {finer} as finer, which does not come before it")]
    FinerNotBefore { group: usize, finer: usize },
    /// The finer groups are exactly the producers of the units consumed.
    #[error("the finer groups of group {group} are not the producers of its units")]
    FinerMismatch { group: usize },
    /// A group without units.
    #[error("group {group} consumes no unit")]
    EmptyGroup { group: usize },
    /// A unit without triangles.
    #[error("unit {unit} has no triangle")]
    EmptyUnit { unit: usize },
    /// A unit in the range of one group that names another as consumer.
    #[error("unit {unit} lies in the range of group {group} but names group {named}")]
    WrongConsumer {
        unit: usize,
        group: usize,
        named: usize,
    },
    /// A terminal group has no simplification, so nothing can be produced by it.
    #[error("unit {unit} is produced by group {group}, which is terminal")]
    ProducedByTerminal { unit: usize, group: usize },
    /// A group that is not terminal must produce something, or its surface would vanish.
    #[error("group {group} is not terminal but produces no unit")]
    ProducesNothing { group: usize },
    /// Levels count simplifications.
    #[error("group {group} stands at level {level}, but its finer groups put it at {expected}")]
    BadLevel {
        group: usize,
        level: u32,
        expected: u32,
    },
    /// Errors are lengths and never shrink from finer to coarser.
    #[error("group {group} has error {error}, which is negative, NaN or below a finer group's")]
    BadError { group: usize, error: f32 },
    /// Deviations are lengths, never shrink from finer to coarser, and are infinite exactly where
    /// the error is.
    #[error(
        "group {group} has deviation {deviation}, which is negative, NaN, below a finer group's, or \
         infinite where the error is not or the other way round"
    )]
    BadDeviation { group: usize, deviation: f32 },
    /// Bounds are finite and not negative.
    #[error("the bounds of {owner} {index} are not finite or negative")]
    BadBounds { owner: &'static str, index: usize },
    /// Bounds hold what they claim to.
    #[error("the bounds of {owner} {index} do not hold its triangles")]
    LooseTriangles { owner: &'static str, index: usize },
    /// The mean of unit vectors is no longer than 1.
    #[error("group {group} has a mean normal that is NaN or longer than 1")]
    BadMeanNormal { group: usize },
}

use InvalidHierarchy as E;

impl Hierarchy {
    /// Checks every invariant.
    ///
    /// # Errors
    /// The first invariant found broken.
    pub fn validate(&self) -> Result<(), InvalidHierarchy> {
        self.check_vertices()?;
        self.check_ranges()?;
        self.check_references()?;
        self.check_links()?;
        self.check_errors()?;
        self.check_bounds()
    }

    fn check_vertices(&self) -> Result<(), E> {
        let vertices = self.vertices.positions.len();
        let counts = [
            ("normals", self.vertices.normals.len()),
            ("uvs", self.vertices.uvs.len()),
            ("tangents", self.vertices.tangents.len()),
            ("second uvs", self.vertices.uvs_1.len()),
            ("colors", self.vertices.colors.len()),
        ];
        for (attribute, count) in counts {
            if count != 0 && count != vertices {
                return Err(E::AttributeCount {
                    attribute,
                    count,
                    vertices,
                });
            }
        }
        match self.vertices.positions.iter().position(|p| !p.is_finite()) {
            Some(vertex) => Err(E::PositionNotFinite { vertex }),
            None => Ok(()),
        }
    }

    fn check_ranges(&self) -> Result<(), E> {
        let units_of_groups = self.groups.iter().map(|g| (g.first_unit, g.unit_count));
        check_tiling("units", "group", units_of_groups, self.units.len())?;
        let finer = self.groups.iter().map(|g| (g.first_finer, g.finer_count));
        check_tiling("finer groups", "group", finer, self.finer.len())?;
        let vertices = self.units.iter().map(|u| (u.first_vertex, u.vertex_count));
        check_tiling("vertices", "unit", vertices, self.unit_vertices.len())?;
        if !self.indices.len().is_multiple_of(3) {
            return Err(E::BrokenRange {
                what: "triangles",
                owner: "unit",
                index: self.units.len(),
            });
        }
        let triangle_count = self.indices.len() / 3;
        let triangles = self
            .units
            .iter()
            .map(|u| (u.first_triangle, u.triangle_count));
        check_tiling("triangles", "unit", triangles, triangle_count)?;
        let clusters = self
            .units
            .iter()
            .map(|u| (u.first_cluster, u.cluster_count));
        check_tiling("clusters", "unit", clusters, self.clusters.len())?;
        let triangles = self
            .clusters
            .iter()
            .map(|c| (c.first_triangle, c.triangle_count));
        check_tiling("triangles", "cluster", triangles, triangle_count)?;
        self.check_clusters_of_units()
    }

    /// Both tile the same triangles, so equal counts are equal ranges.
    fn check_clusters_of_units(&self) -> Result<(), E> {
        for (index, unit) in self.units.iter().enumerate() {
            let clusters = &self.clusters[unit.clusters()];
            let triangles = clusters.iter().map(|c| u64::from(c.triangle_count));
            if triangles.sum::<u64>() != u64::from(unit.triangle_count) {
                let (what, owner) = ("clusters", "unit");
                return Err(E::BrokenRange { what, owner, index });
            }
        }
        Ok(())
    }

    fn check_references(&self) -> Result<(), E> {
        let dangling = |owner, index, what, target: usize, end: usize| {
            if target < end {
                return Ok(());
            }
            Err(E::DanglingReference {
                owner,
                index,
                what,
                target,
            })
        };
        for (index, unit) in self.units.iter().enumerate() {
            let groups = self.groups.len();
            dangling("unit", index, "group", unit.consumed_by as usize, groups)?;
            if let Some(producer) = unit.producer() {
                dangling("unit", index, "group", producer as usize, groups)?;
            }
            for &vertex in self.vertices_of(unit) {
                let end = self.vertices.positions.len();
                dangling("unit", index, "vertex", vertex as usize, end)?;
            }
            for &corner in self.indices_of(unit) {
                let end = unit.vertex_count as usize;
                dangling("unit", index, "vertex", usize::from(corner), end)?;
            }
        }
        for (index, &group) in self.finer.iter().enumerate() {
            let end = self.groups.len();
            dangling("finer link", index, "group", group as usize, end)?;
        }
        Ok(())
    }

    fn check_links(&self) -> Result<(), E> {
        let mut produces = vec![false; self.groups.len()];
        for (index, group) in self.groups.iter().enumerate() {
            if group.unit_count == 0 {
                return Err(E::EmptyGroup { group: index });
            }
            self.check_units_of(index)?;
            self.check_finer_of(index)?;
            self.check_level_of(index)?;
        }
        for (unit, producer) in self.units.iter().map(|u| u.produced_by).enumerate() {
            if producer == NO_GROUP {
                continue;
            }
            let group = producer as usize;
            produces[group] = true;
            if self.groups[group].is_terminal() {
                return Err(E::ProducedByTerminal { unit, group });
            }
        }
        let silent = |(group, &produces): (usize, &bool)| {
            (!produces && !self.groups[group].is_terminal()).then_some(group)
        };
        match produces.iter().enumerate().find_map(silent) {
            Some(group) => Err(E::ProducesNothing { group }),
            None => Ok(()),
        }
    }

    fn check_units_of(&self, group: usize) -> Result<(), E> {
        for unit in self.groups[group].units() {
            if self.units[unit].triangle_count == 0 {
                return Err(E::EmptyUnit { unit });
            }
            let named = self.units[unit].consumed_by as usize;
            if named != group {
                return Err(E::WrongConsumer { unit, group, named });
            }
        }
        Ok(())
    }

    fn check_finer_of(&self, group: usize) -> Result<(), E> {
        let links = self.finer_groups(&self.groups[group]);
        if let Some(&finer) = links.iter().find(|&&finer| finer as usize >= group) {
            let finer = finer as usize;
            return Err(E::FinerNotBefore { group, finer });
        }
        let mut stated = links.to_vec();
        stated.sort_unstable();
        let units = &self.units[self.groups[group].units()];
        let mut actual: Vec<u32> = units.iter().filter_map(crate::Unit::producer).collect();
        actual.sort_unstable();
        actual.dedup();
        if stated == actual {
            Ok(())
        } else {
            Err(E::FinerMismatch { group })
        }
    }

    fn check_level_of(&self, group: usize) -> Result<(), E> {
        let level = self.groups[group].level;
        let finer = self.finer_groups(&self.groups[group]).iter();
        // Finer groups come before and were checked, so that this cannot overflow.
        let above = finer.map(|&finer| self.groups[finer as usize].level + 1);
        let expected = above.max().unwrap_or(0);
        if level == expected {
            return Ok(());
        }
        Err(E::BadLevel {
            group,
            level,
            expected,
        })
    }

    fn check_errors(&self) -> Result<(), E> {
        for group in 0..self.groups.len() {
            let error = self.groups[group].error_in_local;
            if error.is_nan() || error < self.largest_below(group, |finer| finer.error_in_local) {
                return Err(E::BadError { group, error });
            }
            self.check_deviation_of(group)?;
            let length = self.groups[group].mean_normal.length();
            if length.is_nan() || length > 1.0 + 1e-4 {
                return Err(E::BadMeanNormal { group });
            }
        }
        Ok(())
    }

    fn check_deviation_of(&self, group: usize) -> Result<(), E> {
        let deviation = self.groups[group].deviation_in_local;
        let floor = self.largest_below(group, |finer| finer.deviation_in_local);
        let ends = deviation == f32::INFINITY;
        if deviation.is_nan() || deviation < floor || ends != self.groups[group].is_terminal() {
            return Err(E::BadDeviation { group, deviation });
        }
        Ok(())
    }

    /// The largest `length` of the finer groups of `group`; 0 without any.
    fn largest_below(&self, group: usize, length: impl Fn(&Group) -> f32) -> f32 {
        let finer = self.finer_groups(&self.groups[group]).iter();
        let lengths = finer.map(|&finer| length(&self.groups[finer as usize]));
        lengths.fold(0.0, f32::max)
    }

    fn check_bounds(&self) -> Result<(), E> {
        for (index, group) in self.groups.iter().enumerate() {
            check_sphere("group", index, &group.bounds)?;
        }
        for (index, cluster) in self.clusters.iter().enumerate() {
            check_sphere("cluster", index, &cluster.bounds)?;
        }
        for index in 0..self.units.len() {
            self.check_bounds_of_unit(index)?;
            self.check_bounds_of_clusters(index)?;
        }
        Ok(())
    }

    fn check_bounds_of_unit(&self, index: usize) -> Result<(), E> {
        let unit = &self.units[index];
        let groups = [Some(unit.consumed_by), unit.producer()];
        for &vertex in self.vertices_of(unit) {
            let position = self.vertices.positions[vertex as usize];
            if !unit.aabb.contains(position) {
                let owner = "unit";
                return Err(E::LooseTriangles { owner, index });
            }
            for group in groups.into_iter().flatten() {
                let index = group as usize;
                if !self.groups[index].bounds.contains(position) {
                    let owner = "group";
                    return Err(E::LooseTriangles { owner, index });
                }
            }
        }
        Ok(())
    }

    fn check_bounds_of_clusters(&self, unit: usize) -> Result<(), E> {
        let unit = &self.units[unit];
        let mut triangles = self.source_triangles_of(unit);
        for index in unit.clusters() {
            let cluster = &self.clusters[index];
            let corners = triangles.by_ref().take(cluster.triangle_count as usize);
            let mut positions = corners
                .flatten()
                .map(|v| self.vertices.positions[v as usize]);
            if !positions.all(|position| cluster.bounds.contains(position)) {
                let owner = "cluster";
                return Err(E::LooseTriangles { owner, index });
            }
        }
        Ok(())
    }
}

fn check_sphere(owner: &'static str, index: usize, sphere: &crate::Sphere) -> Result<(), E> {
    let finite = sphere.center.is_finite() && sphere.radius.is_finite();
    if finite && sphere.radius >= 0.0 {
        Ok(())
    } else {
        Err(E::BadBounds { owner, index })
    }
}

fn check_tiling(
    what: &'static str,
    owner: &'static str,
    ranges: impl Iterator<Item = (u32, u32)>,
    end: usize,
) -> Result<(), E> {
    let mut next = 0u64;
    let mut last = 0;
    for (index, (first, count)) in ranges.enumerate() {
        if u64::from(first) != next {
            return Err(E::BrokenRange { what, owner, index });
        }
        next += u64::from(count);
        last = index;
    }
    if next == end as u64 {
        return Ok(());
    }
    Err(E::BrokenRange {
        what,
        owner,
        index: last,
    })
}
