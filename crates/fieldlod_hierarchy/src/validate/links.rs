//! Checks links between groups and units, and levels.

use super::InvalidHierarchy as E;
use crate::hierarchy::{Hierarchy, Unit};

impl Hierarchy {
    pub(super) fn check_links(&self) -> Result<(), E> {
        for (index, group) in self.groups.iter().enumerate() {
            if group.unit_count == 0 {
                return Err(E::EmptyGroup { group: index });
            }
            self.check_units_of(index)?;
            self.check_finer_of(index)?;
            self.check_level_of(index)?;
        }
        self.check_producers()
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
        // Order rules out cycles, and lets every pass over the groups see finer groups first.
        if let Some(&finer) = links.iter().find(|&&finer| finer as usize >= group) {
            let finer = finer as usize;
            return Err(E::FinerNotBefore { group, finer });
        }
        let mut stated = links.to_vec();
        stated.sort_unstable();
        let units = &self.units[self.groups[group].units()];
        let mut actual: Vec<u32> = units.iter().filter_map(Unit::producer).collect();
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
        // This cannot overflow, because finer groups were already checked.
        let above = finer.map(|&finer| self.groups[finer as usize].level + 1);
        let expected = above.max().unwrap_or(0);
        if level == expected {
            Ok(())
        } else {
            Err(E::BadLevel {
                group,
                level,
                expected,
            })
        }
    }

    /// Checks that exactly the groups that are not terminal produce units.
    fn check_producers(&self) -> Result<(), E> {
        let mut produces = vec![false; self.groups.len()];
        for (unit, producer) in self.units.iter().map(Unit::producer).enumerate() {
            let Some(group) = producer.map(|group| group as usize) else {
                continue;
            };
            produces[group] = true;
            if self.groups[group].is_terminal() {
                return Err(E::ProducedByTerminal { unit, group });
            }
        }
        let mut groups = self.groups.iter().zip(produces);
        match groups.position(|(group, produces)| !produces && !group.is_terminal()) {
            Some(group) => Err(E::ProducesNothing { group }),
            None => Ok(()),
        }
    }
}
