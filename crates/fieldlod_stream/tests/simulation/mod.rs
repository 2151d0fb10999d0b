//! A walk through a world of rocks whose pages come from a simulated disk.
#![allow(dead_code, reason = "tests and bench each use a part")]

use std::collections::{BTreeSet, VecDeque};
use std::time::Duration;

use camera_field::Camera;
use fieldlod_bake::{BakeConfig, bake_mesh, fixtures};
use fieldlod_hierarchy::{BakedFile, BakedPrimitive, PageOptions, PagedFile, PagedMesh};
use fieldlod_select::{
    AdvancedSettings, InstanceId, LodSettings, MeshId, Offscreen, Scene, Selector, View,
};
use fieldlod_stream::{Residency, StreamMeshId, StreamPageId, StreamSettings};
use glam::{Affine3A, Mat4, Vec2, Vec3};

pub(crate) const FRAMES_PER_SECOND: f64 = 60.0;
/// Distance between rocks, whose radius is about 1.
const SPACING: f32 = 4.0;

/// A simulated disk that reads pages in order, with a latency per page.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Disk {
    pub(crate) bytes_per_second: f64,
    pub(crate) latency_seconds: f64,
}

impl Disk {
    pub(crate) const IDEAL: Self = Self {
        bytes_per_second: f64::INFINITY,
        latency_seconds: 0.0,
    };
}

/// Tables of contents of `count` rocks with `20 · 4^subdivisions` triangles in pages of about `bytes` bytes. They are
/// copies of `distinct` baked rocks.
pub(crate) fn rocks(count: usize, distinct: u32, subdivisions: u32, bytes: u32) -> Vec<PagedMesh> {
    let config = BakeConfig {
        measure_deviation: false,
        ..BakeConfig::default()
    };
    let options = PageOptions {
        page_bytes: bytes,
        ..PageOptions::default()
    };
    let paged = (0..distinct).map(|seed| {
        let rock = fixtures::rock(subdivisions, seed);
        let hierarchy = bake_mesh(&rock, &config).expect("the rock is valid");
        let primitives = vec![BakedPrimitive::new(0, 0, "rock", hierarchy)];
        let bytes = PagedFile::to_bytes(&BakedFile { primitives }, options);
        let file = PagedFile::from_contents(&bytes).expect("the file is valid");
        file.meshes.into_iter().next().expect("one rock")
    });
    let distinct: Vec<PagedMesh> = paged.collect();
    distinct.iter().cycle().take(count).cloned().collect()
}

/// Measurements of a frame.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct FrameReport {
    /// Pages that were wanted and not resident.
    pub(crate) missing: u32,
    /// Largest error of a missing page, in pixels.
    pub(crate) missing_px: f32,
    pub(crate) gpu_bytes: u64,
    pub(crate) loading_bytes: u64,
    pub(crate) read_bytes: u64,
    pub(crate) coarsening: f32,
}

pub(crate) struct Rock {
    pub(crate) mesh: PagedMesh,
    pub(crate) id: MeshId,
    pub(crate) stream: StreamMeshId,
    pub(crate) instance: InstanceId,
}

/// Rocks, one view and a disk.
pub(crate) struct World {
    pub(crate) scene: Scene,
    pub(crate) selector: Selector,
    pub(crate) residency: Residency,
    pub(crate) settings: LodSettings,
    pub(crate) rocks: Vec<Rock>,
    disk: Disk,
    frame: u64,
    /// Pages that are being loaded, with the time in seconds at which each is loaded.
    loading: VecDeque<(f64, StreamPageId)>,
    /// Pages that cannot be read.
    pub(crate) broken: Vec<StreamPageId>,
    /// Loads (`true`) and evictions (`false`) with their frames.
    pub(crate) log: Vec<(u64, StreamPageId, bool)>,
}

impl World {
    pub(crate) fn new(meshes: &[PagedMesh], settings: StreamSettings, disk: Disk) -> Self {
        let mut scene = Scene::default();
        let mut residency = Residency::new(settings);
        let side = (meshes.len() as f32).sqrt().ceil() as usize;
        let place = |(index, mesh): (usize, &PagedMesh)| {
            let id = scene.add_mesh(&mesh.graph);
            scene.set_available(id, |_| false);
            let place = Vec3::new((index % side) as f32, 0.0, (index / side) as f32) * SPACING;
            Rock {
                mesh: mesh.clone(),
                id,
                stream: residency.add_mesh(mesh),
                instance: scene.add_instance(id, Affine3A::from_translation(place), 1.0),
            }
        };
        let rocks = meshes.iter().enumerate().map(place).collect();
        scene.update();
        Self {
            scene,
            selector: Selector::default(),
            residency,
            settings: LodSettings {
                advanced: AdvancedSettings {
                    // Otherwise a turning view would find only the coarsest pages of rocks beside it.
                    offscreen: Offscreen::OnAxis { bias: 1.0 },
                    ..AdvancedSettings::default()
                },
                ..LodSettings::with_error_px(1.0)
            },
            rocks,
            disk,
            frame: 0,
            loading: VecDeque::new(),
            broken: Vec::new(),
            log: Vec::new(),
        }
    }

    fn seconds(&self) -> f64 {
        self.frame as f64 / FRAMES_PER_SECOND
    }

    /// Draws a frame from `eye` towards `target`.
    pub(crate) fn frame(&mut self, eye: Vec3, target: Vec3) -> FrameReport {
        self.frame += 1;
        self.receive();
        let coarsening = self.residency.coarsening();
        let settings = LodSettings {
            error_px: self.settings.error_px.map(|px| px * coarsening),
            ..self.settings
        };
        let view = view(eye, target);
        self.selector.select(&self.scene, &view, &settings);
        let mut missing_px = 0.0f32;
        let (residency, rocks) = (&mut self.residency, &self.rocks);
        self.selector.demand(&self.scene, |demand| {
            let rock = rocks.iter().find(|rock| rock.id == demand.mesh);
            let stream = rock.expect("all meshes are rocks").stream;
            residency.demand(stream, demand.group, demand.missing_px);
            missing_px = missing_px.max(demand.missing_px.unwrap_or(0.0));
        });
        let read_bytes = self.apply_orders();
        let statistics = self.residency.statistics();
        FrameReport {
            missing: statistics.missing_pages,
            missing_px,
            gpu_bytes: statistics.resident_bytes + statistics.loading_gpu_bytes,
            loading_bytes: statistics.loading_bytes,
            read_bytes,
            coarsening: self.residency.coarsening(),
        }
    }

    /// Starts loads and applies evictions. Returns the number of bytes to read.
    fn apply_orders(&mut self) -> u64 {
        let elapsed = Duration::from_secs_f64(1.0 / FRAMES_PER_SECOND);
        let orders = self.residency.update(elapsed);
        let evictions = orders.evict.iter().map(|&page| (self.frame, page, false));
        self.log.extend(evictions);
        let mut read_bytes = 0;
        for page in orders.load {
            self.log.push((self.frame, page, true));
            let bytes = &self.rock(page.mesh).mesh.pages[page.page as usize].bytes;
            let length = bytes.end - bytes.start;
            let free_at = self.loading.back().map_or(0.0, |(at, _)| *at);
            let start = free_at.max(self.seconds() + self.disk.latency_seconds);
            let end = start + length as f64 / self.disk.bytes_per_second;
            self.loading.push_back((end, page));
            read_bytes += length;
        }
        self.update_available(orders.evict.iter().map(|page| page.mesh));
        read_bytes
    }

    fn receive(&mut self) {
        let now = self.seconds();
        let mut changed = Vec::new();
        while let Some((_, page)) = self.loading.pop_front_if(|(at, _)| *at <= now) {
            if self.broken.contains(&page) {
                self.residency.set_failed(page);
            } else if self.residency.set_loaded(page) {
                changed.push(page.mesh);
            }
        }
        self.update_available(changed.into_iter());
    }

    fn update_available(&mut self, changed: impl Iterator<Item = StreamMeshId>) {
        for stream in changed.collect::<BTreeSet<_>>() {
            let id = self.rock(stream).id;
            let residency = &self.residency;
            let is_available = |group| residency.is_resident(stream, group);
            self.scene.set_available(id, is_available);
        }
    }

    fn rock(&self, stream: StreamMeshId) -> &Rock {
        let rock = self.rocks.iter().find(|rock| rock.stream == stream);
        rock.expect("all meshes are rocks")
    }

    pub(crate) fn is_resident(&self, page: StreamPageId) -> bool {
        let groups = self.rock(page.mesh).mesh.groups_of(page.page as usize);
        self.residency.is_resident(page.mesh, groups[0])
    }

    /// Returns `true` if each rock draws a complete cut of resident units.
    pub(crate) fn draws_complete_cuts(&self) -> bool {
        self.rocks.iter().all(|rock| {
            let graph = &rock.mesh.graph;
            let units = self.selector.units(&self.scene, rock.instance);
            let consumer = |unit: &u32| graph.units[*unit as usize].consumed_by;
            // The coarsest cut is selected before its page is resident.
            let is_resident = |group| {
                rock.mesh.page_of(group) == 0 || self.residency.is_resident(rock.stream, group)
            };
            let mut refined = vec![false; graph.groups.len()];
            for unit in units {
                refined[consumer(unit) as usize] = true;
            }
            graph.close_refinement(&mut refined);
            let complete = graph.drawn_units(&refined).map(|unit| unit as u32);
            units.iter().map(consumer).all(is_resident) && complete.eq(units.iter().copied())
        })
    }
}

pub(crate) fn view(eye: Vec3, target: Vec3) -> View {
    let projection = Mat4::perspective_infinite_reverse_rh(1.0, 16.0 / 9.0, 0.1);
    let camera = Camera::from_projection(&projection, Vec2::new(1280.0, 720.0));
    let world_from_view = Mat4::look_at_rh(eye, target, Vec3::Y).inverse();
    View::new(
        camera.expect("the camera is valid"),
        &Affine3A::from_mat4(world_from_view),
    )
}
