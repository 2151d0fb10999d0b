//! Results kept on disk, so that a run that was stopped goes on where it was.

use std::fs;
use std::path::{Path, PathBuf};

use serde::Serialize;
use serde::de::DeserializeOwned;
use xxhash_rust::xxh3::xxh3_64;

use super::ChartError;
use crate::files::{WriteError, make_folder, write_file};

/// Grows when what is measured changes.
const VERSION: u32 = 4;

/// A folder of results, each under the hash of all that it depends on.
#[derive(Clone, Debug)]
pub struct Store {
    folder: PathBuf,
}

impl Store {
    /// Takes a folder, which is made if it is missing.
    ///
    /// # Errors
    /// [`WriteError`] if it cannot be made.
    pub fn new(folder: &Path) -> Result<Self, WriteError> {
        make_folder(folder)?;
        Ok(Self {
            folder: folder.to_owned(),
        })
    }

    /// The result for `key`: read if it is there and whole, else made and kept.
    ///
    /// # Errors
    /// What `make` returns, and [`ChartError::Write`].
    pub fn get_or_make<T: Serialize + DeserializeOwned>(
        &self,
        key: &impl Serialize,
        make: impl FnOnce() -> Result<T, ChartError>,
    ) -> Result<T, ChartError> {
        // What was measured before.
        let path = self.path(key);
        let stored = fs::read(&path).ok();
        if let Some(result) = stored.and_then(|bytes| serde_json::from_slice(&bytes).ok()) {
            return Ok(result);
        }
        // Else what is measured now.
        let result = make()?;
        let json_error = |error: serde_json::Error| WriteError::new(&path, error.into());
        let text = serde_json::to_vec(&result).map_err(json_error)?;
        write_file(&path, &text)?;
        // As it will be read: the last digits of numbers may differ.
        Ok(serde_json::from_slice(&text).map_err(json_error)?)
    }

    fn path(&self, key: &impl Serialize) -> PathBuf {
        let text = serde_json::to_vec(&(VERSION, key)).unwrap_or_default();
        self.folder.join(format!("{:016x}.json", xxh3_64(&text)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_kept_result_is_not_made_again() {
        let folder = tempfile::tempdir().unwrap();
        let store = Store::new(&folder.path().join("new")).unwrap();
        let made: f64 = store.get_or_make(&("rock", 1), || Ok(0.1)).unwrap();
        let kept: f64 = store
            .get_or_make(&("rock", 1), || panic!("it is there"))
            .unwrap();
        assert_eq!(made, kept);
        let other: f64 = store.get_or_make(&("rock", 2), || Ok(0.2)).unwrap();
        assert_eq!(other, 0.2);
    }

    #[test]
    fn a_damaged_result_is_made_again() {
        let folder = tempfile::tempdir().unwrap();
        let store = Store::new(folder.path()).unwrap();
        fs::write(store.path(&7), b"[1.0").unwrap();
        let made: f64 = store.get_or_make(&7, || Ok(0.3)).unwrap();
        assert_eq!(made, 0.3);
    }
}
