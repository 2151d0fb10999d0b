//! A prop of one or more meshes, each with its own levels.

use fieldlod_hierarchy::{Hierarchy, Sphere};
use fieldlod_select::{Cut, LodSettings, select};
use glam::Affine3A;

use super::ERROR_PX;
use crate::eye::Eye;
use crate::render::{DrawnModel, Picture, PlacedUnits, RenderError, Renderer};

/// The uploaded meshes of a prop, with levels of whole meshes.
#[derive(Debug)]
pub struct Prop {
    meshes: Vec<Hierarchy>,
    models: Vec<DrawnModel>,
    /// The sphere around the source vertices. It is equal for all bakes, so they have the same size on screen.
    pub sphere: Sphere,
}

/// The drawn unit of each mesh.
type Units = Vec<u32>;

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
            models: meshes.iter().map(|mesh| renderer.upload(mesh)).collect(),
            meshes,
        }
    }

    /// The units of full detail.
    #[must_use]
    pub fn source(&self) -> Units {
        vec![0; self.meshes.len()]
    }

    /// All levels except the source, each with its error. A level has the coarsest unit of each mesh within its error.
    pub(super) fn levels(&self) -> Vec<(f32, Units)> {
        let groups = self.meshes.iter().flat_map(|mesh| &mesh.groups);
        let errors = groups.map(|group| group.error_in_local);
        let mut errors: Vec<f32> = errors.filter(|error| error.is_finite()).collect();
        errors.sort_by(f32::total_cmp);
        errors.dedup();
        let level = |mesh: &Hierarchy, error: f32| {
            let mut groups = mesh.groups.iter();
            let finer = groups.position(|group| group.error_in_local > error);
            finer.unwrap_or(mesh.units.len() - 1) as u32
        };
        let units = |error: f32| self.meshes.iter().map(|mesh| level(mesh, error)).collect();
        let levels = errors.into_iter().map(|error| (error, units(error)));
        levels.collect()
    }

    /// The units selected at [`ERROR_PX`].
    #[must_use]
    pub fn selected(&self, eye: &Eye) -> Units {
        let settings = LodSettings::with_error_px(ERROR_PX);
        let mut cut = Cut::default();
        let mut unit = |mesh: &Hierarchy| {
            select(mesh, &Affine3A::IDENTITY, &eye.view(), &settings, &mut cut);
            cut.units().first().copied().unwrap_or_default()
        };
        self.meshes.iter().map(&mut unit).collect()
    }

    /// Triangles of some units.
    #[must_use]
    pub fn triangles(&self, units: &[u32]) -> u32 {
        let pairs = self.meshes.iter().zip(units);
        pairs
            .map(|(mesh, &unit)| mesh.units[unit as usize].triangle_count)
            .sum()
    }

    /// Draws some units.
    ///
    /// # Errors
    /// The errors of [`Renderer::draw`].
    pub fn draw(
        &self,
        renderer: &Renderer,
        eye: &Eye,
        units: &[u32],
    ) -> Result<Picture, RenderError> {
        let placed = self.models.iter().zip(units.chunks(1));
        let placed = placed.map(|(model, unit)| PlacedUnits::at_origin(model, unit));
        let placed: Vec<PlacedUnits<'_>> = placed.collect();
        renderer.draw_scene(&placed, eye)
    }
}
