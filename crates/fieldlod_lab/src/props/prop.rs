//! A prop of one or more meshes, each with levels of its own.

use fieldlod_hierarchy::{Hierarchy, Sphere};
use fieldlod_select::{Cut, LodSettings, select};
use glam::Affine3A;

use super::ASKED_PX;
use crate::eye::Eye;
use crate::render::{DrawnModel, Picture, PlacedUnits, RenderError, Renderer};

/// The meshes of a prop as levels of whole meshes, ready to be drawn.
pub(super) struct Prop {
    pub(super) meshes: Vec<Hierarchy>,
    models: Vec<DrawnModel>,
    /// Around the sources, so that bakes of them are seen at the same size.
    pub(super) sphere: Sphere,
}

/// What is drawn of a prop: a unit of each mesh.
pub(super) type Units = Vec<u32>;

impl Prop {
    pub(super) fn new(renderer: &Renderer, baked: &[Hierarchy]) -> Self {
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

    /// All in full.
    pub(super) fn source(&self) -> Units {
        vec![0; self.meshes.len()]
    }

    /// Each level after the source, with the error by which it is chosen: all meshes as fine as that allows.
    pub(super) fn levels(&self) -> Vec<(f32, Units)> {
        let groups = self.meshes.iter().flat_map(|mesh| &mesh.groups);
        let mut errors: Vec<f32> = groups
            .map(|group| group.error_in_local)
            .filter(|error| error.is_finite())
            .collect();
        errors.sort_by(f32::total_cmp);
        errors.dedup();
        let level = |mesh: &Hierarchy, error: f32| {
            let mut groups = mesh.groups.iter();
            let finer = groups.position(|group| group.error_in_local > error);
            finer.unwrap_or(mesh.units.len() - 1) as u32
        };
        let units = |error: f32| self.meshes.iter().map(|mesh| level(mesh, error)).collect();
        errors
            .into_iter()
            .map(|error| (error, units(error)))
            .collect()
    }

    /// What is drawn by [`ASKED_PX`].
    pub(super) fn chosen(&self, eye: &Eye) -> Units {
        let settings = LodSettings {
            error_px: Some(ASKED_PX),
            ..LodSettings::default()
        };
        let mut cut = Cut::default();
        let mut unit = |mesh: &Hierarchy| {
            select(mesh, &Affine3A::IDENTITY, &eye.view(), &settings, &mut cut);
            cut.units().first().copied().unwrap_or_default()
        };
        self.meshes.iter().map(&mut unit).collect()
    }

    pub(super) fn triangles(&self, units: &[u32]) -> u32 {
        let pairs = self.meshes.iter().zip(units);
        pairs
            .map(|(mesh, &unit)| mesh.units[unit as usize].triangle_count)
            .sum()
    }

    /// Whether a mesh is drawn as cards.
    pub(super) fn has_cards(&self, units: &[u32]) -> bool {
        let mut pairs = self.meshes.iter().zip(units);
        pairs.any(|(mesh, &unit)| mesh.card_units().contains(&(unit as usize)))
    }

    pub(super) fn draw(
        &self,
        renderer: &Renderer,
        eye: &Eye,
        units: &[u32],
    ) -> Result<Picture, RenderError> {
        let placed = self.models.iter().zip(units.chunks(1));
        let placed = placed.map(|(model, unit)| PlacedUnits::at_origin(model, unit));
        let placed: Vec<PlacedUnits<'_>> = placed.collect();
        Ok(renderer.draw_scene(&placed, eye, None)?.0)
    }
}
