//! Runs methods through cases and judges them.

use std::sync::atomic::{AtomicUsize, Ordering};

use fieldlod_hierarchy::Hierarchy;
use rayon::prelude::*;
use serde::Serialize;

use super::{Case, Fixture, PROMISE_ALLOWANCE, SAMPLES, Shot, THRESHOLD_PX, THRIFT_RATIO, cases};
use crate::displacement::{CutSurface, Displacement, SourceSurface};
use crate::holes::{FlipCounter, open_edges};
use crate::rivals::{Choice, Chooser, LodObject, Method, Seen};

/// Everything that was found.
#[derive(Clone, Debug, Serialize)]
pub struct Report {
    /// What all methods were asked for, in pixels.
    pub threshold_px: f32,
    /// See [`PROMISE_ALLOWANCE`].
    pub promise_allowance: f64,
    /// See [`THRIFT_RATIO`].
    pub thrift_ratio: f64,
    /// One for the generated fixtures, one for each model.
    pub objects: Vec<ObjectRun>,
}

/// All cases on one object, or each on its fixture.
#[derive(Clone, Debug, Serialize)]
pub struct ObjectRun {
    /// What it is called.
    pub name: String,
    /// The cases, in order.
    pub cases: Vec<CaseResult>,
}

/// All methods in one case.
#[derive(Clone, Debug, Serialize)]
pub struct CaseResult {
    /// [`Case::name`].
    pub case: &'static str,
    /// [`Case::story`].
    pub story: &'static str,
    /// [`Case::reported`].
    pub reported: &'static [&'static str],
    /// One for each of [`Method::ALL`].
    pub verdicts: Vec<Verdict>,
}

/// What came of one method in one case.
#[derive(Clone, Debug, Serialize)]
pub struct Verdict {
    /// The method.
    pub method: Method,
    /// Greatest displacement in pixels over all frames measured.
    pub max_px: f64,
    /// Greatest of the frames' 99.9th percentiles, in pixels.
    pub p99_9_px: f64,
    /// Mean of the frames' means, in pixels.
    pub mean_px: f64,
    /// Groups that changed back within five frames while in the picture, per frame.
    pub flips_per_frame: f64,
    /// The same with those that entered or left the picture.
    pub churn_per_frame: f64,
    /// Most open edges of a cut; `None` if the source itself is open.
    pub open_edges: Option<u64>,
    /// Mean triangles of the units in the picture.
    pub triangles_drawn: f64,
    /// Mean triangles of all units chosen, in the picture or not.
    pub triangles_chosen: f64,
    /// The same, relative to our guaranteed cut.
    pub triangles_to_ours: f64,
    /// The same, relative to the coarsest cut.
    pub triangles_to_coarsest: f64,
    /// What it fails of what the case asks for.
    pub faults: Vec<Fault>,
}

/// How a method fails a case.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Fault {
    /// The cut is not closed.
    Holes,
    /// Displacements beyond the promise.
    Displaced,
    /// Groups flip.
    Flips,
    /// Triangles without need.
    Wastes,
    /// Detail that cannot be seen.
    Idles,
}

/// Runs all cases: each on its fixture, or all on the given objects.
///
/// `progress` hears how many cases are done of how many, from several threads.
#[must_use]
pub fn run(models: &[(String, LodObject)], progress: &(dyn Fn(usize, usize) + Sync)) -> Report {
    let rounds = models.len().max(1);
    let total = cases().count() * rounds;
    let done = AtomicUsize::new(0);
    let tick = || progress(done.fetch_add(1, Ordering::Relaxed) + 1, total);
    let objects = if models.is_empty() {
        vec![run_fixtures(&tick)]
    } else {
        let models = models.iter();
        models
            .map(|(name, object)| run_object(name, object, &tick))
            .collect()
    };
    Report {
        threshold_px: THRESHOLD_PX,
        promise_allowance: PROMISE_ALLOWANCE,
        thrift_ratio: THRIFT_RATIO,
        objects,
    }
}

fn run_fixtures(tick: &(dyn Fn() + Sync)) -> ObjectRun {
    let objects = Fixture::ALL.par_iter().map(|fixture| fixture.bake());
    let objects: Vec<LodObject> = objects.collect();
    let object_of = |fixture: Fixture| &objects[fixture as usize];
    let all: Vec<&Case> = cases().collect();
    let results = all.par_iter().map(|case| {
        let result = run_case(case, object_of(case.fixture), case.fixture.is_closed());
        tick();
        result
    });
    ObjectRun {
        name: "fixtures".to_owned(),
        cases: results.collect(),
    }
}

fn run_object(name: &str, object: &LodObject, tick: &(dyn Fn() + Sync)) -> ObjectRun {
    let units = object.hierarchy.units.iter().enumerate();
    let source = units.filter(|(_, unit)| unit.producer().is_none());
    let source: Vec<u32> = source.map(|(index, _)| index as u32).collect();
    let is_closed = open_edges(&object.hierarchy, &source) == 0;
    let all: Vec<&Case> = cases().collect();
    let results = all.par_iter().map(|case| {
        let result = run_case(case, object, is_closed);
        tick();
        result
    });
    ObjectRun {
        name: name.to_owned(),
        cases: results.collect(),
    }
}

fn run_case(case: &Case, object: &LodObject, is_closed: bool) -> CaseResult {
    let source = SourceSurface::new(&object.hierarchy, SAMPLES);
    let shots = (case.shots)(object);
    let tallies = Method::ALL.map(|method| {
        let mut tally = Tally::new(&source, object, is_closed, case.demands.two_sided);
        for shot in &shots {
            tally.add_shot(method, shot);
        }
        tally.totals
    });
    let ours = Method::ALL.iter().position(|m| *m == Method::Guaranteed);
    let ours_chosen = ours.map_or(0.0, |ours| tallies[ours].chosen);
    let verdicts = Method::ALL.iter().zip(&tallies);
    CaseResult {
        case: case.name,
        story: case.story,
        reported: case.reported,
        verdicts: verdicts
            .map(|(method, totals)| totals.verdict(*method, case, ours_chosen, is_closed))
            .collect(),
    }
}

/// Adds up frames of one method in one case.
struct Tally<'a> {
    source: &'a SourceSurface<'a>,
    object: &'a LodObject,
    is_closed: bool,
    two_sided: bool,
    coarsest_triangles: u64,
    totals: Totals,
    /// The surface measured last, for frames with the same cut.
    last: Option<(Vec<u32>, CutSurface)>,
}

#[derive(Debug, Default)]
struct Totals {
    worst: Displacement,
    means: f64,
    measured: usize,
    flips: u64,
    churn: u64,
    frames: usize,
    open_edges: u64,
    drawn: f64,
    chosen: f64,
    coarsest: f64,
}

impl<'a> Tally<'a> {
    fn new(
        source: &'a SourceSurface<'a>,
        object: &'a LodObject,
        is_closed: bool,
        two_sided: bool,
    ) -> Self {
        Self {
            source,
            object,
            is_closed,
            two_sided,
            coarsest_triangles: coarsest_triangles(&object.hierarchy),
            totals: Totals::default(),
            last: None,
        }
    }

    fn add_shot(&mut self, method: Method, shot: &Shot) {
        let mut chooser = Chooser::new(method, THRESHOLD_PX);
        let mut flips = FlipCounter::default();
        for (index, frame) in shot.frames.iter().enumerate() {
            let seen = Seen::new(self.object, &frame.instance, &frame.eye);
            let choice = chooser.choose(&seen);
            let groups = &self.object.hierarchy.groups;
            flips.add(&choice, |group| seen.touches_sphere(&groups[group].bounds));
            self.totals.frames += 1;
            self.totals.drawn += triangles_in_view(&seen, &choice) as f64;
            self.totals.coarsest += self.coarsest_triangles as f64;
            self.totals.chosen += choice.triangle_count(&self.object.hierarchy) as f64;
            if index % shot.measure_every == 0 {
                self.measure(&seen, &choice);
            }
        }
        self.totals.flips += flips.seen();
        self.totals.churn += flips.all();
    }

    fn measure(&mut self, seen: &Seen, choice: &Choice) {
        if self
            .last
            .as_ref()
            .is_none_or(|(units, _)| *units != choice.units)
        {
            if self.is_closed {
                let edges = open_edges(&self.object.hierarchy, &choice.units);
                self.totals.open_edges = self.totals.open_edges.max(edges);
            }
            let surface = self.source.cut(&choice.units);
            self.last = Some((choice.units.clone(), surface));
        }
        let Some((_, cut)) = &self.last else { return };
        let found = self
            .source
            .displacement(cut, &seen.instance, &seen.eye, self.two_sided);
        let worst = &mut self.totals.worst;
        worst.max_px = worst.max_px.max(found.max_px);
        worst.p99_9_px = worst.p99_9_px.max(found.p99_9_px);
        self.totals.means += found.mean_px;
        self.totals.measured += 1;
    }
}

fn coarsest_triangles(hierarchy: &Hierarchy) -> u64 {
    let coarsest = Choice {
        refined: Vec::new(),
        units: coarsest_units(hierarchy),
    };
    coarsest.triangle_count(hierarchy)
}

/// Units that nothing simplifies further.
fn coarsest_units(hierarchy: &Hierarchy) -> Vec<u32> {
    let terminal = hierarchy.groups.iter().filter(|group| group.is_terminal());
    let units = terminal.flat_map(fieldlod_hierarchy::Group::units);
    units.map(|unit| unit as u32).collect()
}

/// Triangles of the units whose box's sphere touches the picture: what any renderer's culling
/// leaves.
fn triangles_in_view(seen: &Seen, choice: &Choice) -> u64 {
    let units = choice.units.iter();
    units
        .map(|&unit| &seen.object.hierarchy.units[unit as usize])
        .filter(|unit| seen.touches_box(&unit.aabb))
        .map(|unit| u64::from(unit.triangle_count))
        .sum()
}

impl Totals {
    fn verdict(&self, method: Method, case: &Case, ours_chosen: f64, is_closed: bool) -> Verdict {
        let mut verdict = Verdict {
            method,
            max_px: self.worst.max_px,
            p99_9_px: self.worst.p99_9_px,
            mean_px: self.means / self.measured.max(1) as f64,
            flips_per_frame: self.flips as f64 / self.frames.max(1) as f64,
            churn_per_frame: self.churn as f64 / self.frames.max(1) as f64,
            open_edges: is_closed.then_some(self.open_edges),
            triangles_drawn: self.drawn / self.frames.max(1) as f64,
            triangles_chosen: self.chosen / self.frames.max(1) as f64,
            triangles_to_ours: self.chosen / ours_chosen.max(1.0),
            triangles_to_coarsest: self.chosen / self.coarsest.max(1.0),
            faults: Vec::new(),
        };
        verdict.faults = faults(&verdict, case);
        verdict
    }
}

fn faults(verdict: &Verdict, case: &Case) -> Vec<Fault> {
    let demands = &case.demands;
    let promised_px = f64::from(THRESHOLD_PX) * PROMISE_ALLOWANCE;
    let checks = [
        (
            Fault::Holes,
            verdict.open_edges.is_some_and(|edges| edges > 0),
        ),
        (
            Fault::Displaced,
            demands.promise && verdict.max_px > promised_px,
        ),
        (Fault::Flips, demands.calm && verdict.flips_per_frame > 0.0),
        (
            Fault::Wastes,
            demands.thrift && verdict.triangles_to_ours > THRIFT_RATIO,
        ),
        (
            Fault::Idles,
            demands.idle && verdict.triangles_to_coarsest > THRIFT_RATIO,
        ),
    ];
    let failed = checks.into_iter().filter(|(_, fails)| *fails);
    failed.map(|(fault, _)| fault).collect()
}
