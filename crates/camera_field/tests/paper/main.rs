//! Tests of the paper's formulas against counted samples, derivatives and each other, up to 85° off axis.
#![expect(
    clippy::disallowed_methods,
    clippy::disallowed_types,
    reason = "tests may use angles, powers and vectors; selection does not run here"
)]

mod applications;
mod bounds;
mod common;
mod derivatives;
mod errata;
mod field;
mod flux;
mod ldi;
mod projection;
mod splat;
