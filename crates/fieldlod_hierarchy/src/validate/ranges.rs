//! Ranges and references stay within their arrays.

use super::InvalidHierarchy as E;
use crate::Hierarchy;

impl Hierarchy {
    pub(super) fn check_ranges(&self) -> Result<(), E> {
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

    pub(super) fn check_references(&self) -> Result<(), E> {
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
