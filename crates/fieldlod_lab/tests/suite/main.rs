//! Tests of the measurements and of the command.

mod baselines;
mod chart;
mod common;
mod promise;
mod props;
mod render;
mod scenes;
mod stability;
