//! What the commands `fieldlod` and `fieldlod-lab` share: how they tell of results, progress and
//! failures.

pub mod output;
