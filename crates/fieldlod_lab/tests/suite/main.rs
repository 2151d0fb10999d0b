//! Tests of the measurements.

mod baselines;
mod chart;
mod common;
mod promise;
mod props;
mod render;
mod stability;
