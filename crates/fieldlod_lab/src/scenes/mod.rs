//! Scenes of several objects: what it is worth to know what hides what.
//!
//! Worlds are drawn from where one who walks sees them ([`generated_worlds`], or a [`World`] of one's own). At
//! the error that today's pictures have at a threshold, each [`Visibility`] draws so many triangles
//! ([`Row`]): the threshold is searched until the root mean squared difference from full detail, over all
//! frames, is the same.
//!
//! # What is fair
//! - Only units that touch the view are counted, as if all renderers culled them.
//! - Each frame is selected from scratch; no hysteresis helps or harms.
//! - Shares known from the picture are of the picture of full detail: texels that show a group's surface
//!   over those that its front covers.
//! - The oracle gives a group the squared differences that drawing its level makes where it shows, over the
//!   triangles saved. With shadows, what a caster changes elsewhere is not given to it.

mod choice;
mod equal_error;
mod frame;
mod generated;
mod report;
mod shapes;
mod world;

pub use choice::Visibility;
pub use equal_error::Row;
pub use generated::generated_worlds;
pub use report::{Options, WorldResult, measure, table};
pub use world::World;
