//! Checks errors, deviations and mean normals of groups.

use super::InvalidHierarchy as E;
use crate::hierarchy::{Group, Hierarchy};

impl Hierarchy {
    pub(super) fn check_errors(&self) -> Result<(), E> {
        let is_measured = self.is_measured();
        for group in 0..self.groups.len() {
            let error = self.groups[group].error_in_local;
            if error.is_nan() || error < self.largest_of_finer(group, |finer| finer.error_in_local)
            {
                return Err(E::BadError { group, error });
            }
            self.check_deviation_of(group, is_measured)?;
            let error = self.groups[group].whole_mesh_error_in_local;
            let floor = self.largest_of_finer(group, |finer| finer.whole_mesh_error_in_local);
            let is_terminal = self.groups[group].is_terminal();
            if !error.is_finite() || error < 0.0 || error < floor && !is_terminal {
                return Err(E::BadWholeMeshError { group, error });
            }
            let length = self.groups[group].mean_normal.length();
            // A mean of unit normals is at most 1 long, up to the rounding of the sum.
            if length.is_nan() || length > 1.0 + 1e-4 {
                return Err(E::BadMeanNormal { group });
            }
        }
        Ok(())
    }

    fn check_deviation_of(&self, group: usize, is_measured: bool) -> Result<(), E> {
        let deviation = self.groups[group].deviation_in_local;
        let floor = self.largest_of_finer(group, |finer| finer.deviation_in_local);
        let is_infinite = deviation == f32::INFINITY;
        let should_be = !is_measured || self.groups[group].is_terminal();
        if deviation.is_nan() || deviation < floor || is_infinite != should_be {
            return Err(E::BadDeviation { group, deviation });
        }
        Ok(())
    }

    /// Largest value of `length` over the finer groups of `group`. 0 without finer groups.
    fn largest_of_finer(&self, group: usize, length: impl Fn(&Group) -> f32) -> f32 {
        let finer = self.finer_groups(&self.groups[group]).iter();
        let lengths = finer.map(|&finer| length(&self.groups[finer as usize]));
        lengths.fold(0.0, f32::max)
    }
}
