//! Reads values from the front of a byte slice, with bounds checks.

use bytemuck::Pod;

use super::error::FileError;

pub(super) struct Reader<'a> {
    pub(super) rest: &'a [u8],
}

impl<'a> Reader<'a> {
    pub(super) fn take(&mut self, what: &'static str, needed: u64) -> Result<&'a [u8], FileError> {
        let available = self.rest.len() as u64;
        if needed > available {
            return Err(FileError::Truncated {
                what,
                needed,
                available,
            });
        }
        // The cast is exact: `needed` is at most the length of a slice.
        let (taken, rest) = self.rest.split_at(needed as usize);
        self.rest = rest;
        Ok(taken)
    }

    /// Checks that only the zeros are left that a writer pads with, see `MAX_PER_BYTE`.
    pub(super) fn end(&self, what: &'static str) -> Result<(), FileError> {
        if self.rest.iter().all(|&byte| byte == 0) {
            Ok(())
        } else {
            Err(FileError::Corrupt { what })
        }
    }

    pub(super) fn value<T: Pod>(&mut self, what: &'static str) -> Result<T, FileError> {
        let bytes = self.take(what, size_of::<T>() as u64)?;
        Ok(bytemuck::pod_read_unaligned(bytes))
    }

    pub(super) fn array<T: Pod>(
        &mut self,
        count: usize,
        what: &'static str,
    ) -> Result<impl Iterator<Item = T> + use<'a, T>, FileError> {
        let needed = (count as u64).saturating_mul(size_of::<T>() as u64);
        let bytes = self.take(what, needed)?;
        let elements = bytes.chunks_exact(size_of::<T>());
        Ok(elements.map(bytemuck::pod_read_unaligned))
    }
}
