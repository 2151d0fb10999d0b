//! Selection against its specification, and invariants of every cut.

mod invariants;
mod matches_naive;
mod scenes;
mod views;
