//! Pictures of thin layers, such as labels and clothes, at the sizes at which levels with one pixel of error are drawn.
//!
//! Distances do not show which of two surfaces is in front. A layer is swallowed at a pixel if the source shows the layer
//! with another surface just behind it, and the level shows the other surface.

use std::collections::HashMap;

use fieldlod_hierarchy::{Group, Hierarchy};
use glam::Vec3;
use rayon::prelude::*;

use super::pictures::{AROUND, FEWEST_PIXELS, Frame, MARGIN, steady_pixels};
use super::report::VerifyError;
use crate::mesh::SourceMesh;
use crate::mesh::components::connected;
use crate::mesh::surfaces::Surfaces;
use crate::mesh::topology::Topology;
use crate::mesh::triangle_tree::TriangleTree;
use crate::mesh::weld;
use crate::plants::picture::Raster;

/// Sides of pictures in pixels.
const SIDES: [usize; 6] = [16, 32, 64, 128, 256, 512];
/// Largest distance of a layer from the surface behind it, as a share of the largest extent. Farther surfaces are other
/// parts of the object.
const MOST_GAP: f32 = 0.02;
/// Least distance, as a share of the largest extent. Rounded positions and depth buffers do not tell nearer surfaces
/// apart.
const LEAST_GAP: f32 = 1.0 / 4096.0;
/// Largest share of the pixels of a layer that may show the surface behind it.
const MOST_SWALLOWED: f32 = 0.05;
/// No component.
const NONE: u32 = u32::MAX;

/// A triangle in local space, and its component.
type Tagged = ([Vec3; 3], u32);

/// Components in a picture: the front face of each pixel, and the component of the next front face within [`MOST_GAP`].
struct Fronts {
    nearest: Vec<(f32, u32)>,
    behind: Vec<(f32, u32)>,
}

/// Checks that no level shows a surface in front of a thin layer that covers it in the source. The meshes share one
/// space and are drawn by one camera, each at its own level.
///
/// # Errors
/// [`VerifyError::Layer`] if more than a twentieth of a layer's pixels are lost.
pub fn verify_layers(parts: &[(&SourceMesh, &Hierarchy)]) -> Result<(), VerifyError> {
    let Some(scene) = Scene::of(parts) else {
        return Ok(());
    };
    for side in SIDES {
        let share = scene.swallowed_share(side, AROUND);
        if share > MOST_SWALLOWED {
            return Err(VerifyError::Layer { side, share });
        }
    }
    Ok(())
}

/// The largest share of a layer's pixels that show the surface behind it while the meshes are `side` pixels large and
/// are drawn with one pixel of error. 0 without layers. Pixels at the border of a layer do not count: it may move by one.
#[cfg(any(test, feature = "test-support"))]
#[must_use]
pub fn swallowed_share(parts: &[(&SourceMesh, &Hierarchy)], side: usize) -> f32 {
    Scene::of(parts).map_or(0.0, |scene| scene.swallowed_share(side, 1))
}

struct Scene<'a> {
    parts: &'a [(&'a SourceMesh, &'a Hierarchy)],
    components: Vec<Components>,
    frame: Frame,
    source: Vec<Tagged>,
}

impl<'a> Scene<'a> {
    /// `None` without two components and an extent.
    fn of(parts: &'a [(&'a SourceMesh, &'a Hierarchy)]) -> Option<Self> {
        let mut first = 0;
        let components = parts.iter().map(|(mesh, _)| {
            let own = Components::of(mesh, first);
            first += mesh.positions.len() as u32;
            own
        });
        let components: Vec<Components> = components.collect();
        let of_part = parts.iter().zip(&components).map(|((mesh, _), own)| {
            let triangles = mesh.indices.as_chunks::<3>().0.iter();
            triangles.map(|triangle| {
                let corners = triangle.map(|vertex| mesh.positions[vertex as usize]);
                (corners, own.of_vertex[triangle[0] as usize])
            })
        });
        let source: Vec<Tagged> = of_part.flatten().collect();
        let is_one = source.iter().all(|(_, own)| *own == source[0].1);
        let frame = Frame::around(source.iter().flat_map(|(corners, _)| *corners))?;
        (!is_one).then_some(Self {
            parts,
            components,
            frame,
            source,
        })
    }

    /// The largest share of lost pixels of any layer, among the pixels that show the same for `around` pixels.
    fn swallowed_share(&self, side: usize, around: usize) -> f32 {
        let views = (0..6).into_par_iter();
        let sources = views.map(|view| self.fronts(&self.source, view, side, true));
        let sources: Vec<Fronts> = sources.collect();
        let mut behind = sources.iter().flat_map(|fronts| &fronts.behind);
        if behind.all(|(_, component)| *component == NONE) {
            return 0.0;
        }
        let error = self.frame.extent / side as f32;
        let pairs = self.parts.iter().zip(&self.components);
        let level = pairs.flat_map(|((_, hierarchy), own)| own.of_level(hierarchy, error));
        let level: Vec<Tagged> = level.collect();
        let views = sources.par_iter().enumerate().map(|(view, source)| {
            let level = self.fronts(&level, view, side, false);
            lost_pixels(source, &level, side, around)
        });
        let mut of_layers: HashMap<(u32, u32), [usize; 2]> = HashMap::new();
        for (layer, [whole, lost]) in views.collect::<Vec<_>>().into_iter().flatten() {
            let sums = of_layers.entry(layer).or_default();
            *sums = [sums[0] + whole, sums[1] + lost];
        }
        // Near silhouettes, the surface behind may hide a part of the layer. It is in front in fewer pixels.
        let is_layer = |(front, behind): (u32, u32), whole: usize| {
            let reverse = of_layers.get(&(behind, front));
            whole >= FEWEST_PIXELS && reverse.is_none_or(|[other, _]| *other < whole)
        };
        let layers = of_layers
            .iter()
            .filter(|(own, sums)| is_layer(**own, sums[0]));
        let shares = layers.map(|(_, [whole, lost])| *lost as f32 / *whole as f32);
        shares.fold(0.0, f32::max)
    }

    /// The front faces in a picture along one of three axes, from one of two ends.
    fn fronts(&self, triangles: &[Tagged], view: usize, side: usize, with_behind: bool) -> Fronts {
        let (axis, sign) = (view % 3, if view < 3 { 1.0 } else { -1.0 });
        let width = side + 2 * MARGIN;
        let [least_gap, gap] = [LEAST_GAP, MOST_GAP].map(|share| side as f32 * share);
        let far = vec![(f32::NEG_INFINITY, NONE); width * width];
        let mut fronts = Fronts {
            behind: far.clone(),
            nearest: far,
        };
        for pass in 0..1 + usize::from(with_behind) {
            for (corners, own) in triangles {
                let corners = corners.map(|corner| self.frame.place(corner, axis, side));
                let [a, b, c] = corners.map(Vec3::truncate);
                if (b - a).perp_dot(c - a) * sign <= 0.0 {
                    continue;
                }
                let Some(raster) = Raster::of(corners, width) else {
                    continue;
                };
                raster.each_pixel(|pixel, _, height| {
                    let (height, nearest) = (height * sign, &mut fronts.nearest[pixel]);
                    let behind = &mut fronts.behind[pixel];
                    if pass == 0 && height > nearest.0 {
                        *nearest = (height, *own);
                    } else if pass == 1
                        && *own != nearest.1
                        && height > behind.0.max(nearest.0 - gap)
                        && height < nearest.0 - least_gap
                    {
                        *behind = (height, *own);
                    }
                });
            }
        }
        fronts
    }
}

/// For each layer and the surface behind it, the pixels of the source, and those that the level loses.
fn lost_pixels(
    source: &Fronts,
    level: &Fronts,
    side: usize,
    around: usize,
) -> Vec<((u32, u32), [usize; 2])> {
    let layer_at = |at: usize| (source.nearest[at].1, source.behind[at].1);
    let shown = |at| Some(layer_at(at)).filter(|(_, behind)| *behind != NONE);
    let pixels = steady_pixels(side, around, shown);
    let found = pixels.map(|at| {
        let own = layer_at(at);
        (own, [1, usize::from(level.nearest[at].1 == own.1)])
    });
    found.collect()
}

/// The components of a mesh.
struct Components {
    /// For each vertex of the source, a number of its component that no other mesh has.
    of_vertex: Vec<u32>,
    tree: TriangleTree,
    /// The component of each triangle of the tree.
    of_triangle: Vec<u32>,
}

impl Components {
    fn of(mesh: &SourceMesh, first: u32) -> Self {
        let triangles = mesh.indices.as_chunks::<3>().0;
        let place = Topology::of(mesh, &Surfaces::default()).place;
        let connected = connected(place, triangles);
        let of_vertex: Vec<u32> = connected.into_iter().map(|own| first + own).collect();
        let corners = triangles
            .iter()
            .map(|triangle| triangle.map(|v| mesh.positions[v as usize]));
        Self {
            tree: TriangleTree::new(corners),
            of_triangle: triangles.iter().map(|t| of_vertex[t[0] as usize]).collect(),
            of_vertex,
        }
    }

    /// The coarsest level of the whole mesh within an error.
    fn of_level(&self, hierarchy: &Hierarchy, error_in_local: f32) -> Vec<Tagged> {
        let mut cuts = hierarchy.whole_mesh_cuts().into_iter();
        let error_of = |level| hierarchy.largest_below(level, Group::error_of_step);
        let cut = cuts.rfind(|cut| error_of(cut.group_level) <= error_in_local);
        let triangles = cut.map_or(Vec::new(), |cut| cut.triangles);
        let positions = &hierarchy.vertices.positions;
        let own = self.of_vertices(hierarchy, &triangles);
        let tagged = triangles.iter().map(|triangle| {
            let corners = triangle.map(|vertex| positions[vertex as usize]);
            (corners, own[triangle[0] as usize])
        });
        tagged.collect()
    }

    /// The component of each vertex of a level. A component of the level with a vertex of a known origin has the
    /// component of this vertex, another one that of the nearest triangle of the source.
    fn of_vertices(&self, hierarchy: &Hierarchy, triangles: &[[u32; 3]]) -> Vec<u32> {
        let positions = &hierarchy.vertices.positions;
        let first = connected(weld(positions.iter().copied()), triangles);
        let mut known = vec![NONE; positions.len()];
        let used = || triangles.as_flattened().iter().copied();
        for vertex in used() {
            if let Some(origin) = hierarchy.origin_of(vertex) {
                known[first[vertex as usize] as usize] = self.of_vertex[origin as usize];
            }
        }
        for vertex in used() {
            let own = &mut known[first[vertex as usize] as usize];
            if *own == NONE
                && let Some(nearest) = self.tree.nearest(positions[vertex as usize])
            {
                *own = self.of_triangle[nearest.triangle as usize];
            }
        }
        first.iter().map(|&own| known[own as usize]).collect()
    }
}
