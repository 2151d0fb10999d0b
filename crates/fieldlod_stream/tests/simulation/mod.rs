//! A walk through a world of rocks whose pages come from a simulated disk.
#![allow(dead_code, reason = "tests and bench each use a part")]

use std::collections::VecDeque;
use std::time::Duration;

use camera_field::Camera;
use fieldlod_bake::{BakeConfig, bake_mesh, fixtures};
use fieldlod_hierarchy::{BakedFile, BakedPrimitive, PageOptions, PagedFile, PagedMesh};
use fieldlod_select::{
    AdvancedSettings, InstanceId, LodSettings, MeshId, Offscreen, Scene, Selector, View,
};
use fieldlod_stream::{Residency, StreamMeshId, StreamPageId, StreamSettings};
use glam::{Affine3A, Mat4, Vec2, Vec3};

pub(crate) const FRAMES_A_SECOND: f64 = 60.0;
/// Between rocks of a radius of about one, in world units.
const SPACING: f32 = 4.0;

/// Reads one page after the other at a rate; each begins to arrive a latency after it was asked for.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Disk {
    pub(crate) bytes_a_second: f64,
    pub(crate) latency_seconds: f64,
}

impl Disk {
    /// At once.
    pub(crate) const IDEAL: Self = Self {
        bytes_a_second: f64::INFINITY,
        latency_seconds: 0.0,
    };
}

/// The tables of contents of so many rocks of `20 · 4^subdivisions` triangles, of which `different` were baked.
pub(crate) fn rocks(
    count: usize,
    different: u32,
    subdivisions: u32,
    page_bytes: u32,
) -> Vec<PagedMesh> {
    let config = BakeConfig {
        measure_deviation: false,
        ..BakeConfig::default()
    };
    let paged = (0..different).map(|seed| {
        let hierarchy =
            bake_mesh(&fixtures::rock(subdivisions, seed), &config).expect("a sound mesh");
        let file = BakedFile {
            primitives: vec![BakedPrimitive::new(0, 0, "rock", hierarchy)],
        };
        let options = PageOptions {
            page_bytes,
            ..PageOptions::default()
        };
        let bytes = PagedFile::to_bytes(&file, options);
        let mut read = PagedFile::from_contents(&bytes).expect("it was just written");
        read.meshes.swap_remove(0)
    });
    let different: Vec<PagedMesh> = paged.collect();
    (0..count)
        .map(|index| different[index % different.len()].clone())
        .collect()
}

/// What a frame was like.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct FrameReport {
    /// Pages that were wanted and absent.
    pub(crate) missing: u32,
    /// The most that any of those lacked, in pixels.
    pub(crate) missing_px: f32,
    pub(crate) gpu_bytes: u64,
    pub(crate) loading_bytes: u64,
    pub(crate) read_bytes: u64,
    pub(crate) coarsening: f32,
    pub(crate) triangles: u64,
}

/// The world, one view of it, and its disk.
pub(crate) struct World {
    pub(crate) scene: Scene,
    pub(crate) selector: Selector,
    pub(crate) residency: Residency,
    pub(crate) settings: LodSettings,
    pub(crate) meshes: Vec<(PagedMesh, MeshId, StreamMeshId)>,
    pub(crate) instances: Vec<InstanceId>,
    disk: Disk,
    seconds: f64,
    /// Pages on their way, with when they arrive.
    arriving: VecDeque<(f64, StreamPageId)>,
    /// Pages that cannot be read.
    pub(crate) broken: Vec<StreamPageId>,
    /// Every load and eviction: when, and whether it was a load.
    pub(crate) log: Vec<(u64, StreamPageId, bool)>,
    frame: u64,
}

impl World {
    pub(crate) fn new(meshes: &[PagedMesh], settings: StreamSettings, disk: Disk) -> Self {
        let mut scene = Scene::default();
        let mut residency = Residency::new(settings);
        let side = (meshes.len() as f32).sqrt().ceil() as usize;
        let mut instances = Vec::new();
        let mut placed = Vec::new();
        for (index, mesh) in meshes.iter().enumerate() {
            let id = scene.add_mesh(&mesh.graph);
            scene.set_available(id, |_| false);
            let place = Vec3::new((index % side) as f32, 0.0, (index / side) as f32) * SPACING;
            instances.push(scene.add_instance(id, Affine3A::from_translation(place), 1.0));
            placed.push((mesh.clone(), id, residency.add_mesh(mesh)));
        }
        scene.update();
        Self {
            scene,
            selector: Selector::default(),
            residency,
            settings: LodSettings {
                advanced: AdvancedSettings {
                    // What is beside the view is kept for when it turns there.
                    offscreen: Offscreen::OnAxis { bias: 1.0 },
                    ..AdvancedSettings::default()
                },
                ..LodSettings::with_error_px(1.0)
            },
            meshes: placed,
            instances,
            disk,
            seconds: 0.0,
            arriving: VecDeque::new(),
            broken: Vec::new(),
            log: Vec::new(),
            frame: 0,
        }
    }

    /// One frame from `eye`, which looks at `target`.
    pub(crate) fn frame(&mut self, eye: Vec3, target: Vec3) -> FrameReport {
        self.frame += 1;
        self.seconds += 1.0 / FRAMES_A_SECOND;
        self.receive();
        // The cut, at the threshold that memory allows.
        let error_px = self
            .settings
            .error_px
            .map(|px| px * self.residency.coarsening());
        let settings = LodSettings {
            error_px,
            ..self.settings
        };
        self.selector
            .select(&self.scene, &view(eye, target), &settings);
        let mut report = FrameReport::default();
        let (residency, meshes) = (&mut self.residency, &self.meshes);
        self.selector.demand(&self.scene, |demand| {
            let mesh = meshes.iter().find(|(_, id, _)| *id == demand.mesh);
            let stream = mesh.expect("all meshes are streamed").2;
            residency.demand(stream, demand.group, demand.missing_px);
            report.missing_px = report.missing_px.max(demand.missing_px.unwrap_or(0.0));
        });
        let read_bytes = self.obey();
        let statistics = self.residency.statistics();
        FrameReport {
            missing: statistics.missing_pages,
            gpu_bytes: statistics.resident_bytes + statistics.loading_gpu_bytes,
            loading_bytes: statistics.loading_bytes,
            read_bytes,
            coarsening: self.residency.coarsening(),
            triangles: self.selector.triangle_count(),
            ..report
        }
    }

    /// Does what residency asks for. Returns the bytes that are to be read.
    fn obey(&mut self) -> u64 {
        let orders = self
            .residency
            .update(Duration::from_secs_f64(1.0 / FRAMES_A_SECOND));
        let mut changed: Vec<StreamMeshId> = orders.evict.iter().map(|page| page.mesh).collect();
        self.log
            .extend(orders.evict.iter().map(|&page| (self.frame, page, false)));
        let mut read_bytes = 0;
        for page in orders.load {
            self.log.push((self.frame, page, true));
            let bytes = &self.meshes[self.place(page.mesh)].0.pages[page.page as usize].bytes;
            let length = bytes.end - bytes.start;
            let free_at = self.arriving.back().map_or(self.seconds, |(at, _)| *at);
            let starts = free_at.max(self.seconds + self.disk.latency_seconds);
            let ends = starts + length as f64 / self.disk.bytes_a_second;
            self.arriving.push_back((ends, page));
            read_bytes += length;
        }
        self.tell_scene(&mut changed);
        read_bytes
    }

    /// Takes what has arrived.
    fn receive(&mut self) {
        let mut changed = Vec::new();
        while let Some((_, page)) = self.arriving.pop_front_if(|(at, _)| *at <= self.seconds) {
            if self.broken.contains(&page) {
                self.residency.set_failed(page);
            } else if self.residency.set_loaded(page) {
                changed.push(page.mesh);
            }
        }
        self.tell_scene(&mut changed);
    }

    fn tell_scene(&mut self, changed: &mut Vec<StreamMeshId>) {
        changed.sort_unstable();
        changed.dedup();
        for &stream in &*changed {
            let (_, mesh, _) = self.meshes[self.place(stream)];
            let residency = &self.residency;
            self.scene
                .set_available(mesh, |group| residency.is_at_hand(stream, group));
        }
    }

    fn place(&self, stream: StreamMeshId) -> usize {
        let place = self.meshes.iter().position(|(_, _, id)| *id == stream);
        place.expect("all meshes are streamed")
    }

    /// Whether each instance draws units that are at hand, and covers its surface: a cut.
    pub(crate) fn draws_whole_cuts(&self) -> bool {
        self.instances
            .iter()
            .zip(&self.meshes)
            .all(|(&instance, (mesh, _, stream))| {
                let units = self.selector.units(&self.scene, instance);
                let consumer = |unit: &u32| mesh.graph.units[*unit as usize].consumed_by;
                // The coarsest cut waits for its first page.
                let at_hand = |unit: &u32| {
                    let group = consumer(unit);
                    mesh.page_of(group) == 0 || self.residency.is_at_hand(*stream, group)
                };
                let mut refined: Vec<bool> = vec![false; mesh.graph.groups.len()];
                units
                    .iter()
                    .for_each(|unit| refined[consumer(unit) as usize] = true);
                mesh.graph.close_refinement(&mut refined);
                let whole = mesh.graph.drawn_units(&refined).map(|unit| unit as u32);
                units.iter().all(at_hand) && whole.eq(units.iter().copied())
            })
    }
}

pub(crate) fn view(eye: Vec3, target: Vec3) -> View {
    let projection = Mat4::perspective_infinite_reverse_rh(1.0, 16.0 / 9.0, 0.1);
    let camera = Camera::from_projection(&projection, Vec2::new(1280.0, 720.0));
    let world_from_view = Mat4::look_at_rh(eye, target, Vec3::Y).inverse();
    View::new(
        camera.expect("a sound camera"),
        &Affine3A::from_mat4(world_from_view),
    )
}
