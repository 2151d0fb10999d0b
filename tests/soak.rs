//! A world with random changes, and a simple model of what must be drawn.

use std::any::TypeId;
use std::collections::{HashMap, HashSet};

use bevy::camera::RenderTarget;
use bevy::camera::visibility::VisibleEntities;
use bevy::prelude::*;
use bevy_fieldlod::LodUnit;
use bevy_fieldlod::prelude::*;
use fieldlod_hierarchy::Random;

use crate::apps::{bevy_mesh, rendererless_app, run_until_ready, shared_cache};
use crate::rock;

/// An object of the model: what was spawned, and whether it is shown.
#[derive(Clone, Copy, Debug)]
struct Object {
    entity: Entity,
    is_shown: bool,
}

/// Numbers of entities and assets of a world.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Counts {
    /// All entities.
    pub entities: usize,
    /// All meshes.
    pub meshes: usize,
}

/// A world with two cameras and a random change in each frame.
#[derive(Debug)]
pub struct Soak {
    app: App,
    sources: Vec<Handle<Mesh>>,
    objects: Vec<Object>,
    cameras: [Entity; 2],
    /// Whether each camera has pixels to draw.
    has_pixels: [bool; 2],
    surfaces: ClosedSurfaces,
    random: Random,
    /// Units that cameras drew, over all frames.
    pub units_drawn: u64,
}

const MOST_OBJECTS: usize = 24;
const KINDS: [LodKind; 2] = [LodKind::Auto, LodKind::Clusters];

impl Soak {
    /// A world without objects and meshes. Equal seeds make equal changes.
    pub fn new(seed: u64) -> Self {
        let mut app = rendererless_app();
        let world = app.world_mut();
        world.resource_mut::<FieldLodAppConfig>().cache_folder = Some(shared_cache());
        let cameras = [40.0, 120.0].map(|distance| {
            let pose = Transform::from_xyz(0.0, 0.0, distance);
            let target = RenderTarget::None {
                size: UVec2::new(1280, 720),
            };
            let fine = FieldLodCamera::with_error_px(0.2);
            world.spawn((Camera3d::default(), fine, target, pose)).id()
        });
        let mut soak = Self {
            app,
            sources: Vec::new(),
            objects: Vec::new(),
            cameras,
            has_pixels: [true; 2],
            surfaces: ClosedSurfaces::default(),
            random: Random::new(seed),
            units_drawn: 0,
        };
        soak.app.update();
        soak
    }

    /// Numbers of entities and assets.
    pub fn counts(&mut self) -> Counts {
        let world = self.app.world_mut();
        Counts {
            entities: world.query::<Entity>().iter(world).count(),
            meshes: world.resource::<Assets<Mesh>>().len(),
        }
    }

    /// Makes one change, draws a frame and checks what it drew.
    ///
    /// # Panics
    /// If the frame drew other objects than the model expects.
    pub fn step(&mut self) {
        self.change_something();
        self.app.update();
        self.check();
    }

    /// Adds small meshes, props and large meshes, and prepares their levels of detail. No object remains.
    pub fn fill(&mut self) {
        let world = self.app.world_mut();
        for (subdivisions, seed) in [(2, 1), (3, 2), (4, 3), (5, 4)] {
            let mut meshes = world.resource_mut::<Assets<Mesh>>();
            let source = meshes.add(bevy_mesh(&rock(subdivisions, seed)));
            for kind in KINDS {
                world.spawn((Mesh3d(source.clone()), AutoLod::of_kind(kind)));
            }
            self.sources.push(source);
        }
        run_until_ready(&mut self.app, (4 * KINDS.len()) as u32);
        let world = self.app.world_mut();
        let mut marked = world.query_filtered::<Entity, With<AutoLod>>();
        let marked: Vec<Entity> = marked.iter(world).collect();
        marked.into_iter().for_each(|entity| {
            world.despawn(entity);
        });
    }

    /// Despawns all objects, drops their meshes, and waits until all units are despawned.
    pub fn clear(&mut self) {
        for object in std::mem::take(&mut self.objects) {
            self.app.world_mut().despawn(object.entity);
        }
        self.sources.clear();
        // Unused units are despawned after 60 frames.
        (0..64).for_each(|_| self.app.update());
    }

    fn change_something(&mut self) {
        match self.random.index(12) {
            0 | 1 => self.spawn(),
            2 => self.despawn(),
            3 => self.clone_one(),
            4 => self.change(|object, world| {
                let mut pose = world.get_mut::<Transform>(object.entity).unwrap();
                pose.translation.z = -20.0 - pose.translation.z;
            }),
            5 => self.change(|object, world| {
                object.is_shown = !object.is_shown;
                let visibility = if object.is_shown {
                    Visibility::Inherited
                } else {
                    Visibility::Hidden
                };
                world.entity_mut(object.entity).insert(visibility);
            }),
            6 => self.change(|object, world| {
                let mut entity = world.entity_mut(object.entity);
                if entity.take::<AutoLod>().is_none() {
                    entity.insert(AutoLod::default());
                }
            }),
            7 => self.change(|object, world| {
                world.entity_mut(object.entity).despawn_children();
            }),
            8 => self.minimize(),
            9 => {
                let camera = self.cameras[self.random.index(2)];
                let distance = 30.0 + self.random.index(200) as f32;
                let world = self.app.world_mut();
                let mut pose = world.get_mut::<Transform>(camera).unwrap();
                pose.translation.z = distance;
            }
            10 if self.random.index(20) == 0 => self.change_mesh(),
            _ => {}
        }
    }

    fn spawn(&mut self) {
        if self.objects.len() >= MOST_OBJECTS {
            return self.despawn();
        }
        let source = self.random.index(self.sources.len());
        let mesh = Mesh3d(self.sources[source].clone());
        let place = [16, 10, 20].map(|size| self.random.index(size) as f32);
        let place = Vec3::from(place) - Vec3::new(8.0, 5.0, 20.0);
        let kind = KINDS[self.random.index(KINDS.len())];
        let bundle = (
            mesh,
            AutoLod::of_kind(kind),
            Transform::from_translation(place),
        );
        let entity = self.app.world_mut().spawn(bundle).id();
        self.objects.push(Object {
            entity,
            is_shown: true,
        });
    }

    fn despawn(&mut self) {
        if !self.objects.is_empty() {
            let index = self.random.index(self.objects.len());
            let object = self.objects.swap_remove(index);
            self.app.world_mut().despawn(object.entity);
        }
    }

    fn clone_one(&mut self) {
        if self.objects.is_empty() || self.objects.len() >= MOST_OBJECTS {
            return;
        }
        let with_children = self.random.index(2) == 0;
        let index = self.random.index(self.objects.len());
        let original = self.objects[index];
        let mut entity = self.app.world_mut().entity_mut(original.entity);
        let clone = entity.clone_and_spawn_with_opt_out(move |cloner| {
            cloner.linked_cloning(with_children);
        });
        self.objects.push(Object {
            entity: clone,
            ..original
        });
    }

    fn change(&mut self, change: impl FnOnce(&mut Object, &mut World)) {
        if !self.objects.is_empty() {
            let index = self.random.index(self.objects.len());
            change(&mut self.objects[index], self.app.world_mut());
        }
    }

    fn minimize(&mut self) {
        let which = self.random.index(2);
        self.has_pixels[which] = !self.has_pixels[which];
        let size = UVec2::new(1280, 720) * u32::from(self.has_pixels[which]);
        let changed = (RenderTarget::None { size }, Projection::default());
        let world = self.app.world_mut();
        world.entity_mut(self.cameras[which]).insert(changed);
    }

    fn change_mesh(&mut self) {
        if !self.sources.is_empty() {
            let source = self.random.index(self.sources.len());
            let mut meshes = self.app.world_mut().resource_mut::<Assets<Mesh>>();
            let mesh = meshes.get_mut(&self.sources[source]);
            mesh.expect("`sources` has the handle").into_inner();
        }
    }

    /// Checks that each camera draws exactly the shown objects, each whole and once.
    fn check(&mut self) {
        let world = self.app.world();
        for (camera, has_pixels) in self.cameras.into_iter().zip(self.has_pixels) {
            if !has_pixels {
                continue;
            }
            let visible = world.get::<VisibleEntities>(camera).unwrap();
            let mut units: HashMap<Entity, Vec<Entity>> = HashMap::new();
            let mut whole = HashSet::new();
            for &entity in visible.get(TypeId::of::<Mesh3d>()) {
                match world.get::<LodUnit>(entity) {
                    Some(unit) => units.entry(unit.object).or_default().push(entity),
                    None => assert!(whole.insert(entity), "{entity} is drawn twice"),
                }
            }
            for object in &self.objects {
                let is_whole = whole.remove(&object.entity);
                let units = units.remove(&object.entity).unwrap_or_default();
                if !object.is_shown {
                    assert!(!is_whole && units.is_empty(), "{object:?} is hidden");
                    continue;
                }
                assert_eq!(is_whole, units.is_empty(), "{object:?}: {units:?}");
                self.units_drawn += units.len() as u64;
                self.surfaces.check(world, &units);
            }
            assert!(whole.is_empty() && units.is_empty(), "{whole:?} {units:?}");
        }
    }
}

/// Sets of meshes that form a closed surface. The search for open edges is slow, and depends on the meshes alone.
#[derive(Resource, Debug, Default)]
pub struct ClosedSurfaces(HashSet<Vec<AssetId<Mesh>>>);

impl ClosedSurfaces {
    /// Checks that entities form a closed surface, unless the same meshes were checked earlier.
    ///
    /// # Panics
    /// If the surface has a hole, or an entity has no mesh in main memory.
    pub fn check(&mut self, world: &World, drawn: &[Entity]) {
        let mesh = |drawn: &Entity| world.get::<Mesh3d>(*drawn).unwrap().id();
        let mut meshes: Vec<AssetId<Mesh>> = drawn.iter().map(mesh).collect();
        meshes.sort_unstable();
        if self.0.insert(meshes) {
            assert_eq!(open_edges(world, drawn), 0, "{drawn:?} have holes");
        }
    }
}

/// The number of edges of the surface of `drawn` with more triangles on one side than on the other. It is 0 for a
/// closed surface.
///
/// # Panics
/// If an entity has no mesh in main memory, or the mesh has no positions and indices.
pub fn open_edges(world: &World, drawn: &[Entity]) -> usize {
    let meshes = world.resource::<Assets<Mesh>>();
    let mut sides: HashMap<[[u32; 3]; 2], i32> = HashMap::new();
    for &entity in drawn {
        let mesh = meshes.get(world.get::<Mesh3d>(entity).unwrap()).unwrap();
        let positions = mesh.attribute(Mesh::ATTRIBUTE_POSITION).unwrap();
        let positions = positions.as_float3().unwrap();
        let corners: Vec<[u32; 3]> = mesh
            .indices()
            .unwrap()
            .iter()
            .map(|corner| positions[corner].map(f32::to_bits))
            .collect();
        for triangle in corners.chunks_exact(3) {
            for (from, to) in [(0, 1), (1, 2), (2, 0)] {
                let (from, to) = (triangle[from], triangle[to]);
                // The triangles on both sides of an edge use it in opposite directions.
                let (edge, side) = if from < to {
                    ([from, to], 1)
                } else {
                    ([to, from], -1)
                };
                *sides.entry(edge).or_default() += side;
            }
        }
    }
    sides.values().filter(|&&side| side != 0).count()
}
