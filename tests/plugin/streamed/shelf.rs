//! A source of assets in memory, with faults.

use std::collections::HashMap;
use std::io;
use std::path::Path;
use std::pin::Pin;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Arc, Mutex};
use std::task::{Context, Poll};
use std::time::Duration;

use bevy::asset::io::{
    AssetReader, AssetReaderError, PathStream, Reader, ReaderNotSeekableError, SeekableReader,
    VecReader,
};
use futures_io::{AsyncRead, AsyncSeek};

/// An asset source. Clones share the files.
#[derive(Clone, Default)]
pub(crate) struct Shelf(Arc<Contents>);

#[derive(Default)]
struct Contents {
    files: Mutex<HashMap<String, Vec<u8>>>,
    /// Whether reads block.
    stalls: AtomicBool,
    /// Whether readers cannot seek.
    streams_only: AtomicBool,
    bytes_read: AtomicU64,
    /// The names of all reads, missing files included.
    reads: Mutex<Vec<String>>,
}

impl Shelf {
    pub(crate) fn put(&self, name: &str, bytes: Vec<u8>) {
        self.0.files.lock().unwrap().insert(name.into(), bytes);
    }

    pub(super) fn remove(&self, name: &str) {
        self.0.files.lock().unwrap().remove(name);
    }

    /// Blocks or unblocks reads.
    pub(super) fn stall(&self, stalls: bool) {
        self.0.stalls.store(stalls, Ordering::Release);
    }

    pub(super) fn stream_only(&self) {
        self.0.streams_only.store(true, Ordering::Release);
    }

    /// How often a file was read or missing.
    pub(crate) fn reads_of(&self, name: &str) -> usize {
        let reads = self.0.reads.lock().unwrap();
        reads.iter().filter(|read| *read == name).count()
    }

    /// Bytes that were read from all files.
    pub(super) fn bytes_read(&self) -> u64 {
        self.0.bytes_read.load(Ordering::Acquire)
    }
}

impl AssetReader for Shelf {
    async fn read<'a>(&'a self, path: &'a Path) -> Result<impl Reader + 'a, AssetReaderError> {
        // Blocks the thread, as a slow disk does.
        while self.0.stalls.load(Ordering::Acquire) {
            std::thread::sleep(Duration::from_millis(5));
        }
        let name = path.to_str().unwrap();
        self.0.reads.lock().unwrap().push(name.into());
        let bytes = self.0.files.lock().unwrap().get(name).cloned();
        let bytes = bytes.ok_or_else(|| AssetReaderError::NotFound(path.into()))?;
        Ok(ShelfReader {
            bytes: VecReader::new(bytes),
            shelf: self.clone(),
            can_seek: !self.0.streams_only.load(Ordering::Acquire),
        })
    }

    async fn read_meta<'a>(&'a self, path: &'a Path) -> Result<impl Reader + 'a, AssetReaderError> {
        Err::<VecReader, _>(AssetReaderError::NotFound(path.into()))
    }

    async fn read_directory<'a>(
        &'a self,
        path: &'a Path,
    ) -> Result<Box<PathStream>, AssetReaderError> {
        Err(AssetReaderError::NotFound(path.into()))
    }

    async fn is_directory<'a>(&'a self, _path: &'a Path) -> Result<bool, AssetReaderError> {
        Ok(false)
    }
}

struct ShelfReader {
    bytes: VecReader,
    shelf: Shelf,
    can_seek: bool,
}

impl AsyncRead for ShelfReader {
    fn poll_read(
        mut self: Pin<&mut Self>,
        context: &mut Context<'_>,
        into: &mut [u8],
    ) -> Poll<io::Result<usize>> {
        let poll = Pin::new(&mut self.bytes).poll_read(context, into);
        if let Poll::Ready(Ok(count)) = &poll {
            let read = &self.shelf.0.bytes_read;
            read.fetch_add(*count as u64, Ordering::AcqRel);
        }
        poll
    }
}

impl AsyncSeek for ShelfReader {
    fn poll_seek(
        mut self: Pin<&mut Self>,
        context: &mut Context<'_>,
        to: io::SeekFrom,
    ) -> Poll<io::Result<u64>> {
        Pin::new(&mut self.bytes).poll_seek(context, to)
    }
}

impl Reader for ShelfReader {
    fn seekable(&mut self) -> Result<&mut dyn SeekableReader, ReaderNotSeekableError> {
        if self.can_seek {
            Ok(self)
        } else {
            Err(ReaderNotSeekableError)
        }
    }
}
