//! Choices as they would be made in a frame: ours by the [`Selector`], clusterlod's by a scan of eight
//! groups at once, the others by plain code.

use std::time::{Duration, Instant};

use fieldlod_select::{GroupTable, InstanceId, LodSettings, Scene, Selector};

use crate::baselines::sphere_scan::SphereScan;
use crate::chooser::Chooser;
use crate::eye::Instance;
use crate::method::Method;
use crate::object::LodObject;
use crate::object_view::ObjectView;

/// An object laid out for the methods that have code made for speed.
#[derive(Debug)]
pub(super) struct FastSelection {
    scene: Scene,
    instance: InstanceId,
    pub(super) table: GroupTable,
    pub(super) scan: SphereScan,
}

/// Storage of the fast methods, kept from one choice to the next.
#[derive(Debug, Default)]
pub(super) struct Scratch {
    selector: Selector,
    refined: Vec<u64>,
    units: Vec<u32>,
}

impl FastSelection {
    pub(super) fn new(object: &LodObject, instance: &Instance) -> Self {
        let mut scene = Scene::default();
        let table = GroupTable::new(&object.hierarchy);
        let mesh = scene.add_table(table.clone());
        let instance = scene.add_instance(mesh, instance.world_from_local, 1.0);
        scene.update();
        Self {
            scene,
            instance,
            table,
            scan: SphereScan::new(object),
        }
    }

    /// The units that a method draws at a threshold, from scratch, and the time that the choice took on
    /// one thread.
    ///
    /// # Panics
    /// For the [oracle](Method::Oracle), which needs pictures.
    pub(super) fn choose(
        &self,
        method: Method,
        view: &ObjectView,
        threshold_px: f32,
        scratch: &mut Scratch,
    ) -> (Vec<u32>, Duration) {
        if let Some(settings) = method.settings(threshold_px) {
            self.by_selector(&settings, view, scratch)
        } else if method.is_clusterlods_rule() {
            self.by_scan(view, threshold_px, scratch)
        } else {
            let start = Instant::now();
            let choice = Chooser::new(method, threshold_px).choose(view);
            (choice.units, start.elapsed())
        }
    }

    fn by_selector(
        &self,
        settings: &LodSettings,
        view: &ObjectView,
        scratch: &mut Scratch,
    ) -> (Vec<u32>, Duration) {
        // From scratch, as without a frame before.
        let selector = &mut scratch.selector;
        selector.clear();
        let start = Instant::now();
        selector.select(&self.scene, &view.eye.view(), settings);
        let elapsed = start.elapsed();
        (selector.units(&self.scene, self.instance).to_vec(), elapsed)
    }

    fn by_scan(
        &self,
        view: &ObjectView,
        threshold_px: f32,
        scratch: &mut Scratch,
    ) -> (Vec<u32>, Duration) {
        let Scratch { refined, units, .. } = scratch;
        let start = Instant::now();
        self.scan.refine(view, threshold_px, refined);
        self.scan.units(refined, units);
        let elapsed = start.elapsed();
        (units.clone(), elapsed)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::eye::Eye;
    use crate::object::ErrorSource;
    use fieldlod_bake::{BakeConfig, bake_mesh, fixtures};
    use glam::{Vec2, Vec3};

    /// The fast methods choose what the plain ones do.
    #[test]
    fn the_fast_methods_choose_as_the_plain_ones() {
        let hierarchy = bake_mesh(&fixtures::rock(5, 3), &BakeConfig::fine_grained()).unwrap();
        let object = LodObject::new(hierarchy, ErrorSource::Reported);
        let instance = Instance::default();
        let fast_selection = FastSelection::new(&object, &instance);
        let mut scratch = Scratch::default();
        let mut sizes = Vec::new();
        for position in [
            Vec3::new(0.3, 0.4, 1.5),
            Vec3::new(-2.0, 1.0, 3.0),
            Vec3::Z * 9.0,
        ] {
            let eye = Eye::perspective(70.0, Vec2::new(640.0, 360.0), 0.01);
            let eye = eye.looking_at(position, Vec3::ZERO);
            let view = ObjectView::new(&object, &instance, &eye);
            for method in [Method::Quality, Method::Guaranteed, Method::Clusterlod] {
                let (fast, _) = fast_selection.choose(method, &view, 1.0, &mut scratch);
                let plain = Chooser::new(method, 1.0).choose(&view).units;
                assert_eq!(fast, plain, "{method:?}");
                sizes.push(fast.len());
            }
        }
        sizes.sort_unstable();
        sizes.dedup();
        assert!(sizes.len() > 3, "always the same cut: {sizes:?}");
    }
}
