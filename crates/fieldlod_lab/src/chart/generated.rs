//! Generated models: one set for choosing constants, another for reported figures.

use fieldlod_bake::{SourceMesh, fixtures};

/// A generated model.
#[derive(Clone, Copy, Debug)]
pub struct Generated {
    /// The model's name.
    pub name: &'static str,
    /// Generates the mesh.
    pub mesh: fn() -> SourceMesh,
}

impl Generated {
    /// The models that constants were chosen on.
    pub const TRAINING: [Self; 3] = [
        Self {
            name: "boulder",
            mesh: || fixtures::rock(6, 3),
        },
        Self {
            name: "thin knot",
            mesh: || fixtures::torus_knot(1024, 32),
        },
        Self {
            name: "small hills",
            mesh: || fixtures::height_field(256),
        },
    ];

    /// The models of reported figures, of other shapes and sizes.
    pub const TEST: [Self; 6] = [
        Self {
            name: "rock",
            mesh: || fixtures::rock(6, 7),
        },
        Self {
            name: "knot",
            mesh: || fixtures::torus_knot(768, 96),
        },
        Self {
            name: "large rock",
            mesh: || fixtures::rock(8, 11),
        },
        Self {
            name: "hills",
            mesh: || fixtures::height_field(768),
        },
        Self {
            name: "machine",
            mesh: || fixtures::machine(5),
        },
        Self {
            name: "kit",
            mesh: || fixtures::kit(5),
        },
    ];

    /// Plants, which are drawn as whole meshes.
    pub const PLANTS: [Self; 2] = [
        Self {
            name: "small crown",
            mesh: || fixtures::crown(1_500, 1),
        },
        Self {
            name: "crown",
            mesh: || fixtures::crown(4_000, 1),
        },
    ];
}
