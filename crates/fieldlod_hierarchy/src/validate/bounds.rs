//! Bounds hold what they claim to.

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
