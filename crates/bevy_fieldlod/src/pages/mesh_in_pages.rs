//! One mesh of a `.fieldpages` file, and the Bevy meshes of its pages.

use std::sync::Arc;

use bevy::camera::primitives::Aabb;
use bevy::prelude::*;
use fieldlod_hierarchy::{Hierarchy, PagedMesh};

use crate::api::events::LodError;
use crate::assets::lod_pages::LodPages;
use crate::assets::standalone::LodMesh3d;
use crate::scene::unit_mesh::{source_mesh, unit_mesh};

/// One mesh of a file.
#[derive(Clone, Debug)]
pub(super) struct MeshInPages {
    pub(super) pages: Arc<LodPages>,
    pub(super) index: usize,
}

/// The mesh of a unit of a page.
#[derive(Debug)]
pub(super) struct UnitOfPage {
    /// The index of the unit in the hierarchy.
    pub(super) index: u32,
    pub(super) mesh: Mesh,
    pub(super) aabb: Aabb,
}

impl MeshInPages {
    pub(super) fn find(
        pages: &Arc<LodPages>,
        wanted: &LodMesh3d,
        name: &str,
    ) -> Result<Self, LodError> {
        let place = (wanted.mesh_index, wanted.primitive_index);
        let is_wanted = |one: &PagedMesh| (one.mesh_index, one.primitive_index) == place;
        let index = pages.file.meshes.iter().position(is_wanted);
        Ok(Self {
            pages: pages.clone(),
            index: index.ok_or_else(|| wanted.no_primitive(name))?,
        })
    }

    pub(super) fn paged(&self) -> &PagedMesh {
        &self.pages.file.meshes[self.index]
    }

    /// The path of the file.
    pub(super) fn file(&self) -> &str {
        &self.pages.name
    }

    /// The coarsest level, as one mesh.
    pub(super) fn coarsest(&self) -> Result<Mesh, LodError> {
        let (page, graph) = (self.coarsest_page()?, &self.paged().graph);
        // The coarsest cut refines only terminal groups.
        let mut refined = vec![false; graph.groups.len()];
        graph.close_refinement(&mut refined);
        let is_drawn = |unit: u32| {
            let producer = graph.units[unit as usize].producer();
            producer.is_none_or(|producer| !refined[producer as usize])
        };
        let units = self.paged().units_of(0).zip(&page.units);
        let drawn = units.filter(|(index, _)| is_drawn(*index));
        let triangles = drawn.flat_map(|(_, unit)| page.triangles_of(unit));
        Ok(source_mesh(page, triangles.flatten().collect()))
    }

    /// The meshes of the units of the first page.
    pub(super) fn first_page(&self) -> Result<Vec<UnitOfPage>, LodError> {
        let page = self.coarsest_page()?;
        self.units_of_page(0, page).map_err(LodError::from)
    }

    fn coarsest_page(&self) -> Result<&Hierarchy, LodError> {
        let page = self.pages.first_pages[self.index].as_ref();
        page.map_err(|fault| LodError::Unreadable {
            file: self.file().into(),
            fault: fault.clone(),
        })
    }

    /// The meshes of the units of a page.
    pub(super) fn units_of_page(
        &self,
        page: u32,
        read: &Hierarchy,
    ) -> Result<Vec<UnitOfPage>, bevy::mesh::MeshAccessError> {
        // Each unit selects its vertices from this mesh.
        let all = source_mesh(read, Vec::new());
        let units = self.paged().units_of(page as usize).zip(&read.units);
        let unit = |(index, unit): (u32, &fieldlod_hierarchy::Unit)| {
            Ok(UnitOfPage {
                index,
                mesh: unit_mesh(&all, read, 0, unit)?,
                aabb: Aabb::from_min_max(unit.aabb.min, unit.aabb.max),
            })
        };
        units.map(unit).collect()
    }
}
