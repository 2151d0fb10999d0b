//! Codes the triangles of a unit as one number per corner.
//!
//! ```text
//! 0          the vertex after the highest vertex so far
//! 1, 2, 3    a corner of the triangle before
//! 3 + n      the n-th vertex below the vertex after the highest one, modulo 65536
//! ```
//! Vertex lists are in the order of first use, so most numbers are small. Each corner has a list of its own, because the
//! corners of a triangle have different numbers on average.

use crate::file::error::FileError;

/// Numbers above this one are distances.
const CORNERS: u32 = 3;

/// The numbers of the triangles of a section, one list per corner.
pub(crate) type Numbers = [Vec<u32>; 3];

/// The vertices that the next corner is compared with.
#[derive(Default)]
struct History {
    /// The vertex after the highest one.
    next: u16,
    /// The triangle before.
    corners: [u16; 3],
}

impl History {
    fn number(&self, vertex: u16) -> u32 {
        let distance = self.next.wrapping_sub(vertex);
        let corner = self.corners.iter().position(|&corner| corner == vertex);
        match (distance, corner) {
            (0, _) => 0,
            (_, Some(corner)) => corner as u32 + 1,
            (distance, None) => CORNERS + u32::from(distance),
        }
    }

    /// Inverse of [`Self::number`]. Returns `None` for an unknown number.
    fn vertex(&self, number: u32) -> Option<u16> {
        match number {
            0 => Some(self.next),
            1..=CORNERS => Some(self.corners[number as usize - 1]),
            _ => {
                let distance = u16::try_from(number - CORNERS).ok()?;
                Some(self.next.wrapping_sub(distance))
            }
        }
    }

    fn push(&mut self, vertex: u16) {
        self.next = self.next.max(vertex.wrapping_add(1));
    }
}

/// Appends the numbers of the triangles of a unit.
pub(crate) fn write_unit(numbers: &mut Numbers, indices: &[u16]) {
    let mut history = History::default();
    for triangle in indices.as_chunks::<3>().0 {
        for (numbers, &vertex) in numbers.iter_mut().zip(triangle) {
            numbers.push(history.number(vertex));
            history.push(vertex);
        }
        history.corners = *triangle;
    }
}

/// Appends the indices of the triangles of a unit, all below `vertex_count`. The slices have equal lengths.
pub(crate) fn read_unit(
    [a, b, c]: [&[u32]; 3],
    vertex_count: u32,
    indices: &mut Vec<u16>,
) -> Result<(), FileError> {
    let mut history = History::default();
    for ((&a, &b), &c) in a.iter().zip(b).zip(c) {
        let mut triangle = [0; 3];
        for (corner, number) in triangle.iter_mut().zip([a, b, c]) {
            let vertex = history.vertex(number);
            let inside = vertex.filter(|&vertex| u32::from(vertex) < vertex_count);
            *corner = inside.ok_or(FileError::Corrupt {
                what: "the triangles",
            })?;
            history.push(*corner);
        }
        history.corners = triangle;
        indices.extend_from_slice(&triangle);
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fixtures::Random;

    #[test]
    fn any_indices_round_trip() {
        let mut random = Random::new(0);
        for range in [1, 4, 300, 65_536] {
            let any = |_| (random.next_u64() % range) as u16;
            let mut indices: Vec<u16> = (0..3_000).map(any).collect();
            indices[2] = (range - 1) as u16;
            let mut numbers = Numbers::default();
            write_unit(&mut numbers, &indices);
            let mut read = Vec::new();
            let [a, b, c] = &numbers;
            read_unit([a, b, c], range as u32, &mut read).unwrap();
            assert_eq!(read, indices);
        }
    }
}
