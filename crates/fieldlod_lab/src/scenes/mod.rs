//! Scenes of many instances: triangles with and without visible flux at equal image error.
//!
//! [`generated_worlds`], or a [`World`] built by the caller, are drawn from the eye height of a pedestrian. The
//! baseline is [`ERROR_PX`] without visible flux. A search finds the threshold with visible flux that has the same
//! root mean squared difference from full detail over all frames ([`Row`]).
//!
//! # Fairness of the comparison
//! - Only units that touch the view are counted, as a renderer with frustum culling draws them.
//! - Each frame is selected from scratch, without hysteresis.

mod equal_error;
mod frame;
mod generated;
mod report;
mod shapes;
mod world;

pub use equal_error::Row;
pub use generated::generated_worlds;
pub use report::{ERROR_PX, WorldResult, measure, table};
pub use world::World;
