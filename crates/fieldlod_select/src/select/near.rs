//! The decision on one near instance: at a level, or group by group.

use super::cuts::SceneCuts;
use super::decision::Decision;
use super::frame::Frame;
use super::limits::keep_test::Near;
use super::memory::InstanceState;
use crate::hidden::shares::{HIDDEN, Shares, share_of_step};
use crate::scene::MeshId;
use crate::scene::table::GroupTable;
use crate::view::InstanceView;

impl SceneCuts {
    /// Decides one instance, and records its changes.
    pub(super) fn decide(&mut self, frame: &Frame, near: &Near) {
        let (index, entry) = (near.index, &frame.scene.entries[near.index as usize]);
        if self.holds(index) {
            return;
        }
        // If the index has passed to another instance, the units of the last one leave.
        if self.memories[index as usize].generation != entry.generation {
            self.change_state(frame, index, InstanceState::Empty);
        }
        let memory = &mut self.memories[index as usize];
        (memory.generation, memory.version) = (entry.generation, entry.version);
        // Not on the view's layers.
        let Some(mesh) = entry.seen_mesh(frame.view.layers) else {
            return self.draw_whole(frame, index, InstanceState::Empty);
        };
        // Without a shadow in the view, or forced to a level.
        let forced_level = frame.settings.forced_level.or(entry.forced_level);
        if forced_level.is_none() && near.is_dark {
            return self.draw_whole(frame, index, InstanceState::Coarsest(mesh));
        }
        self.statistics.instances_decided += 1;
        self.statistics.groups_decided += frame.scene.table(mesh).group_count();
        if frame.scene.table(mesh).is_chain() {
            self.decide_level(frame, near, mesh, forced_level);
        } else if !self.stays_hidden(frame, near, mesh, forced_level) {
            self.decide_groups(frame, near, mesh, forced_level);
        }
    }

    fn draw_whole(&mut self, frame: &Frame, index: u32, state: InstanceState) {
        self.change_state(frame, index, state);
        self.set_limits(frame, index, false);
    }

    /// Decides the level of a mesh that is drawn as a whole.
    fn decide_level(
        &mut self,
        frame: &Frame,
        near: &Near,
        mesh: MeshId,
        forced_level: Option<u32>,
    ) {
        let (table, index) = (frame.scene.table(mesh), near.index as usize);
        let coarsest = table.group_count() - 1;
        let was = match self.memories[index].state {
            InstanceState::AtLevel(_, level) => usize::from(level),
            InstanceState::Mixed(key) => self.pool.at(key).refined()[0].trailing_zeros() as usize,
            _ => coarsest,
        };
        let level = match forced_level {
            Some(level) => table.chain_level(level),
            None => {
                self.see_level(frame, near.index, mesh, was < coarsest);
                let certain = self.certain_level(frame, near, table, was);
                certain.unwrap_or_else(|| self.exact_level(frame, index, table, was))
            }
        };
        let state = match level == coarsest {
            true => InstanceState::Coarsest(mesh),
            false => InstanceState::AtLevel(mesh, level as u8),
        };
        self.change_state(frame, near.index, state);
        self.set_limits(frame, near.index, forced_level.is_some());
    }

    /// The first level whose group is certainly refined; `None` if the certain bounds do not tell.
    fn certain_level(
        &self,
        frame: &Frame,
        near: &Near,
        table: &GroupTable,
        was: usize,
    ) -> Option<usize> {
        let weights = match &frame.settings.visible_flux {
            None => [1.0; 2],
            Some(flux) => {
                let steps = self.memories[near.index as usize].share.now_and_held();
                steps.map(|step| share_of_step(step, flux.least_share).sqrt())
            }
        };
        let [least_scale, most_scale] = frame.scene.columns.error_scales[near.index as usize];
        for level in 0..table.group_count() {
            let was_refined = usize::from(level >= was);
            let [least, most] =
                (table.errors_at(Some(level))).own(&frame.units, weights[was_refined]);
            if least == f32::INFINITY || near.allowed.fine[was_refined] < least * least_scale {
                return Some(level);
            }
            // NaN is not certain.
            let is_coarse = most * most_scale <= near.allowed.coarse[was_refined];
            if !is_coarse {
                return None;
            }
        }
        None
    }

    /// The level by the criterion.
    fn exact_level(&self, frame: &Frame, index: usize, table: &GroupTable, was: usize) -> usize {
        let steps = self.memories[index].share.steps(was);
        let shares = match &frame.settings.visible_flux {
            Some(flux) => Shares::new(&steps, flux.least_share),
            None => Shares::FULL,
        };
        let placed = &frame.scene.instances[index];
        let view = InstanceView::new(frame.view, &placed.world_from_local);
        Decision::new(&view, &frame.bounds, frame.settings, placed.bias, shares).level(table, was)
    }

    /// Updates the visible share of a mesh that is drawn as a whole.
    fn see_level(&mut self, frame: &Frame, index: u32, mesh: MeshId, is_refined: bool) {
        let (Some(flux), Some(buffer)) = (&frame.settings.visible_flux, &self.visible.buffer)
        else {
            return;
        };
        let share = &mut self.memories[index as usize].share;
        if !(frame.are_shares_known && is_refined) {
            let table = frame.scene.table(mesh);
            let placed = &frame.scene.instances[index as usize];
            let now = buffer.share_of_all(table, index, placed);
            share.update(now.unwrap_or(HIDDEN), is_refined, flux.hold_frames);
        }
        self.has_unsettled_shares |= !share.is_settled();
    }

    /// Whether an instance at its coarsest level stays there because of its visible share.
    fn stays_hidden(
        &mut self,
        frame: &Frame,
        near: &Near,
        mesh: MeshId,
        forced_level: Option<u32>,
    ) -> bool {
        let index = near.index;
        let is_coarsest = match self.memories[index as usize].state {
            InstanceState::AtLevel(..) | InstanceState::Mixed(_) => false,
            InstanceState::Empty | InstanceState::Coarsest(_) => true,
        };
        let (Some(flux), Some(buffer)) = (&frame.settings.visible_flux, &self.visible.buffer)
        else {
            return false;
        };
        let (table, placed) = (
            frame.scene.table(mesh),
            &frame.scene.instances[index as usize],
        );
        if !is_coarsest || forced_level.is_some() {
            return false;
        }
        let Some(step) = buffer.share_of_all(table, index, placed) else {
            return false;
        };
        let share = share_of_step(step, flux.least_share);
        let limits = table.errors_at(None).limits(&frame.units, share);
        let limits = limits.scaled(frame.scene.columns.error_scales[index as usize]);
        let stays = limits.highest <= near.allowed.coarse[0];
        if stays {
            self.draw_whole(frame, index, InstanceState::Coarsest(mesh));
        }
        stays
    }

    /// Whether the cut of an instance holds for the camera's motion so far.
    fn holds(&self, index: u32) -> bool {
        let hold = match self.memories[index as usize].state {
            InstanceState::Mixed(key) => &self.pool.at(key).hold,
            _ => &None,
        };
        hold.as_ref()
            .is_some_and(|hold| self.odometer.is_within(hold))
    }

    /// Tests whether the cut of an instance holds for the next frames too.
    fn extend_hold(&mut self, frame: &Frame, index: u32, mesh: MeshId) -> bool {
        let InstanceState::Mixed(key) = self.memories[index as usize].state else {
            return false;
        };
        let (table, placed) = (
            frame.scene.table(mesh),
            &frame.scene.instances[index as usize],
        );
        let ahead = (self.odometer.ahead()).filter(|_| frame.settings.visible_flux.is_none());
        let drift = ahead.and_then(|ahead| frame.test.drift(&placed.sphere, ahead));
        let (Some(ahead), Some(drift)) = (ahead, drift) else {
            return false;
        };
        let view = InstanceView::new(frame.view, &placed.world_from_local);
        // Nothing is known of how uneven stretches change with the direction.
        if view.seen_stretch.is_some() {
            return false;
        }
        let cut = self.pool.at_mut(key);
        let (bounds, bias) = (&frame.bounds, placed.bias);
        let decision = Decision::new(&view, bounds, frame.settings, bias, Shares::FULL);
        let decision = decision.throughout(drift);
        decision.decide(table, cut.refined(), &mut self.own_throughout);
        let is_same = cut.is_same_for(&self.own_throughout);
        cut.hold = is_same.then(|| self.odometer.hold(ahead));
        is_same
    }

    /// Decides the groups of an instance.
    fn decide_groups(
        &mut self,
        frame: &Frame,
        near: &Near,
        mesh: MeshId,
        forced_level: Option<u32>,
    ) {
        let (index, scene, settings) = (near.index, frame.scene, frame.settings);
        let (table, placed) = (scene.table(mesh), &scene.instances[index as usize]);
        // A new cut starts from the units drawn so far.
        let was = self.memories[index as usize].state;
        let is_mixed = matches!(was, InstanceState::Mixed(_));
        if forced_level.is_none() && self.extend_hold(frame, index, mesh) {
            return;
        }
        let key = match was {
            InstanceState::Mixed(key) => key,
            _ => {
                let key = self.pool.make();
                let level = match was {
                    InstanceState::AtLevel(_, level) => Some(usize::from(level)),
                    _ => None,
                };
                self.pool
                    .at_mut(key)
                    .begin(table, level, was.drawn_whole(scene));
                key
            }
        };
        let cut = self.pool.at_mut(key);
        let (_, triangles_before) = cut.drawn();
        if !(frame.are_shares_known && is_mixed) {
            let flux = settings.visible_flux.filter(|_| forced_level.is_none());
            let seen = flux.map(|_| self.visible.seen(table, index, placed));
            cut.update_shares(seen, flux.map_or(0, |flux| flux.hold_frames));
        }
        self.has_unsettled_shares |= !cut.shares().is_settled();
        // Decide the groups, then record the changes.
        let has_changed = cut.decide(table, |shares, was_refined, refined| match forced_level {
            Some(level) => table.refine_from_level(level, refined),
            None => {
                let view = InstanceView::new(frame.view, &placed.world_from_local);
                let shares = shares.shares(settings);
                Decision::new(&view, &frame.bounds, settings, placed.bias, shares).decide(
                    table,
                    was_refined,
                    refined,
                );
            }
        });
        if has_changed {
            let (now, triangles) = cut.drawn();
            let id = scene.instance_at(index);
            self.changes.record(id, cut.drawn_before(), now);
            self.triangle_count = self.triangle_count + triangles - triangles_before;
        }
        // A cut of its own may hold where the limits of the coarsest level do not.
        let limits = table.errors_at(None).limits(&frame.units, 1.0);
        let limits = limits.scaled(scene.columns.error_scales[index as usize]);
        let has_limits =
            settings.visible_flux.is_some() || limits.highest <= near.allowed.coarse[0];
        let is_coarsest = forced_level.is_none() && has_limits && cut.is_coarsest(table);
        self.memories[index as usize].state = InstanceState::Mixed(key);
        if is_coarsest {
            self.change_state(frame, index, InstanceState::Coarsest(mesh));
        }
        self.set_limits(frame, index, forced_level.is_some());
    }
}
