//! Vertex attributes as the simplifier weighs and mixes them: numbers in a row for each vertex.

use fieldlod_hierarchy::Vertices;
use glam::{DVec2, Vec2, Vec3, Vec4};

use crate::mesh::topology::SAME_UV;
use crate::mesh::{MAX_COORDINATE, SourceMesh};

/// How much a change of the unit normal by 1 counts, as a share of the extent of the simplified group. Between .25 and
/// .5 the triangles of scans at equal image error differ by less than 2 %; at 1 there are 4 % more.
pub(crate) const NORMAL_WEIGHT: f32 = 0.45;
/// How much a texture that slides along the surface counts against an equal displacement of the surface, for a group
/// as large as the mesh; proportionally less for a smaller group. At .15, textured props take 3 % more triangles at
/// equal image error; at 1 as many.
const UV_WEIGHT: f32 = 0.5;
/// How much a change of a colour by 1 counts, as for [`NORMAL_WEIGHT`].
const COLOR_WEIGHT: f32 = 0.25;
/// Attributes that differ by less are the same.
const SAME: f32 = 1e-5;

/// The layout of a row of attributes, and the weight of each number.
pub(crate) struct AttributeLayout {
    /// One weight for each number of a row.
    pub(crate) weights: Vec<f32>,
    /// Offset of each attribute that the mesh has.
    normal: Option<usize>,
    uv: Option<usize>,
    uv_1: Option<usize>,
    color: Option<usize>,
    /// The least and the greatest of the source's colours, which levels keep to: they may be weights.
    color_range: [Vec4; 2],
    uv_scale: UvScale,
    uv_1_scale: UvScale,
}

/// Texture coordinates around zero, in units in which sliding the texture across the whole mesh is
/// a change of about 1, whether it repeats a thousand times or covers a thousandth of the image.
///
/// The simplifier subtracts squares of these numbers from each other, so they must not be large.
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

    /// Keeps the texture coordinates of a row within a range of rows.
    pub(crate) fn clamp_uvs(&self, row: &mut [f32], least: &[f32], greatest: &[f32]) {
        for at in [self.uv, self.uv_1].into_iter().flatten() {
            for number in at..at + 2 {
                row[number] = row[number].clamp(least[number], greatest[number]);
            }
        }
    }

    /// How many numbers a row has.
    pub(crate) fn width(&self) -> usize {
        self.weights.len()
    }

    pub(crate) fn has_uvs(&self) -> bool {
        self.uv.is_some() || self.uv_1.is_some()
    }

    /// The texture coordinates of a row; of the second set, if `second`.
    pub(crate) fn uv_of(&self, row: &[f32], second: bool) -> Option<Vec2> {
        let (at, scale) = if second {
            (self.uv_1?, self.uv_1_scale)
        } else {
            (self.uv?, self.uv_scale)
        };
        Some(scale.unscaled(Vec2::from_slice(&row[at..])))
    }

    /// The rows of the vertices of `mesh`.
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

    /// Whether a texture is torn between two vertices at one place, and must stay as it is.
    pub(crate) fn is_seam(&self, a: &[f32], b: &[f32]) -> bool {
        let differs = |at: Option<usize>, scale: UvScale| {
            let same = SAME_UV * scale.scale as f32;
            at.is_some_and(|at| (at..at + 2).any(|k| (a[k] - b[k]).abs() > same))
        };
        differs(self.uv, self.uv_scale) || differs(self.uv_1, self.uv_1_scale)
    }

    /// Whether two rows are the same but for rounding.
    pub(crate) fn is_same(&self, a: &[f32], b: &[f32]) -> bool {
        a.iter().zip(b).all(|(a, b)| (a - b).abs() <= SAME)
    }

    /// Makes a row that the simplifier mixed an attribute of a surface again: normals of unit length, colours as dark and
    /// as bright as some of the source. What is beyond help is taken from `before`.
    pub(crate) fn mend(&self, row: &mut [f32], before: &[f32]) {
        if row.iter().any(|number| !number.is_finite()) {
            row.copy_from_slice(before);
        }
        if let Some(at) = self.normal {
            let old = Vec3::from_slice(&before[at..]);
            let normal = Vec3::from_slice(&row[at..]).try_normalize();
            normal.unwrap_or(old).write_to_slice(&mut row[at..]);
        }
        if let Some(at) = self.color {
            let [least, greatest] = self.color_range;
            let color = Vec4::from_slice(&row[at..]).clamp(least, greatest);
            color.write_to_slice(&mut row[at..]);
        }
    }

    /// Shifts the normal and scales the colour of a row, so that rows whose mean is `own_mean` have the mean
    /// `wanted`. What is 0 stays so: colours may be weights of the wind, of which the foot of a blade has
    /// none.
    pub(crate) fn adapt(&self, row: &mut [f32], own_mean: &[f32], wanted: &[f32]) {
        let before = row.to_vec();
        for number in self.normal.map_or(0..0, |at| at..at + 3) {
            row[number] += wanted[number] - own_mean[number];
        }
        for number in self.color.map_or(0..0, |at| at..at + 4) {
            if own_mean[number] > 0.0 {
                row[number] *= wanted[number] / own_mean[number];
            }
        }
        self.mend(row, &before);
    }

    /// The row on the back of a sheet of a vertex with the row `own` on its front, which comes from a vertex with the
    /// row `front` and the row `back` behind it.
    pub(crate) fn turned(&self, own: &[f32], front: &[f32], back: &[f32]) -> Vec<f32> {
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
        self.mend(&mut row, back);
        row
    }

    /// Appends the attributes in `row` to `vertices`, which are of the same kinds, for a vertex that
    /// came from the vertex `from` there.
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
        // Tangents follow from the rest: that of the source, turned into the surface.
        if let Some(&tangent) = vertices.tangents.get(from) {
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
        // The scale at which sliding across the mesh is about 1, but no more than the range.
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

/// Which share of the mesh's extent one unit of texture covers, on average; infinite for a texture
/// that covers nothing.
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
    (area / uv_area).sqrt() / extent_of(&mesh.positions)
}

fn extent_of(positions: &[Vec3]) -> f64 {
    let aabb = fieldlod_hierarchy::Aabb::around(positions.iter().copied()).unwrap_or_default();
    f64::from((aabb.max - aabb.min).max_element())
}
