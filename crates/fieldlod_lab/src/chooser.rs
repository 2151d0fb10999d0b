//! Applies a method frame by frame.

use fieldlod_select::{Cut, select};

use crate::baselines::{clusterlod_error_px, godot_level, visibility_range_level};
use crate::method::Method;
use crate::object_view::ObjectView;

/// The cut that a method draws.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Choice {
    /// Whether each group is refined.
    pub refined: Vec<bool>,
    /// Indices of the units drawn, ascending.
    pub units: Vec<u32>,
}

impl Choice {
    /// The source.
    pub(crate) fn full_detail(view: &ObjectView) -> Self {
        whole_level(view, 0)
    }
}

/// One method on one instance in one view, with its state from the last frame.
#[derive(Clone, Debug)]
pub struct Chooser {
    method: Method,
    threshold_px: f32,
    cut: Cut,
}

impl Chooser {
    /// A method at a threshold, without state from earlier frames.
    #[must_use]
    pub fn new(method: Method, threshold_px: f32) -> Self {
        Self {
            method,
            threshold_px,
            cut: Cut::default(),
        }
    }

    /// Chooses the cut of the next frame.
    pub fn choose(&mut self, view: &ObjectView) -> Choice {
        let threshold_px = self.threshold_px;
        match self.method {
            Method::Quality | Method::Guaranteed | Method::Curl | Method::AspectRatio => {
                self.select(view)
            }
            Method::Clusterlod | Method::ClusterlodOnOurLevels => refine_if(view, |group| {
                let error_px = clusterlod_error_px(view, group);
                // A NaN transform gives a NaN error. Full detail is the safe fallback.
                error_px.is_nan() || error_px > threshold_px
            }),
            Method::Godot => whole_level(view, godot_level(view, threshold_px)),
            Method::VisibilityRange => {
                whole_level(view, visibility_range_level(view, threshold_px))
            }
        }
    }

    /// Runs the selection of this project.
    fn select(&mut self, view: &ObjectView) -> Choice {
        let settings = self.method.settings(self.threshold_px).unwrap_or_default();
        let world_from_local = &view.instance.world_from_local;
        let (hierarchy, eye) = (&view.object.hierarchy, view.eye.view());
        select(hierarchy, world_from_local, &eye, &settings, &mut self.cut);
        Choice {
            refined: self.cut.refined().to_vec(),
            units: self.cut.units().to_vec(),
        }
    }
}

/// The cut that draws the whole object at one level.
fn whole_level(view: &ObjectView, level: u32) -> Choice {
    let groups = &view.object.hierarchy.groups;
    // A group of level n simplifies units of level n or finer. Refining all groups from `level` on leaves the units of
    // `level`, and finer units where no coarser ones exist.
    refine_if(view, |group| groups[group].level >= level)
}

fn refine_if(view: &ObjectView, criterion: impl Fn(usize) -> bool) -> Choice {
    let hierarchy = &view.object.hierarchy;
    let mut refined = vec![false; hierarchy.groups.len()];
    hierarchy.refine_by(&mut refined, |group, _| criterion(group));
    let units = hierarchy.drawn_units(&refined);
    Choice {
        units: units.map(|unit| unit as u32).collect(),
        refined,
    }
}
