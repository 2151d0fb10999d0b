//! The decision on one near instance: at a level, or group by group.

use super::cuts::SceneCuts;
use super::decision::Decision;
use super::frame::Frame;
use super::limits::keep_test::Near;
use super::memory::InstanceState;
use super::weights::Weights;
use crate::criterion::limits::ErrorUnits;
use crate::lanes::smaller;
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
    /// The weight of its errors.
    weight: f32,
}

impl SceneCuts {
    /// Decides one instance, and records its changes.
    pub(super) fn decide(&mut self, frame: &Frame, near: &Near, weights: &mut impl Weights) {
        let (scene, slot) = (frame.scene, near.slot);
        let occupant = &scene.columns.occupants[slot];
        // The instance is not on the view's layers.
        let Some(mesh) = occupant.seen_mesh(frame.view.layers) else {
            return self.draw_whole(frame, slot, InstanceState::Empty);
        };
        let is_free = frame.settings.forced_level.is_none();
        // The instance casts no shadow into the view.
        if near.is_dark && is_free {
            return self.draw_whole(frame, slot, InstanceState::Coarsest(mesh));
        }
        let was = self.memories[slot].state;
        let is_refined = !matches!(was, InstanceState::Empty | InstanceState::Coarsest(_));
        let weight = if is_free {
            usable_weight(weights.weight(occupant.id, is_refined))
        } else {
            1.0
        };
        let candidate = Candidate {
            near,
            id: occupant.id,
            placed: &scene.instances[occupant.id.index()],
            mesh,
            table: scene.table(mesh),
            was,
            weight,
        };
        self.statistics.instances_decided += 1;
        if candidate.table.is_chain() {
            self.decide_level(frame, &candidate);
        } else if is_free && !is_refined && candidate.fits_coarsest(frame) {
            self.draw_whole(frame, slot, InstanceState::Coarsest(mesh));
        } else {
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
                let certain = candidate.certain_level(frame, was);
                certain.unwrap_or_else(|| candidate.exact_level(frame, was))
            }
        };
        let state = if level == coarsest {
            InstanceState::Coarsest(candidate.mesh)
        } else {
            InstanceState::AtLevel(candidate.mesh, level as u8)
        };
        self.draw_whole(frame, candidate.near.slot, state);
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
        cut.weight = candidate.weight;
        // Decide the groups, then record the changes.
        let has_changed = cut.decide(table, |was_refined, refined| {
            if let Some(level) = settings.forced_level {
                return table.refine_from_level(level, refined);
            }
            let view = InstanceView::new(frame.view, &placed.world_from_local);
            let decision = Decision::new(&view, settings, placed.bias, candidate.weight);
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

/// A weight from 0 to 1; 1 for NaN. It is above 0, because 0 times an infinite error is NaN.
fn usable_weight(weight: f32) -> f32 {
    smaller(weight, 1.0).max(f32::MIN_POSITIVE)
}

impl Candidate<'_> {
    /// The weights of errors and deviations.
    fn units(&self, frame: &Frame) -> ErrorUnits {
        frame.units.weighed(self.weight)
    }

    /// Whether the coarsest level certainly shows no error above the threshold.
    fn fits_coarsest(&self, frame: &Frame) -> bool {
        let errors = &self.table.level_errors;
        let limits = errors.limits(errors.coarsest(), &self.units(frame));
        let limits = limits.scaled(frame.scene.columns.error_scales[self.near.slot]);
        limits.highest <= self.near.allowed.coarse[0]
    }

    /// The level by bounds over the whole instance; `None` if the bounds are not decisive.
    fn certain_level(&self, frame: &Frame, was: usize) -> Option<usize> {
        let scale = frame.scene.columns.error_scales[self.near.slot];
        let (errors, allowed) = (&self.table.level_errors, &self.near.allowed);
        errors.certain_level(&self.units(frame), was, allowed, scale)
    }

    /// The level by the criterion.
    fn exact_level(&self, frame: &Frame, was: usize) -> usize {
        let view = InstanceView::new(frame.view, &self.placed.world_from_local);
        let decision = Decision::new(&view, frame.settings, self.placed.bias, self.weight);
        decision.level(self.table, was)
    }
}
