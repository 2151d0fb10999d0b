//! Scenes with changing instances, and selectors that are compared with the specification of each instance.

use std::collections::BTreeMap;

use fieldlod_select::{
    Cut, InstanceId, InstanceView, LodSettings, MeshId, Scene, Selector, View, Weights,
    select_with, weighed_error_px,
};
use glam::{Affine3A, Vec3};

use super::{hierarchies, look, perspective};

/// An instance of one of the [`hierarchies`].
#[derive(Clone, Debug)]
pub(crate) struct Placed {
    pub(crate) mesh: usize,
    pub(crate) placement: Affine3A,
    pub(crate) bias: f32,
    pub(crate) layers: u64,
}

impl Placed {
    pub(crate) fn new(mesh: usize, placement: Affine3A) -> Self {
        Self {
            mesh,
            placement,
            bias: 1.0,
            layers: u64::MAX,
        }
    }
}

/// A scene and its contents.
pub(crate) struct World {
    pub(crate) scene: Scene,
    pub(crate) meshes: Vec<MeshId>,
    pub(crate) placed: BTreeMap<InstanceId, Placed>,
}

impl World {
    pub(crate) fn new(placed: &[Placed]) -> Self {
        let mut scene = Scene::default();
        let meshes = hierarchies().iter().map(|h| scene.add_mesh(h)).collect();
        let mut world = Self {
            scene,
            meshes,
            placed: BTreeMap::new(),
        };
        world.add(placed);
        world.scene.update();
        world
    }

    /// A square of instances in rows, the first at the origin.
    pub(crate) fn forest(mesh: usize, side: u16, spacing: f32) -> Self {
        let place = |index: u16| {
            let (x, z) = (f32::from(index % side), f32::from(index / side));
            let at = Vec3::new(x, 0.0, -z) * spacing;
            Placed::new(mesh, Affine3A::from_translation(at))
        };
        Self::new(&(0..side * side).map(place).collect::<Vec<_>>())
    }

    pub(crate) fn add(&mut self, placed: &[Placed]) {
        for one in placed {
            let mesh = self.meshes[one.mesh];
            let id = self.scene.add_instance(mesh, one.placement, one.bias);
            assert!(self.placed.insert(id, one.clone()).is_none());
        }
    }

    pub(crate) fn ids(&self) -> Vec<InstanceId> {
        self.placed.keys().copied().collect()
    }

    /// The cut of each instance.
    pub(crate) fn cuts(&self, selector: &Selector) -> Vec<Vec<u32>> {
        let ids = self.placed.keys();
        ids.map(|&id| selector.units(&self.scene, id).to_vec())
            .collect()
    }

    /// A selection without history.
    pub(crate) fn select(&self, view: &View, settings: &LodSettings) -> Selector {
        let mut selector = Selector::default();
        selector.select(&self.scene, view, settings);
        selector
    }
}

/// A step of a walk along the front of a forest.
pub(crate) fn step_of_walk(step: u16) -> View {
    let eye = Vec3::new(5.0 + f32::from(step) * 0.02, 1.5, 4.0);
    look(perspective(1.0), eye, eye + Vec3::new(0.2, -0.1, -1.0))
}

/// Weights that change from frame to frame, by no order.
#[derive(Clone, Copy)]
pub(crate) struct AnyWeights(pub(crate) u64);

impl Weights for AnyWeights {
    fn revision(&self) -> u64 {
        self.0
    }

    fn weight(&mut self, instance: InstanceId, _: bool) -> f32 {
        // Every frame has some weights of earlier frames.
        let seed = self.0 / (1 + instance.index() as u64 % 3);
        let mixed = (seed + 1).wrapping_mul(instance.index() as u64 + 7);
        let share = (mixed.wrapping_mul(0x9e37_79b9_7f4a_7c15) >> 61) as f32;
        // Often 0 or 1, and sometimes NaN, which counts as 1.
        match mixed % 11 {
            0 => f32::NAN,
            _ => (share / 4.0 - 0.4).clamp(0.0, 1.0),
        }
    }
}

/// A view with settings of its own, selected by a selector and one instance at a time.
pub(crate) struct Watcher {
    pub(crate) view: View,
    pub(crate) settings: LodSettings,
    pub(crate) weights: Option<AnyWeights>,
    selector: Selector,
    naive: BTreeMap<InstanceId, Cut>,
    /// The cuts by the changes so far.
    followed: BTreeMap<InstanceId, Vec<u32>>,
}

impl Watcher {
    pub(crate) fn new(view: View, settings: LodSettings) -> Self {
        Self {
            view,
            settings,
            weights: None,
            selector: Selector::default(),
            naive: BTreeMap::new(),
            followed: BTreeMap::new(),
        }
    }

    /// Selects a frame and asserts that cuts, changes and triangles are those of the specification.
    pub(crate) fn check(&mut self, world: &World, layers: u64) {
        let (scene, settings) = (&world.scene, &self.settings);
        let view = self.view.with_layers(layers);
        match &mut self.weights {
            Some(weights) => {
                weights.0 += 1;
                self.selector
                    .select_weighed(scene, &view, settings, weights);
            }
            None => self.selector.select(scene, &view, settings),
        }
        for change in self.selector.changes() {
            assert!(change.entered.is_sorted() && change.left.is_sorted());
            let cut = self.followed.entry(change.instance).or_default();
            cut.retain(|unit| !change.left.contains(unit));
            cut.extend(change.entered);
            cut.sort_unstable();
        }
        self.followed.retain(|_, units| !units.is_empty());
        // An instance on other layers counts as absent.
        let sees = |id: &InstanceId| world.placed.get(id).is_some_and(|p| p.layers & layers != 0);
        self.naive.retain(|id, _| sees(id));
        let wide = view.with_margins(settings);
        let mut triangle_count = 0;
        for (id, placed) in &world.placed {
            let units = self.selector.units(scene, *id);
            if !sees(id) {
                assert!(units.is_empty());
                continue;
            }
            let naive = self.naive.entry(*id).or_default();
            let weight = self
                .weights
                .map_or(1.0, |mut weights| weights.weight(*id, false));
            select_naively(naive, placed, &wide, settings, weight);
            assert_eq!(units, naive.units());
            assert_eq!(self.followed.get(id).unwrap(), naive.units());
            triangle_count += naive.triangle_count();
        }
        assert_eq!(self.followed.len(), self.naive.len());
        assert_eq!(self.selector.triangle_count(), triangle_count);
    }
}

/// The specification of one instance, from its last cut.
fn select_naively(
    cut: &mut Cut,
    placed: &Placed,
    view: &View,
    settings: &LodSettings,
    weight: f32,
) {
    let hierarchy = &hierarchies()[placed.mesh];
    if let Some(level) = settings.forced_level {
        let error_px = |group: usize| {
            if hierarchy.groups[group].level >= level {
                f32::INFINITY
            } else {
                0.0
            }
        };
        return select_with(hierarchy, &LodSettings::default(), cut, error_px);
    }
    let mut before = cut.refined().to_vec();
    before.resize(hierarchy.groups.len(), false);
    let instance = InstanceView::new(view, &placed.placement);
    // A bias divides the threshold, as the resolution scale does.
    let biased = LodSettings {
        resolution_scale: settings.resolution_scale * placed.bias,
        ..*settings
    };
    // Above 0, because 0 times an infinite error is NaN.
    let weight = if weight.is_nan() {
        1.0
    } else {
        weight.max(f32::MIN_POSITIVE)
    };
    select_with(hierarchy, &biased, cut, |index| {
        let group = &hierarchy.groups[index];
        weighed_error_px(group, &instance, settings, before[index], weight)
    });
}
