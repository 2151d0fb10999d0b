//! Scenes with changing instances, and selectors that are compared with the specification of each instance.

use std::collections::BTreeMap;

use fieldlod_hierarchy::Hierarchy;
use fieldlod_select::{
    Cut, InstanceId, InstanceView, LodSettings, MeshId, OcclusionBuffer, Scene, Selector, View,
    VisibleFlux, select_with, visible_error_px,
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

/// A view with settings of its own, selected by a selector and one instance at a time.
pub(crate) struct Watcher {
    pub(crate) view: View,
    pub(crate) settings: LodSettings,
    selector: Selector,
    naive: BTreeMap<InstanceId, Naive>,
    /// The cuts by the changes so far.
    followed: BTreeMap<InstanceId, Vec<u32>>,
}

impl Watcher {
    pub(crate) fn new(view: View, settings: LodSettings) -> Self {
        Self {
            view,
            settings,
            selector: Selector::default(),
            naive: BTreeMap::new(),
            followed: BTreeMap::new(),
        }
    }

    /// Selects a frame and asserts that cuts, changes and triangles are those of the specification.
    pub(crate) fn check(&mut self, world: &World, layers: u64) {
        let (scene, settings) = (&world.scene, &self.settings);
        let view = self.view.with_layers(layers);
        self.selector.select(scene, &view, settings);
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
        let flux = settings.visible_flux;
        let buffer = flux.map(|flux| OcclusionBuffer::new(scene, &wide, flux.occluder_triangles));
        let mut triangle_count = 0;
        for (id, placed) in &world.placed {
            let units = self.selector.units(scene, *id);
            if !sees(id) {
                assert!(units.is_empty());
                continue;
            }
            let naive = self.naive.entry(*id).or_default();
            let seen = buffer.as_ref().map(|b| b.visible_shares(scene, *id));
            naive.select(placed, &wide, settings, seen.as_deref());
            assert_eq!(units, naive.cut.units());
            assert_eq!(self.followed.get(id).unwrap(), naive.cut.units());
            triangle_count += naive.cut.triangle_count();
        }
        assert_eq!(self.followed.len(), self.naive.len());
        assert_eq!(self.selector.triangle_count(), triangle_count);
    }
}

/// The specification of one instance, with its last cut and its held shares.
#[derive(Default)]
struct Naive {
    cut: Cut,
    shares: Vec<HeldShare>,
}

impl Naive {
    fn select(
        &mut self,
        placed: &Placed,
        view: &View,
        settings: &LodSettings,
        seen: Option<&[f32]>,
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
            return select_with(hierarchy, &LodSettings::default(), &mut self.cut, error_px);
        }
        let mut before = self.cut.refined().to_vec();
        before.resize(hierarchy.groups.len(), false);
        let shares = match (seen, &settings.visible_flux) {
            (Some(seen), Some(flux)) => self.update_shares(hierarchy, &before, seen, flux),
            _ => vec![1.0; before.len()],
        };
        let instance = InstanceView::new(view, &placed.placement);
        // A bias divides the threshold, as the resolution scale does.
        let biased = LodSettings {
            resolution_scale: settings.resolution_scale * placed.bias,
            ..*settings
        };
        select_with(hierarchy, &biased, &mut self.cut, |index| {
            let group = &hierarchy.groups[index];
            visible_error_px(group, &instance, settings, before[index], shares[index])
        });
    }

    /// Updates the held shares, and returns the share of each group for the criterion.
    fn update_shares(
        &mut self,
        hierarchy: &Hierarchy,
        before: &[bool],
        seen: &[f32],
        flux: &VisibleFlux,
    ) -> Vec<f32> {
        let last = before.len() - 1;
        let is_whole = hierarchy.groups.len() == hierarchy.units.len();
        self.shares.resize(before.len(), HeldShare::default());
        let update = |(group, held): (usize, &mut HeldShare)| {
            // A mesh that is drawn as a whole holds one share for all refined levels.
            let was_refined = if is_whole {
                before[..last].contains(&true)
            } else {
                before[group]
            };
            held.update(seen[group], was_refined, flux.hold_frames);
            let share = if is_whole && !before[group] {
                seen[group]
            } else {
                held.share
            };
            share.max(flux.least_share).min(1.0)
        };
        self.shares.iter_mut().enumerate().map(update).collect()
    }
}

/// The held share of a group.
#[derive(Clone, Copy, Default)]
struct HeldShare {
    share: f32,
    peak: f32,
    waited: u8,
}

impl HeldShare {
    /// A larger share counts at once. A smaller one counts after some frames if the group was refined.
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
