//! What is counted without a look at every instance is what a look at each gives.

mod common;

use std::collections::{HashMap, HashSet};

use common::{hierarchies, vector};
use fieldlod_select::{InstanceId, Scene, Tally};
use glam::{Affine3A, Vec3, Vec4};
use proptest::prelude::*;

#[derive(Clone, Debug)]
enum Event {
    Add(Vec<Vec3>),
    Remove(usize),
    Move(usize, Vec3),
    Number(usize, Option<[u32; 3]>),
    /// Numbers given before the scene is up to date.
    MoveAndNumber(usize, Vec3, [u32; 3]),
    /// To layers that the view does not see, or to none.
    Hide(usize, u64),
    Show(usize),
}

/// The layer that is counted.
const LAYER: u64 = 1;

fn any_event() -> impl Strategy<Value = Event> {
    let numbers = || [0u32..100_000, 0u32..100_000, 0u32..3];
    let every = || 1usize..9;
    prop_oneof![
        prop::collection::vec(vector(), 1..200).prop_map(Event::Add),
        every().prop_map(Event::Remove),
        (every(), vector()).prop_map(|(n, by)| Event::Move(n, by)),
        (every(), prop::option::weighted(0.9, numbers())).prop_map(|(n, to)| Event::Number(n, to)),
        (every(), vector(), numbers()).prop_map(|(n, by, to)| Event::MoveAndNumber(n, by, to)),
        (every(), prop::sample::select(vec![0, 2])).prop_map(|(n, to)| Event::Hide(n, to)),
        every().prop_map(Event::Show),
    ]
}

/// A scene with the numbers of its instances.
#[derive(Default)]
struct Counted {
    scene: Scene,
    numbers: HashMap<InstanceId, Option<[u32; 3]>>,
    hidden: HashSet<InstanceId>,
}

impl Counted {
    fn every(&self, n: usize) -> Vec<InstanceId> {
        let mut ids: Vec<InstanceId> = self.numbers.keys().copied().collect();
        ids.sort_unstable();
        ids.into_iter().step_by(n).collect()
    }

    fn move_all(&mut self, ids: &[InstanceId], by: Vec3) {
        for &id in ids {
            let placement = self.scene.placement(id);
            let moved = Affine3A::from_translation(by * 30.0) * placement;
            self.scene.set_placement(id, moved);
        }
    }

    /// What is hidden has no numbers, or zeros.
    fn number(&mut self, ids: &[InstanceId], to: Option<[u32; 3]>) {
        for &id in ids {
            let is_hidden = self.hidden.contains(&id);
            let to = to.map(|numbers| numbers.map(|number| if is_hidden { 0 } else { number }));
            self.scene.set_numbers(id, to);
            self.numbers.insert(id, to);
        }
    }

    fn hide(&mut self, ids: &[InstanceId], layers: u64) {
        self.hidden.extend(ids);
        self.number(ids, (layers == 0).then_some([0; 3]));
        ids.iter().for_each(|&id| self.scene.set_layers(id, layers));
    }

    fn show(&mut self, ids: &[InstanceId]) {
        for &id in ids {
            self.hidden.remove(&id);
            self.scene.set_layers(id, LAYER);
        }
    }

    fn apply(&mut self, event: &Event, mesh: fieldlod_select::MeshId) {
        match event {
            Event::Add(places) => {
                for place in places {
                    let placement = Affine3A::from_translation(*place * 60.0);
                    let id = self.scene.add_instance(mesh, placement, 1.0);
                    self.numbers.insert(id, None);
                }
            }
            Event::Remove(n) => {
                for id in self.every(*n) {
                    self.scene.remove(id);
                    self.numbers.remove(&id);
                    self.hidden.remove(&id);
                }
            }
            Event::Move(n, by) => self.move_all(&self.every(*n), *by),
            Event::Number(n, to) => self.number(&self.every(*n), *to),
            Event::MoveAndNumber(n, by, to) => {
                self.move_all(&self.every(*n), *by);
                self.number(&self.every(*n), Some(*to));
            }
            Event::Hide(n, layers) => self.hide(&self.every(*n), *layers),
            Event::Show(n) => self.show(&self.every(*n)),
        }
    }

    /// Of what is within planes: the tally, and how many instances were visited.
    fn tally(&self, planes: &[Vec4], sums: bool) -> (Tally, usize) {
        let mut visited = Vec::new();
        let mut tally = self
            .scene
            .tally_within(planes, LAYER, sums, &mut |id, _| visited.push(id));
        for id in &visited {
            assert!(!self.hidden.contains(id), "{id:?} is on another layer");
            let Some(numbers) = self.numbers[id] else {
                tally.without_numbers += 1;
                continue;
            };
            for (sum, number) in tally.sums.iter_mut().zip(numbers) {
                *sum += u64::from(number);
            }
        }
        (tally, visited.len())
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 100, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn sums_are_those_of_a_look_at_each(
        events in prop::collection::vec(any_event(), 1..12),
        planes in prop::collection::vec((vector(), -20.0f32..60.0), 0..5),
    ) {
        let mut counted = Counted::default();
        let mesh = counted.scene.add_mesh(&hierarchies()[0]);
        let plane = |(normal, distance): &(Vec3, f32)| {
            (*normal + Vec3::splat(1e-3)).normalize().extend(*distance)
        };
        let planes: Vec<Vec4> = planes.iter().map(plane).collect();
        counted.apply(&Event::Add(vec![Vec3::X, Vec3::Y]), mesh);
        for event in &events {
            // Numbers are given to what is there, and the rest waits for an update.
            counted.scene.update();
            counted.apply(event, mesh);
            counted.scene.update();
            prop_assert_eq!(counted.tally(&planes, true).0, counted.tally(&planes, false).0);
        }
    }
}

#[test]
fn what_has_numbers_is_not_visited_within() {
    let mut counted = Counted::default();
    let mesh = counted.scene.add_mesh(&hierarchies()[0]);
    let places = (0..1000u16).map(|i| Vec3::new(f32::from(i % 32), 0.0, f32::from(i / 32)) * 0.1);
    counted.apply(&Event::Add(places.collect()), mesh);
    counted.apply(&Event::Number(1, Some([3, 2, 1])), mesh);
    counted.scene.update();
    let half = Vec3::X.extend(-90.0);
    let (tally, visited) = counted.tally(&[half], true);
    assert!(visited as u64 * 3 < tally.sums[2], "{visited} {tally:?}");
    let all = counted.tally(&[], true);
    assert_eq!((all.0.sums, all.1), ([3000, 2000, 1000], 0));
    // Nor is what is hidden among it.
    counted.apply(&Event::Hide(2, 0), mesh);
    counted.scene.update();
    let all = counted.tally(&[], true);
    assert_eq!((all.0.sums, all.1), ([1500, 1000, 500], 0));
}
