//! A method with its memory: from frame to frame, which units are drawn.

use fieldlod_hierarchy::{Hierarchy, Sphere};
use fieldlod_select::{Cut, LodSettings, select, select_with};

use super::{Method, Seen, clusterlod};

/// What a method draws.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Choice {
    /// For each group, whether its simplification is refused.
    pub refined: Vec<bool>,
    /// Indices of the units drawn, ascending.
    pub units: Vec<u32>,
}

impl Choice {
    /// Triangles of all units drawn.
    #[must_use]
    pub fn triangle_count(&self, hierarchy: &Hierarchy) -> u64 {
        let units = self.units.iter();
        units
            .map(|&unit| u64::from(hierarchy.units[unit as usize].triangle_count))
            .sum()
    }
}

/// One method on one instance in one view, with what it remembers of the last frame.
#[derive(Clone, Debug)]
pub struct Chooser {
    method: Method,
    threshold_px: f32,
    cut: Cut,
    last_level: Option<u32>,
}

impl Chooser {
    /// A method that asks for `threshold_px`, without memory yet.
    #[must_use]
    pub fn new(method: Method, threshold_px: f32) -> Self {
        Self {
            method,
            threshold_px,
            cut: Cut::default(),
            last_level: None,
        }
    }

    /// What the method draws in the next frame.
    pub fn choose(&mut self, seen: &Seen) -> Choice {
        let hierarchy = &seen.object.hierarchy;
        match self.method {
            Method::Quality | Method::Guaranteed => {
                let settings = self.our_settings();
                let world_from_local = &seen.instance.world_from_local;
                let view = seen.eye.view();
                select(hierarchy, world_from_local, &view, &settings, &mut self.cut);
                of_cut(&self.cut)
            }
            Method::ClusterlodUnclosed => unclosed(seen, self.threshold_px),
            _ => self.choose_as_rival(seen),
        }
    }

    fn our_settings(&self) -> LodSettings {
        match self.method {
            Method::Guaranteed => LodSettings::guaranteed(self.threshold_px),
            _ => LodSettings::with_error_px(self.threshold_px),
        }
    }

    fn choose_as_rival(&mut self, seen: &Seen) -> Choice {
        let Self {
            method,
            threshold_px,
            ..
        } = *self;
        let hierarchy = &seen.object.hierarchy;
        let level = method.object_level(seen, threshold_px, self.last_level);
        self.last_level = level;
        let mut settings = LodSettings::with_error_px(threshold_px);
        settings.hysteresis = 1.0;
        select_with(hierarchy, &settings, &mut self.cut, |group| match level {
            Some(level) => error_of_level(hierarchy.groups[group].level >= level),
            None => method.group_error_px(seen, group).unwrap_or(f32::NAN),
        });
        of_cut(&self.cut)
    }
}

/// A whole level as errors of groups: all or nothing.
fn error_of_level(refined: bool) -> f32 {
    if refined { f32::INFINITY } else { 0.0 }
}

fn of_cut(cut: &Cut) -> Choice {
    Choice {
        refined: cut.refined().to_vec(),
        units: cut.units().to_vec(),
    }
}

/// Every unit for itself, its two groups' errors taken at its own bounds: clusters of one group
/// disagree.
fn unclosed(seen: &Seen, threshold_px: f32) -> Choice {
    let hierarchy = &seen.object.hierarchy;
    let exceeds = |group: u32, bounds: &Sphere| {
        clusterlod::error_px(seen, group as usize, bounds) > threshold_px
    };
    let drawn = |index: &u32| {
        let unit = &hierarchy.units[*index as usize];
        let bounds = Sphere {
            center: (unit.aabb.min + unit.aabb.max) * 0.5,
            radius: (unit.aabb.max - unit.aabb.min).length() * 0.5,
        };
        let too_coarse = unit.producer().is_some_and(|group| exceeds(group, &bounds));
        exceeds(unit.consumed_by, &bounds) && !too_coarse
    };
    let groups = hierarchy.groups.iter().zip(0..);
    Choice {
        units: (0..hierarchy.units.len() as u32).filter(drawn).collect(),
        refined: groups
            .map(|(group, index)| exceeds(index, &group.bounds))
            .collect(),
    }
}
