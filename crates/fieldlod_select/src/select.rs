//! Selects the cuts of a scene in a view: limits, one pass over all instances, and decisions on near instances.
//! [`Selector`](crate::Selector) calls these steps in order.

mod bounds_test;
pub(crate) mod budget;
pub(crate) mod changes;
pub(crate) mod cuts;
pub(crate) mod decision;
pub(crate) mod demand;
pub(crate) mod frame;
mod instance_cut;
mod limits;
mod memory;
mod near;
pub(crate) mod weights;
