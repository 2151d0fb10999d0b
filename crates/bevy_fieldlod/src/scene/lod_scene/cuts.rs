//! Applies the cuts of views to the scene: which units are drawn, which must be spawned, and which are idle.

use bevy::platform::collections::HashMap;
use bevy::prelude::*;
use fieldlod_select::{Change, MeshId};

use super::LodScene;
use crate::scene::view_cut::{CutVisibility, ViewCut};

impl LodScene {
    /// Applies the changes of the last selection to what a view draws.
    pub(crate) fn apply_changes(&mut self, cut: &mut ViewCut) {
        for change in cut.selector.changes() {
            cut.unit_count += change.entered.len() as u32;
            cut.unit_count -= change.left.len() as u32;
            self.apply_change(&change, &mut cut.visibility);
        }
    }

    /// Applies the change of the cut of one instance.
    fn apply_change(&mut self, change: &Change, view: &mut CutVisibility) {
        let index = change.instance.index();
        let instance = self.instances.get_mut(index).and_then(Option::as_mut);
        // The index of a removed instance may have been reused.
        let Some(instance) = instance.filter(|instance| instance.id == change.instance) else {
            return;
        };
        // The cut of a whole mesh is one unit, its level, or empty on layers that the view does not draw.
        if instance.level.is_some() {
            self.whole_meshes_to_swap.push(index as u32);
            return;
        }
        // Units become idle when their last view stops drawing them.
        for &unit in change.left {
            if let Ok(position) = instance.find_unit(unit) {
                let record = instance.units[position].1;
                view.set(record, false);
                if self.records.leave_view(record, self.frame) {
                    self.idle_units.push_back((record, self.frame));
                }
            }
        }
        // Units are spawned for the first view that draws them.
        for &unit in change.entered {
            let (record, is_new) = instance.record_of(unit, &mut self.records);
            if is_new {
                self.units_to_spawn.push(record);
            }
            view.set(record, true);
            self.records.enter_view(record);
        }
    }

    /// Empties the cut of a view.
    pub(crate) fn clear_view(&mut self, cut: &mut ViewCut) {
        cut.unit_count = 0;
        for record in cut.visibility.take() {
            if self.records.leave_view(record, self.frame) {
                self.idle_units.push_back((record, self.frame));
            }
        }
        // The level of a whole mesh is then the finest of the other views.
        self.swap_all_whole_meshes();
    }

    /// Removes up to `most` units that no view has drawn for `idle_frames`, and returns their entities. If more than
    /// `most_idle` are idle, the others are removed earlier, in any number.
    pub(crate) fn take_idle_units(
        &mut self,
        idle_frames: u32,
        most: usize,
        most_idle: usize,
    ) -> Vec<Entity> {
        let mut entities = Vec::new();
        // Entries are in the order of frames, so the first that is too young ends the search.
        while let Some(&(record, since)) = self.idle_units.front()
            && (self.records.drawn_and_idle().1 > most_idle
                || entities.len() < most && self.frame.wrapping_sub(since) > idle_frames)
        {
            self.idle_units.pop_front();
            // A unit that a view drew in between has a later entry, or none.
            if self.records.is_idle_since(record, since) {
                entities.extend(self.remove_unit(record));
            }
        }
        entities
    }

    /// Removes the given units of meshes that no view draws, and returns their entities.
    pub(crate) fn remove_idle_units(&mut self, units: &HashMap<MeshId, Vec<u32>>) -> Vec<Entity> {
        let mut records = Vec::new();
        for instance in self.instances.iter().flatten() {
            if let Some(units) = units.get(&instance.mesh.id) {
                let positions = units
                    .iter()
                    .filter_map(|&unit| instance.find_unit(unit).ok());
                records.extend(positions.map(|position| instance.units[position].1));
            }
        }
        records.retain(|&record| self.records.is_idle(record));
        let entities = records.into_iter();
        entities
            .filter_map(|record| self.remove_unit(record))
            .collect()
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
