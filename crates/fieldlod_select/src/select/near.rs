//! The decision on one near instance: at a level, or group by group.

use super::cuts::SceneCuts;
use super::decision::Decision;
use super::frame::Frame;
use super::limits::keep_test::Near;
use super::memory::InstanceState;
use crate::hidden::shares::{HIDDEN, Shares, share_of_step};
use crate::scene::table::GroupTable;
use crate::scene::{Instance, InstanceId, MeshId};
use crate::view::InstanceView;

/// A near instance that the criterion decides.
struct Candidate<'a> {
    near: &'a Near,
    id: InstanceId,
    placed: &'a Instance,
    mesh: MeshId,
    table: &'a GroupTable,
    was: InstanceState,
}

impl SceneCuts {
    /// Decides one instance, and records its changes.
    pub(super) fn decide(&mut self, frame: &Frame, near: &Near) {
        let (scene, slot) = (frame.scene, near.slot);
        let occupant = &scene.columns.occupants[slot];
        // The instance is not on the view's layers.
        let Some(mesh) = occupant.seen_mesh(frame.view.layers) else {
            return self.draw_whole(frame, slot, InstanceState::Empty);
        };
        // The instance casts no shadow into the view.
        if near.is_dark && frame.settings.forced_level.is_none() {
            return self.draw_whole(frame, slot, InstanceState::Coarsest(mesh));
        }
        let was = self.memories[slot].state;
        let candidate = Candidate {
            near,
            id: occupant.id,
            placed: &scene.instances[occupant.id.index()],
            mesh,
            table: scene.table(mesh),
            was,
        };
        self.statistics.instances_decided += 1;
        if candidate.table.is_chain() {
            self.decide_level(frame, &candidate);
        } else if !self.stays_hidden(frame, &candidate) {
            self.decide_groups(frame, &candidate);
        }
    }

    fn draw_whole(&mut self, frame: &Frame, slot: usize, state: InstanceState) {
        self.change_state(frame, slot, state);
        self.limits.set(slot, state.limits(frame, slot));
    }

    /// Decides the level of a mesh that is drawn as a whole.
    fn decide_level(&mut self, frame: &Frame, candidate: &Candidate) {
        let table = candidate.table;
        let coarsest = table.group_count - 1;
        let was = match candidate.was {
            InstanceState::AtLevel(_, level) => usize::from(level),
            _ => coarsest,
        };
        let level = match frame.settings.forced_level {
            Some(level) => table.chain_level(level),
            None => {
                self.see_level(frame, candidate, was < coarsest);
                let certain = self.certain_level(frame, candidate, was);
                certain.unwrap_or_else(|| self.exact_level(frame, candidate, was))
            }
        };
        let state = if level == coarsest {
            InstanceState::Coarsest(candidate.mesh)
        } else {
            InstanceState::AtLevel(candidate.mesh, level as u8)
        };
        self.draw_whole(frame, candidate.near.slot, state);
    }

    /// The level by bounds over the whole instance; `None` if the bounds are not decisive.
    fn certain_level(&self, frame: &Frame, candidate: &Candidate, was: usize) -> Option<usize> {
        let weight = match &frame.settings.visible_flux {
            None => [1.0; 2],
            Some(flux) => {
                let [now, held] = self.level_shares[candidate.near.slot].now_and_held();
                let weight = |step: u8| share_of_step(step, flux.least_share).sqrt();
                [weight(now), weight(held)]
            }
        };
        let scale = frame.scene.columns.error_scales[candidate.near.slot];
        let (errors, allowed) = (&candidate.table.level_errors, &candidate.near.allowed);
        errors.certain_level(&frame.units, was, allowed, [scale, weight])
    }

    /// The level by the criterion.
    fn exact_level(&self, frame: &Frame, candidate: &Candidate, was: usize) -> usize {
        let steps;
        let shares = match &frame.settings.visible_flux {
            Some(flux) => {
                steps = self.level_shares[candidate.near.slot].steps(was);
                Shares {
                    steps: &steps,
                    least: flux.least_share,
                }
            }
            None => Shares::FULL,
        };
        let placed = candidate.placed;
        let view = InstanceView::new(frame.view, &placed.world_from_local);
        let decision = Decision::new(&view, frame.settings, placed.bias, shares);
        decision.level(candidate.table, was)
    }

    /// Updates the visible share of a mesh that is drawn as a whole.
    fn see_level(&mut self, frame: &Frame, candidate: &Candidate, is_refined: bool) {
        let flux = frame.settings.visible_flux.as_ref();
        let Some((flux, image)) = flux.zip(self.depth_image.as_ref()) else {
            return;
        };
        let share = &mut self.level_shares[candidate.near.slot];
        // Tries of a budget search count as one frame for the held shares. A share that is not held follows each try.
        if !(frame.are_shares_known && is_refined) {
            let now = image.share_of_all(candidate.table, candidate.id, candidate.placed);
            share.update(now.unwrap_or(HIDDEN), is_refined, flux.hold_frames);
        }
        self.has_unsettled_shares |= !share.is_settled();
    }

    /// Whether an instance at its coarsest level stays there because of its visible share.
    fn stays_hidden(&mut self, frame: &Frame, candidate: &Candidate) -> bool {
        let flux = frame.settings.visible_flux.as_ref();
        let Some((flux, image)) = flux.zip(self.depth_image.as_ref()) else {
            return false;
        };
        let &Candidate {
            table, id, placed, ..
        } = candidate;
        // A refined instance that disappears waits for its held shares.
        if !matches!(
            candidate.was,
            InstanceState::Empty | InstanceState::Coarsest(_)
        ) {
            return false;
        }
        let share = image.share_of_all(table, id, placed);
        let share = share.map(|step| share_of_step(step, flux.least_share));
        let stays = share.is_some_and(|share| candidate.fits_coarsest(frame, share));
        if stays {
            let coarsest = InstanceState::Coarsest(candidate.mesh);
            self.draw_whole(frame, candidate.near.slot, coarsest);
        }
        stays
    }

    /// Decides the groups of an instance.
    fn decide_groups(&mut self, frame: &Frame, candidate: &Candidate) {
        let &Candidate {
            near,
            id,
            placed,
            table,
            ..
        } = candidate;
        let (slot, settings) = (near.slot, frame.settings);
        let key = self.key_of_cut(frame, candidate);
        let cut = self.pool.at_mut(key);
        let (_, triangles_before) = cut.drawn();
        let is_mixed = matches!(candidate.was, InstanceState::Mixed(_));
        if !(frame.are_shares_known && is_mixed) {
            match settings.visible_flux.zip(self.depth_image.as_ref()) {
                Some((flux, image)) => {
                    let of_all = image.shares(table, id, placed, &mut self.group_shares);
                    let seen = (of_all, &self.group_shares[..]);
                    cut.shares.update(seen, &cut.refined, flux.hold_frames);
                }
                None => cut.shares.clear(),
            }
        }
        self.has_unsettled_shares |= !cut.shares.is_settled;
        // Decide the groups, then record the changes.
        let has_changed = cut.decide(table, |shares, was_refined, refined| {
            if let Some(level) = settings.forced_level {
                return table.refine_from_level(level, refined);
            }
            let view = InstanceView::new(frame.view, &placed.world_from_local);
            let shares = shares.shares(settings);
            let decision = Decision::new(&view, settings, placed.bias, shares);
            decision.decide(table, was_refined, refined);
        });
        if has_changed {
            let (now, triangles) = cut.drawn();
            self.changes.record(id, &cut.units_before, now);
            self.triangle_count = self.triangle_count + triangles - triangles_before;
        }
        let is_coarsest = settings.forced_level.is_none() && cut.refined == table.terminal;
        // The changes to this cut are recorded. The coarsest state has the same units, and frees the cut.
        self.memories[slot].state = InstanceState::Mixed(key);
        let state = if is_coarsest {
            InstanceState::Coarsest(candidate.mesh)
        } else {
            InstanceState::Mixed(key)
        };
        self.draw_whole(frame, slot, state);
    }

    /// The key of the cut of an instance. A new cut starts from the units that are drawn.
    fn key_of_cut(&mut self, frame: &Frame, candidate: &Candidate) -> u32 {
        let level = match candidate.was {
            InstanceState::Mixed(key) => return key,
            InstanceState::AtLevel(_, level) => Some(usize::from(level)),
            _ => None,
        };
        let key = self.pool.make(candidate.id);
        let drawn = candidate.was.drawn_whole(frame.scene);
        self.pool.at_mut(key).begin(candidate.table, level, drawn);
        key
    }
}

impl Candidate<'_> {
    /// Whether the coarsest level certainly shows no error above the threshold, if errors count √`share` times.
    fn fits_coarsest(&self, frame: &Frame, share: f32) -> bool {
        let errors = &self.table.level_errors;
        let limits = errors.limits(errors.coarsest(), &frame.units.hidden_to(share));
        let limits = limits.scaled(frame.scene.columns.error_scales[self.near.slot]);
        limits.highest <= self.near.allowed.coarse[0]
    }
}
