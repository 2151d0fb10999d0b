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
    const fn new(name: &'static str, mesh: fn() -> SourceMesh) -> Self {
        Self { name, mesh }
    }

    /// The models that constants were chosen on.
    pub const TRAINING: [Self; 3] = [
        Self::new("boulder", || fixtures::rock(6, 3)),
        Self::new("thin knot", || fixtures::torus_knot(1024, 32)),
        Self::new("small hills", || fixtures::height_field(256)),
    ];

    /// The models of reported figures. They have other shapes than the training models; rocks have other seeds.
    pub const TEST: [Self; 6] = [
        Self::new("rock", || fixtures::rock(6, 7)),
        Self::new("knot", || fixtures::knotted_tube(768, 96, [3.0, 4.0], 0.4)),
        Self::new("large rock", || fixtures::rock(8, 11)),
        Self::new("mountains", || fixtures::mountains(768)),
        Self::new("machine", || fixtures::machine(5)),
        Self::new("kit", || fixtures::kit(5)),
    ];

    /// Plants, which are drawn as whole meshes.
    pub const PLANTS: [Self; 2] = [
        Self::new("small crown", || fixtures::crown(1_500, 1)),
        Self::new("crown", || fixtures::crown(4_000, 1)),
    ];
}
