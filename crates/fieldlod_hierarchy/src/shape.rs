//! What follows from a group's triangles. Nothing of it steers a cut, so none of it is stored.

use glam::{DVec3, Vec3};

use crate::{Group, Hierarchy, Unit};

/// A cone that holds the directions in which a surface faces.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct NormalCone {
    /// Unit vector; zero for a surface that faces nowhere.
    pub axis: Vec3,
    /// Cosine of the angle between the axis and the normal furthest from it: 1 for a plane,
    /// below 0 for more than a half space.
    pub cos_half_angle: f32,
}

impl Hierarchy {
    /// How many triangles `group` consumes.
    #[must_use]
    pub fn triangle_count_of(&self, group: &Group) -> u64 {
        let units = &self.units[group.units()];
        let counts = units.iter().map(|unit| u64::from(unit.triangle_count));
        counts.sum()
    }

    /// The area of the triangles that `group` consumes, in local units squared.
    #[must_use]
    pub fn area_of(&self, group: &Group) -> f64 {
        let units = &self.units[group.units()];
        units.iter().map(|unit| self.area_of_unit(unit)).sum()
    }

    /// The area of the triangles of `unit`, in local units squared.
    #[must_use]
    pub fn area_of_unit(&self, unit: &Unit) -> f64 {
        self.area_vectors_of(unit).map(DVec3::length).sum()
    }

    /// A cone around [`Group::mean_normal`] that holds the normals of all triangles that `group`
    /// consumes.
    #[must_use]
    pub fn normal_cone_of(&self, group: &Group) -> NormalCone {
        let axis = group.mean_normal.normalize_or_zero();
        let units = &self.units[group.units()];
        let normals = units.iter().flat_map(|unit| self.area_vectors_of(unit));
        let normals = normals.filter_map(DVec3::try_normalize);
        let cosines = normals.map(|normal| normal.dot(axis.as_dvec3()));
        // Rounded down, so that the cone holds them all.
        let least = cosines.fold(1.0, f64::min) as f32;
        NormalCone {
            axis,
            cos_half_angle: least.next_down().max(-1.0),
        }
    }

    /// Normals as long as the area of each triangle.
    fn area_vectors_of(&self, unit: &Unit) -> impl Iterator<Item = DVec3> + '_ {
        let corner = |v: u32| self.vertices.positions[v as usize].as_dvec3();
        self.source_triangles_of(unit).map(move |triangle| {
            let [a, b, c] = triangle.map(corner);
            (b - a).cross(c - a) * 0.5
        })
    }
}
