//! How the cuts of views reach the scene: which units are drawn, which must be spawned, and which are
//! idle.

use bevy::prelude::*;
use fieldlod_select::Change;

use super::{DrawnAs, LodScene};
use crate::view_cut::CutVisibility;

/// The position of `unit` in a list of units with their records, or where it belongs.
fn find_unit(units: &[(u32, u32)], unit: u32) -> Result<usize, usize> {
    units.binary_search_by_key(&unit, |&(unit, _)| unit)
}

impl LodScene {
    /// Applies what changed in the cut of one instance in one view.
    pub(crate) fn apply_change(&mut self, change: &Change, view: &mut CutVisibility) {
        let index = change.instance.index();
        let instance = self.instances.get_mut(index).and_then(Option::as_mut);
        // Another id means the cut of a former instance with the same index.
        let Some(instance) = instance.filter(|instance| instance.id == change.instance) else {
            return;
        };
        // The cut of a whole mesh is one unit, its level, which the selector knows.
        let DrawnAs::Units(units) = &mut instance.drawn_as else {
            self.whole_meshes_to_swap.push(index as u32);
            return;
        };
        // Units that left the cut become idle with their last view.
        for &unit in change.left {
            if let Ok(position) = find_unit(units, unit) {
                let record = units[position].1;
                view.set(record, false);
                if self.records.leave_view(record, self.frame) {
                    self.idle_units.push_back((record, self.frame));
                }
            }
        }
        // Units that entered it are spawned for their first view.
        for &unit in change.entered {
            let record = match find_unit(units, unit) {
                Ok(position) => units[position].1,
                Err(position) => {
                    let triangles = instance.mesh.pieces[unit as usize].triangles;
                    let record = self.records.add_unit(index as u32, unit, triangles);
                    units.insert(position, (unit, record));
                    self.units_to_spawn.push(record);
                    record
                }
            };
            view.set(record, true);
            self.records.enter_view(record);
        }
    }

    /// Removes everything from the cut of a view, which has no say in the levels of whole meshes any
    /// more.
    pub(crate) fn clear_view(&mut self, view: &mut CutVisibility) {
        for record in view.take() {
            if self.records.leave_view(record, self.frame) {
                self.idle_units.push_back((record, self.frame));
            }
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

    fn remove_unit(&mut self, record: u32) -> Option<Entity> {
        let (instance, unit) = self.records.unit(record)?;
        if let Some(Some(instance)) = self.instances.get_mut(instance as usize)
            && let DrawnAs::Units(units) = &mut instance.drawn_as
            && let Ok(position) = find_unit(units, unit)
        {
            units.remove(position);
        }
        self.records.free(record)
    }
}
