//! Leaves: thin closed tetrahedra on a surface. They give tree crowns a rough outline.

use bevy::prelude::*;

use super::Shape;
use crate::noise::random;

/// Size and direction of leaves.
#[derive(Clone, Copy, Debug)]
pub(super) struct Foliage {
    pub(super) length_in_m: f32,
    pub(super) width_in_m: f32,
    /// Direction of leaves, from 0 (away from the surface) to 1 (upwards).
    pub(super) rise: f32,
    pub(super) seed: u32,
}

impl Foliage {
    pub(super) const fn new(length_in_m: f32, width_in_m: f32, rise: f32) -> Self {
        Self {
            length_in_m,
            width_in_m,
            rise,
            seed: 1,
        }
    }

    /// Adds leaves at about `count` of the vertices that `grows` accepts. A leaf takes the colour of its vertex.
    pub(super) fn sprout(&self, shape: &mut Shape, count: usize, grows: impl Fn(Vec3) -> bool) {
        let vertices = 0..shape.positions.len() as u32;
        let fertile: Vec<_> = vertices
            .filter(|&v| grows(shape.positions[v as usize]))
            .collect();
        let share = count as f32 / fertile.len().max(1) as f32;
        let chosen = fertile.iter().filter(|&&v| random(v, self.seed) < share);
        for &vertex in chosen {
            self.add_leaf(shape, vertex);
        }
    }

    /// Adds a leaf: a flat tetrahedron that is folded along the line from stalk to tip.
    fn add_leaf(&self, shape: &mut Shape, vertex: u32) {
        let draw = |k: u32| random(vertex, self.seed + 1 + k);
        let index = vertex as usize;
        let (at, normal) = (shape.positions[index], shape.normals[index]);

        // The axes of the leaf: from stalk to tip, across, and away from the upper side.
        let aside = Vec3::new(draw(0), draw(1), draw(2)) * 2.0 - 1.0;
        let outward = normal.lerp(Vec3::Y, self.rise);
        let along = (outward + 0.9 * aside).normalize_or(Vec3::Y);
        let across = along.cross(normal + 0.3 * aside);
        let across = across.normalize_or(along.any_orthonormal_vector());
        let back = across.cross(along);

        // The corners are the stalk, the tip and both sides. The fold lowers the sides.
        let size = f32::lerp(0.65, 1.25, draw(3));
        let (length, half) = (self.length_in_m * size, 0.5 * self.width_in_m * size);
        let stalk = at - 0.25 * length * along;
        let middle = stalk + 0.55 * length * along - 0.35 * half * back;
        let corners = [
            stalk,
            stalk + length * along,
            middle + half * across,
            middle - half * across,
        ];

        let first = shape.positions.len() as u32;
        // Normals stay close to that of the crown, so that leaves and crown have similar shading.
        let turned = |corner: Vec3| (normal + (corner - middle) / length).normalize_or(normal);
        let tint = shape.colors[index] * f32::lerp(0.7, 1.45, draw(4));
        shape.positions.extend(corners);
        shape.normals.extend(corners.map(turned));
        shape.colors.extend([tint * 0.75, tint * 1.15, tint, tint]);
        let sides = [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]];
        let corners = sides.as_flattened().iter();
        shape.indices.extend(corners.map(|corner| first + corner));
    }
}
