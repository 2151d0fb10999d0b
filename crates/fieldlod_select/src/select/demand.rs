//! Which groups a view needs, of meshes that are loaded in parts.

use wide::f32x8;

use super::instance_cut::InstanceCut;
use crate::criterion::Criterion;
use crate::lanes::bits::{LANES, block_bits, set_bits_of};
use crate::lanes::mask_of;
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
    /// coarser groups are no smaller.
    pub missing_px: Option<f32>,
}

impl Selector {
    /// Calls `visit` with each group that the last selection refines, or would refine if it were available, of meshes
    /// that are [loaded in parts](Scene::set_available). Groups that every cut refines are left out. `scene` must be
    /// the one that was selected from.
    pub fn demand(&self, scene: &Scene, mut visit: impl FnMut(GroupDemand)) {
        let Some((cuts, view, settings)) = self.last_cuts() else {
            return;
        };
        for (index, entry) in (0..).zip(&scene.entries) {
            let (Some(mesh), Some(slot)) = (entry.mesh, entry.slot) else {
                continue;
            };
            if scene.table(mesh).available.is_some()
                && let Some(cut) = cuts.cut(slot as usize)
            {
                let generation = entry.generation;
                let instance = InstanceId { index, generation };
                Demand {
                    scene,
                    view,
                    settings,
                    mesh,
                    instance,
                }
                .visit(cut, &mut visit);
            }
        }
    }
}

/// Demand of one instance.
struct Demand<'a> {
    scene: &'a Scene,
    view: &'a View,
    settings: &'a LodSettings,
    mesh: MeshId,
    instance: InstanceId,
}

impl Demand<'_> {
    fn visit(&self, cut: &InstanceCut, visit: &mut impl FnMut(GroupDemand)) {
        let table = self.scene.table(self.mesh);
        let placed = &self.scene.instances[self.instance.index()];
        let view = InstanceView::new(self.view, &placed.world_from_local);
        let criterion = Criterion::<f32x8>::new(&view, self.settings);
        let shares = cut.shares().shares(self.settings);
        let mut demand = GroupDemand {
            mesh: self.mesh,
            instance: self.instance,
            group: 0,
            missing_px: None,
        };
        // Eight groups at once, errors only where some are missing.
        let refined = cut.refined();
        for block in 0..table.group_count().div_ceil(LANES) {
            let bits = |words: &[u64]| block_bits(words[block / LANES], block % LANES);
            let asked = bits(refined) & !bits(&table.coarsest_refined);
            let missing = asked & !table.available.as_deref().map_or(0xff, bits);
            let errors = (missing != 0).then(|| {
                let input = table.criterion_input(block, shares);
                criterion
                    .error_px(&input, mask_of(bits(refined)))
                    .to_array()
            });
            for lane in set_bits_of(asked) {
                demand.group = (block * LANES + lane) as u32;
                let is_missing = missing & 1 << lane != 0;
                let error = errors.filter(|_| is_missing);
                demand.missing_px = error.map(|errors| errors[lane] * placed.bias);
                visit(demand);
            }
        }
    }
}
