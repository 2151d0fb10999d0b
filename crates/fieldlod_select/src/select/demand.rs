//! Finds the groups that a view needs, of meshes that are loaded in parts.

use super::frame::Input;
use crate::criterion::Criterion;
use crate::lanes::bits::{LANES, is_set, set_bits};
use crate::scene::{InstanceId, MeshId, Scene};
use crate::selector::Selector;
use crate::view::InstanceView;

/// A group that an instance refines in a view, or would refine if it were available.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GroupDemand {
    /// The mesh of the instance.
    pub mesh: MeshId,
    /// The instance.
    pub instance: InstanceId,
    /// The group's index in its hierarchy.
    pub group: u32,
    /// The error in pixels of the group's simplification, times the instance's bias; `None` if the group is
    /// [available](Scene::set_available). A coarser group may have a smaller error.
    pub missing_px: Option<f32>,
}

impl Selector {
    /// Calls `visit` with each group that the last selection refines, or would refine if it were available, of meshes
    /// that are [loaded in parts](Scene::set_available). Groups that every cut refines are left out. `scene` must be
    /// the scene of the last selection, unchanged since.
    pub fn demand(&self, scene: &Scene, mut visit: impl FnMut(GroupDemand)) {
        let Some(Input { view, settings, .. }) = &self.last else {
            return;
        };
        for (instance, cut) in self.cuts.mixed(scene) {
            let placed = &scene.instances[instance.index()];
            let Some(mesh) = placed.mesh else {
                continue;
            };
            let table = scene.table(mesh);
            let Some(available) = &table.available else {
                continue;
            };
            let instance_view = InstanceView::new(view, &placed.world_from_local);
            let criterion = Criterion::new(&instance_view, settings, cut.weight);
            let error_px = |group: usize| {
                let (block, lane) = (group / LANES, group % LANES);
                // `true`, as for a refined group, so that errors at the edge of the view count.
                criterion.error_px(table.groups[block].at(lane), true) * placed.bias
            };
            // Every cut refines terminal groups, which are loaded with the mesh.
            let is_needed = |group: &usize| !is_set(&table.terminal, *group);
            for group in set_bits(&cut.refined).filter(is_needed) {
                let is_missing = !is_set(available, group);
                visit(GroupDemand {
                    mesh,
                    instance,
                    group: group as u32,
                    missing_px: is_missing.then(|| error_px(group)),
                });
            }
        }
    }
}
