//! The connected components of a triangle list.

use glam::Vec3;

/// One connected component.
#[derive(Clone, Default)]
pub(crate) struct Component {
    pub(crate) triangles: Vec<[u32; 3]>,
    /// Half the diagonal of the bounding box.
    pub(crate) radius: f32,
    pub(crate) area: f32,
    /// Visible pixels over all views; the area if these are unknown.
    pub(crate) visible_px: f32,
    /// Centroid of the area.
    pub(crate) centroid: Vec3,
    /// Whether any vertex is locked.
    pub(crate) is_locked: bool,
}

impl Component {
    pub(crate) fn corners(&self) -> impl Iterator<Item = u32> + '_ {
        self.triangles.as_flattened().iter().copied()
    }

    /// Vertices in ascending order.
    pub(crate) fn vertices(&self) -> Vec<u32> {
        let mut vertices: Vec<u32> = self.corners().collect();
        vertices.sort_unstable();
        vertices.dedup();
        vertices
    }

    /// The sum of the area vectors of the triangles, each twice as long as its area.
    pub(crate) fn area_vector(&self, positions: &[[f32; 3]]) -> Vec3 {
        let of_triangle = |triangle: &[u32; 3]| {
            let [a, b, c] = triangle.map(|vertex| Vec3::from(positions[vertex as usize]));
            (b - a).cross(c - a)
        };
        self.triangles.iter().map(of_triangle).sum()
    }

    /// Updates radius, area and centroid.
    pub(crate) fn measure(&mut self, positions: &[[f32; 3]]) {
        let (mut min, mut max) = (Vec3::INFINITY, Vec3::NEG_INFINITY);
        let mut moment = Vec3::ZERO;
        self.area = 0.0;
        for triangle in &self.triangles {
            let [a, b, c] = triangle.map(|vertex| Vec3::from(positions[vertex as usize]));
            min = min.min(a).min(b).min(c);
            max = max.max(a).max(b).max(c);
            let area = 0.5 * (b - a).cross(c - a).length();
            moment += (a + b + c) * (area / 3.0);
            self.area += area;
        }
        self.radius = 0.5 * (max - min).length();
        // Components on a line have no area. The middle of the box replaces their centroid.
        self.centroid = if self.area > 0.0 {
            moment / self.area
        } else {
            0.5 * (min + max)
        };
    }
}

/// Splits triangles into connected components, in the order of their first triangles. Vertices at the same position are
/// connected; `same_position` holds the first vertex at each position.
pub(crate) fn components_of(
    corners: &[u32],
    positions: &[[f32; 3]],
    same_position: &[u32],
    is_locked: &[bool],
) -> Vec<Component> {
    let (triangles, _) = corners.as_chunks::<3>();
    let first = connected(same_position.to_vec(), triangles);
    // Collect the triangles of each component.
    const NONE: u32 = u32::MAX;
    let mut index_of = vec![NONE; first.len()];
    let mut components: Vec<Component> = Vec::new();
    for &triangle in triangles {
        let index = &mut index_of[first[triangle[0] as usize] as usize];
        if *index == NONE {
            *index = components.len() as u32;
            components.push(Component::default());
        }
        let component = &mut components[*index as usize];
        component.triangles.push(triangle);
        component.is_locked |= triangle.iter().any(|&vertex| is_locked[vertex as usize]);
    }
    for component in &mut components {
        component.measure(positions);
    }
    components
}

/// For each vertex, the first vertex of its component. `first` holds connections besides the triangles: each vertex
/// links to an earlier vertex or to itself.
pub(crate) fn connected(mut first: Vec<u32>, triangles: &[[u32; 3]]) -> Vec<u32> {
    for &[a, b, c] in triangles {
        connect(&mut first, a, b);
        connect(&mut first, b, c);
    }
    for vertex in 0..first.len() as u32 {
        first[vertex as usize] = find_first(&mut first, vertex);
    }
    first
}

/// Connects two vertices.
pub(crate) fn connect(first: &mut [u32], a: u32, b: u32) {
    let (a, b) = (find_first(first, a), find_first(first, b));
    first[a.max(b) as usize] = a.min(b);
}

/// Finds the first vertex of a component, with path compression.
pub(crate) fn find_first(first: &mut [u32], mut vertex: u32) -> u32 {
    while first[vertex as usize] != vertex {
        let next = first[vertex as usize];
        first[vertex as usize] = first[next as usize];
        vertex = next;
    }
    vertex
}
