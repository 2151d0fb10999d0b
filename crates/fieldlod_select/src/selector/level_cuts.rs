//! The levels of meshes that are drawn as a whole: a comparison with what the last answer was, and for how far
//! the camera may go until it is another. They need no storage of their own.

use camera_field::Camera;

use super::hidden_test::HiddenTest;
use super::memory::{InstanceState, NodeMemory};
use super::scene_cuts::SceneCuts;
use super::share_memory::LevelShare;
use super::traversal::TraversalContext;
use crate::bits::{CHUNK, LANES};
use crate::decide::{Decision, LevelAnswer};
use crate::scene::{InstanceId, MeshId, Scene};
use crate::shares::Shares;
use crate::table::GroupTable;
use crate::validity::{Tolerance, Validity};
use crate::view::{InstanceView, View};

/// What counts of the groups of a mesh as a whole, in steps.
pub(super) type LevelSteps = [[u8; LANES]; CHUNK / LANES];

/// The least share of what may be tolerated that is worth it.
const LEAST_SHARE: f32 = 1.0 / 256.0;

/// What an instance tolerates of the most there is. Without perspective most tolerate the same share of it: from half
/// on, so that answers that begin in one frame, as all do in the first one, do not end in one.
fn spread(view: &View, instance: u32) -> f32 {
    match view.camera {
        Camera::Perspective(_) => 1.0,
        Camera::Orthographic(_) => {
            let mixed = instance.wrapping_mul(0x9e37_79b9) >> 16;
            0.5 + 0.5 / 65536.0 * mixed as f32
        }
    }
}

impl TraversalContext<'_> {
    /// The level of an instance in the view, which had another one or the same.
    fn level(
        &self,
        instance: u32,
        table: &GroupTable,
        was: usize,
        share: Option<&LevelShare>,
    ) -> (usize, Validity) {
        let placed = &self.scene.instances[instance as usize];
        let view = InstanceView::new(self.view, &placed.world_from_local);
        let steps = share.map(|share| share.steps(was));
        let shares = self.shares(steps.as_ref());
        let mut decision = Decision::new(
            table,
            &view,
            self.parts,
            placed.bias,
            &Tolerance::default(),
            shares,
        );
        let farthest = self.test.farthest(&placed.node.bounds.sphere);
        // Less than a step is not worth it.
        let largest = self.now.ahead(farthest);
        let largest = largest.times(spread(self.view, instance));
        let least = self.last_step.step().larger(&largest.times(LEAST_SHARE));
        let may_stay = self.test.is_usable() && !self.now.is_restless();
        let tolerances = may_stay.then_some([least, largest]);
        let LevelAnswer { level, tolerance } = decision.level(table, was, tolerances);
        // What counts depends on what was drawn, where that is not the same of all. So do thresholds, but what becomes
        // refined leaves at no higher one than it came at.
        let is_settled = share.is_none_or(LevelShare::is_settled);
        let tolerance = tolerance.filter(|_| level == was || is_settled);
        let validity = tolerance.map_or(Validity::NONE, |tolerance| {
            Validity::within(&tolerance, &self.now)
        });
        (level, validity)
    }

    /// What counts of a mesh as a whole, by the steps of its levels.
    fn shares<'a>(&self, steps: Option<&'a LevelSteps>) -> Shares<'a> {
        match (steps, &self.hidden) {
            (Some(steps), Some(hidden)) => Shares::new(steps, hidden.least_share),
            _ => Shares::FULL,
        }
    }
}

impl SceneCuts {
    /// Takes notice of what is visible of an instance that is drawn at a level, or at its coarsest because of what is
    /// visible. Whether the last answer may be another one for that.
    pub(super) fn update_level_share(&mut self, context: &TraversalContext, instance: u32) -> bool {
        let memory = &mut self.memories[instance as usize];
        let (mesh, is_refined) = match memory.state {
            InstanceState::AtLevel(mesh, _) => (mesh, true),
            InstanceState::Coarsest(mesh) if memory.share.is_some() => (mesh, false),
            _ => return false,
        };
        let Some(hidden) = &context.hidden else {
            return memory.share.take().is_some();
        };
        if context.are_shares_known && memory.share.is_some() {
            return false;
        }
        let was_hidden = memory.share.is_some_and(|share| share.is_hidden());
        let now = hidden.share_of_whole(context.scene, mesh, instance, was_hidden);
        match (&mut memory.share, now) {
            (Some(share), Some(now)) => {
                let may_change = share.update(now, is_refined, hidden.hold_frames);
                self.has_unsettled_shares |= !share.is_settled();
                may_change
            }
            (share, Some(now)) => {
                *share = Some(LevelShare::seen(now));
                true
            }
            (share, None) => !is_refined && share.take().is_some(),
        }
    }

    /// Decides the level of an instance that is drawn as a whole, of which `seen` is visible if that is known.
    pub(super) fn decide_level(
        &mut self,
        context: &TraversalContext,
        instance: u32,
        mesh: MeshId,
        seen: Option<u8>,
        size_validity: &Validity,
    ) -> NodeMemory {
        let table = context.scene.table(mesh);
        let coarsest = table.group_count() - 1;
        let was = match self.memories[instance as usize].state {
            InstanceState::AtLevel(_, level) => usize::from(level),
            InstanceState::Mixed(key) => self.pool.at(key).refined()[0].trailing_zeros() as usize,
            _ => coarsest,
        };
        let is_at_level = matches!(
            self.memories[instance as usize].state,
            InstanceState::AtLevel(..)
        );
        if !is_at_level {
            let hidden = context.hidden.as_ref();
            let ask =
                |hidden: &HiddenTest| hidden.share_of_whole(context.scene, mesh, instance, true);
            let seen = seen.or_else(|| hidden.and_then(ask));
            self.memories[instance as usize].share = seen.map(LevelShare::seen);
        }
        let share = self.memories[instance as usize].share.as_mut();
        let share = share.map(|share| {
            share.note_decided();
            *share
        });
        let (level, validity) = context.level(instance, table, was, share.as_ref());
        self.statistics.instances_decided += 1;
        self.statistics.groups_decided += table.group_count();
        let state = match level == coarsest {
            true => InstanceState::Coarsest(mesh),
            false => InstanceState::AtLevel(mesh, level as u8),
        };
        // A first frame lists what is at its coarsest in the end.
        let is_listed_later = context.is_first && level == coarsest;
        if !is_listed_later && self.memories[instance as usize].state != state {
            self.memories[instance as usize].generation =
                context.scene.instance_at(instance).generation;
            self.change_state(context.scene, instance, state);
        }
        NodeMemory {
            validity: validity.and(size_validity, &context.now),
            below: state.below(),
        }
    }

    /// What counts of each level of an instance that is drawn at one, if hidden things count less.
    pub(super) fn level_steps(&self, index: usize) -> Option<LevelSteps> {
        let memory = self.memories.get(index)?;
        match memory.state {
            InstanceState::AtLevel(_, level) => Some(memory.share?.steps(usize::from(level))),
            _ => None,
        }
    }

    /// Gives instances that are drawn at a level cuts of their own, where their meshes are loaded in parts now.
    pub(super) fn give_cuts_to_loaded_levels(&mut self, scene: &Scene) {
        for index in 0..self.memories.len() as u32 {
            let memory = self.memories[index as usize];
            let generation = memory.generation;
            if let InstanceState::AtLevel(mesh, level) = memory.state
                && scene.mesh_of(InstanceId { index, generation }) == Some(mesh)
                && scene.table(mesh).available.is_some()
            {
                let table = scene.table(mesh);
                let key = self.pool.make(table);
                let cut = self.pool.at_mut(key);
                cut.begin_shares(index, table.terminal.len(), None);
                cut.begin_at_level(table, usize::from(level));
                let memory = &mut self.memories[index as usize];
                (memory.state, memory.share) = (InstanceState::Mixed(key), None);
            }
        }
    }

    /// The bits of the groups that are refined of an instance, if it is drawn as a whole at a level.
    pub(super) fn refined_at_level(&self, index: usize) -> Option<&'static [u64]> {
        match self.memories.get(index)?.state {
            InstanceState::AtLevel(_, level) => {
                Some(GroupTable::closed_from_level(usize::from(level)))
            }
            _ => None,
        }
    }
}
