//! All methods at all thresholds from one pose.

use std::time::Duration;

use super::curve::{Curve, Point, PoseResult, THRESHOLDS_PX};
use super::fast_selection::Scratch;
use super::pose::Pose;
use super::pose_view::PoseView;
use super::scene::ChartScene;
use crate::method::Method;
use crate::oracle::Oracle;
use crate::render::RenderError;

/// The number of times that a choice is made, of which the fastest counts.
const SELECTIONS: usize = 5;

/// Measures some methods from a pose.
///
/// # Errors
/// [`RenderError`] from an adapter that stops.
pub(super) fn sweep(
    scene: &ChartScene,
    pose: &Pose,
    methods: &[Method],
) -> Result<PoseResult, RenderError> {
    let mut view = PoseView::new(scene, pose)?;
    let curve = |&method: &Method| match method {
        Method::Oracle => oracle_curve(&mut view),
        _ => curve(&mut view, method),
    };
    let curves = methods.iter().map(curve).collect::<Result<_, _>>()?;
    Ok(PoseResult {
        pose: *pose,
        curves,
    })
}

fn curve(view: &mut PoseView, method: Method) -> Result<Curve, RenderError> {
    let selection = &view.scene.levels(method).fast_selection;
    let object_view = view.scene.view(method, &view.eye);
    let mut scratch = Scratch::default();
    let measured = THRESHOLDS_PX.map(|threshold| {
        let choose = |_| selection.choose(method, &object_view, threshold, &mut scratch);
        let fastest = (0..SELECTIONS).map(choose).min_by_key(|(_, time)| *time);
        let (units, elapsed) = fastest.unwrap_or_default();
        point(view, method, f64::from(threshold), &units, elapsed)
    });
    let points = measured.into_iter().collect::<Result<_, _>>()?;
    Ok(Curve { method, points })
}

fn oracle_curve(view: &mut PoseView) -> Result<Curve, RenderError> {
    let method = Method::Oracle;
    let scene = view.scene;
    let views = [scene.view(method, &view.eye)];
    let draw = |cuts: &Vec<Vec<u32>>| {
        let units = views[0].units_in_view(&cuts[0]);
        scene
            .renderer
            .draw_units(&scene.ours.model, &view.eye, &units)
    };
    let oracle = Oracle::new(&view.reference, &views, draw)?;
    let thresholds = oracle.thresholds(THRESHOLDS_PX.len()).into_iter();
    let measured = thresholds.map(|threshold| {
        let cuts = oracle.choose(&views, threshold);
        point(view, method, f64::from(threshold), &cuts[0], Duration::ZERO)
    });
    let points = measured.collect::<Result<_, _>>()?;
    Ok(Curve { method, points })
}

fn point(
    view: &mut PoseView,
    method: Method,
    threshold: f64,
    units: &[u32],
    select: Duration,
) -> Result<Point, RenderError> {
    // Only what touches the view is drawn and counted.
    let drawn = view.scene.view(method, &view.eye).units_in_view(units);
    let triangles = view.scene.levels(method).object.triangle_count(&drawn);
    let units = drawn.len() as u64;
    let (error, frame) = view.measure(method, drawn)?;
    Ok(Point {
        threshold,
        triangles,
        units,
        error,
        select_us: select.as_secs_f64() * 1e6,
        frame_ms: frame.as_secs_f64() * 1e3,
    })
}
