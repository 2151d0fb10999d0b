//! What each view draws, as marks on slots and instances.

/// What one view draws.
#[derive(Default)]
pub(crate) struct ViewMarks {
    /// By slot.
    drawn: Vec<bool>,
    /// By the index of the instance: the level that this view asks of a chain.
    levels: Vec<u8>,
}

/// Of an instance that is no chain, or not known.
pub(crate) const NO_LEVEL: u8 = u8::MAX;

impl ViewMarks {
    pub(crate) fn draws(&self, slot: u32) -> bool {
        self.drawn.get(slot as usize) == Some(&true)
    }

    pub(crate) fn level(&self, instance: u32) -> u8 {
        let level = self.levels.get(instance as usize);
        level.copied().unwrap_or(NO_LEVEL)
    }

    pub(crate) fn forget_slots(&mut self, slots: &[u32]) {
        for &slot in slots {
            if let Some(drawn) = self.drawn.get_mut(slot as usize) {
                *drawn = false;
            }
        }
    }

    pub(crate) fn set_drawn(&mut self, slot: u32, drawn: bool) {
        let slot = slot as usize;
        if self.drawn.len() <= slot {
            self.drawn.resize(slot + 1, false);
        }
        self.drawn[slot] = drawn;
    }

    pub(crate) fn set_level(&mut self, instance: usize, level: u32) {
        if self.levels.len() <= instance {
            self.levels.resize(instance + 1, NO_LEVEL);
        }
        // A chain has far fewer levels: each keeps at most three quarters of the triangles.
        self.levels[instance] = level.min(u32::from(NO_LEVEL) - 1) as u8;
    }

    /// Forgets all units, and hands out their slots.
    pub(crate) fn take_drawn(&mut self) -> impl Iterator<Item = u32> + use<> {
        let drawn = std::mem::take(&mut self.drawn).into_iter();
        let slots = drawn.enumerate().filter(|(_, drawn)| *drawn);
        slots.map(|(slot, _)| slot as u32)
    }

    /// Forgets all levels; whether there were any.
    pub(crate) fn take_levels(&mut self) -> bool {
        !std::mem::take(&mut self.levels).is_empty()
    }
}
