//! The rules of other systems, each as a function of one object in one view.
//!
//! Which system has which rule, and what is fair between them, is told by
//! [`Method`](crate::method::Method).

pub(crate) mod group_wise;
pub(crate) mod sphere_scan;
pub(crate) mod whole_object;
