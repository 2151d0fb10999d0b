//! A Bevy world that follows a [`State`].

use std::any::TypeId;
use std::collections::{BTreeMap, HashMap, HashSet};
use std::ops::RangeInclusive;

use bevy::camera::RenderTarget;
use bevy::camera::primitives::{Aabb, Frustum};
use bevy::camera::visibility::{CascadesVisibleEntities, RenderLayers, VisibleEntities};
use bevy::ecs::entity_disabling::Disabled;
use bevy::ecs::system::RunSystemOnce;
use bevy::prelude::*;
use bevy::render::RenderApp;
use bevy::render::sync_world::{MainEntity, RenderEntity};
use bevy::render::view::RenderVisibleEntities;
use bevy_fieldlod::LodUnit;
use bevy_fieldlod::prelude::*;

use super::state::{
    CAMERAS, Camera, Detail, LIGHTS, Light, Look, MATERIALS, MESHES, Mark, OBJECTS, Object, ROOTS,
    Root, State, Step,
};
use super::surfaces::ClosedSurfaces;
use crate::apps::bevy_mesh;
use crate::rock;

/// Takes something from a camera that Bevy draws it by.
pub type Loss = for<'a, 'w> fn(&'a mut EntityWorldMut<'w>) -> &'a mut EntityWorldMut<'w>;

/// Ways in which a camera entity stops being a view.
pub const LOSSES: [Loss; 7] = [
    |camera| camera.remove::<(Camera3d, bevy::camera::Camera)>(),
    |camera| camera.remove::<Frustum>(),
    |camera| camera.remove::<GlobalTransform>(),
    |camera| camera.remove::<VisibleEntities>(),
    |camera| camera.remove::<RenderTarget>(),
    |camera| camera.insert(Camera2d),
    |camera| camera.insert(Disabled),
];

/// Makes an entity a camera, also after any [`Loss`].
pub fn restore_camera(camera: &mut EntityWorldMut, size: UVec2) {
    camera.remove::<(Camera2d, Camera3d, Disabled)>();
    camera.insert((Camera3d::default(), RenderTarget::None { size }));
}

/// The file that streamed objects are read from.
pub(super) const PAGES: &str = "rock.fieldpages";

type Material = MeshMaterial3d<StandardMaterial>;

/// A world that follows a state, step by step.
#[derive(Debug)]
pub(super) struct Soak {
    app: App,
    state: State,
    cameras: [Option<Entity>; CAMERAS],
    lights: [Option<Entity>; LIGHTS],
    meshes: [Option<Handle<Mesh>>; MESHES],
    materials: [Handle<StandardMaterial>; MATERIALS],
    roots: [Option<Entity>; ROOTS],
    objects: [Option<Entity>; OBJECTS],
    surfaces: ClosedSurfaces,
    /// Units that cameras drew, over all frames.
    pub(super) units_drawn: u64,
}

/// What one camera draws of one object: its levels, and the level and box of each unit.
type Drawn = (Option<RangeInclusive<u32>>, Vec<(u32, [u32; 3])>);

/// What the cameras of a world draw.
#[derive(Debug, Default, PartialEq)]
pub(super) struct Views {
    /// Triangles that are drawn and of all sources, and units, for each camera.
    stats: BTreeMap<usize, (u64, u64, u32)>,
    /// By camera and object.
    drawn: BTreeMap<(usize, usize), Drawn>,
}

impl Soak {
    /// A world in this state.
    pub(super) fn new(mut app: App, state: &State) -> Self {
        let mut materials = app.world_mut().resource_mut::<Assets<StandardMaterial>>();
        let materials = std::array::from_fn(|_| materials.add(StandardMaterial::default()));
        let mut soak = Self {
            app,
            state: State::default(),
            cameras: default(),
            lights: default(),
            meshes: default(),
            materials,
            roots: default(),
            objects: default(),
            surfaces: default(),
            units_drawn: 0,
        };
        soak.change_to(state.clone());
        soak
    }

    pub(super) fn state(&self) -> &State {
        &self.state
    }

    /// Makes a change, draws a frame and checks what it drew.
    pub(super) fn step(&mut self, step: Step) {
        let mut state = self.state.clone();
        state.apply(step);
        match step {
            Step::Material(at) => {
                let mut materials = self.app.world_mut().resource_mut::<Assets<_>>();
                self.materials[at] = materials.add(StandardMaterial::default());
                let objects = self.state.objects.iter().zip(self.objects);
                let users = objects
                    .filter(|(object, _)| object.is_some_and(|one| one.material == Some(at)));
                for entity in users.filter_map(|(_, entity)| entity).collect::<Vec<_>>() {
                    let material = MeshMaterial3d(self.materials[at].clone());
                    self.app.world_mut().entity_mut(entity).insert(material);
                }
            }
            Step::DespawnUnits(at) => {
                if let Some(object) = self.objects[at] {
                    self.app.world_mut().entity_mut(object).despawn_children();
                }
            }
            // A new mesh takes the slot, even if it has the same shape.
            Step::Mesh(at, _) => self.state.meshes[at] = None,
            _ => {}
        }
        self.change_to(state);
        self.app.update();
        self.check();
    }

    /// Changes the world from one state to another.
    fn change_to(&mut self, state: State) {
        let old = std::mem::replace(&mut self.state, state);
        for at in 0..MESHES {
            let shape = self.state.meshes[at];
            if shape != old.meshes[at] || shape.is_some() != self.meshes[at].is_some() {
                let mut meshes = self.app.world_mut().resource_mut::<Assets<Mesh>>();
                self.meshes[at] =
                    shape.map(|shape| meshes.add(bevy_mesh(&rock(shape.subdivisions, shape.seed))));
            }
        }
        for at in 0..ROOTS {
            if self.state.roots[at] != old.roots[at] {
                self.change_root(at);
            }
        }
        for at in 0..OBJECTS {
            self.change_object(at, old.objects[at]);
        }
        for at in 0..CAMERAS {
            if self.state.cameras[at] != old.cameras[at] {
                self.change_camera(at, old.cameras[at]);
            }
        }
        for at in 0..LIGHTS {
            if self.state.lights[at] != old.lights[at] {
                self.change_light(at);
            }
        }
    }

    fn change_root(&mut self, at: usize) {
        let world = self.app.world_mut();
        let Some(Root { has_lod, is_shown }) = self.state.roots[at] else {
            if let Some(root) = self.roots[at].take() {
                let children = world.get::<Children>(root).into_iter().flatten();
                let children: HashSet<Entity> = children.copied().collect();
                world.despawn(root);
                for object in &mut self.objects {
                    object.take_if(|entity| children.contains(entity));
                }
            }
            return;
        };
        let root = *self.roots[at].get_or_insert_with(|| world.spawn(Transform::default()).id());
        let mut root = world.entity_mut(root);
        root.insert(visibility(is_shown));
        if has_lod {
            root.insert_if_new(AutoLod::default());
        } else {
            root.remove::<AutoLod>();
        }
    }

    fn change_object(&mut self, at: usize, old: Option<Object>) {
        let world = self.app.world_mut();
        let Some(object) = self.state.objects[at] else {
            if let Some(entity) = self.objects[at].take() {
                world.despawn(entity);
            }
            return;
        };
        // A streamed object is spawned again: its components come and go with those of the plugin.
        let is_streamed = object.look == Look::Streamed;
        let old = old.filter(|old| (old.look == Look::Streamed) == is_streamed);
        if old.is_none()
            && let Some(entity) = self.objects[at].take()
        {
            world.despawn(entity);
        }
        let entity = *self.objects[at].get_or_insert_with(|| world.spawn_empty().id());
        let assets = world.resource::<AssetServer>().clone();
        let mut entity = world.entity_mut(entity);
        if old.is_none_or(|old| old.place != object.place) {
            let [x, y, z] =
                [object.place % 4, object.place / 4 % 4, object.place / 16].map(f32::from);
            entity.insert(Transform::from_xyz(x * 4.0 - 6.0, y * 2.5 - 4.0, -z));
        }
        if old.is_none_or(|old| old.is_shown != object.is_shown) {
            entity.insert(visibility(object.is_shown));
        }
        if old.is_none_or(|old| old.layers != object.layers) {
            entity.insert(layers(object.layers));
        }
        if old.is_none_or(|old| old.material != object.material) {
            match object.material {
                Some(material) => entity.insert(MeshMaterial3d(self.materials[material].clone())),
                None => entity.remove::<Material>(),
            };
        }
        if old.is_none_or(|old| old.root != object.root) {
            match object.root.and_then(|root| self.roots[root]) {
                Some(root) => entity.insert(ChildOf(root)),
                None => entity.remove::<ChildOf>(),
            };
        }
        match object.look {
            Look::Streamed if old.is_some() => {}
            Look::Streamed => {
                // Without a mark of its own, it would have that of a root at the time when its file is loaded.
                let streamed = LodMesh3d::new(assets.load(PAGES), 0, 0);
                entity.insert((streamed, AutoLod::default()));
            }
            Look::Mesh(mesh, mark) => {
                match &self.meshes[mesh] {
                    Some(mesh) if entity.get::<Mesh3d>().is_some_and(|old| old.0 == *mesh) => {}
                    Some(mesh) => {
                        entity.insert(Mesh3d(mesh.clone()));
                    }
                    None => {
                        entity.remove::<Mesh3d>();
                    }
                }
                if old.is_none_or(|old| old.look != object.look) {
                    entity.remove::<(AutoLod, NoLod)>();
                    match mark {
                        Mark::None => {}
                        Mark::No => {
                            entity.insert(NoLod);
                        }
                        Mark::Auto => {
                            entity.insert(AutoLod::default());
                        }
                        Mark::Clusters => {
                            entity.insert(AutoLod::of_kind(LodKind::Clusters));
                        }
                    }
                }
            }
        }
    }

    fn change_camera(&mut self, at: usize, old: Option<Camera>) {
        let world = self.app.world_mut();
        let Some(camera) = self.state.cameras[at] else {
            if let Some(entity) = self.cameras[at].take() {
                world.despawn(entity);
            }
            return;
        };
        let entity = *self.cameras[at].get_or_insert_with(|| world.spawn_empty().id());
        let mut entity = world.entity_mut(entity);
        if let Some(loss) = camera.lost {
            if old.is_some_and(|old| old.lost.is_none()) {
                LOSSES[loss](&mut entity);
            }
            return;
        }
        if old.is_none_or(|old| old.lost.is_some()) {
            restore_camera(&mut entity, UVec2::new(320, 180));
        }
        let mut settings = match camera.detail {
            Detail::Fine => FieldLodCamera::with_error_px(0.1),
            Detail::Coarse => FieldLodCamera::with_error_px(1.0),
            Detail::Held => FieldLodCamera::with_error_px(0.3),
            Detail::Full => FieldLodCamera::at_level(0),
        };
        if camera.detail != Detail::Held {
            // A cut then depends on the state alone.
            (
                settings.advanced.hysteresis,
                settings.advanced.edge_hysteresis,
            ) = (1.0, 0.0);
        }
        let pose = Transform::from_xyz(0.0, 0.0, 30.0 + 8.0 * f32::from(camera.distance));
        entity.insert((pose, settings, layers(camera.layers)));
        let mut active = entity.get_mut::<bevy::camera::Camera>().expect("a camera");
        active.is_active = camera.is_active;
    }

    fn change_light(&mut self, at: usize) {
        let world = self.app.world_mut();
        if let Some(light) = self.lights[at].take() {
            world.despawn(light);
        }
        let Some(Light {
            is_sun,
            has_shadows,
            layers: on,
        }) = self.state.lights[at]
        else {
            return;
        };
        let pose = Transform::from_xyz(0.0, 9.0, 4.0).looking_at(Vec3::ZERO, Vec3::Y);
        let mut light = world.spawn((pose, layers(on)));
        if is_sun {
            light.insert(DirectionalLight {
                shadow_maps_enabled: has_shadows,
                ..default()
            });
        } else {
            light.insert(PointLight {
                shadow_maps_enabled: has_shadows,
                ..default()
            });
        }
        self.lights[at] = Some(light.id());
    }

    /// The cameras that draw.
    fn views(&self) -> impl Iterator<Item = (usize, Entity, Camera)> {
        let cameras = self.state.cameras.iter().zip(self.cameras);
        let cameras = (0..).zip(cameras);
        let cameras = cameras.filter_map(|(at, (camera, entity))| Some((at, entity?, (*camera)?)));
        cameras.filter(|(_, _, camera)| camera.lost.is_none() && camera.is_active)
    }

    /// The objects that are drawn on some layers.
    fn shown_on(&self, layers: u8) -> impl Iterator<Item = (usize, Entity)> {
        let objects = (0..).zip(self.state.objects.iter().zip(self.objects));
        objects.filter_map(move |(at, (object, entity))| {
            let (object, entity) = ((*object)?, entity?);
            let root = object.root.and_then(|root| self.state.roots[root]);
            let is_shown = object.is_shown && root.is_none_or(|root| root.is_shown);
            // The mesh of a streamed object is inserted once its file is loaded.
            let has_mesh = self.app.world().get::<Mesh3d>(entity).is_some();
            (is_shown && has_mesh && object.layers & layers != 0).then_some((at, entity))
        })
    }

    /// The entities in the list of a camera. Bevy 0.19.1 leaves entities there whose `Mesh3d` was removed.
    fn listed(&self, camera: Entity) -> Vec<Entity> {
        let mut listed = self.listed_with_meshless(camera);
        listed.retain(|entity| self.app.world().get::<Mesh3d>(*entity).is_some());
        listed
    }

    fn listed_with_meshless(&self, camera: Entity) -> Vec<Entity> {
        let (world, class) = (self.app.world(), TypeId::of::<Mesh3d>());
        let Some(render_app) = self.app.get_sub_app(RenderApp) else {
            let visible = world.get::<VisibleEntities>(camera).expect("a camera");
            return visible.get(class).to_vec();
        };
        let of = world
            .get::<RenderEntity>(camera)
            .expect("an extracted camera");
        let visible = render_app.world().get::<RenderVisibleEntities>(of.id());
        let lists = visible.and_then(|visible| visible.classes.get(&class));
        let lists = lists.into_iter();
        let listed = lists.flat_map(|list| {
            let by_cpu = list.entities_cpu_culling.iter().map(|(_, entity)| entity);
            by_cpu.chain(list.entities_gpu_culling.keys())
        });
        listed.map(MainEntity::id).collect()
    }

    /// The entities in the cascades of all suns for a camera.
    fn cast(&self, camera: Entity) -> HashSet<Entity> {
        let suns = self.lights.iter().flatten();
        let suns = suns.filter_map(|sun| self.app.world().get::<CascadesVisibleEntities>(*sun));
        let cascades = suns.flat_map(|sun| sun.entities.get(&camera).into_iter().flatten());
        cascades
            .flat_map(|list| list.entities.iter().copied())
            .collect()
    }

    /// Checks that each camera draws exactly the shown objects, each whole and once, with its material.
    fn check(&mut self) {
        let views: Vec<_> = self.views().collect();
        for (_, camera, Camera { layers, .. }) in views {
            let world = self.app.world();
            let mut units: HashMap<Entity, Vec<Entity>> = HashMap::new();
            let mut whole = HashSet::new();
            let cast = self.cast(camera);
            for entity in self.listed(camera) {
                match world.get::<LodUnit>(entity) {
                    Some(unit) => units.entry(unit.object).or_default().push(entity),
                    // Bevy 0.19.1 lists an entity twice if its `Mesh3d` was removed and inserted.
                    None => {
                        whole.insert(entity);
                    }
                }
            }
            let shown: Vec<_> = self.shown_on(layers).collect();
            for (at, entity) in shown {
                let is_whole = whole.remove(&entity);
                let units = units.remove(&entity).unwrap_or_default();
                assert_eq!(is_whole, units.is_empty(), "object {at}: {units:?}");
                // Shadows have the cut of their camera.
                let cast_units = cast
                    .iter()
                    .filter(|one| object_of(world, **one) == Some(entity));
                assert!(
                    cast_units.into_iter().all(|unit| units.contains(unit)),
                    "object {at}"
                );
                assert!(is_whole || !cast.contains(&entity), "object {at}");
                self.units_drawn += units.len() as u64;
                let material = world.get::<Material>(entity);
                let is_same = |unit: &Entity| world.get::<Material>(*unit) == material;
                assert!(units.iter().all(is_same), "object {at}");
                // With a renderer, meshes of units are on the GPU only.
                if self.app.get_sub_app(RenderApp).is_none() {
                    self.surfaces.check(world, &units);
                }
            }
            assert!(whole.is_empty() && units.is_empty(), "{whole:?} {units:?}");
        }
    }

    /// Draws frames until no change is pending. Cameras with a hysteresis select anew.
    pub(super) fn settle(&mut self) {
        for is_active in [false, true] {
            for (_, entity, _) in self
                .views()
                .filter(|one| one.2.detail == Detail::Held)
                .collect::<Vec<_>>()
            {
                let world = self.app.world_mut();
                let mut camera = world
                    .get_mut::<bevy::camera::Camera>(entity)
                    .expect("a view");
                camera.is_active = is_active;
            }
            let mut quiet = 0;
            for _ in 0..2_000 {
                self.app.update();
                quiet = if self.is_quiet() { quiet + 1 } else { 0 };
                if quiet == 3 {
                    break;
                }
            }
            let progress = self.app.world().resource::<FieldLodProgress>();
            assert_eq!(quiet, 3, "the world does not settle: {progress:?}");
        }
    }

    fn is_quiet(&mut self) -> bool {
        let world = self.app.world_mut();
        let mut views = world.query::<&FieldLodViewStats>();
        let is_streaming = views.iter(world).any(|stats| stats.missing_pieces > 0);
        let mut streamed = world.query_filtered::<(), (With<LodMesh3d>, Without<Mesh3d>)>();
        let awaits_file = streamed.iter(world).next().is_some();
        let progress = world.resource::<FieldLodProgress>();
        let is_waiting = progress.waiting > 0 || progress.baking > 0;
        if is_waiting || is_streaming || awaits_file {
            // Leaves time for bakes and reads.
            std::thread::sleep(std::time::Duration::from_millis(1));
        }
        !(is_waiting || is_streaming || awaits_file)
    }

    /// What is drawn.
    pub(super) fn record(&mut self) -> Views {
        let mut views = Views::default();
        for (camera_at, camera, Camera { layers, .. }) in self.views().collect::<Vec<_>>() {
            let stats = self
                .app
                .world()
                .get::<FieldLodViewStats>(camera)
                .expect("a view");
            let counts = (
                stats.triangles_drawn,
                stats.triangles_full,
                stats.units_drawn,
            );
            views.stats.insert(camera_at, counts);
            let mut units: HashMap<Entity, Vec<(u32, [u32; 3])>> = HashMap::new();
            for entity in self.listed(camera) {
                if let Some((object, unit)) = self.unit(entity) {
                    units.entry(object).or_default().push(unit);
                }
            }
            for (at, object) in self.shown_on(layers).collect::<Vec<_>>() {
                let find = move |levels: LodLevels| levels.in_view(object, camera);
                let levels = self.app.world_mut().run_system_once(find).expect("it runs");
                let mut units = units.remove(&object).unwrap_or_default();
                units.sort_unstable();
                views.drawn.insert((camera_at, at), (levels, units));
            }
        }
        views
    }

    /// The object, level and box of a unit.
    fn unit(&self, entity: Entity) -> Option<(Entity, (u32, [u32; 3]))> {
        let entity = self.app.world().get_entity(entity).ok()?;
        let (unit, aabb) = (entity.get::<LodUnit>()?, entity.get::<Aabb>()?);
        Some((
            unit.object,
            (unit.level, aabb.center.to_array().map(f32::to_bits)),
        ))
    }

    /// Despawns everything, draws frames until unused units are gone, and returns the numbers of entities and meshes.
    pub(super) fn clear(&mut self) -> [usize; 2] {
        self.change_to(State::default());
        (0..70).for_each(|_| self.app.update());
        let world = self.app.world_mut();
        let entities = world.query::<Entity>().iter(world).count();
        [entities, world.resource::<Assets<Mesh>>().len()]
    }
}

/// The object of a unit.
fn object_of(world: &World, unit: Entity) -> Option<Entity> {
    world.get::<LodUnit>(unit).map(|unit| unit.object)
}

fn visibility(is_shown: bool) -> Visibility {
    if is_shown {
        Visibility::Inherited
    } else {
        Visibility::Hidden
    }
}

/// Layers by their bits.
fn layers(bits: u8) -> RenderLayers {
    RenderLayers::from_layers(
        &[0, 1]
            .into_iter()
            .filter(|layer| bits & 1 << layer != 0)
            .collect::<Vec<_>>(),
    )
}
