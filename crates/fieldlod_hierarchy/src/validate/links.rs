//! What consumes what, and at which level.

use super::InvalidHierarchy as E;
use crate::{Hierarchy, NO_GROUP};

impl Hierarchy {
    pub(super) fn check_links(&self) -> Result<(), E> {
        let mut produces = vec![false; self.groups.len()];
        for (index, group) in self.groups.iter().enumerate() {
            if group.unit_count == 0 {
                return Err(E::EmptyGroup { group: index });
            }
            self.check_units_of(index)?;
            self.check_finer_of(index)?;
            self.check_level_of(index)?;
        }
        for (unit, producer) in self.units.iter().map(|u| u.produced_by).enumerate() {
            if producer == NO_GROUP {
                continue;
            }
            let group = producer as usize;
            produces[group] = true;
            if self.groups[group].is_terminal() {
                return Err(E::ProducedByTerminal { unit, group });
            }
        }
        let silent = |(group, &produces): (usize, &bool)| {
            (!produces && !self.groups[group].is_terminal()).then_some(group)
        };
        match produces.iter().enumerate().find_map(silent) {
            Some(group) => Err(E::ProducesNothing { group }),
            None => Ok(()),
        }
    }

    fn check_units_of(&self, group: usize) -> Result<(), E> {
        for unit in self.groups[group].units() {
            if self.units[unit].triangle_count == 0 {
                return Err(E::EmptyUnit { unit });
            }
            let named = self.units[unit].consumed_by as usize;
            if named != group {
                return Err(E::WrongConsumer { unit, group, named });
            }
        }
        Ok(())
    }

    fn check_finer_of(&self, group: usize) -> Result<(), E> {
        let links = self.finer_groups(&self.groups[group]);
        if let Some(&finer) = links.iter().find(|&&finer| finer as usize >= group) {
            let finer = finer as usize;
            return Err(E::FinerNotBefore { group, finer });
        }
        let mut stated = links.to_vec();
        stated.sort_unstable();
        let units = &self.units[self.groups[group].units()];
        let mut actual: Vec<u32> = units.iter().filter_map(crate::Unit::producer).collect();
        actual.sort_unstable();
        actual.dedup();
        if stated == actual {
            Ok(())
        } else {
            Err(E::FinerMismatch { group })
        }
    }

    fn check_level_of(&self, group: usize) -> Result<(), E> {
        let level = self.groups[group].level;
        let finer = self.finer_groups(&self.groups[group]).iter();
        // Finer groups come before and were checked, so that this cannot overflow.
        let above = finer.map(|&finer| self.groups[finer as usize].level + 1);
        let expected = above.max().unwrap_or(0);
        if level == expected {
            return Ok(());
        }
        Err(E::BadLevel {
            group,
            level,
            expected,
        })
    }
}
