//! The pages of one mesh and their dependencies.

use std::time::Duration;

use fieldlod_hierarchy::PagedMesh;

/// A mesh of a [`Residency`](crate::Residency). Ids are not reused, because an old id must not refer to a new mesh.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct StreamMeshId(pub(crate) u32);

/// A page of a mesh.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct StreamPageId {
    /// The mesh.
    pub mesh: StreamMeshId,
    /// Index in [`PagedMesh::pages`].
    pub page: u32,
}

/// The state of a page.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) enum PageState {
    #[default]
    Absent,
    Loading,
    Resident,
    /// The page could not be loaded. It is retried in frame `until` or later.
    Failed {
        until: u64,
    },
}

#[derive(Clone, Debug)]
pub(crate) struct PageEntry {
    pub(crate) state: PageState,
    /// Bytes on the GPU.
    pub(crate) gpu_bytes: u64,
    /// Bytes of main memory while loading: the encoded and the decoded page.
    pub(crate) loading_bytes: u64,
    /// Number of consecutive failures.
    pub(crate) failures: u32,
    /// Last frame with a demand for one of its groups.
    pub(crate) used_at: u64,
    /// Time of the frame `used_at`, since the first frame.
    pub(crate) used_at_time: Duration,
    /// Missing pixels per byte, or the priority of a page that depends on this page if that is higher.
    pub(crate) priority: f32,
    /// Pages of coarser groups. They must be resident before groups of this page can be refined.
    pub(crate) coarser: Vec<u32>,
}

impl PageEntry {
    /// Bytes in the file.
    pub(crate) fn file_bytes(&self) -> u64 {
        self.loading_bytes - self.gpu_bytes
    }
}

/// The pages of one mesh, coarsest first.
#[derive(Clone, Debug)]
pub(crate) struct MeshPages {
    pub(crate) pages: Vec<PageEntry>,
    page_of: Vec<u32>,
}

impl MeshPages {
    pub(crate) fn new(mesh: &PagedMesh) -> Self {
        let group_count = mesh.graph.groups.len() as u32;
        let mut coarser = vec![Vec::new(); mesh.pages.len()];
        for (group, data) in (0..group_count).zip(&mesh.graph.groups) {
            let page = mesh.page_of(group);
            // By the cut rule, refining `finer` also refines `group`. `group` then draws units of `page`.
            for &finer in mesh.graph.finer_groups(data) {
                let own = mesh.page_of(finer);
                // A page must not wait for itself.
                if own != page {
                    coarser[own as usize].push(page);
                }
            }
        }
        let pages = mesh.pages.iter().zip(coarser);
        let pages = pages.map(|(page, mut coarser)| {
            coarser.sort_unstable();
            coarser.dedup();
            let gpu_bytes = u64::from(page.mesh_bytes);
            PageEntry {
                state: PageState::Absent,
                gpu_bytes,
                loading_bytes: gpu_bytes + (page.bytes.end - page.bytes.start),
                failures: 0,
                used_at: 0,
                used_at_time: Duration::ZERO,
                priority: 0.0,
                coarser,
            }
        });
        Self {
            pages: pages.collect(),
            page_of: (0..group_count).map(|group| mesh.page_of(group)).collect(),
        }
    }

    pub(crate) fn page_of(&self, group: u32) -> Option<u32> {
        self.page_of.get(group as usize).copied()
    }

    /// Raises the priority of the coarser pages that a page depends on.
    pub(crate) fn raise_coarser_priorities(&mut self, page: u32) {
        let priority = self.pages[page as usize].priority;
        // The list is taken out while other pages are changed, which saves a copy.
        let coarser = std::mem::take(&mut self.pages[page as usize].coarser);
        for &coarser in &coarser {
            let coarser = &mut self.pages[coarser as usize];
            coarser.priority = coarser.priority.max(priority);
        }
        self.pages[page as usize].coarser = coarser;
    }
}
