//! A method with its memory: which units it draws, from frame to frame.

use fieldlod_hierarchy::Sphere;
use fieldlod_select::{Cut, select};

use crate::baselines::group_wise;
use crate::method::Method;
use crate::object_view::ObjectView;

/// The cut that a method draws.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Choice {
    /// Whether the simplification of each group is refused.
    pub refined: Vec<bool>,
    /// Indices of the units drawn, ascending.
    pub units: Vec<u32>,
}

/// One method on one instance in one view, with what it remembers of the last frame.
#[derive(Clone, Debug)]
pub struct Chooser {
    method: Method,
    threshold_px: f32,
    cut: Cut,
}

impl Chooser {
    /// A method that asks for `threshold_px`, without memory yet.
    #[must_use]
    pub fn new(method: Method, threshold_px: f32) -> Self {
        Self {
            method,
            threshold_px,
            cut: Cut::default(),
        }
    }

    /// Chooses the cut that the method draws in the next frame.
    ///
    /// # Panics
    /// For the [oracle](Method::Oracle), which needs pictures.
    pub fn choose(&mut self, view: &ObjectView) -> Choice {
        if self.method == Method::ClusterlodUnclosed {
            return unclosed(view, self.threshold_px);
        }
        // Ours by the selection itself, the others by their errors.
        let Some(settings) = self.method.settings(self.threshold_px) else {
            return self.choose_by_error(view);
        };
        let world_from_local = &view.instance.world_from_local;
        let (hierarchy, eye) = (&view.object.hierarchy, view.eye.view());
        select(hierarchy, world_from_local, &eye, &settings, &mut self.cut);
        Choice {
            refined: self.cut.refined().to_vec(),
            units: self.cut.units().to_vec(),
        }
    }

    /// Chooses by the error of each group, or by one level for all of them, without memory.
    fn choose_by_error(&self, view: &ObjectView) -> Choice {
        let hierarchy = &view.object.hierarchy;
        let level = self.method.object_level(view, self.threshold_px);
        let mut refined = vec![false; hierarchy.groups.len()];
        hierarchy.refine_by(&mut refined, |group, _| match level {
            Some(level) => hierarchy.groups[group].level >= level,
            None => {
                let error_px = self
                    .method
                    .group_error_px(view, group)
                    .expect("the oracle chooses by pictures");
                error_px.is_nan() || error_px > self.threshold_px
            }
        });
        let units = hierarchy.drawn_units(&refined);
        Choice {
            units: units.map(|unit| unit as u32).collect(),
            refined,
        }
    }
}

/// Chooses each unit for itself, with its two groups' errors taken at its own bounds, so that clusters
/// of one group disagree.
fn unclosed(view: &ObjectView, threshold_px: f32) -> Choice {
    let hierarchy = &view.object.hierarchy;
    let exceeds = |group: u32, bounds: &Sphere| {
        group_wise::clusterlod(view, group as usize, bounds) > threshold_px
    };
    // A unit is drawn if its own group is too coarse and the finer one is not, each at the unit's box.
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
