//! Finds the groups that a view needs, of meshes that are loaded in parts.

use super::frame::Input;
use super::instance_cut::InstanceCut;
use crate::criterion::{Criterion, CriterionInput};
use crate::lanes::bits::{LANES, block_bits, set_bits_of};
use crate::scene::{InstanceId, MeshId, Scene};
use crate::selector::Selector;
use crate::settings::LodSettings;
use crate::view::{InstanceView, View};

/// A group that an instance refines in a view, or would refine if it were available.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GroupDemand {
    /// The mesh of the instance.
    pub mesh: MeshId,
    /// The instance.
    pub instance: InstanceId,
    /// The group's index in its hierarchy.
    pub group: u32,
    /// The error in pixels of its simplification, if the group is not [available](Scene::set_available). Errors of
    /// coarser groups are equal or larger.
    pub missing_px: Option<f32>,
}

impl Selector {
    /// Calls `visit` with each group that the last selection refines, or would refine if it were available, of meshes
    /// that are [loaded in parts](Scene::set_available). Groups that every cut refines are left out. `scene` must be
    /// the one that was selected from.
    pub fn demand(&self, scene: &Scene, mut visit: impl FnMut(GroupDemand)) {
        let Some(Input { view, settings, .. }) = &self.last else {
            return;
        };
        for (index, instance) in (0..).zip(&scene.instances) {
            if let (Some(mesh), Some(slot)) = (instance.mesh, instance.slot)
                && scene.table(mesh).available.is_some()
                && let Some(cut) = self.cuts.cut(slot as usize)
            {
                let id = scene.id_of(index);
                visit_cut(scene, (view, settings), (mesh, id), cut, &mut visit);
            }
        }
    }
}

/// Calls `visit` with each group that a cut of an instance refines.
fn visit_cut(
    scene: &Scene,
    (view, settings): (&View, &LodSettings),
    (mesh, instance): (MeshId, InstanceId),
    cut: &InstanceCut,
    visit: &mut impl FnMut(GroupDemand),
) {
    let table = scene.table(mesh);
    let placed = &scene.instances[instance.index()];
    let view = InstanceView::new(view, &placed.world_from_local);
    let criterion = Criterion::new(&view, settings);
    let shares = cut.shares.shares(settings);
    for block in 0..table.group_count.div_ceil(LANES) {
        let bits = |words: &[u64]| block_bits(words[block / LANES], block % LANES);
        let refined = bits(&cut.refined);
        let needed = refined & !bits(&table.coarsest_refined);
        let missing = needed & !table.available.as_deref().map_or(0xff, bits);
        let error_px = |lane: usize| {
            let group = CriterionInput::from_array(table.groups[block].at(lane));
            let share = shares.of_block(block)[lane];
            criterion.error_px(&group, share, refined & 1 << lane != 0) * placed.bias
        };
        for lane in set_bits_of(needed) {
            let is_missing = missing & 1 << lane != 0;
            visit(GroupDemand {
                mesh,
                instance,
                group: (block * LANES + lane) as u32,
                missing_px: is_missing.then(|| error_px(lane)),
            });
        }
    }
}
