//! A prop of one or more meshes, each with its own levels.

use fieldlod_hierarchy::{Hierarchy, Sphere};
use fieldlod_select::{Cut, LodSettings, select};
use glam::Affine3A;

use super::ERROR_PX;
use crate::eye::Eye;
use crate::render::{DrawnModel, Picture, RenderError, Renderer};

/// The uploaded meshes of a prop. A mesh has one unit per level, unless a level has too many vertices for it.
#[derive(Debug)]
pub struct Prop {
    meshes: Vec<Hierarchy>,
    /// The levels of each mesh, finest first.
    levels: Vec<Vec<Level>>,
    models: Vec<DrawnModel>,
    /// The sphere around the source vertices. All bakes of the same meshes have the same sphere and size on screen.
    pub sphere: Sphere,
}

/// The drawn units of each mesh.
type Units = Vec<Vec<u32>>;

/// A level of one whole mesh.
#[derive(Debug)]
struct Level {
    error_in_local: f32,
    units: Vec<u32>,
}

impl Prop {
    /// Uploads `baked` as levels of whole meshes.
    #[must_use]
    pub fn new(renderer: &Renderer, baked: &[Hierarchy]) -> Self {
        let whole = |baked: &Hierarchy| baked.whole_mesh_levels().unwrap_or_else(|| baked.clone());
        let meshes: Vec<Hierarchy> = baked.iter().map(whole).collect();
        let sources = meshes.iter().flat_map(|mesh| {
            let source = mesh.vertices.positions.iter().copied();
            source.take(mesh.source_vertex_count as usize)
        });
        Self {
            sphere: Sphere::around(sources),
            models: meshes
                .iter()
                .map(|mesh| renderer.upload(mesh, None))
                .collect(),
            levels: meshes.iter().map(levels_of).collect(),
            meshes,
        }
    }

    /// The units of full detail.
    #[must_use]
    pub fn source(&self) -> Units {
        let levels = self.levels.iter();
        levels.map(|levels| levels[0].units.clone()).collect()
    }

    /// All levels except the source, each with its error. A level draws each mesh at its coarsest level within the error.
    pub(super) fn levels(&self) -> Vec<(f32, Units)> {
        let coarser = self.levels.iter().flat_map(|levels| &levels[1..]);
        let mut errors: Vec<f32> = coarser.map(|level| level.error_in_local).collect();
        // Each distinct error of the meshes is the error of one level of the prop.
        errors.sort_by(f32::total_cmp);
        errors.dedup();
        let units = |levels: &Vec<Level>, error: f32| {
            let coarser = levels.partition_point(|level| level.error_in_local <= error);
            levels[coarser - 1].units.clone()
        };
        let level = |error: f32| {
            self.levels
                .iter()
                .map(|levels| units(levels, error))
                .collect()
        };
        errors
            .into_iter()
            .map(|error| (error, level(error)))
            .collect()
    }

    /// The units selected at [`ERROR_PX`].
    #[must_use]
    pub fn selected(&self, eye: &Eye) -> Units {
        let settings = LodSettings::with_error_px(ERROR_PX);
        let unit = |mesh: &Hierarchy| {
            let mut cut = Cut::default();
            select(mesh, &Affine3A::IDENTITY, &eye.view(), &settings, &mut cut);
            cut.units().to_vec()
        };
        self.meshes.iter().map(unit).collect()
    }

    /// Triangles of some units.
    #[must_use]
    pub fn triangles(&self, units: &[Vec<u32>]) -> u32 {
        let pairs = self.meshes.iter().zip(units);
        let units =
            pairs.flat_map(|(mesh, units)| units.iter().map(|&unit| &mesh.units[unit as usize]));
        units.map(|unit| unit.triangle_count).sum()
    }

    /// Draws some units.
    ///
    /// # Errors
    /// The errors of [`Renderer::draw`].
    pub fn draw(
        &self,
        renderer: &Renderer,
        eye: &Eye,
        units: &[Vec<u32>],
    ) -> Result<Picture, RenderError> {
        let models = self.models.iter().zip(units);
        let models: Vec<(&DrawnModel, &[u32])> = models
            .map(|(model, units)| (model, units.as_slice()))
            .collect();
        renderer.draw_together(&models, eye)
    }
}

/// The levels of a whole mesh, finest first.
fn levels_of(mesh: &Hierarchy) -> Vec<Level> {
    let levels = 0..mesh.level_count();
    let units = |level| {
        mesh.units_at_level(level)
            .into_iter()
            .map(|unit| unit as u32)
    };
    let level = |level| Level {
        error_in_local: mesh.largest_below(level, |group| group.error_in_local),
        units: units(level).collect(),
    };
    levels.map(level).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::holes::open_edges;
    use fieldlod_bake::{BakeConfig, bake_mesh, fixtures};

    /// The levels of this hierarchy have several units, as those of meshes with more than 65,536 vertices.
    #[test]
    fn levels_of_several_units_are_whole() {
        let mesh = bake_mesh(&fixtures::rock(5, 1), &BakeConfig::fine_grained()).unwrap();
        let levels = levels_of(&mesh);
        assert!(levels.len() > 3 && levels[0].units.len() > 1);
        assert!(levels.is_sorted_by_key(|level| level.error_in_local));
        for level in levels {
            assert_eq!(open_edges(&mesh, &level.units), 0);
        }
    }
}
