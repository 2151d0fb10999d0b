//! Bounds hold what they claim to.

use glam::Vec3;

use super::InvalidHierarchy as E;
use crate::Hierarchy;

impl Hierarchy {
    pub(super) fn check_bounds(&self) -> Result<(), E> {
        for (index, group) in self.groups.iter().enumerate() {
            check_sphere("group", index, &group.bounds)?;
        }
        for (index, cluster) in self.clusters.iter().enumerate() {
            check_sphere("cluster", index, &cluster.bounds)?;
        }
        let mut positions = Vec::new();
        for index in 0..self.units.len() {
            let vertices = self.vertices_of(&self.units[index]).iter();
            positions.clear();
            positions.extend(vertices.map(|&vertex| self.vertices.positions[vertex as usize]));
            self.check_bounds_of_unit(index, &positions)?;
            self.check_bounds_of_clusters(index, &positions)?;
        }
        Ok(())
    }

    /// `positions` are those of the unit's vertices.
    fn check_bounds_of_unit(&self, index: usize, positions: &[Vec3]) -> Result<(), E> {
        let unit = &self.units[index];
        if !positions.iter().all(|&point| unit.aabb.contains(point)) {
            let owner = "unit";
            return Err(E::LooseTriangles { owner, index });
        }
        for group in [Some(unit.consumed_by), unit.producer()] {
            let Some(index) = group.map(|group| group as usize) else {
                continue;
            };
            let bounds = self.groups[index].bounds;
            if !bounds.contains_all(positions.iter().copied()) {
                let owner = "group";
                return Err(E::LooseTriangles { owner, index });
            }
        }
        Ok(())
    }

    fn check_bounds_of_clusters(&self, unit: usize, positions: &[Vec3]) -> Result<(), E> {
        let unit = &self.units[unit];
        let mut corners = self.indices_of(unit);
        for index in unit.clusters() {
            let cluster = &self.clusters[index];
            let taken;
            (taken, corners) = corners.split_at(cluster.triangle_count as usize * 3);
            let taken = taken.iter().map(|&corner| positions[usize::from(corner)]);
            if !cluster.bounds.contains_all(taken) {
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
