//! The selection of scenes, from scratch and incremental, against one instance at a time.

mod common;

use camera_field::Camera;
use common::{
    HIERARCHIES, any_camera, any_placement, any_settings, hierarchies, look, orthographic,
    perspective, synthetic, vector, zoomed,
};
use fieldlod_hierarchy::Hierarchy;
use fieldlod_select::{
    AdvancedSettings, InstanceId, InstanceView, LodSettings, MeshId, OcclusionBuffer, Scene,
    Selector, View, VisibleFlux, naive, visible_error_px,
};
use glam::{Affine3A, Vec3};
use proptest::prelude::*;

/// The specification: every instance by itself, with the bits of the last cut.
#[derive(Default)]
struct Naive {
    refined: Vec<Vec<bool>>,
    shares: Vec<Vec<HeldShare>>,
}

/// What counts as visible of a group.
#[derive(Clone, Copy, Default)]
struct HeldShare {
    share: f32,
    peak: f32,
    waited: u8,
}

impl HeldShare {
    /// More counts at once, and less after some frames, if the group was refined.
    fn update(&mut self, seen: f32, was_refined: bool, hold_frames: u8) {
        if seen >= self.share || !was_refined {
            (self.share, self.waited) = (seen, 0);
            return;
        }
        self.peak = match self.waited {
            0 => seen,
            _ => seen.max(self.peak),
        };
        if self.waited >= hold_frames {
            (self.share, self.waited) = (self.peak, 0);
        } else {
            self.waited += 1;
        }
    }
}

impl Naive {
    fn select(
        &mut self,
        scene: &Scene,
        ids: &[InstanceId],
        placed: &[Placed],
        view: &View,
        settings: &LodSettings,
    ) -> Vec<Vec<u32>> {
        self.refined.resize(placed.len(), Vec::new());
        self.shares.resize(placed.len(), Vec::new());
        let view = view.with_margins(settings);
        let flux = settings.visible_flux;
        let buffer = flux.map(|flux| OcclusionBuffer::new(scene, &view, flux.occluder_triangles));
        let one = |(index, refined): (usize, &mut Vec<bool>)| {
            let (placed, held) = (&placed[index], &mut self.shares[index]);
            let hierarchy = &hierarchies()[placed.mesh];
            refined.resize(hierarchy.groups.len(), false);
            let before = refined.clone();
            let instance = InstanceView::new(&view, &placed.placement);
            // What is visible of each group.
            let (mut seen, last) = (Vec::new(), hierarchy.groups.len() - 1);
            let is_whole = hierarchy.groups.len() == hierarchy.units.len();
            held.resize(hierarchy.groups.len(), HeldShare::default());
            if let (Some(flux), Some(buffer)) = (&flux, &buffer) {
                seen = buffer.visible_shares(scene, ids[index]);
                for (group, held) in held.iter_mut().enumerate() {
                    // Of a mesh as a whole one share is held for all levels that are refined.
                    let was_refined = match is_whole {
                        true => before[..last].contains(&true),
                        false => before[group],
                    };
                    held.update(seen[group], was_refined, flux.hold_frames);
                }
            }
            let counted = |group: usize| match is_whole && !before[group] {
                true => seen[group],
                false => held[group].share,
            };
            let share = |group: usize| match &flux {
                Some(flux) => counted(group).max(flux.least_share).min(1.0),
                None => 1.0,
            };
            let errors: Vec<f32> = hierarchy
                .groups
                .iter()
                .enumerate()
                .map(|(index, group)| {
                    let was_refined = before[index];
                    visible_error_px(group, &instance, settings, was_refined, share(index))
                })
                .collect();
            // A bias is a threshold of one's own.
            let settings = LodSettings {
                resolution_scale: settings.resolution_scale * placed.bias,
                ..*settings
            };
            let error_px = |group: usize| errors[group];
            let was_refined = |group: usize| before[group];
            for (group, bit) in refined.iter_mut().enumerate() {
                *bit = naive::is_refined(hierarchy, group, &settings, &was_refined, &error_px);
            }
            naive::select(hierarchy, &settings, &was_refined, &error_px)
        };
        self.refined.iter_mut().enumerate().map(one).collect()
    }
}

#[derive(Clone, Debug)]
struct Placed {
    mesh: usize,
    placement: Affine3A,
    bias: f32,
}

fn any_instances() -> impl Strategy<Value = Vec<Placed>> {
    let bias = prop_oneof![3 => Just(1.0f32), 1 => 0.2f32..4.0];
    let one = (0usize..HIERARCHIES, any_placement(), vector(), bias).prop_map(
        |(mesh, placement, shift, bias)| {
            let placement =
                Affine3A::from_translation(shift * shift.length_squared() * 100.0) * placement;
            Placed {
                mesh,
                placement,
                bias,
            }
        },
    );
    prop::collection::vec(one, 1..60)
}

fn any_flux() -> impl Strategy<Value = Option<VisibleFlux>> {
    let flux =
        (0u32..4000, 0u8..4, 0.0f32..0.5).prop_map(|(triangles, hold_frames, least)| VisibleFlux {
            occluder_triangles: triangles,
            hold_frames,
            least_share: (least - 0.2).max(0.0),
        });
    prop_oneof![1 => Just(None), 2 => flux.prop_map(Some)]
}

fn scene_of(placed: &[Placed]) -> (Scene, Vec<InstanceId>) {
    let mut scene = Scene::default();
    let meshes: Vec<MeshId> = hierarchies()
        .iter()
        .map(|h: &Hierarchy| scene.add_mesh(h))
        .collect();
    let ids = placed
        .iter()
        .map(|p| scene.add_instance(meshes[p.mesh], p.placement, p.bias))
        .collect();
    scene.update();
    (scene, ids)
}

fn cuts(selector: &Selector, scene: &Scene, ids: &[InstanceId]) -> Vec<Vec<u32>> {
    ids.iter()
        .map(|&id| selector.units(scene, id).to_vec())
        .collect()
}

/// Applies what a selection says has changed.
fn apply(selector: &Selector, cuts: &mut [Vec<u32>]) {
    for change in selector.changes() {
        let cut = &mut cuts[change.instance.index()];
        cut.retain(|unit| !change.left.contains(unit));
        cut.extend(change.entered);
        cut.sort_unstable();
    }
}

/// A walk from a place: each step goes, turns and may do something else.
struct Walk {
    eye: Vec3,
    target: Vec3,
    steps: Vec<(Vec3, Vec3, u8)>,
}

/// Walks through a scene, and compares each cut with the naive one.
fn check_walk(
    mut placed: Vec<Placed>,
    mut camera: Camera,
    settings: &LodSettings,
    walk: Walk,
) -> Result<(), TestCaseError> {
    let (mut scene, ids) = scene_of(&placed);
    let mut naive = Naive::default();
    let mut selector = Selector::default();
    let mut followed = vec![Vec::new(); ids.len()];
    let Walk {
        mut eye,
        mut target,
        steps,
    } = walk;
    for (go, turn, event) in steps {
        // Mostly small steps; now and then a jump, a standstill or a moved object.
        match event {
            0 => eye += go * 50.0,
            1 => {}
            2 => {
                let moved = (go.x.to_bits() as usize) % placed.len();
                placed[moved].placement.translation += glam::Vec3A::from(go);
                scene.set_placement(ids[moved], placed[moved].placement);
                scene.update();
            }
            3 => target += turn * 30.0,
            4 => camera = zoomed(camera, 1.0 + turn.x * 0.02),
            _ => {
                eye += go * 0.1;
                target += turn * 0.1;
            }
        }
        let view = look(camera, eye, target + Vec3::new(0.1, 0.0, 0.2));
        let expected = naive.select(&scene, &ids, &placed, &view, settings);
        selector.select(&scene, &view, settings);
        prop_assert_eq!(&cuts(&selector, &scene, &ids), &expected);
        apply(&selector, &mut followed);
        prop_assert_eq!(&followed, &expected);
        let triangles = expected.iter().zip(&placed).flat_map(|(units, placed)| {
            let of_mesh = &hierarchies()[placed.mesh].units;
            units
                .iter()
                .map(|&unit| u64::from(of_mesh[unit as usize].triangle_count))
        });
        prop_assert_eq!(selector.triangle_count(), triangles.sum::<u64>());
    }
    Ok(())
}

fn any_steps() -> impl Strategy<Value = Vec<(Vec3, Vec3, u8)>> {
    prop::collection::vec((vector(), vector(), 0u8..10), 8..20)
}

/// Walls, and many small things behind them.
fn any_crowd() -> impl Strategy<Value = Vec<Placed>> {
    let scaled = |mesh: usize, at: Vec3, scale: Vec3| Placed {
        mesh,
        placement: Affine3A::from_translation(at) * Affine3A::from_scale(scale),
        bias: 1.0,
    };
    let wall = (vector(), 1.0f32..4.0).prop_map(move |(at, size)| {
        let place = at * Vec3::new(6.0, 1.0, 2.0) - Vec3::Z * 6.0;
        scaled(0, place, Vec3::new(size, size, 0.2))
    });
    let small = (0usize..HIERARCHIES, vector(), 0.1f32..0.8).prop_map(move |(mesh, at, size)| {
        let place = at * Vec3::new(15.0, 2.0, 20.0) - Vec3::Z * 32.0;
        scaled(mesh, place, Vec3::splat(size))
    });
    let (walls, crowd) = (
        prop::collection::vec(wall, 1..4),
        prop::collection::vec(small, 20..120),
    );
    (walls, crowd).prop_map(|(walls, crowd)| walls.into_iter().chain(crowd).collect())
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 150, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn incremental_equals_naive_along_a_walk(
        placed in any_instances(),
        camera in any_camera(),
        settings in any_settings(),
        flux in any_flux(),
        start in vector(),
        steps in any_steps(),
    ) {
        let settings = LodSettings { visible_flux: flux, ..settings };
        check_walk(placed, camera, &settings, Walk { eye: start * 30.0, target: Vec3::ZERO, steps })?;
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 40, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn incremental_equals_naive_along_a_walk_past_walls(
        placed in any_crowd(),
        settings in any_settings(),
        flux in any_flux(),
        start in vector(),
        steps in any_steps(),
    ) {
        let settings = LodSettings { visible_flux: flux, ..settings };
        check_walk(placed, perspective(1.0), &settings, Walk { eye: start, target: Vec3::Z * -30.0, steps })?;
    }
}

/// A forest of balls, `side` on each side.
fn forest(side: u16) -> (Scene, Vec<InstanceId>) {
    let mut scene = Scene::default();
    let ball = scene.add_mesh(&synthetic::ball(4, 0.002));
    let place = |index: u16| {
        let (x, z) = (f32::from(index % side), f32::from(index / side));
        Affine3A::from_translation(Vec3::new(x * 3.0, 0.0, z * -3.0))
    };
    let ids = (0..side * side).map(|index| scene.add_instance(ball, place(index), 1.0));
    let ids = ids.collect();
    scene.update();
    (scene, ids)
}

fn step_of_walk(step: u16) -> View {
    let eye = Vec3::new(5.0 + f32::from(step) * 0.02, 1.5, 4.0);
    look(perspective(1.0), eye, eye + Vec3::new(0.2, -0.1, -1.0))
}

#[test]
fn still_camera_decides_nothing_and_walking_one_little() {
    let (scene, _) = forest(40);
    let mut selector = Selector::default();
    let settings = LodSettings::default();
    selector.select(&scene, &step_of_walk(0), &settings);
    assert!(selector.changes().count() == 1600);
    selector.select(&scene, &step_of_walk(0), &settings);
    assert_eq!(
        selector.statistics(),
        fieldlod_select::Statistics::default()
    );
    assert_eq!(selector.changes().count(), 0);
    let decided: usize = (1..50)
        .map(|step| {
            selector.select(&scene, &step_of_walk(step), &settings);
            selector.statistics().instances_decided
        })
        .sum();
    assert!(decided < 49 * 1600 / 4, "{decided}");
}

#[test]
fn instances_on_other_layers_are_skipped_until_shown() {
    let (mut scene, ids) = forest(40);
    let (shown, _) = forest(40);
    ids.iter().for_each(|&id| scene.set_layers(id, 0));
    scene.update();
    let settings = LodSettings::default();
    let (mut selector, mut other) = (Selector::default(), Selector::default());
    for step in 0..50 {
        selector.select(&scene, &step_of_walk(step), &settings);
        let statistics = selector.statistics();
        assert_eq!(statistics.instances_decided, 0);
        assert_eq!(selector.changes().count(), 0);
    }
    // In the very frame in which it is shown it is drawn as if it had always been.
    ids.iter().for_each(|&id| scene.set_layers(id, u64::MAX));
    scene.update();
    selector.select(&scene, &step_of_walk(50), &settings);
    other.select(&shown, &step_of_walk(50), &settings);
    let drawn = |selector: &Selector, scene| cuts(selector, scene, &ids);
    assert_eq!(drawn(&selector, &scene), drawn(&other, &shown));
    assert_eq!(selector.changes().count(), 1600);
}

#[test]
fn a_removed_instance_draws_nothing() {
    let (mut scene, ids) = scene_of(&[Placed {
        mesh: 0,
        placement: Affine3A::IDENTITY,
        bias: 1.0,
    }]);
    let mut selector = Selector::default();
    let view = look(orthographic(), Vec3::Z * 5.0, Vec3::ZERO);
    selector.select(&scene, &view, &LodSettings::default());
    assert!(!selector.units(&scene, ids[0]).is_empty());
    scene.remove(ids[0]);
    scene.update();
    selector.select(&scene, &view, &LodSettings::default());
    assert!(selector.units(&scene, ids[0]).is_empty());
    assert_eq!(selector.triangle_count(), 0);
    assert!(selector.changes().all(|change| change.entered.is_empty()));
}

#[test]
fn a_view_of_nan_refines_all_and_the_next_view_recovers() {
    let (scene, ids) = scene_of(&[Placed {
        mesh: 0,
        placement: Affine3A::IDENTITY,
        bias: 1.0,
    }]);
    let mut selector = Selector::default();
    let settings = LodSettings {
        advanced: AdvancedSettings {
            hysteresis: 1.0,
            ..AdvancedSettings::default()
        },
        ..LodSettings::default()
    };
    let view = look(perspective(1.0), Vec3::Z * 5.0, Vec3::ZERO);
    selector.select(&scene, &view, &settings);
    let before = selector.units(&scene, ids[0]).to_vec();
    let nowhere = View::new(
        perspective(1.0),
        &Affine3A::from_translation(Vec3::splat(f32::NAN)),
    );
    selector.select(&scene, &nowhere, &settings);
    assert_eq!(
        selector.triangle_count(),
        hierarchies()[0].source_triangle_count()
    );
    selector.select(&scene, &view, &settings);
    assert_eq!(selector.units(&scene, ids[0]), before);
}

#[test]
fn a_budget_is_kept_in_every_frame_and_does_not_breathe() {
    let (scene, _) = forest(20);
    let free = triangles_without_budget(&scene, &step_of_walk(0));
    for share in [0.5, 0.7, 0.9] {
        let budget = (free as f64 * share) as u64;
        let settings = LodSettings::with_triangle_budget(budget);
        let mut selector = Selector::default();
        let mut thresholds = 0;
        let mut last = None;
        for step in 0..120 {
            let view = step_of_walk(step);
            selector.select(&scene, &view, &settings);
            assert_kept(&scene, &view, &selector, budget);
            thresholds += usize::from(last != selector.threshold_px());
            last = selector.threshold_px();
        }
        assert!(
            thresholds < 40,
            "{budget}: {thresholds} thresholds in 120 frames"
        );
    }
}

fn triangles_without_budget(scene: &Scene, view: &View) -> u64 {
    let mut selector = Selector::default();
    selector.select(scene, view, &LodSettings::default());
    selector.triangle_count()
}

/// A budget is used up unless less is asked for, and never exceeded.
fn assert_kept(scene: &Scene, view: &View, selector: &Selector, budget: u64) {
    let count = selector.triangle_count();
    assert!(count <= budget, "{count} of {budget}");
    let threshold_px = selector.threshold_px().unwrap();
    assert!(threshold_px >= 1.0, "{threshold_px}");
    let wanted = budget.min(triangles_without_budget(scene, view));
    assert!(count as f64 > 0.9 * wanted as f64, "{count} of {wanted}");
}

/// Jumps, a lens that zooms and a new budget.
#[test]
fn a_budget_is_kept_after_any_change() {
    let (scene, _) = forest(20);
    let mut selector = Selector::default();
    let mut stops = Vec::new();
    for (eye, fov_y) in [
        (Vec3::new(5.0, 1.5, 4.0), 1.0),
        (Vec3::new(30.0, 9.0, -20.0), 1.0),
        (Vec3::new(5.0, 1.5, 4.0), 0.4),
        (Vec3::new(55.0, 3.0, -3.0), 1.3),
    ] {
        let shares = [100_000, 200_000, 400_000, 900_000];
        stops.extend(shares.map(|budget| (eye, fov_y, budget)));
    }
    for (eye, fov_y, budget) in stops {
        let settings = LodSettings::with_triangle_budget(budget);
        for frame in 0..20u8 {
            let sway = Vec3::X * (f32::from(frame % 4) * 0.01);
            let view = look(perspective(fov_y), eye + sway, Vec3::new(28.0, 0.0, -30.0));
            selector.select(&scene, &view, &settings);
            if frame > 2 {
                assert_kept(&scene, &view, &selector, budget);
            }
        }
    }
}

#[test]
fn a_budget_that_is_out_of_reach_costs_little() {
    let (scene, _) = forest(20);
    let mut selector = Selector::default();
    // Less than everything at its coarsest.
    let settings = LodSettings::with_triangle_budget(10);
    let mut searches = 0;
    for step in 0..60 {
        selector.select(&scene, &step_of_walk(step), &settings);
        searches += usize::from(selector.statistics().budget_tries > 0);
    }
    assert!(searches <= 4, "{searches}");
    assert_eq!(selector.threshold_px(), Some(f32::INFINITY));
    // Within reach, it is used again.
    let settings = LodSettings::with_triangle_budget(200_000);
    let view = step_of_walk(60);
    for _ in 0..3 {
        selector.select(&scene, &view, &settings);
    }
    assert_kept(&scene, &view, &selector, 200_000);
    // One object, whose groups are large steps.
    let mut scene = Scene::default();
    let mesh = scene.add_mesh(&hierarchies()[0]);
    scene.add_instance(mesh, Affine3A::IDENTITY, 1.0);
    scene.update();
    let view = look(perspective(1.0), Vec3::Z * 3.0, Vec3::ZERO);
    let free = triangles_without_budget(&scene, &view);
    for budget in (1..20).map(|step| free * step / 20) {
        let settings = LodSettings::with_triangle_budget(budget);
        let mut selector = Selector::default();
        let mut searches = Vec::new();
        for _ in 0..10 {
            selector.select(&scene, &view, &settings);
            searches.push(selector.statistics().budget_tries);
        }
        assert_eq!(searches[4..], [0; 6], "{budget}");
    }
}
