//! Principal components of posed positions, as vertex attributes for the simplifier.
//!
//! The posed positions of a vertex are three numbers per pose. Their principal components are found by orthogonal
//! iteration. Distances between vertices in a few components are nearly the distances between their posed positions.

use fieldlod_hierarchy::Random;
use glam::Vec3;
use rayon::prelude::*;

/// Components per vertex. 6 describe nearly all of the motion of the characters measured; 12 leave room for other
/// characters. The simplifier takes time and memory for each.
pub(super) const CHANNELS: usize = 12;
/// Number of iterations. The largest components converge first. With 4, characters have 4 % more triangles at equal
/// deviation; with 16, equally many.
const ITERATIONS: usize = 8;

/// For each vertex, [`CHANNELS`] components of its positions in all `poses`, in local units.
pub(super) fn channels(poses: &[Vec<Vec3>]) -> Vec<[f32; CHANNELS]> {
    let vertices = poses.first().map_or(0, Vec::len);
    let width = poses.len() * 3;
    let centers = poses.iter().map(|pose| {
        let sum: Vec3 = pose.iter().sum();
        sum / pose.len().max(1) as f32
    });
    let centers: Vec<Vec3> = centers.collect();
    let row = |vertex: usize| {
        let own = poses.iter().zip(&centers);
        own.flat_map(move |(pose, center)| (pose[vertex] - center).to_array())
    };
    let rows: Vec<f32> = (0..vertices).flat_map(row).collect();
    // Any start converges. A fixed seed makes bakes repeatable.
    let mut random = Random::new(1);
    let mut axes: Vec<[f32; CHANNELS]> = (0..width)
        .map(|_| std::array::from_fn(|_| random.unit() - 0.5))
        .collect();
    orthonormalize(&mut axes);
    for _ in 1..ITERATIONS {
        axes = back(&rows, &project(&rows, &axes), width);
        orthonormalize(&mut axes);
    }
    project(&rows, &axes)
}

/// Multiplies rows by axes: the components of each row.
fn project(rows: &[f32], axes: &[[f32; CHANNELS]]) -> Vec<[f32; CHANNELS]> {
    let of_row = |row: &[f32]| {
        let mut sum = [0.0; CHANNELS];
        for (number, axis) in row.iter().zip(axes) {
            for (sum, axis) in sum.iter_mut().zip(axis) {
                *sum += number * axis;
            }
        }
        sum
    };
    rows.par_chunks(axes.len().max(1)).map(of_row).collect()
}

/// Multiplies the transposed rows by their components.
fn back(rows: &[f32], projected: &[[f32; CHANNELS]], width: usize) -> Vec<[f32; CHANNELS]> {
    // Not in parallel: sums of floating-point numbers depend on their order.
    let mut axes = vec![[0.0; CHANNELS]; width];
    for (row, components) in rows.chunks(width.max(1)).zip(projected) {
        for (axis, number) in axes.iter_mut().zip(row) {
            for (axis, component) in axis.iter_mut().zip(components) {
                *axis += number * component;
            }
        }
    }
    axes
}

/// Makes the columns orthonormal by the Gram-Schmidt process. A column that depends on other columns becomes zero.
fn orthonormalize(axes: &mut [[f32; CHANNELS]]) {
    for column in 0..CHANNELS {
        let length = |axes: &[[f32; CHANNELS]]| {
            let squares = axes.iter().map(|row| f64::from(row[column]).powi(2));
            squares.sum::<f64>().sqrt() as f32
        };
        let before = length(axes);
        for other in 0..column {
            let products = axes.iter().map(|row| f64::from(row[column] * row[other]));
            let dot = products.sum::<f64>() as f32;
            axes.iter_mut()
                .for_each(|row| row[column] -= dot * row[other]);
        }
        let after = length(axes);
        // Below this share of its length, only rounding errors are left of a column.
        let scale = if after > before * 1e-4 {
            after.recip()
        } else {
            0.0
        };
        axes.iter_mut().for_each(|row| row[column] *= scale);
    }
}
