//! The cut of one instance that is decided group by group, in storage that is used again.

use crate::InstanceView;
use crate::decide::Decision;
use crate::scene::Scene;
use crate::{LodSettings, View};

#[derive(Debug, Default)]
pub(super) struct Slot {
    refined: Vec<u64>,
    refined_before: Vec<u64>,
    units: Vec<u32>,
    units_before: Vec<u32>,
    triangle_count: u64,
    triangles_before: u64,
    group_count: usize,
    has_changed: bool,
}

impl Slot {
    /// Decides the cut anew. `has_memory` tells that the slot holds the last one of this instance.
    pub(super) fn decide(
        &mut self,
        scene: &Scene,
        instance: u32,
        has_memory: bool,
        view: &View,
        settings: &LodSettings,
    ) {
        let data = &scene.instances[instance as usize];
        let Some(mesh) = scene.occupants[instance as usize].mesh else {
            return;
        };
        let table = scene.table(mesh);
        if !has_memory {
            // Every group that was refined is so whatever its error.
            self.refined.clone_from(&table.coarsest_refined);
        }
        std::mem::swap(&mut self.refined, &mut self.refined_before);
        let instance_view = InstanceView::new(view, &data.world_from_local);
        let thresholds = settings.thresholds(data.bias);
        let decision = Decision::new(table, &instance_view, settings, thresholds);
        decision.decide(table, &self.refined_before, &mut self.refined);
        table.close(&mut self.refined);
        self.group_count = table.group_count();
        self.has_changed = !has_memory || self.refined != self.refined_before;
        if self.has_changed {
            std::mem::swap(&mut self.units, &mut self.units_before);
            self.triangles_before = self.triangle_count;
            self.units.clear();
            self.triangle_count = table.gather_units(&self.refined, &mut self.units);
        }
    }

    /// What its storage could hold without growing.
    #[cfg(test)]
    pub(super) fn capacity(&self) -> usize {
        self.refined.capacity()
            + self.refined_before.capacity()
            + self.units.capacity()
            + self.units_before.capacity()
    }

    pub(super) fn refined(&self) -> &[u64] {
        &self.refined
    }

    pub(super) fn units(&self) -> &[u32] {
        &self.units
    }

    pub(super) fn units_before(&self) -> &[u32] {
        &self.units_before
    }

    pub(super) fn triangle_count(&self) -> u64 {
        self.triangle_count
    }

    pub(super) fn triangles_before(&self) -> u64 {
        self.triangles_before
    }

    pub(super) fn group_count(&self) -> usize {
        self.group_count
    }

    pub(super) fn has_changed(&self) -> bool {
        self.has_changed
    }
}

/// The two differences of two ascending lists, appended.
pub(super) fn entered_and_left(
    before: &[u32],
    now: &[u32],
    entered: &mut Vec<u32>,
    left: &mut Vec<u32>,
) {
    let (mut before, mut now) = (before.iter().peekable(), now.iter().peekable());
    loop {
        match (before.peek(), now.peek()) {
            (Some(&&b), Some(&&n)) if b == n => {
                before.next();
                now.next();
            }
            (Some(&&b), Some(&&n)) if b < n => left.extend(before.next_if_eq(&&b)),
            (Some(_), None) => left.extend(before.next()),
            (_, Some(_)) => entered.extend(now.next()),
            (None, None) => return,
        }
    }
}
