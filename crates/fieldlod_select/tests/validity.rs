//! Mixed cuts that are still valid, and so not decided anew, are those that deciding them anew gives.

mod common;

use common::{
    HIERARCHIES, any_camera, any_orthographic, any_placement, any_settings, hierarchies, look,
    orthographic, perspective, vector, zoomed,
};
use fieldlod_select::{Cut, InstanceId, LodSettings, Scene, Selector, View, select};
use glam::{Affine3A, Vec3};
use proptest::prelude::*;

/// One instance of each mesh, by the selector and by the scalar criterion.
struct Watched {
    scene: Scene,
    placements: Vec<Affine3A>,
    ids: Vec<InstanceId>,
    selector: Selector,
    cuts: Vec<Cut>,
    /// Mixed cuts that were not decided in a frame, summed over frames.
    still_valid: usize,
}

impl Watched {
    fn new(placements: Vec<Affine3A>) -> Self {
        let mut scene = Scene::default();
        let place = |(hierarchy, placement): (_, &Affine3A)| {
            let mesh = scene.add_mesh(hierarchy);
            scene.add_instance(mesh, *placement, 1.0)
        };
        let ids = hierarchies().iter().zip(&placements).map(place).collect();
        scene.update();
        Self {
            scene,
            cuts: vec![Cut::default(); placements.len()],
            placements,
            ids,
            selector: Selector::default(),
            still_valid: 0,
        }
    }

    fn check(&mut self, view: &View, settings: &LodSettings) {
        self.selector.select(&self.scene, view, settings);
        let mut mixed = 0;
        let placed = hierarchies().iter().zip(&self.placements);
        for (index, (hierarchy, placement)) in placed.enumerate() {
            let cut = &mut self.cuts[index];
            select(hierarchy, placement, view, settings, cut);
            let units = self.selector.units(&self.scene, self.ids[index]);
            assert_eq!(units, cut.units(), "mesh {index}, {settings:?}");
            mixed += usize::from(units.len() > 1);
        }
        let decided = self.selector.statistics().instances_decided;
        self.still_valid += mixed.saturating_sub(decided);
    }
}

/// A camera that goes and turns slowly, at its own pace, and whose lens grows longer by `zoom` a step.
fn walk(
    watched: &mut Watched,
    (mut camera, zoom): (camera_field::Camera, f32),
    settings: &LodSettings,
    (mut eye, go): (Vec3, Vec3),
    (mut target, turn): (Vec3, Vec3),
) {
    for frame in 0..60u8 {
        // Now and then it stops, or goes back.
        let pace = [1.0, 1.0, 1.0, 0.0, -0.7][usize::from(frame / 7) % 5];
        eye += go * pace;
        target += turn * pace;
        camera = zoomed(camera, 1.0 + zoom * pace);
        watched.check(&look(camera, eye, target), settings);
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 120, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn a_cut_that_is_still_valid_is_the_cut_anew(
        camera in prop_oneof![any_camera(), any_orthographic(), Just(perspective(1.0))],
        settings in any_settings(),
        is_plain in any::<bool>(),
        placements in prop::collection::vec((any_placement(), vector()), HIERARCHIES),
        distance in prop_oneof![0.5f32..4.0, 4.0f32..40.0],
        start in vector(),
        (go, turn) in (vector(), vector()),
        pace in prop_oneof![1e-5f32..1e-3, 1e-3f32..0.03],
        zoom in prop_oneof![Just(0.0f32), -1e-3f32..1e-3, -0.03f32..0.03],
    ) {
        let place = |(placement, shift): (Affine3A, Vec3)| {
            Affine3A::from_translation(shift * distance * 0.5) * placement
        };
        // What relaxes the criterion, or leaves nothing valid, is not all there is.
        let settings = if is_plain {
            LodSettings { min_aspect_ratio: 0.0, max_curl: 0.0, ..settings }
        } else {
            settings
        };
        let mut watched = Watched::new(placements.into_iter().map(place).collect());
        let eye = (start + Vec3::new(0.02, 0.01, 0.03)) * distance * 2.0;
        let (go, turn) = (go * distance * pace, turn * distance * pace);
        walk(&mut watched, (camera, zoom), &settings, (eye, go), (Vec3::new(0.1, 0.0, 0.2), turn));
    }
}

/// So that the above is a test of something.
#[test]
fn a_slow_walk_decides_few_cuts_anew() {
    let scales = [Vec3::ONE, Vec3::new(1.0, 1.3, 0.8)];
    let lenses = [perspective(1.0), orthographic()];
    for (scale, lens) in scales
        .iter()
        .flat_map(|&scale| lenses.map(|lens| (scale, lens)))
    {
        let placements = (0..4u8).map(|i| {
            let place = Vec3::new(f32::from(i) * 2.5 - 4.0, 0.0, -f32::from(i));
            Affine3A::from_translation(place) * Affine3A::from_scale(scale)
        });
        let mut watched = Watched::new(placements.collect());
        let settings = LodSettings::default();
        let (eye, go) = (Vec3::new(0.0, 0.5, 9.0), Vec3::new(0.001, 0.0, -0.004));
        let target = (Vec3::ZERO, Vec3::new(0.002, 0.0, 0.0));
        walk(&mut watched, (lens, 0.0), &settings, (eye, go), target);
        let still_valid = watched.still_valid;
        assert!(still_valid > 120, "{still_valid} of {}", 60 * 4);
    }
}
