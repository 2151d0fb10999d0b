//! A coarse level as something solid: its triangles, and the edges at which what it covers may end.

use std::collections::HashMap;

use fieldlod_hierarchy::Hierarchy;
use glam::Vec3;

/// A level of a mesh whose deviation from the source is known.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct SolidLevel {
    pub(crate) vertices: Vec<Vec3>,
    pub(crate) triangles: Vec<[u32; 3]>,
    pub(crate) edges: Vec<SolidEdge>,
    /// How far from it the source is, in local units.
    pub(crate) deviation_in_local: f32,
}

/// An edge and the triangles on its sides.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct SolidEdge {
    pub(crate) ends: [u32; 2],
    /// `None` where the surface ends, or where more than two triangles meet.
    pub(crate) sides: Option<[u32; 2]>,
}

impl SolidLevel {
    /// The triangles of a cut; `None` if its deviation or a vertex is not finite.
    pub(crate) fn new(hierarchy: &Hierarchy, refined: &[bool]) -> Option<Self> {
        let simplified = hierarchy.groups.iter().zip(refined);
        let deviations = simplified.filter(|(_, refined)| !**refined);
        let mut deviations = deviations.map(|(group, _)| group.deviation_in_local);
        let deviation_in_local = deviations.try_fold(0.0, |most: f32, deviation| {
            deviation.is_finite().then(|| most.max(deviation))
        })?;
        // Vertices at one place are one, whichever unit they are of.
        let mut level = Self {
            deviation_in_local,
            ..Self::default()
        };
        let mut places: HashMap<[u32; 3], u32> = HashMap::new();
        for unit in hierarchy.drawn_units(refined) {
            for triangle in hierarchy.triangles_of(&hierarchy.units[unit]) {
                let corners = triangle.map(|vertex| {
                    let at = hierarchy.vertices.positions[vertex as usize];
                    // No negative zeros.
                    let key = (at + Vec3::ZERO).to_array().map(f32::to_bits);
                    *places.entry(key).or_insert_with(|| {
                        level.vertices.push(at);
                        level.vertices.len() as u32 - 1
                    })
                });
                level.triangles.push(corners);
            }
        }
        level.find_edges();
        let is_finite = level.vertices.iter().all(|vertex| vertex.is_finite());
        (is_finite && !level.triangles.is_empty()).then_some(level)
    }

    fn find_edges(&mut self) {
        // Each edge as it is run through by each of its triangles.
        let mut runs: Vec<([u32; 2], bool, u32)> = Vec::new();
        for (triangle, corners) in (0..).zip(&self.triangles) {
            for side in 0..3 {
                let (from, to) = (corners[side], corners[(side + 1) % 3]);
                runs.push(([from.min(to), from.max(to)], from < to, triangle));
            }
        }
        runs.sort_unstable();
        // Two triangles that run through it either way go on into one another.
        self.edges = runs
            .chunk_by(|a, b| a.0 == b.0)
            .map(|runs| SolidEdge {
                ends: runs[0].0,
                sides: match runs {
                    [(_, false, a), (_, true, b)] => Some([*a, *b]),
                    _ => None,
                },
            })
            .collect();
    }
}
