//! Checks that bounds contain their triangles.

use glam::Vec3;

use super::InvalidHierarchy as E;
use crate::bounds::Sphere;
use crate::hierarchy::Hierarchy;

impl Hierarchy {
    pub(super) fn check_spheres(&self) -> Result<(), E> {
        let is_usable = |Sphere { center, radius }: Sphere| {
            center.is_finite() && radius.is_finite() && radius >= 0.0
        };
        let mut groups = self.groups.iter();
        match groups.position(|group| !is_usable(group.bounds)) {
            Some(group) => Err(E::BadBounds { group }),
            None => Ok(()),
        }
    }

    pub(super) fn check_bounds(&self) -> Result<(), E> {
        self.check_spheres()?;
        let mut positions = Vec::new();
        for index in 0..self.units.len() {
            let vertices = self.vertices_of(&self.units[index]).iter();
            positions.clear();
            positions.extend(vertices.map(|&vertex| self.vertices.positions[vertex as usize]));
            self.check_bounds_of_unit(index, &positions)?;
        }
        Ok(())
    }

    /// Checks the box and the spheres around a unit whose vertices have these `positions`.
    fn check_bounds_of_unit(&self, index: usize, positions: &[Vec3]) -> Result<(), E> {
        let unit = &self.units[index];
        let in_box = positions.iter().all(|&point| unit.aabb.contains(point));
        check_contains("unit", index, in_box)?;
        // The sphere of a group contains its surface before and after simplification.
        for group in [Some(unit.consumed_by), unit.producer()]
            .into_iter()
            .flatten()
        {
            let bounds = self.groups[group as usize].bounds;
            let in_sphere = positions.iter().all(|&point| bounds.contains(point));
            check_contains("group", group as usize, in_sphere)?;
        }
        Ok(())
    }
}

fn check_contains(owner: &'static str, index: usize, contains: bool) -> Result<(), E> {
    if contains {
        Ok(())
    } else {
        Err(E::TrianglesOutsideBounds { owner, index })
    }
}
