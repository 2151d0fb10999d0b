//! Which parts of meshes are in memory, for worlds that are larger than it.
//!
//! A `.fieldpages` file ([`PagedFile`](fieldlod_hierarchy::PagedFile)) is read page by page: some
//! neighbouring groups of one level each. [`Residency`] decides which pages are resident, under a budget of
//! bytes on the GPU and one of bytes that are being read. In each frame it hears which groups views
//! refine, or would if they could, and answers with pages to load and pages to evict:
//!
//! - The first page of a mesh, which draws its coarsest cut, is loaded first and stays.
//! - Of the pages that are wanted, those are loaded first that lack most pixels for their bytes, and coarser
//!   ones before those that are of no use without. What was not used for longest is evicted first.
//! - What is in use is never evicted. Where all that is in use or wanted exceeds the budget, errors count
//!   for less, [in small steps](Residency::coarsening), until it fits; where much of the budget is free again, for more.
//! - What was not in use for a while is evicted though there is room: a camera that comes back within it reads nothing.
//!
//! `benches/RECORD.md` has what is missing, by how many pixels, while one walks, drives and teleports through a
//! world of 33 million triangles with 256 and 26 MiB. Views whose selection keeps what is beside them
//! (`Offscreen::OnAxis`) miss least.
//!
//! # What a world costs
//! On paper, from 100 rocks that were measured (the record has how):
//!
//! | source triangles | file, lossless | quantised | table of contents | its reading at 100 MB/s | tables in main memory | all levels on the GPU |
//! |---|---|---|---|---|---|---|
//! | 1 million | 15 MB | 6.2 MB | 30 kB | 0.3 ms | 0.17 MB | 39 MB |
//! | 1 billion | 15 GB | 6.2 GB | 30 MB | 0.3 s | 168 MB | 39 GB |
//! | 1 trillion | 15 TB | 6.2 TB | 30 GB | 300 s | 168 GB | 39 TB |
//!
//! Of the last, what fits the budget is there; tables are there as a whole. A billion triangles are within reach as it
//! is. A trillion are not: their tables would have to come and go as their pages do, mesh by mesh, with the coarsest
//! page of each region in place of its meshes.
//!
//! # How it is used
//! Nothing here reads files, draws or waits: whoever does tells of it. What it decides depends on
//! what it was told alone, in its order.
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
//! // In each frame: what views ask for, and what is to be done.
//! let orders = residency.update(Duration::from_millis(16));
//! assert_eq!((orders.load.len(), orders.load[0].mesh, orders.load[0].page), (1, hills, 0));
//! // When it has been read and is on the GPU:
//! residency.set_loaded(orders.load[0]);
//! let coarsest = file.meshes[0].groups_of(0)[0];
//! assert!(residency.is_at_hand(hills, coarsest));
//! ```

mod mesh_pages;
mod residency;
mod settings;

pub use mesh_pages::{StreamMeshId, StreamPageId};
pub use residency::{Orders, Residency, Statistics};
pub use settings::StreamSettings;
