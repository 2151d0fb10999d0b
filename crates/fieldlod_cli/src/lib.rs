//! Output shared by the commands `fieldlod` and `fieldlod-lab`: results, progress and failures.

pub mod output;
