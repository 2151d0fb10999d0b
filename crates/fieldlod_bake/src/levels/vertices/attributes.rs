//! Vertex attributes as the simplifier weights and interpolates them: one row of numbers per vertex.

use fieldlod_hierarchy::Vertices;
use glam::{DVec2, Vec2, Vec3, Vec4};

use crate::mesh::bounds::extent_of;
use crate::mesh::topology::SAME_UV;
use crate::mesh::{MAX_COORDINATE, SourceMesh};

/// Error of a unit normal that changes by 1, as a share of the extent of the simplified group. Between 0.25 and 0.5,
/// triangles of scans at equal image error differ by less than 2 %; at 1 there are 4 % more. At 0.2, seven textured
/// props have 3 % fewer triangles at 1 px and 1 % more at 2.5 px, and four smooth models have 17 % more. Hard-edged
/// scenes, each primitive simplified as a whole, had up to 20 % less image error at 0.1 than at 0.5.
pub(crate) const NORMAL_WEIGHT: f32 = 0.45;
/// Error of sliding a texture, relative to moving the surface by the same distance. The factor holds for a group as
/// large as the mesh, and is proportionally smaller for a smaller group. At 0.15, textured props have 3 % more
/// triangles at equal image error; at 1 there is no difference.
const UV_WEIGHT: f32 = 0.5;
/// Error of a colour that changes by 1, as for [`NORMAL_WEIGHT`]. The value matters little: at 0.125 and 0.5, a
/// coloured rock has 3 to 4 % fewer triangles at equal image error.
const COLOR_WEIGHT: f32 = 0.25;
/// Interpolated normals below this length are not used. At 0.01, a rock with missing normals shows bright specks where
/// they begin; normals of unit length are hardly ever interpolated to less than a half.
const SHORTEST_NORMAL: f32 = 0.1;
/// Smaller differences of attributes are rounding errors of the simplifier.
const ATTRIBUTE_TOLERANCE: f32 = 1e-5;

/// Offsets and weights of the numbers in a row.
pub(crate) struct AttributeLayout {
    /// One weight per number of a row.
    pub(crate) weights: Vec<f32>,
    /// Offset of each attribute; `None` if the mesh does not have it.
    normal: Option<usize>,
    uv: Option<usize>,
    uv_1: Option<usize>,
    color: Option<usize>,
    /// Minimum and maximum of the source's colours. Levels stay in this range, because colours may hold other data.
    color_range: [Vec4; 2],
    uv_scale: UvScale,
    uv_1_scale: UvScale,
}

/// Texture coordinates are centred and scaled, so that sliding the texture across the whole mesh is a change of about
/// 1. The number of repetitions then has no effect.
///
/// The simplifier subtracts squares of these numbers, so large numbers would lose precision.
#[derive(Clone, Copy, Default)]
struct UvScale {
    center: DVec2,
    scale: f64,
}

impl AttributeLayout {
    pub(crate) fn of(mesh: &SourceMesh, normal_weight: f32) -> Self {
        let mut weights = Vec::new();
        let mut place = |count: usize, width: usize, weight: f32| {
            let first = weights.len();
            // Attributes that the mesh does not have take no space in a row.
            weights.resize(first + if count > 0 { width } else { 0 }, weight);
            (count > 0).then_some(first)
        };
        Self {
            normal: place(mesh.normals.len(), 3, normal_weight),
            uv: place(mesh.uvs.len(), 2, UV_WEIGHT),
            uv_1: place(mesh.uvs_1.len(), 2, UV_WEIGHT),
            color: place(mesh.colors.len(), 4, COLOR_WEIGHT),
            color_range: range_of(&mesh.colors),
            uv_scale: UvScale::of(mesh, &mesh.uvs),
            uv_1_scale: UvScale::of(mesh, &mesh.uvs_1),
            weights,
        }
    }

    /// Clamps the texture coordinates of a row to a range.
    pub(crate) fn clamp_uvs(&self, row: &mut [f32], least: &[f32], greatest: &[f32]) {
        for at in [self.uv, self.uv_1].into_iter().flatten() {
            for number in at..at + 2 {
                row[number] = row[number].clamp(least[number], greatest[number]);
            }
        }
    }

    /// Copies the texture coordinates of a row.
    pub(crate) fn copy_uvs(&self, row: &mut [f32], from: &[f32]) {
        for at in [self.uv, self.uv_1].into_iter().flatten() {
            row[at..at + 2].copy_from_slice(&from[at..at + 2]);
        }
    }

    /// Number of values in a row.
    pub(crate) fn width(&self) -> usize {
        self.weights.len()
    }

    pub(crate) fn has_colors(&self) -> bool {
        self.color.is_some()
    }

    pub(crate) fn has_uvs(&self) -> bool {
        self.uv.is_some() || self.uv_1.is_some()
    }

    /// Texture coordinates of a row; the second set if `second`.
    pub(crate) fn uv_of(&self, row: &[f32], second: bool) -> Option<Vec2> {
        let (at, scale) = if second {
            (self.uv_1?, self.uv_1_scale)
        } else {
            (self.uv?, self.uv_scale)
        };
        Some(scale.unscaled(Vec2::from_slice(&row[at..])))
    }

    /// Alpha of the colour of a row.
    pub(crate) fn alpha_of(&self, row: &[f32]) -> Option<f32> {
        self.color.map(|at| row[at + 3])
    }

    /// Rows of all vertices of `mesh`.
    pub(crate) fn rows_of(&self, mesh: &SourceMesh) -> Vec<f32> {
        let mut rows = Vec::with_capacity(mesh.positions.len() * self.width());
        for vertex in 0..mesh.positions.len() {
            if let Some(normal) = mesh.normals.get(vertex) {
                rows.extend(normal.normalize_or_zero().to_array());
            }
            if let Some(&uv) = mesh.uvs.get(vertex) {
                rows.extend(self.uv_scale.scaled(uv).to_array());
            }
            if let Some(&uv) = mesh.uvs_1.get(vertex) {
                rows.extend(self.uv_1_scale.scaled(uv).to_array());
            }
            if let Some(color) = mesh.colors.get(vertex) {
                rows.extend(usable_color(*color).to_array());
            }
        }
        rows
    }

    /// Whether the texture coordinates of two vertices at one place differ, so that the seam must be protected.
    pub(crate) fn is_seam(&self, a: &[f32], b: &[f32]) -> bool {
        let differs = |at: Option<usize>, scale: UvScale| {
            let same = SAME_UV * scale.scale as f32;
            at.is_some_and(|at| (at..at + 2).any(|k| (a[k] - b[k]).abs() > same))
        };
        differs(self.uv, self.uv_scale) || differs(self.uv_1, self.uv_1_scale)
    }

    /// Whether two rows are equal up to rounding.
    pub(crate) fn is_same(&self, a: &[f32], b: &[f32]) -> bool {
        a.iter()
            .zip(b)
            .all(|(a, b)| (a - b).abs() <= ATTRIBUTE_TOLERANCE)
    }

    /// Makes an interpolated row valid: normals get unit length, and colours stay in the range of the source. A row
    /// with a value that is not finite is replaced by `before`.
    pub(crate) fn make_valid(&self, row: &mut [f32], before: &[f32]) {
        if row.iter().any(|number| !number.is_finite()) {
            row.copy_from_slice(before);
        }
        if let Some(at) = self.normal {
            let old = Vec3::from_slice(&before[at..]);
            let normal = Vec3::from_slice(&row[at..]);
            // A missing normal stays zero. A short one, between opposite or missing normals, has a random direction.
            let is_usable = old != Vec3::ZERO && normal.length() > SHORTEST_NORMAL;
            let usable = is_usable.then(|| normal.try_normalize()).flatten();
            usable.unwrap_or(old).write_to_slice(&mut row[at..]);
        }
        if let Some(at) = self.color {
            let [least, greatest] = self.color_range;
            let color = Vec4::from_slice(&row[at..]).clamp(least, greatest);
            color.write_to_slice(&mut row[at..]);
        }
    }

    /// Shifts the normal and scales the colour of a row, so that rows with the mean `own_mean` get the mean `wanted`.
    /// Zero stays zero: colours may be wind weights, which are zero at the foot of a blade.
    pub(crate) fn shift_mean(&self, row: &mut [f32], own_mean: &[f32], wanted: &[f32]) {
        let before = row.to_vec();
        for number in self.normal.map_or(0..0, |at| at..at + 3) {
            row[number] += wanted[number] - own_mean[number];
        }
        for number in self.color.map_or(0..0, |at| at..at + 4) {
            if own_mean[number] > 0.0 {
                row[number] *= wanted[number] / own_mean[number];
            }
        }
        self.make_valid(row, &before);
    }

    /// Row of a vertex on the back of a sheet whose front changed from `front` to `own`. `back` is its old row.
    pub(crate) fn back_row(&self, own: &[f32], front: &[f32], back: &[f32]) -> Vec<f32> {
        let changes = own.iter().zip(front);
        let changed = back
            .iter()
            .zip(changes)
            .map(|(back, (own, front))| back + (own - front));
        let mut row: Vec<f32> = changed.collect();
        if let Some(at) = self.normal {
            let [own, front, back] = [own, front, back].map(|row| Vec3::from_slice(&row[at..]));
            if front.dot(back) < 0.0 {
                (-own).write_to_slice(&mut row[at..]);
            }
        }
        self.make_valid(&mut row, back);
        row
    }

    /// Appends the attributes in `row` to `vertices`. The tangent is derived from the source vertex `from`.
    pub(crate) fn push_to(&self, vertices: &mut Vertices, row: &[f32], from: usize) {
        if let Some(at) = self.normal {
            vertices.normals.push(Vec3::from_slice(&row[at..]));
        }
        if let Some(at) = self.uv {
            let uv = Vec2::from_slice(&row[at..]);
            vertices.uvs.push(self.uv_scale.unscaled(uv));
        }
        if let Some(at) = self.uv_1 {
            let uv = Vec2::from_slice(&row[at..]);
            vertices.uvs_1.push(self.uv_1_scale.unscaled(uv));
        }
        // Project the tangent of the source onto the surface.
        if let Some(&tangent) = vertices.tangents.get(from) {
            // The normal of this vertex was pushed above.
            let normal = vertices.normals.last().copied().unwrap_or_default();
            let along = tangent.truncate();
            let flat = (along - normal * normal.dot(along)).try_normalize();
            vertices
                .tangents
                .push(flat.unwrap_or(along).extend(tangent.w));
        }
        if let Some(at) = self.color {
            vertices.colors.push(Vec4::from_slice(&row[at..]));
        }
    }
}

impl UvScale {
    fn of(mesh: &SourceMesh, uvs: &[Vec2]) -> Self {
        let usable = uvs.iter().map(|&uv| finite_or_zero(uv).as_dvec2());
        let bounds = usable.map(|uv| (uv, uv));
        let Some((low, high)) = bounds.reduce(|a, b| (a.0.min(b.0), a.1.max(b.1))) else {
            return Self::default();
        };
        // Sliding across the mesh is a change of about 1. A smaller scale keeps the range of all coordinates within 1.
        let range = (high - low).max_element();
        let scale = mesh_per_uv(mesh, uvs).min(range.recip());
        Self {
            center: (low + high) * 0.5,
            scale: if scale.is_finite() { scale } else { 0.0 },
        }
    }

    fn scaled(self, uv: Vec2) -> Vec2 {
        ((finite_or_zero(uv).as_dvec2() - self.center) * self.scale).as_vec2()
    }

    fn unscaled(self, uv: Vec2) -> Vec2 {
        let scale = if self.scale > 0.0 {
            self.scale.recip()
        } else {
            0.0
        };
        (uv.as_dvec2() * scale + self.center).as_vec2()
    }
}

fn usable_color(color: Vec4) -> Vec4 {
    let usable = if color.is_finite() { color } else { Vec4::ZERO };
    usable.max(Vec4::ZERO).with_w(usable.w.clamp(0.0, 1.0))
}

fn range_of(colors: &[Vec4]) -> [Vec4; 2] {
    let usable = colors.iter().map(|&color| usable_color(color));
    let bounds = usable.map(|color| [color; 2]);
    let widest = bounds.reduce(|a, b| [a[0].min(b[0]), a[1].max(b[1])]);
    widest.unwrap_or_default()
}

fn finite_or_zero(uv: Vec2) -> Vec2 {
    let usable = uv.is_finite() && uv.abs().max_element() <= MAX_COORDINATE;
    if usable { uv } else { Vec2::ZERO }
}

/// Mean share of the mesh's extent that one unit of texture covers; infinite if the texture coordinates have no area.
fn mesh_per_uv(mesh: &SourceMesh, uvs: &[Vec2]) -> f64 {
    // Twice the areas on the surface and in the texture.
    let (mut area, mut uv_area) = (0.0, 0.0);
    let (triangles, _) = mesh.indices.as_chunks::<3>();
    for triangle in triangles {
        let [a, b, c] = triangle.map(|v| mesh.positions[v as usize].as_dvec3());
        area += (b - a).cross(c - a).length();
        let [a, b, c] = triangle.map(|v| finite_or_zero(uvs[v as usize]).as_dvec2());
        uv_area += (b - a).perp_dot(c - a).abs();
    }
    (area / uv_area).sqrt() / f64::from(extent_of(&mesh.positions))
}
