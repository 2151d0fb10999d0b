//! The generated shapes of the scene. Every call gives the same triangles.

mod column;
mod leaves;
mod mesh;
mod rock;
mod sdf;
mod statue;
pub(crate) mod terrain;
mod tree;
mod undergrowth;

use bevy::prelude::Component;

pub(crate) use mesh::Shape;

/// Every distinct shape of the scene.
#[derive(Component, Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(crate) enum ShapeId {
    /// The ground.
    Terrain,
    /// One of three boulders, about 1 m in radius, centred on the origin.
    Rock(u8),
    /// A fluted column, 6 m tall.
    Column,
    /// The stump of a column, about 3 m tall.
    BrokenColumn,
    /// A seated figure on a throne, 3.1 m tall, facing +Z.
    SeatedFigure,
    /// A knot on a pedestal, 3.6 m tall.
    Knot,
    /// An arched gate, 7.5 m tall. Its passage runs along Z.
    Gate,
    /// One of two broad-leaved trees, about 7 m tall.
    Oak(u8),
    /// One of two umbrella pines, about 9 m tall.
    Pine(u8),
    /// A cypress, about 9 m tall.
    Cypress,
    /// A bush, 0.9 m tall.
    Bush,
    /// A tuft of grass, 0.5 m tall.
    Tuft,
    /// A stone, about 1 m in radius. The scene scales it down.
    Stone,
}

impl ShapeId {
    /// All shapes, the slowest to generate first.
    pub(crate) const ALL: [Self; 17] = [
        Self::Terrain,
        Self::SeatedFigure,
        Self::Knot,
        Self::Gate,
        Self::Rock(0),
        Self::Rock(1),
        Self::Rock(2),
        Self::Column,
        Self::BrokenColumn,
        Self::Oak(0),
        Self::Oak(1),
        Self::Pine(0),
        Self::Pine(1),
        Self::Cypress,
        Self::Bush,
        Self::Tuft,
        Self::Stone,
    ];

    /// Generates the shape. The ground has `ground_squares` along each side.
    pub(crate) fn generate(self, ground_squares: u32) -> Shape {
        match self {
            Self::Terrain => terrain::terrain(ground_squares),
            Self::Rock(variant) => rock::rock(u32::from(variant)),
            Self::Column => column::column(),
            Self::BrokenColumn => column::broken_column(),
            Self::SeatedFigure => statue::seated_figure(),
            Self::Knot => statue::knot(),
            Self::Gate => statue::gate(),
            Self::Oak(variant) => tree::oak(u32::from(variant)),
            Self::Pine(variant) => tree::pine(u32::from(variant)),
            Self::Cypress => tree::cypress(),
            Self::Bush => undergrowth::bush(),
            Self::Tuft => undergrowth::tuft(),
            Self::Stone => rock::stone(),
        }
    }
}

/// Generates all shapes on all cores. They are in the order of [`ShapeId::ALL`].
pub(crate) fn generate_all(ground_squares: u32) -> Vec<(ShapeId, Shape)> {
    std::thread::scope(|scope| {
        let threads = ShapeId::ALL.map(|id| (id, scope.spawn(move || id.generate(ground_squares))));
        let finished = threads.into_iter().map(|(id, thread)| {
            let shape = thread.join();
            (id, shape.expect("shapes are generated without panics"))
        });
        finished.collect()
    })
}

/// All shapes, generated once for all tests.
#[cfg(test)]
pub(crate) fn generated() -> &'static std::collections::HashMap<ShapeId, Shape> {
    static SHAPES: std::sync::OnceLock<std::collections::HashMap<ShapeId, Shape>> =
        std::sync::OnceLock::new();
    SHAPES.get_or_init(|| generate_all(620).into_iter().collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shapes_are_deterministic() {
        for id in [ShapeId::Rock(1), ShapeId::Knot] {
            assert!(id.generate(1) == generated()[&id]);
        }
    }
}
