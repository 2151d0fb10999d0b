//! The cut of one instance: its specification, invariants, and views with a known result.

#[path = "../common/mod.rs"]
mod common;
mod invariants;
mod known_views;
mod matches_naive;
