//! Tests of levels: shapes, deviations, neighbours, textures, plants and kits.

#[path = "../common/mod.rs"]
mod common;

mod aggregates;
mod clusterlod;
mod deviation;
mod invariants;
mod kits;
mod layers;
mod matches_naive;
mod neighbours;
mod pictures;
mod seams;
mod surfaces;
mod together;
mod topology;
