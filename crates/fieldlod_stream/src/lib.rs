//! Streams pages of meshes for worlds that are larger than memory.
//!
//! A `.fieldpages` file ([`PagedFile`](fieldlod_hierarchy::PagedFile)) is read page by page. A page holds neighbouring
//! groups of one level. [`Residency`] keeps two budgets: bytes on the GPU, and bytes that are being loaded. Each frame,
//! the caller reports the groups that views refine, or would refine if they were resident. [`Residency::update`] returns
//! lists of pages to load and to evict:
//!
//! - The first page of a mesh is loaded first and never evicted. It holds the coarsest cut.
//! - Wanted pages are ordered by missing pixels per byte. Coarser pages come before the finer pages that need them.
//! - The least recently used pages are evicted first.
//! - Pages in use are never evicted. If the pages that are in use or wanted exceed the budget, thresholds rise
//!   [in small steps](Residency::coarsening) until the pages fit. Thresholds fall when much of the budget is free.
//! - Pages that were unused for [some time](StreamSettings::keep_unused) are evicted even if there is room.
//!
//! `benches/RECORD.md` lists missing pages and their errors for a world of 33 million triangles with 256 and 26 MiB.
//!
//! # Memory of a world
//! Extrapolated from 100 measured rocks:
//!
//! | source triangles | file, lossless | quantized | table of contents | read at 100 MB/s | tables in main memory | all levels on the GPU |
//! |---|---|---|---|---|---|---|
//! | 1 million | 15 MB | 6.2 MB | 30 kB | 0.3 ms | 0.17 MB | 39 MB |
//! | 1 billion | 15 GB | 6.2 GB | 30 MB | 0.3 s | 168 MB | 39 GB |
//!
//! Tables stay in main memory. Of the levels in the last column, at most the GPU budget is resident.
//!
//! # Example
//! The caller reads files and uploads meshes. Decisions depend only on the reported events and their order.
//!
//! ```
//! # use std::time::Duration;
//! # use fieldlod_hierarchy::{BakedFile, BakedPrimitive, PageOptions, PagedFile, fixtures};
//! # use fieldlod_stream::{Residency, StreamSettings};
//! let hills = BakedPrimitive::new(0, 0, "hills", fixtures::grid_pyramid(2));
//! let bytes = PagedFile::to_bytes(&BakedFile { primitives: vec![hills] }, PageOptions::default());
//! let file = PagedFile::from_contents(&bytes).unwrap();
//!
//! let mut residency = Residency::new(StreamSettings::default());
//! let hills = residency.add_mesh(&file.meshes[0]);
//! // In each frame, after `demand` for the groups that views refine:
//! let orders = residency.update(Duration::from_millis(16));
//! assert_eq!((orders.load.len(), orders.load[0].mesh, orders.load[0].page), (1, hills, 0));
//! // When the page is on the GPU:
//! residency.set_loaded(orders.load[0]);
//! let coarsest = file.meshes[0].groups_of(0)[0];
//! assert!(residency.is_resident(hills, coarsest));
//! ```

mod mesh_pages;
mod residency;
mod settings;

pub use mesh_pages::{StreamMeshId, StreamPageId};
pub use residency::{Orders, Residency, Statistics};
pub use settings::StreamSettings;
