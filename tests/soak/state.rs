//! The state of a world as plain data, and its random changes.

use proptest::option::weighted;
use proptest::prelude::*;

/// Slots of each kind. With more, fewer changes meet what earlier changes left.
pub(super) const CAMERAS: usize = 3;
pub(super) const LIGHTS: usize = 2;
pub(super) const MESHES: usize = 4;
pub(super) const MATERIALS: usize = 2;
pub(super) const ROOTS: usize = 2;
pub(super) const OBJECTS: usize = 8;

/// What a world consists of.
#[derive(Clone, Debug, Default)]
pub(super) struct State {
    pub(super) cameras: [Option<Camera>; CAMERAS],
    pub(super) lights: [Option<Light>; LIGHTS],
    pub(super) meshes: [Option<Shape>; MESHES],
    pub(super) roots: [Option<Root>; ROOTS],
    pub(super) objects: [Option<Object>; OBJECTS],
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Camera {
    pub(super) distance: u8,
    pub(super) layers: u8,
    pub(super) detail: Detail,
    pub(super) is_active: bool,
    /// An index of the losses of components.
    pub(super) lost: Option<usize>,
}

/// The settings of a camera.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Detail {
    Fine,
    Coarse,
    /// With a hysteresis.
    Held,
    Full,
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Light {
    pub(super) is_sun: bool,
    pub(super) has_shadows: bool,
    pub(super) layers: u8,
}

/// The source of a mesh.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Shape {
    pub(super) subdivisions: u32,
    pub(super) seed: u32,
}

/// The parent of objects, as that of a scene.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Root {
    pub(super) has_lod: bool,
    pub(super) is_shown: bool,
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Object {
    pub(super) place: u8,
    pub(super) layers: u8,
    pub(super) is_shown: bool,
    pub(super) look: Look,
    pub(super) material: Option<usize>,
    pub(super) root: Option<usize>,
}

/// The geometry of an object.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Look {
    /// The mesh in a slot, and its marks.
    Mesh(usize, Mark),
    /// A primitive of a `.fieldpages` file.
    Streamed,
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Mark {
    None,
    No,
    Auto,
    Clusters,
}

/// A change of the world in one frame. Most steps change, add or remove what is in a slot.
#[derive(Clone, Copy, Debug)]
pub(super) enum Step {
    /// Nothing changes.
    Wait,
    Camera(usize, Option<Camera>),
    Light(usize, Option<Light>),
    /// Another mesh takes the slot of one.
    Mesh(usize, Option<Shape>),
    /// Another material takes the slot of one.
    Material(usize),
    Root(usize, Option<Root>),
    Object(usize, Option<Object>),
    /// Other code despawns the units of an object.
    DespawnUnits(usize),
}

/// Any step; with `streams`, also of streamed objects.
pub(super) fn step(streams: bool, losses: usize) -> impl Strategy<Value = Step> {
    let layers = || 1..4u8;
    let detail = prop_oneof![
        3 => Just(Detail::Fine),
        1 => Just(Detail::Coarse),
        1 => Just(Detail::Held),
        1 => Just(Detail::Full)
    ];
    let lost = weighted(0.4, 0..losses);
    let camera = (1..24u8, layers(), detail, weighted(0.2, Just(())), lost);
    let camera = camera.prop_map(|(distance, layers, detail, is_inactive, lost)| Camera {
        distance,
        layers,
        detail,
        is_active: is_inactive.is_none(),
        lost,
    });
    let light = (any::<bool>(), any::<bool>(), layers());
    let light = light.prop_map(|(is_sun, has_shadows, layers)| Light {
        is_sun,
        has_shadows,
        layers,
    });
    let shape = (1..4u32, 0..2u32);
    let shape = shape.prop_map(|(subdivisions, seed)| Shape { subdivisions, seed });
    let root = (any::<bool>(), any::<bool>());
    let root = root.prop_map(|(has_lod, is_shown)| Root { has_lod, is_shown });
    let mark = prop_oneof![
        1 => Just(Mark::None),
        1 => Just(Mark::No),
        3 => Just(Mark::Auto),
        3 => Just(Mark::Clusters)
    ];
    let mesh = (0..MESHES, mark).prop_map(|(mesh, mark)| Look::Mesh(mesh, mark));
    let look = (weighted(0.3, Just(Look::Streamed)), mesh);
    let look = look.prop_map(move |(streamed, mesh)| streamed.filter(|_| streams).unwrap_or(mesh));
    let object = (
        any::<u8>(),
        layers(),
        weighted(0.2, Just(())),
        look,
        weighted(0.7, 0..MATERIALS),
        weighted(0.4, 0..ROOTS),
    );
    let object = object.prop_map(|(place, layers, is_hidden, look, material, root)| Object {
        place,
        layers,
        is_shown: is_hidden.is_none(),
        look,
        material,
        root,
    });
    prop_oneof![
        4 => Just(Step::Wait),
        4 => (0..CAMERAS, weighted(0.8, camera)).prop_map(|(at, camera)| Step::Camera(at, camera)),
        1 => (0..LIGHTS, weighted(0.7, light)).prop_map(|(at, light)| Step::Light(at, light)),
        2 => (0..MESHES, weighted(0.8, shape)).prop_map(|(at, shape)| Step::Mesh(at, shape)),
        1 => (0..MATERIALS).prop_map(Step::Material),
        1 => (0..ROOTS, weighted(0.7, root)).prop_map(|(at, root)| Step::Root(at, root)),
        6 => (0..OBJECTS, weighted(0.8, object)).prop_map(|(at, object)| Step::Object(at, object)),
        1 => (0..OBJECTS).prop_map(Step::DespawnUnits),
    ]
}

impl State {
    /// Applies a step.
    pub(super) fn apply(&mut self, step: Step) {
        match step {
            Step::Wait | Step::Material(_) | Step::DespawnUnits(_) => {}
            Step::Camera(at, camera) => self.cameras[at] = camera,
            Step::Light(at, light) => self.lights[at] = light,
            Step::Mesh(at, shape) => self.meshes[at] = shape,
            Step::Object(at, object) => self.objects[at] = object,
            Step::Root(at, root) => {
                self.roots[at] = root;
                // Children are despawned with their parent.
                if root.is_none() {
                    for object in &mut self.objects {
                        object.take_if(|object| object.root == Some(at));
                    }
                }
            }
        }
        // An object needs the root that it names.
        let roots = &self.roots;
        for object in self.objects.iter_mut().flatten() {
            object.root = object.root.filter(|&root| roots[root].is_some());
        }
    }
}
