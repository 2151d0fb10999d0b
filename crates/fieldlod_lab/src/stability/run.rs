//! Runs all methods in all cases.

use std::sync::atomic::{AtomicUsize, Ordering};

use rayon::prelude::*;
use serde::Serialize;

use super::case::{Case, Fault, Shot};
use super::fixtures::Fixture;
use super::{METHODS, PROMISE_ALLOWANCE, SAMPLES, THRESHOLD_PX, THRIFT_RATIO, cases};
use crate::chooser::{Choice, Chooser};
use crate::displacement::{CutSurface, Displacement, SourceSurface};
use crate::holes::{FlipCounter, open_edges};
use crate::method::Method;
use crate::object::LodObject;
use crate::object_view::ObjectView;

/// The results of all methods in one case.
#[derive(Clone, Debug, Serialize)]
pub struct CaseResult {
    /// [`Case::name`].
    pub case: &'static str,
    /// [`Case::reported`].
    pub reported: &'static [&'static str],
    /// The verdicts on [`METHODS`], in the same order.
    pub verdicts: Vec<Verdict>,
}

/// Result of one method in one case.
#[derive(Clone, Debug, Default, Serialize)]
pub struct Verdict {
    /// The method.
    pub method: Method,
    /// Largest displacement in pixels over all measured frames.
    pub max_px: f64,
    /// Flips of groups in the picture, per frame; see [`FlipCounter`].
    pub flips_per_frame: f64,
    /// Largest number of open edges of a cut; `None` if the source itself is open.
    pub open_edges: Option<u64>,
    /// Mean triangles of all chosen units, in the picture or not.
    pub triangles_chosen: f64,
    /// Triangles of all chosen units, relative to the guaranteed cut.
    pub triangles_to_ours: f64,
    /// Triangles of all chosen units, relative to the coarsest cut.
    pub triangles_to_coarsest: f64,
    /// The faults of the method: holes, or faults that the case checks for.
    pub faults: Vec<Fault>,
}

/// Runs each case on its fixture.
///
/// `progress` is called with the numbers of finished cases and of all cases, from several threads.
#[must_use]
pub fn run(progress: &(dyn Fn(usize, usize) + Sync)) -> Vec<CaseResult> {
    // Each fixture is baked once.
    let fixtures = Fixture::ALL.par_iter();
    let objects: Vec<LodObject> = fixtures.map(|fixture| fixture.bake()).collect();
    let all: Vec<&Case> = cases().collect();
    let done = AtomicUsize::new(0);
    let results = all.par_iter().map(|case| {
        let object = &objects[case.fixture as usize];
        let result = run_case(case, object, case.fixture.is_closed());
        progress(done.fetch_add(1, Ordering::Relaxed) + 1, all.len());
        result
    });
    results.collect()
}

fn run_case(case: &Case, object: &LodObject, is_closed: bool) -> CaseResult {
    let source = SourceSurface::new(&object.hierarchy, SAMPLES);
    let shots = (case.shots)(object);
    assert!(!shots.is_empty(), "{}: no shots", case.name);
    let mut verdicts = METHODS.map(|method| {
        let mut trial = Trial {
            source: &source,
            object,
            is_two_sided: case.is_two_sided,
            frames: 0,
            last: None,
            sums: Verdict {
                method,
                open_edges: is_closed.then_some(0),
                ..Verdict::default()
            },
        };
        for shot in &shots {
            trial.add_shot(shot);
        }
        trial.verdict()
    });
    // The ratios need the verdict of the guaranteed method, which may come after others.
    let ours = METHODS.iter().position(|m| *m == Method::Guaranteed);
    let ours_chosen = ours.map_or(0.0, |ours| verdicts[ours].triangles_chosen);
    for verdict in &mut verdicts {
        verdict.triangles_to_ours = verdict.triangles_chosen / ours_chosen.max(1.0);
        verdict.faults = faults(verdict, case);
    }
    CaseResult {
        case: case.name,
        reported: case.reported,
        verdicts: verdicts.into(),
    }
}

/// Runs one method in one case, and sums the results of its frames.
struct Trial<'a> {
    source: &'a SourceSurface<'a>,
    object: &'a LodObject,
    is_two_sided: bool,
    frames: usize,
    /// The units and the surface of the last measured cut. The next frame reuses them if it has the same cut.
    last: Option<(Vec<u32>, CutSurface)>,
    /// Sums and maxima over frames. [`Trial::verdict`] divides the sums.
    sums: Verdict,
}

impl Trial<'_> {
    fn add_shot(&mut self, shot: &Shot) {
        let mut chooser = Chooser::new(self.sums.method, THRESHOLD_PX);
        let mut flips = FlipCounter::default();
        let groups = &self.object.hierarchy.groups;
        for (index, frame) in shot.frames.iter().enumerate() {
            let view = ObjectView::new(self.object, &frame.instance, &frame.eye);
            let choice = chooser.choose(&view);
            flips.add(&choice, |group| view.touches_sphere(&groups[group].bounds));
            self.sums.triangles_chosen += self.object.triangle_count(&choice.units) as f64;
            if index % shot.measure_every == 0 {
                self.measure(&view, &choice);
            }
        }
        self.frames += shot.frames.len();
        self.sums.flips_per_frame += flips.seen() as f64;
    }

    fn measure(&mut self, view: &ObjectView, choice: &Choice) {
        // Building the surface of a cut takes most of the time, and most frames keep the cut.
        let last = self.last.take().filter(|(units, _)| *units == choice.units);
        let (units, cut) = last.unwrap_or_else(|| {
            if let Some(most) = &mut self.sums.open_edges {
                *most = (*most).max(open_edges(&self.object.hierarchy, &choice.units));
            }
            (choice.units.clone(), self.source.cut(&choice.units))
        });
        let (instance, eye) = (&view.instance, &view.eye);
        let source = self.source;
        let displaced_px = source.displacements(&cut, instance, eye, self.is_two_sided);
        let found = Displacement::of(&displaced_px);
        self.sums.max_px = self.sums.max_px.max(found.max_px);
        self.last = Some((units, cut));
    }

    /// The means over all frames, without ratios to other methods.
    fn verdict(self) -> Verdict {
        let (frames, sums) = (self.frames.max(1) as f64, self.sums);
        let coarsest = self.object.coarsest_triangle_count() as f64 * frames;
        Verdict {
            flips_per_frame: sums.flips_per_frame / frames,
            triangles_chosen: sums.triangles_chosen / frames,
            triangles_to_coarsest: sums.triangles_chosen / coarsest.max(1.0),
            ..sums
        }
    }
}

/// The faults of a method: holes, or faults that the case checks for.
fn faults(verdict: &Verdict, case: &Case) -> Vec<Fault> {
    let promised_px = f64::from(THRESHOLD_PX) * PROMISE_ALLOWANCE;
    let fails = |fault: Fault| match fault {
        Fault::Holes => verdict.open_edges.is_some_and(|edges| edges > 0),
        Fault::Displaced => verdict.max_px > promised_px,
        Fault::Flips => verdict.flips_per_frame > 0.0,
        Fault::Wastes => verdict.triangles_to_ours > THRIFT_RATIO,
        Fault::Idles => verdict.triangles_to_coarsest > THRIFT_RATIO,
    };
    let checks = std::iter::once(&Fault::Holes).chain(case.checks);
    checks.copied().filter(|&fault| fails(fault)).collect()
}
