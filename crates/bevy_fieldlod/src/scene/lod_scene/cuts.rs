//! How the cuts of views reach the scene: which units are drawn, which must be spawned, and which are
//! idle.

use bevy::platform::collections::HashMap;
use bevy::prelude::*;
use fieldlod_select::{Change, InstanceId, MeshId, Selector};

use super::LodScene;
use crate::scene::deferred_cuts::{DeferredCut, DeferredCuts};
use crate::scene::view_cut::CutVisibility;

impl LodScene {
    /// Applies what changed in the cut of one instance in one view; defers it if that needs more units than may
    /// be spawned in this frame.
    pub(crate) fn apply_change(
        &mut self,
        change: &Change,
        view: &mut CutVisibility,
        deferred: &mut DeferredCuts,
    ) {
        let index = change.instance.index();
        let instance = self.instances.get_mut(index).and_then(Option::as_mut);
        // Another id means the cut of a former instance with the same index.
        let Some(instance) = instance.filter(|instance| instance.id == change.instance) else {
            return;
        };
        // The cut of a whole mesh is one unit, its level, which the selector knows; or none.
        if instance.piece.is_some() {
            self.whole_meshes_to_swap.push(index as u32);
            self.casters_to_choose.push(index as u32);
            let is_culled = change.entered.is_empty();
            if view.contains(instance.record) != is_culled {
                view.set(instance.record, is_culled);
            }
            return;
        }
        // A cut that waits goes on from what the view draws.
        if deferred.contains(change.instance) {
            return;
        }
        let is_new = |unit: &&u32| instance.find_unit(**unit).is_err();
        if self.units_left < change.entered.len()
            && self.units_left < change.entered.iter().filter(is_new).count()
        {
            // Until there is anything else, the source is drawn.
            let is_first = change.left.is_empty();
            let mut records = instance.units.iter().map(|&(_, record)| record);
            let draws_any = records.any(|record| view.contains(record));
            if is_first && !draws_any {
                view.set(instance.record, true);
            }
            return deferred.push(change.instance);
        }
        // Units that left the cut become idle with their last view.
        for &unit in change.left {
            if let Ok(position) = instance.find_unit(unit) {
                let record = instance.units[position].1;
                view.set(record, false);
                if self.records.leave_view(record, self.frame) {
                    self.idle_units.push_back((record, self.frame));
                }
            }
        }
        // Units that entered it are spawned for their first view.
        for &unit in change.entered {
            let (record, is_new) = instance.record_of(unit, &mut self.records);
            if is_new {
                self.units_to_spawn.push(record);
                self.units_left = self.units_left.saturating_sub(1);
            }
            view.set(record, true);
            self.records.enter_view(record);
        }
    }

    /// Applies all cuts of `selector` to a view that has drawn nothing.
    pub(crate) fn apply_whole_cut(
        &mut self,
        selector: &Selector,
        view: &mut CutVisibility,
        deferred: &mut DeferredCuts,
    ) {
        let instances: Vec<InstanceId> =
            self.instances.iter().flatten().map(|one| one.id).collect();
        for instance in instances {
            let entered = selector.units(&self.scene, instance).to_vec();
            let change = Change {
                instance,
                entered: &entered,
                left: &[],
            };
            self.apply_change(&change, view, deferred);
        }
    }

    /// Spawns units that deferred cuts of a view wait for, as many as may be, and draws the cuts that have all.
    /// `selector` tells what they should be by now.
    pub(crate) fn advance_deferred(
        &mut self,
        selector: &Selector,
        view: &mut CutVisibility,
        deferred: &mut DeferredCuts,
    ) {
        let mut cuts = std::mem::take(&mut deferred.0);
        cuts.retain_mut(|cut| {
            loop {
                // What it should be may have gone on meanwhile.
                let wanted = selector.units(&self.scene, cut.instance);
                if cut.held == cut.units().len() {
                    (cut.units, cut.held) = (Some(wanted.to_vec()), 0);
                }
                if !self.hold_units(cut) {
                    // Some units are to come, or the instance is gone.
                    return self.scene.mesh_of(cut.instance).is_some();
                }
                self.show(cut, view);
                if cut.units() == selector.units(&self.scene, cut.instance) {
                    return false;
                }
            }
        });
        deferred.0 = cuts;
    }

    /// Makes records of units of a deferred cut, as far as they may be spawned. Whether it has all.
    fn hold_units(&mut self, cut: &mut DeferredCut) -> bool {
        while let Some(&unit) = cut.units().get(cut.held) {
            // It is not idle while it is waited for.
            if self.hold_unit(cut.instance, unit).is_none() {
                return false;
            }
            cut.held += 1;
        }
        true
    }

    /// The record of a unit, which one more view draws from now on; `None` if it would have to be spawned and may
    /// not be in this frame, or the instance is gone.
    pub(crate) fn hold_unit(&mut self, instance: InstanceId, unit: u32) -> Option<u32> {
        let found = self.instances.get_mut(instance.index())?.as_mut();
        let found = found.filter(|one| one.id == instance)?;
        if self.units_left == 0 && found.find_unit(unit).is_err() {
            return None;
        }
        let (record, is_new) = found.record_of(unit, &mut self.records);
        if is_new {
            self.units_to_spawn.push(record);
            self.units_left -= 1;
        }
        self.records.enter_view(record);
        Some(record)
    }

    /// Notes that a view does not draw a unit any more.
    pub(crate) fn leave_unit(&mut self, record: u32) {
        if self.records.leave_view(record, self.frame) {
            self.idle_units.push_back((record, self.frame));
        }
    }

    /// Draws a deferred cut, all of whose units are held, in place of what the view draws of its instance.
    fn show(&mut self, cut: &DeferredCut, view: &mut CutVisibility) {
        let Some(Some(instance)) = self.instances.get(cut.instance.index()) else {
            return;
        };
        for &(unit, record) in &instance.units {
            let was_drawn = view.contains(record);
            let is_drawn = cut.units().binary_search(&unit).is_ok();
            // What stays was counted twice meanwhile.
            if was_drawn && self.records.leave_view(record, self.frame) {
                self.idle_units.push_back((record, self.frame));
            }
            if was_drawn != is_drawn {
                view.set(record, is_drawn);
            }
        }
        if view.contains(instance.record) {
            view.set(instance.record, false);
        }
    }

    /// Gives up the deferred cuts of a view.
    fn clear_deferred(&mut self, deferred: &mut DeferredCuts) {
        for cut in deferred.0.drain(..) {
            let Some(Some(instance)) = self.instances.get(cut.instance.index()) else {
                continue;
            };
            for &unit in &cut.units()[..cut.held] {
                if let Ok(position) = instance.find_unit(unit) {
                    let record = instance.units[position].1;
                    if self.records.leave_view(record, self.frame) {
                        self.idle_units.push_back((record, self.frame));
                    }
                }
            }
        }
    }

    /// Removes everything from the cut of a view, which has no say in the levels of whole meshes any
    /// more.
    pub(crate) fn clear_view(&mut self, view: &mut CutVisibility, deferred: &mut DeferredCuts) {
        self.clear_deferred(deferred);
        for record in view.take() {
            self.leave_unit(record);
        }
        self.swap_all_whole_meshes();
    }

    /// Removes units that no view has drawn for `idle_frames`, at most `most` of them, and returns their
    /// entities.
    pub(crate) fn take_idle_units(&mut self, idle_frames: u32, most: usize) -> Vec<Entity> {
        let mut entities = Vec::new();
        while entities.len() < most
            && let Some(&(record, since)) = self.idle_units.front()
            && self.frame.wrapping_sub(since) > idle_frames
        {
            self.idle_units.pop_front();
            // A unit that was drawn again in between stands further back, or not at all.
            if self.records.is_idle_since(record, since) {
                entities.extend(self.remove_unit(record));
            }
        }
        entities
    }

    /// Removes the units of meshes whose page goes, unless a view still draws them, and returns their entities.
    pub(crate) fn remove_units_of_pages(
        &mut self,
        pages: &HashMap<MeshId, Vec<u32>>,
    ) -> Vec<Entity> {
        let mut records = Vec::new();
        for instance in self.instances.iter().flatten() {
            if let Some(gone) = pages.get(&instance.mesh.id) {
                let of_pages = gone
                    .iter()
                    .filter_map(|&unit| instance.find_unit(unit).ok());
                records.extend(of_pages.map(|position| instance.units[position].1));
            }
        }
        records.retain(|&record| self.records.is_idle(record));
        let entities = records.into_iter();
        entities
            .filter_map(|record| self.remove_unit(record))
            .collect()
    }

    /// Tells `visit` of the units that a view draws, or is to draw as soon as all are spawned, of instances whose
    /// cut is deferred.
    pub(crate) fn visit_deferred(
        &self,
        deferred: &DeferredCuts,
        mut visit: impl FnMut(MeshId, u32),
    ) {
        for cut in &deferred.0 {
            let instance = self.instance(cut.instance.index() as u32);
            let Some(instance) = instance.filter(|instance| instance.id == cut.instance) else {
                continue;
            };
            let drawn = instance.units.iter().map(|&(unit, _)| unit);
            let wanted = cut.units().iter().copied();
            (drawn.chain(wanted)).for_each(|unit| visit(instance.mesh.id, unit));
        }
    }

    fn remove_unit(&mut self, record: u32) -> Option<Entity> {
        let (instance, unit) = self.records.unit(record)?;
        if let Some(Some(instance)) = self.instances.get_mut(instance as usize)
            && let Ok(position) = instance.find_unit(unit)
        {
            instance.units.remove(position);
        }
        self.records.free(record)
    }
}
