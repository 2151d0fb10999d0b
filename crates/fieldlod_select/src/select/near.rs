//! The decision on one instance that may not stay as it is: not drawn, at a level, or group by group.

use super::cuts::SceneCuts;
use super::decision::Decision;
use super::frame::Frame;
use super::memory::InstanceState;
use crate::criterion::limits::ErrorUnits;
use crate::hidden::shares::{HIDDEN, Shares};
use crate::lanes::V3;
use crate::scene::MeshId;
use crate::view::InstanceView;

/// An instance that is to be decided.
#[derive(Clone, Copy)]
struct Near {
    index: u32,
    mesh: MeshId,
    /// The level that it is to be drawn at, if that is forced.
    forced_level: Option<u32>,
}

impl SceneCuts {
    /// Decides one instance, and notes what that changes.
    pub(super) fn decide(&mut self, frame: &Frame, index: u32) {
        let (entry, placed) = (
            &frame.scene.entries[index as usize],
            &frame.scene.instances[index as usize],
        );
        // If the index has gone to another instance, what the last one drew leaves.
        if self.memories[index as usize].generation != entry.generation {
            self.change_state(frame, index, InstanceState::Empty);
        }
        let memory = &mut self.memories[index as usize];
        (memory.generation, memory.version) = (entry.generation, entry.version);
        let was_drawn = memory.state.is_drawn();
        // What the view does not see, or not large enough.
        let Some(mesh) = entry.seen_mesh(frame.view.layers) else {
            return self.draw_whole(frame, index, InstanceState::Empty);
        };
        let sighted = (frame.test).sight(V3::splat(placed.sphere.center), placed.sphere.radius, 0.0);
        let size = frame.scene.columns.size(index as usize);
        if !frame.test.is_large(&sighted, size, was_drawn) {
            return self.draw_whole(frame, index, InstanceState::Culled);
        }
        // What is forced to a level, or not seen at all.
        let forced_level = frame.settings.forced_level.or(placed.forced_level);
        if forced_level.is_none() && frame.test.is_outside_and_dark(&sighted) {
            return self.draw_whole(frame, index, InstanceState::Coarsest(mesh));
        }
        let near = Near {
            index,
            mesh,
            forced_level,
        };
        self.statistics.instances_decided += 1;
        self.statistics.groups_decided += frame.scene.table(mesh).group_count();
        if frame.scene.table(mesh).is_chain() {
            self.decide_level(frame, &near);
        } else if !self.stays_hidden(frame, &near) {
            self.decide_groups(frame, &near);
        }
    }

    fn draw_whole(&mut self, frame: &Frame, index: u32, state: InstanceState) {
        self.change_state(frame, index, state);
        self.set_limits(frame, index, false);
    }

    /// Decides the level of a mesh that is drawn as a whole.
    fn decide_level(&mut self, frame: &Frame, near: &Near) {
        let (table, index) = (frame.scene.table(near.mesh), near.index as usize);
        let coarsest = table.group_count() - 1;
        let was = match self.memories[index].state {
            InstanceState::AtLevel(_, level) => usize::from(level),
            InstanceState::Mixed(key) => self.pool.at(key).refined()[0].trailing_zeros() as usize,
            _ => coarsest,
        };
        let level = match near.forced_level {
            Some(level) => table.chain_level(level),
            None => {
                self.see_level(frame, near, was < coarsest);
                let steps = self.memories[index].share.steps(was);
                let shares = match &frame.settings.visible_flux {
                    Some(flux) => Shares::new(&steps, flux.least_share),
                    None => Shares::FULL,
                };
                let placed = &frame.scene.instances[index];
                let view = InstanceView::new(frame.view, &placed.world_from_local);
                Decision::new(&view, &frame.bounds, frame.settings, placed.bias, shares)
                    .level(table, was)
            }
        };
        let state = match level == coarsest {
            true => InstanceState::Coarsest(near.mesh),
            false => InstanceState::AtLevel(near.mesh, level as u8),
        };
        self.change_state(frame, near.index, state);
        self.set_limits(frame, near.index, near.forced_level.is_some());
    }

    /// Takes notice of what is visible of a mesh that is drawn as a whole.
    fn see_level(&mut self, frame: &Frame, near: &Near, is_refined: bool) {
        let (Some(flux), Some(buffer)) = (&frame.settings.visible_flux, &self.visible.buffer)
        else {
            return;
        };
        let share = &mut self.memories[near.index as usize].share;
        if !(frame.are_shares_known && is_refined) {
            let is_likely_hidden = !is_refined || share.now == HIDDEN;
            let (table, index) = (frame.scene.table(near.mesh), near.index);
            let placed = &frame.scene.instances[index as usize];
            let now = buffer.share_of_all(table, index, placed, is_likely_hidden);
            share.update(now.unwrap_or(HIDDEN), is_refined, flux.hold_frames);
        }
        self.has_unsettled_shares |= !share.is_settled();
    }

    /// Whether an instance at its coarsest stays there by what is visible of it.
    fn stays_hidden(&mut self, frame: &Frame, near: &Near) -> bool {
        let Near { index, mesh, .. } = *near;
        let is_coarsest = match self.memories[index as usize].state {
            InstanceState::AtLevel(..) | InstanceState::Mixed(_) => false,
            InstanceState::Empty | InstanceState::Culled | InstanceState::Coarsest(_) => true,
        };
        let (Some(flux), Some(buffer)) = (&frame.settings.visible_flux, &self.visible.buffer)
        else {
            return false;
        };
        let (table, placed) = (frame.scene.table(mesh), &frame.scene.instances[index as usize]);
        if !is_coarsest || near.forced_level.is_some() || !frame.test.is_usable() {
            return false;
        }
        let Some(step) = buffer.share_of_all(table, index, placed, true) else {
            return false;
        };
        let share = crate::hidden::shares::share_of_step(step, flux.least_share);
        let units = ErrorUnits::new(&frame.view.camera, frame.settings);
        let limits = table.errors_at(None).limits(&units, share);
        let limits = limits.scaled(placed.error_scale);
        let center = V3::splat(placed.sphere.center);
        let sighted = (frame.test).sight(center, placed.sphere.radius, limits.lowest);
        let stays = (frame.test).keeps(&sighted, limits.lowest, limits.highest);
        if stays {
            self.draw_whole(frame, index, InstanceState::Coarsest(mesh));
        }
        stays
    }

    /// Decides the groups of an instance.
    fn decide_groups(&mut self, frame: &Frame, near: &Near) {
        let Near { index, mesh, forced_level } = *near;
        let (scene, settings) = (frame.scene, frame.settings);
        let (table, placed) = (scene.table(mesh), &scene.instances[index as usize]);
        // The cut, after what was drawn so far.
        let was = self.memories[index as usize].state;
        let is_mixed = matches!(was, InstanceState::Mixed(_));
        let key = match was {
            InstanceState::Mixed(key) => key,
            _ => {
                let key = self.pool.make(table);
                let level = match was {
                    InstanceState::AtLevel(_, level) => Some(usize::from(level)),
                    _ => None,
                };
                self.pool.at_mut(key).begin(table, level, was.drawn_whole(scene));
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
        // The groups, and what that changes.
        let has_changed = cut.decide(table, |shares, was_refined, refined| match forced_level {
            Some(level) => table.refine_from_level(level, refined),
            None => {
                let view = InstanceView::new(frame.view, &placed.world_from_local);
                let shares = shares.shares(settings);
                Decision::new(&view, &frame.bounds, settings, placed.bias, shares)
                    .decide(table, was_refined, refined);
            }
        });
        if has_changed {
            let (now, triangles) = cut.drawn();
            let id = scene.instance_at(index);
            self.changes.record(id, cut.drawn_before(), now);
            self.triangle_count = self.triangle_count + triangles - triangles_before;
        }
        let is_coarsest = forced_level.is_none() && cut.is_coarsest(table);
        self.memories[index as usize].state = InstanceState::Mixed(key);
        if is_coarsest {
            self.change_state(frame, index, InstanceState::Coarsest(mesh));
        }
        self.set_limits(frame, index, forced_level.is_some());
    }
}
