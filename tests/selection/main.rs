//! Selection against its specification, and what must hold of every cut.

mod invariants;
mod matches_naive;
mod scenes;
mod views;
