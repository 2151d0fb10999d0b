//! Scenes whose instances come, move and go, in several views at once.

mod common;

use std::collections::{BTreeMap, HashMap};

use camera_field::Camera;
use common::{
    HIERARCHIES, any_camera, any_placement, any_settings, hierarchies, look, orthographic,
    perspective, synthetic, vector, zoomed,
};
use fieldlod_hierarchy::Sphere;
use fieldlod_select::{
    AdvancedSettings, Cut, GroupTable, InstanceId, InstanceView, LodSettings, MeshId, Offscreen,
    Scene, Selector, ShadowLight, View, group_error_px, select_with,
};
use glam::{Affine3A, Vec3};
use proptest::prelude::*;
use rayon::prelude::*;

#[derive(Clone, Debug)]
struct Placed {
    mesh: usize,
    placement: Affine3A,
    bias: f32,
    layers: u64,
    forced_level: Option<u32>,
}

fn any_placed() -> impl Strategy<Value = Placed> {
    let bias = prop_oneof![3 => Just(1.0f32), 1 => 0.2f32..4.0];
    (0usize..HIERARCHIES, any_placement(), vector(), bias).prop_map(
        |(mesh, placement, shift, bias)| {
            let shift = Affine3A::from_translation(shift * 40.0);
            Placed {
                mesh,
                placement: shift * placement,
                bias,
                layers: u64::MAX,
                forced_level: None,
            }
        },
    )
}

#[derive(Clone, Debug)]
enum Event {
    Add(Vec<Placed>),
    /// Every n-th instance.
    Remove(usize),
    /// Removed, and as many others put in their place.
    Replace(usize, Vec<Placed>),
    Move(usize, Vec3),
    Bias(usize, f32),
    Layers(usize, u64),
    Force(usize, Option<u32>),
    Nothing,
}

fn any_event() -> impl Strategy<Value = Event> {
    let some = || prop::collection::vec(any_placed(), 1..6);
    prop_oneof![
        2 => some().prop_map(Event::Add),
        1 => prop::collection::vec(any_placed(), 100..140).prop_map(Event::Add),
        2 => (1usize..10).prop_map(Event::Remove),
        2 => (1usize..10, some()).prop_map(|(n, placed)| Event::Replace(n, placed)),
        2 => (1usize..10, vector()).prop_map(|(n, by)| Event::Move(n, by)),
        1 => (1usize..10, 0.2f32..4.0).prop_map(|(n, bias)| Event::Bias(n, bias)),
        2 => (1usize..4, 0u64..4).prop_map(|(n, layers)| Event::Layers(n, layers)),
        1 => (1usize..6, prop::option::of(0u32..5)).prop_map(|(n, level)| Event::Force(n, level)),
        1 => Just(Event::Nothing),
    ]
}

/// A scene, and what should be in it.
struct World {
    scene: Scene,
    meshes: Vec<MeshId>,
    placed: BTreeMap<InstanceId, Placed>,
}

impl World {
    fn new() -> Self {
        let mut scene = Scene::default();
        let meshes = hierarchies().iter().map(|h| scene.add_mesh(h)).collect();
        Self {
            scene,
            meshes,
            placed: BTreeMap::new(),
        }
    }

    fn add(&mut self, placed: &[Placed]) {
        for one in placed {
            let mesh = self.meshes[one.mesh];
            let id = self.scene.add_instance(mesh, one.placement, one.bias);
            assert!(self.placed.insert(id, one.clone()).is_none());
        }
    }

    fn every(&self, n: usize) -> Vec<InstanceId> {
        self.placed.keys().copied().step_by(n).collect()
    }

    fn apply(&mut self, event: &Event) {
        match event {
            Event::Add(placed) => self.add(placed),
            Event::Remove(n) => self.remove(&self.every(*n)),
            Event::Replace(n, placed) => {
                self.remove(&self.every(*n));
                self.add(placed);
            }
            Event::Move(n, by) => {
                for id in self.every(*n) {
                    let one = self.placed.get_mut(&id).unwrap();
                    one.placement.translation += glam::Vec3A::from(*by * 20.0);
                    self.scene.set_placement(id, one.placement);
                }
            }
            Event::Bias(n, bias) => {
                for id in self.every(*n) {
                    self.placed.get_mut(&id).unwrap().bias = *bias;
                    self.scene.set_bias(id, *bias);
                }
            }
            Event::Layers(n, layers) => {
                for id in self.every(*n) {
                    self.placed.get_mut(&id).unwrap().layers = *layers;
                    self.scene.set_layers(id, *layers);
                }
            }
            Event::Force(n, level) => {
                for id in self.every(*n) {
                    self.placed.get_mut(&id).unwrap().forced_level = *level;
                    self.scene.set_forced_level(id, *level);
                }
            }
            Event::Nothing => {}
        }
        self.scene.update();
        assert_eq!(self.scene.instance_count(), self.placed.len());
    }

    fn remove(&mut self, ids: &[InstanceId]) {
        for id in ids {
            self.scene.remove(*id);
            self.placed.remove(id);
        }
    }
}

/// A view with a camera and settings of its own, selected by a selector and one instance at a time.
struct Watcher {
    view: View,
    layers: u64,
    settings: LodSettings,
    selector: Selector,
    cuts: HashMap<InstanceId, Cut>,
    /// The cuts as `changes` tell them.
    followed: BTreeMap<InstanceId, Vec<u32>>,
}

impl Watcher {
    fn new(view: View, settings: LodSettings) -> Self {
        Self {
            view,
            layers: u64::MAX,
            settings,
            selector: Selector::default(),
            cuts: HashMap::new(),
            followed: BTreeMap::new(),
        }
    }

    fn check(&mut self, world: &World) {
        self.selector.select(
            &world.scene,
            &self.view.with_layers(self.layers),
            &self.settings,
        );
        for change in self.selector.changes() {
            assert!(change.entered.is_sorted() && change.left.is_sorted());
            let cut = self.followed.entry(change.instance).or_default();
            cut.retain(|unit| !change.left.contains(unit));
            cut.extend(change.entered);
            cut.sort_unstable();
        }
        self.followed.retain(|_, units| !units.is_empty());
        self.cuts.retain(|id, _| world.placed.contains_key(id));
        let mut triangle_count = 0;
        // What it does not see is as if it were not there.
        let layers = self.layers;
        let is_seen = |placed: &&Placed| placed.layers & layers != 0;
        self.cuts.retain(|id, _| is_seen(&&world.placed[id]));
        for (id, placed) in &world.placed {
            let units = self.selector.units(&world.scene, *id);
            if !is_seen(&placed) {
                assert!(units.is_empty());
                continue;
            }
            let cut = self.cuts.entry(*id).or_default();
            select_one(placed, &self.view, &self.settings, cut);
            assert_eq!(self.selector.units(&world.scene, *id), cut.units());
            assert_eq!(self.followed.get(id).unwrap(), cut.units());
            triangle_count += cut.triangle_count();
        }
        assert_eq!(self.followed.len(), self.cuts.len());
        assert_eq!(self.selector.triangle_count(), triangle_count);
    }
}

fn select_one(placed: &Placed, view: &View, settings: &LodSettings, cut: &mut Cut) {
    let hierarchy = &hierarchies()[placed.mesh];
    let view = view.with_margins(settings);
    let instance = InstanceView::new(&view, &placed.placement);
    // A bias is a threshold of one's own.
    let biased = LodSettings {
        resolution_scale: settings.resolution_scale * placed.bias,
        ..*settings
    };
    if let Some(level) = settings.forced_level.or(placed.forced_level) {
        return select_with(hierarchy, &LodSettings::default(), cut, |group| {
            match hierarchy.groups[group].level >= level {
                true => f32::INFINITY,
                false => 0.0,
            }
        });
    }
    let before = cut.refined().to_vec();
    select_with(hierarchy, &biased, cut, |group| {
        let was_refined = before.get(group) == Some(&true);
        group_error_px(&hierarchy.groups[group], &instance, settings, was_refined)
    });
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 80, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn views_of_a_scene_that_changes_equal_one_instance_at_a_time(
        cameras in prop::array::uniform3((any_camera(), vector(), any_settings())),
        forced_level in prop::option::weighted(0.1, 0u32..4),
        events in prop::collection::vec(any_event(), 6..14),
        walk in vector(),
    ) {
        let mut world = World::new();
        let mut watchers = cameras.map(|(camera, eye, settings)| {
            Watcher::new(look(camera, eye * 30.0, Vec3::new(0.1, 0.0, 0.2)), settings)
        });
        watchers[0].settings.forced_level = forced_level;
        for (step, event) in (0u8..).zip(&events) {
            world.apply(event);
            // The third looks at every other scene only.
            let watching = if step % 2 == 0 { 3 } else { 2 };
            watchers[1].view = look(cameras[1].0, cameras[1].1 * 30.0 + walk * f32::from(step), Vec3::X);
            watchers[1].layers = [u64::MAX, 1, 1, 2][usize::from(step % 4)];
            watchers[..watching].par_iter_mut().for_each(|watcher| watcher.check(&world));
        }
    }
}

fn one_view() -> View {
    look(perspective(1.0), Vec3::new(0.3, 0.2, 6.0), Vec3::ZERO)
}

#[test]
fn ids_are_never_given_twice_and_indices_are_used_again() {
    let mut scene = Scene::default();
    let mesh = scene.add_mesh(&hierarchies()[3]);
    let first = scene.add_instance(mesh, Affine3A::IDENTITY, 1.0);
    scene.remove(first);
    let second = scene.add_instance(mesh, Affine3A::IDENTITY, 1.0);
    assert_eq!(first.index(), second.index());
    assert_ne!(first, second);
    assert_eq!(scene.instance_count(), 1);
    assert_eq!(
        (scene.mesh_of(first), scene.mesh_of(second)),
        (None, Some(mesh))
    );
    // What is done to the first does not touch the second.
    scene.remove(first);
    scene.set_placement(first, Affine3A::from_translation(Vec3::splat(1e6)));
    scene.update();
    let mut selector = Selector::default();
    selector.select(&scene, &one_view(), &LodSettings::default());
    assert!(selector.units(&scene, first).is_empty());
    assert!(selector.units(&scene, second).len() > 1);
}

#[test]
fn what_a_removed_mesh_drew_leaves() {
    let mut scene = Scene::default();
    let far = Affine3A::from_translation(Vec3::Z * -1e6);
    for placement in [Affine3A::IDENTITY, far] {
        let mesh = scene.add_table(GroupTable::new(&hierarchies()[0]));
        let id = scene.add_instance(mesh, placement, 1.0);
        scene.update();
        let mut selector = Selector::default();
        selector.select(&scene, &one_view(), &LodSettings::default());
        let drawn = selector.units(&scene, id).to_vec();
        assert!(!drawn.is_empty());
        scene.remove(id);
        scene.remove_mesh(mesh);
        scene.update();
        selector.select(&scene, &one_view(), &LodSettings::default());
        let changes: Vec<_> = selector.changes().collect();
        assert_eq!(changes.len(), 1);
        assert_eq!(
            (changes[0].instance, changes[0].left),
            (id, drawn.as_slice())
        );
        assert_eq!(selector.triangle_count(), 0);
    }
}

#[test]
fn ids_of_removed_meshes_are_used_again() {
    let mut scene = Scene::default();
    let [first, second] = [0, 1].map(|which| scene.add_mesh(&hierarchies()[which]));
    scene.remove_mesh(first);
    scene.remove_mesh(first);
    let third = scene.add_mesh(&hierarchies()[2]);
    assert_eq!(third, first);
    let fourth = scene.add_mesh(&hierarchies()[3]);
    assert!(fourth != third && fourth != second);
}

/// A whole mesh at each level: every group consumes one unit and produces one.
#[test]
fn of_whole_mesh_levels_one_is_drawn() {
    let whole = synthetic::whole_mesh_levels(5, 0.01);
    let mut scene = Scene::default();
    let mesh = scene.add_mesh(&whole);
    let distances = [0.0, 10.0, 30.0, 100.0, 1000.0, 1e5];
    let ids: Vec<InstanceId> = distances
        .iter()
        .map(|&z| scene.add_instance(mesh, Affine3A::from_translation(Vec3::Z * -z), 1.0))
        .collect();
    scene.update();
    let mut selector = Selector::default();
    selector.select(&scene, &one_view(), &LodSettings::default());
    let drawn: Vec<u32> = ids
        .iter()
        .map(|&id| {
            let units = selector.units(&scene, id);
            assert_eq!(units.len(), 1);
            units[0]
        })
        .collect();
    assert!(drawn.is_sorted(), "{drawn:?}");
    assert_eq!((drawn[0], drawn[5]), (0, 5));
}

/// Whether a sphere swept along a direction meets the image of a view.
fn may_cast(center: Vec3, radius: f32, direction: Vec3, sees: &impl Fn(Vec3) -> bool) -> bool {
    let ring = [
        Vec3::ZERO,
        Vec3::X,
        Vec3::NEG_X,
        Vec3::Y,
        Vec3::NEG_Y,
        Vec3::Z,
        Vec3::NEG_Z,
    ];
    let steps = (0u16..600).map(|step| f32::from(step) * 0.5);
    let mut points = steps.flat_map(|way| ring.map(|out| center + out * radius + direction * way));
    points.any(sees)
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 40, failure_persistence: None, ..ProptestConfig::default() })]

    /// What may throw a shadow into the view is drawn as if all things might, while camera and lights move.
    #[test]
    fn what_may_cast_into_the_view_keeps_its_shape(
        places in prop::collection::vec(vector(), 60..120),
        eye in vector(), step in vector(), sun in vector(), turn in vector(), lamp in vector(),
        by_lamp in any::<bool>(), is_orthographic in any::<bool>(),
        (pace, zoom) in (prop_oneof![Just(1.0f32), Just(0.05f32)], prop_oneof![Just(0.0f32), -0.02f32..0.02]),
    ) {
        let mut scene = Scene::default();
        // In pieces and as a whole.
        let rock = &hierarchies()[0];
        let meshes = [scene.add_mesh(rock), scene.add_mesh(&rock.whole_mesh_levels().unwrap())];
        let rocks: Vec<(InstanceId, Vec3)> = places.iter().zip(meshes.iter().cycle()).map(|(place, mesh)| {
            let at = *place * 30.0;
            (scene.add_instance(*mesh, Affine3A::from_translation(at), 1.0), at)
        }).collect();
        scene.update();
        let settings = LodSettings { advanced: AdvancedSettings { offscreen: Offscreen::OnAxis { bias: 1.0 }, hysteresis: 1.0, edge_hysteresis: 0.0, ..AdvancedSettings::default() }, ..LodSettings::default() };
        let (mut all, mut lit) = (Selector::default(), Selector::default());
        let mut fewer = 0;
        let lens = if is_orthographic { orthographic() } else { perspective(0.8) };
        for frame in 0u8..16 {
            let lens = zoomed(lens, 1.0 + zoom * f32::from(frame));
            let frame = f32::from(frame) * pace;
            let at = eye * 10.0 + step * frame;
            let view = look(lens, at, at + Vec3::NEG_Z * 5.0 + turn * frame * 0.3);
            let direction = (sun + Vec3::Y * 0.01 * frame + Vec3::splat(0.011)).normalize();
            let reach = Sphere { center: lamp * 20.0 + step * frame, radius: 12.0 };
            let light = if by_lamp { ShadowLight::Lamp(reach) } else { ShadowLight::Sun(direction) };
            all.select(&scene, &view, &settings);
            lit.select(&scene, &view.with_shadow_lights(&[light]), &settings);
            let seen = InstanceView::new(&view, &Affine3A::IDENTITY);
            let sees = |point: Vec3| {
                let point = seen.sphere_in_camera(&Sphere { center: point, radius: 0.0 }).center;
                match view.camera() {
                    Camera::Perspective(camera) => camera.contains(point),
                    Camera::Orthographic(camera) => camera.contains(point),
                }
            };
            for &(rock, place) in &rocks {
                let (of_all, of_lit) = (all.units(&scene, rock), lit.units(&scene, rock));
                let casts = if by_lamp {
                    place.distance(reach.center) < reach.radius
                } else {
                    may_cast(place, 0.9, direction, &sees)
                };
                if casts || sees(place) {
                    prop_assert_eq!(of_all, of_lit);
                }
                prop_assert!(of_lit.len() <= of_all.len());
                fewer += usize::from(of_all != of_lit);
            }
        }
        prop_assert!(!by_lamp || fewer > 0);
    }
}
