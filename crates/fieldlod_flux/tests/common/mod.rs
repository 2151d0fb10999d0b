//! Scenes of rocks and views of them.
#![allow(dead_code, reason = "each suite uses its part")]

use std::sync::{Arc, OnceLock};

use camera_field::Camera;
use fieldlod_bake::{BakeConfig, bake_mesh, fixtures};
use fieldlod_flux::{FluxSettings, Occluder, Occluders, VisibleFlux};
use fieldlod_hierarchy::Hierarchy;
use fieldlod_select::{InstanceId, LodSettings, MeshId, Scene, Selector, View};
use glam::{Affine3A, Mat4, Vec2, Vec3};

/// A rock in units.
pub(crate) fn rock() -> &'static Hierarchy {
    static ROCK: OnceLock<Hierarchy> = OnceLock::new();
    ROCK.get_or_init(|| {
        let config = BakeConfig {
            cluster_triangles: 64,
            group_clusters: 6,
            ..BakeConfig::default()
        };
        bake_mesh(&fixtures::rock(5, 1), &config).unwrap()
    })
}

pub(crate) fn perspective(fov_y: f32) -> Camera {
    let projection = Mat4::perspective_infinite_reverse_rh(fov_y, 16.0 / 9.0, 0.01);
    Camera::from_projection(&projection, Vec2::new(1920.0, 1080.0)).unwrap()
}

pub(crate) fn look(camera: Camera, eye: Vec3, target: Vec3) -> View {
    let world_from_view = Mat4::look_at_rh(eye, target, Vec3::Y).inverse();
    View::new(camera, &Affine3A::from_mat4(world_from_view))
}

pub(crate) fn settings() -> LodSettings {
    LodSettings::with_error_px(0.5)
}

pub(crate) fn placed(at: Vec3, half_size: Vec3) -> Affine3A {
    Affine3A::from_translation(at) * Affine3A::from_scale(half_size)
}

/// A scene of rocks, some of them stretched into walls and posts.
pub(crate) struct Stage {
    pub(crate) scene: Scene,
    pub(crate) occluders: Occluders,
    rock: MeshId,
    _occluder: Arc<Occluder>,
    pub(crate) ids: Vec<InstanceId>,
}

impl Stage {
    pub(crate) fn new() -> Self {
        let (mut scene, mut occluders) = (Scene::default(), Occluders::default());
        let mesh = scene.add_mesh(rock());
        let occluder = Arc::new(Occluder::new(rock()));
        occluders.set_mesh(mesh, Some(occluder.clone()));
        Self {
            scene,
            occluders,
            rock: mesh,
            _occluder: occluder,
            ids: Vec::new(),
        }
    }

    pub(crate) fn put(&mut self, at: Vec3, half_size: Vec3) -> InstanceId {
        let placement = placed(at, half_size);
        let id = self.scene.add_instance(self.rock, placement, 1.0);
        self.ids.push(id);
        id
    }

    pub(crate) fn remove(&mut self, id: InstanceId) {
        self.scene.remove(id);
        self.ids.retain(|&other| other != id);
    }

    /// Triangles that an instance draws.
    pub(crate) fn triangles(&self, selector: &Selector, id: InstanceId) -> u64 {
        let drawn = selector.units(&self.scene, id).iter();
        let count = |&unit: &u32| u64::from(rock().units[unit as usize].triangle_count);
        drawn.map(count).sum()
    }

    /// Selects without weights and without history.
    pub(crate) fn select_all_visible(&self, view: &View) -> Selector {
        let mut selector = Selector::default();
        selector.select(&self.scene, view, &settings());
        selector
    }
}

pub(crate) fn add_mesh(
    scene: &mut Scene,
    occluders: &mut Occluders,
    hierarchy: &Hierarchy,
) -> MeshId {
    let mesh = scene.add_mesh(hierarchy);
    occluders.set_mesh(mesh, Some(Arc::new(Occluder::new(hierarchy))));
    mesh
}

/// The selection of one view.
#[derive(Default)]
pub(crate) struct Eye {
    pub(crate) flux: VisibleFlux,
    pub(crate) selector: Selector,
}

impl Eye {
    pub(crate) fn new(flux: FluxSettings) -> Self {
        Self {
            flux: VisibleFlux::new(flux),
            selector: Selector::default(),
        }
    }

    pub(crate) fn select(&mut self, stage: &Stage, view: &View, settings: &LodSettings) {
        let mut weights = self.flux.look(&stage.scene, view, &stage.occluders);
        self.selector
            .select_weighed(&stage.scene, view, settings, &mut weights);
    }
}
