//! Decides which pages are loaded and evicted.

use std::cmp::Reverse;
use std::collections::BTreeMap;
use std::time::Duration;

use fieldlod_hierarchy::PagedMesh;

use crate::mesh_pages::{MeshPages, PageEntry, PageState, StreamMeshId, StreamPageId};
use crate::settings::StreamSettings;

/// Factor of the coarsening per frame while wanted pages exceed the budget. With a smaller factor the budget is exceeded
/// for longer. With a larger one the coarsening overshoots, and pages that would fit are evicted.
const COARSER: f32 = 1.05;
/// Factor of the coarsening per frame while much of the budget is free. Falling slower than rising avoids exceeding the
/// budget again.
const FINER: f32 = 1.0 / 1.02;
/// The coarsening falls while wanted pages need less than this share of the budget. Between this share and the whole
/// budget it stays constant.
const DEAD_BAND_FROM: f64 = 0.8;
/// Largest coarsening: a threshold of about the height of a picture. After the wait of [`WAIT_FRAMES`], thresholds fall
/// back within 6 seconds at 60 Hz. Without a limit they would take far longer after a budget that was too small.
const MAX_COARSENING: f32 = 1000.0;
/// First and largest number of frames between exceeding the budget and lowering thresholds.
///
/// The number doubles if the budget is exceeded again soon. Otherwise a page that is larger than the dead band would be
/// loaded and evicted forever.
const WAIT_FRAMES: [u64; 2] = [120, 7680];
/// First and largest number of frames until a failed page is retried: half a second and half a minute at 60 Hz. Shorter
/// delays keep a broken disk busy; longer ones keep geometry coarse after the disk recovers.
const RETRY_FRAMES: [u64; 2] = [30, 1920];
/// Eviction of unused pages visits each mesh once in this number of frames. Visits cost time for each page of the mesh;
/// rare visits evict later than the setting demands.
const SWEEP_FRAMES: u64 = 16;

/// Tracks resident pages and decides which pages are loaded and evicted.
#[derive(Clone, Debug)]
pub struct Residency {
    settings: StreamSettings,
    /// The present meshes. Ordered, so that equal calls give equal orders.
    meshes: BTreeMap<StreamMeshId, MeshPages>,
    next_mesh: u32,
    frame: u64,
    /// Time of this frame since the first frame.
    time: Duration,
    coarsening: f32,
    /// Last frame in which wanted pages exceeded the budget.
    exceeded_at: u64,
    /// Frames to wait after [`exceeded_at`](Self::exceeded_at), see [`WAIT_FRAMES`]. 0 until the budget is exceeded.
    wait_frames: u64,
    /// Bytes of the pages that are demanded in this frame, without first pages.
    wanted_bytes: u64,
    /// Demanded pages that are not resident, without duplicates.
    wanted: Vec<StreamPageId>,
    first_page_bytes: u64,
    /// Pages that may be evicted in this frame, least recently used last. `None` until an eviction needs them.
    idle: Option<Vec<StreamPageId>>,
    statistics: Statistics,
}

/// The loads and evictions of a frame.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Orders {
    /// Pages to free. They count as evicted.
    pub evict: Vec<StreamPageId>,
    /// Pages to load: first pages, then other pages by descending priority.
    pub load: Vec<StreamPageId>,
}

/// Memory statistics. Totals cover all frames.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Statistics {
    /// GPU bytes of resident pages.
    pub resident_bytes: u64,
    /// GPU bytes of loading pages.
    pub loading_gpu_bytes: u64,
    /// Bytes of main memory of loading pages.
    pub loading_bytes: u64,
    /// GPU bytes of all pages that were in use or wanted in the last frame.
    pub wanted_bytes: u64,
    /// Pages that were wanted in the last frame and are not resident.
    pub missing_pages: u32,
    /// Total number of loaded pages.
    pub loaded: u64,
    /// Total file bytes of loaded pages.
    pub loaded_file_bytes: u64,
    /// Total number of evicted pages.
    pub evicted: u64,
    /// Total number of failed loads.
    pub failed: u64,
}

impl Default for Residency {
    fn default() -> Self {
        Self::new(StreamSettings::default())
    }
}

impl Residency {
    /// Creates a residency without meshes.
    #[must_use]
    pub fn new(settings: StreamSettings) -> Self {
        Self {
            settings,
            meshes: BTreeMap::new(),
            next_mesh: 0,
            // Frame 0 is the initial value of `used_at`: no page was used yet.
            frame: 1,
            time: Duration::ZERO,
            coarsening: 1.0,
            exceeded_at: 0,
            wait_frames: 0,
            wanted_bytes: 0,
            wanted: Vec::new(),
            first_page_bytes: 0,
            idle: None,
            statistics: Statistics::default(),
        }
    }

    /// Changes the budgets, starting with the next frame.
    pub fn set_settings(&mut self, settings: StreamSettings) {
        self.settings = settings;
    }

    /// Adds a mesh without resident pages.
    pub fn add_mesh(&mut self, mesh: &PagedMesh) -> StreamMeshId {
        let pages = MeshPages::new(mesh);
        self.first_page_bytes += pages.pages.first().map_or(0, |page| page.gpu_bytes);
        let id = StreamMeshId(self.next_mesh);
        self.next_mesh += 1;
        self.meshes.insert(id, pages);
        id
    }

    /// Removes a mesh. The caller frees its resident pages. Later reports about its loading pages are ignored.
    pub fn remove_mesh(&mut self, mesh: StreamMeshId) {
        let Some(removed) = self.meshes.remove(&mesh) else {
            return;
        };
        self.wanted.retain(|page| page.mesh != mesh);
        self.first_page_bytes -= removed.pages.first().map_or(0, |page| page.gpu_bytes);
        let demanded = removed.pages.iter().skip(1);
        let demanded = demanded.filter(|page| page.used_at == self.frame);
        self.wanted_bytes -= demanded.map(|page| page.gpu_bytes).sum::<u64>();
        let statistics = &mut self.statistics;
        for page in &removed.pages {
            match page.state {
                PageState::Resident => statistics.resident_bytes -= page.gpu_bytes,
                PageState::Loading => {
                    statistics.loading_gpu_bytes -= page.gpu_bytes;
                    statistics.loading_bytes -= page.loading_bytes;
                }
                _ => {}
            }
        }
    }

    /// Factor of this frame's thresholds in pixels. It is 1 until wanted pages exceed the budget, and returns to 1
    /// when much of the budget stays free.
    #[must_use]
    pub fn coarsening(&self) -> f32 {
        self.coarsening
    }

    /// Returns `true` if the first pages alone exceed the budget. Finer pages are then not loaded.
    #[must_use]
    pub fn is_budget_too_small(&self) -> bool {
        self.first_page_bytes > self.settings.gpu_bytes
    }

    /// Memory statistics.
    #[must_use]
    pub fn statistics(&self) -> Statistics {
        self.statistics
    }

    /// Returns `true` if the units of a group are resident.
    #[must_use]
    pub fn is_resident(&self, mesh: StreamMeshId, group: u32) -> bool {
        let page = self.meshes.get(&mesh).and_then(|mesh| mesh.page_of(group));
        let page = page.and_then(|page| self.page(StreamPageId { mesh, page }));
        page.is_some_and(|page| page.state == PageState::Resident)
    }

    fn page(&self, page: StreamPageId) -> Option<&PageEntry> {
        self.meshes.get(&page.mesh)?.pages.get(page.page as usize)
    }

    /// Reports that a view refines a group in this frame, or would refine it if it were resident. `missing_px` is the
    /// error of the geometry that is drawn in place of a group that is not resident.
    pub fn demand(&mut self, mesh: StreamMeshId, group: u32, missing_px: Option<f32>) {
        let Some(pages) = self.meshes.get_mut(&mesh) else {
            return;
        };
        let Some(page) = pages.page_of(group) else {
            return;
        };
        let entry = &mut pages.pages[page as usize];
        let is_first_time = entry.used_at != self.frame;
        if is_first_time {
            entry.used_at = self.frame;
            entry.used_at_time = self.time;
            entry.priority = 0.0;
            // `update` adds the bytes of all first pages.
            if page > 0 {
                self.wanted_bytes += entry.gpu_bytes;
            }
            if entry.state != PageState::Resident {
                self.wanted.push(StreamPageId { mesh, page });
            }
        }
        if let Some(missing_px) = missing_px.filter(|error| *error > 0.0) {
            let priority = missing_px / entry.gpu_bytes.max(1) as f32;
            entry.priority = entry.priority.max(priority);
        }
    }

    /// Ends a frame and returns its loads and evictions. The next frame begins `elapsed` later.
    pub fn update(&mut self, elapsed: Duration) -> Orders {
        // First pages stay resident whether or not they are demanded, so they always count.
        self.statistics.wanted_bytes = self.wanted_bytes + self.first_page_bytes;
        self.statistics.missing_pages = self.wanted.len() as u32;
        self.adapt();
        let mut orders = Orders::default();
        self.load_pages(&mut orders);
        // A reduced budget may require evictions even if no page is wanted.
        self.make_room(0, &mut orders);
        // The list may hold pages that are used or removed in the next frame.
        self.idle = None;
        self.evict_unused(&mut orders);
        self.wanted.clear();
        self.wanted_bytes = 0;
        self.frame += 1;
        self.time = self.time.saturating_add(elapsed);
        orders
    }

    /// Raises thresholds if wanted pages exceed the budget, and lowers them if much of it is free.
    fn adapt(&mut self) {
        let budget = self.settings.gpu_bytes;
        let wanted = self.statistics.wanted_bytes;
        let waited = self.frame - self.exceeded_at;
        if wanted > budget {
            self.coarsening = (self.coarsening * COARSER).min(MAX_COARSENING);
            // In consecutive frames above the budget, the wait must not double each time.
            if waited > self.wait_frames {
                self.wait_frames = if waited < self.wait_frames * 2 {
                    (self.wait_frames * 2).min(WAIT_FRAMES[1])
                } else {
                    WAIT_FRAMES[0]
                };
            }
            self.exceeded_at = self.frame;
        } else if (wanted as f64) < budget as f64 * DEAD_BAND_FROM && waited > self.wait_frames {
            self.coarsening = (self.coarsening * FINER).max(1.0);
        }
    }

    /// Loads first pages, then wanted pages by descending priority, while there is room.
    fn load_pages(&mut self, orders: &mut Orders) {
        let mut wanted = std::mem::take(&mut self.wanted);
        // Finer pages have larger indices, so priorities propagate from fine to coarse.
        wanted.sort_unstable_by_key(|page| Reverse(*page));
        for page in &wanted {
            if let Some(mesh) = self.meshes.get_mut(&page.mesh) {
                mesh.raise_coarser_priorities(page.page);
            }
        }
        let priority = |page: &StreamPageId| self.page(*page).map_or(0.0, |page| page.priority);
        // At equal priority, coarser pages come first.
        wanted.sort_by(|a, b| priority(b).total_cmp(&priority(a)).then(a.cmp(b)));
        let first_pages = self.meshes.keys();
        let first_pages = first_pages.map(|&mesh| StreamPageId { mesh, page: 0 });
        let first_pages: Vec<StreamPageId> = first_pages
            .filter(|page| {
                self.page(*page)
                    .is_some_and(|page| page.state != PageState::Resident)
            })
            .collect();
        for page in first_pages.into_iter().chain(wanted.drain(..)) {
            let Some(entry) = self.page(page).filter(|entry| self.may_load(page, entry)) else {
                continue;
            };
            let (bytes, loading) = (entry.gpu_bytes, self.statistics.loading_bytes);
            // A page larger than the whole budget must load at some time: it loads alone.
            let fits = loading == 0 || loading + entry.loading_bytes <= self.settings.loading_bytes;
            // First pages ignore the GPU budget: a missing mesh is worse than an exceeded budget. Pages of lower
            // priority must not take the room that a page waits for.
            if !fits || page.page > 0 && !self.make_room(bytes, orders) {
                break;
            }
            self.begin_loading(page, orders);
        }
        self.wanted = wanted;
    }

    /// Returns `true` if a page is absent or due for a retry, and needs no coarser page first.
    fn may_load(&self, page: StreamPageId, entry: &PageEntry) -> bool {
        let is_due = match entry.state {
            PageState::Absent => true,
            PageState::Failed { until } => until <= self.frame,
            PageState::Loading | PageState::Resident => false,
        };
        // Without its coarser pages, the page would not be drawn. Those that are not demanded belong to other groups.
        let waits_for = |coarser: &PageEntry| {
            let is_held = matches!(coarser.state, PageState::Loading | PageState::Resident);
            coarser.used_at == self.frame && !is_held
        };
        let mut coarser = entry.coarser.iter();
        is_due
            && !coarser.any(|&coarser| {
                let coarser = StreamPageId {
                    page: coarser,
                    ..page
                };
                self.page(coarser).is_some_and(waits_for)
            })
    }

    fn begin_loading(&mut self, page: StreamPageId, orders: &mut Orders) {
        let Some(mesh) = self.meshes.get_mut(&page.mesh) else {
            return;
        };
        let entry = &mut mesh.pages[page.page as usize];
        entry.state = PageState::Loading;
        self.statistics.loading_bytes += entry.loading_bytes;
        self.statistics.loading_gpu_bytes += entry.gpu_bytes;
        orders.load.push(page);
    }

    /// Evicts the least recently used pages until `bytes` more fit. Returns whether they fit. If they do not, nothing is
    /// evicted for them.
    fn make_room(&mut self, bytes: u64, orders: &mut Orders) -> bool {
        let held = self.statistics.resident_bytes + self.statistics.loading_gpu_bytes;
        let excess = (held + bytes).saturating_sub(self.settings.gpu_bytes);
        if excess == 0 {
            return true;
        }
        // The list is sorted once for all evictions of a frame.
        let mut idle = self.idle.take().unwrap_or_else(|| self.find_idle());
        let (mut freed, mut kept) = (0, idle.len());
        while freed < excess && kept > 0 {
            kept -= 1;
            freed += self.page(idle[kept]).map_or(0, |page| page.gpu_bytes);
        }
        let fits = freed >= excess;
        if fits || bytes == 0 {
            for page in idle.drain(kept..).rev() {
                self.evict(page, orders);
            }
        }
        self.idle = Some(idle);
        fits
    }

    /// Returns the pages that may be evicted, least recently used last.
    fn find_idle(&self) -> Vec<StreamPageId> {
        let idle = self
            .meshes
            .iter()
            .flat_map(|(&id, mesh)| self.idle_of(id, mesh));
        let mut idle: Vec<(StreamPageId, &PageEntry)> = idle.collect();
        // Among pages of the same frame, finer pages are evicted first, because they depend on coarser pages.
        idle.sort_unstable_by_key(|&(id, page)| (Reverse(page.used_at), id.page, id.mesh));
        idle.into_iter().map(|(id, _)| id).collect()
    }

    /// Returns the resident pages of a mesh that were not used in this frame, without its first page.
    fn idle_of<'a>(
        &self,
        mesh: StreamMeshId,
        pages: &'a MeshPages,
    ) -> impl Iterator<Item = (StreamPageId, &'a PageEntry)> {
        // First pages are never evicted.
        let pages = (0..).zip(&pages.pages).skip(1);
        let pages = pages.map(move |(page, entry)| (StreamPageId { mesh, page }, entry));
        let frame = self.frame;
        pages.filter(move |(_, page)| page.state == PageState::Resident && page.used_at < frame)
    }

    /// Evicts pages that were unused for longer than the setting. Each frame checks some of the meshes.
    fn evict_unused(&mut self, orders: &mut Orders) {
        let keep = self.settings.keep_unused;
        let is_unused = |page: &PageEntry| self.time - page.used_at_time > keep;
        // Each frame starts at another mesh, so the work is spread evenly over frames.
        let is_due =
            |id: &StreamMeshId| u64::from(id.0) % SWEEP_FRAMES == self.frame % SWEEP_FRAMES;
        let due = self.meshes.iter().filter(|(id, _)| is_due(id));
        let idle = due.flat_map(|(&id, mesh)| self.idle_of(id, mesh));
        let unused = idle.filter(|(_, page)| is_unused(page)).map(|(id, _)| id);
        for page in unused.collect::<Vec<StreamPageId>>() {
            self.evict(page, orders);
        }
    }

    fn evict(&mut self, page: StreamPageId, orders: &mut Orders) {
        let Some(mesh) = self.meshes.get_mut(&page.mesh) else {
            return;
        };
        let entry = &mut mesh.pages[page.page as usize];
        entry.state = PageState::Absent;
        self.statistics.resident_bytes -= entry.gpu_bytes;
        self.statistics.evicted += 1;
        orders.evict.push(page);
    }

    /// Reports that a page is loaded. Returns `false` if it was not being loaded, or if its mesh was removed.
    pub fn set_loaded(&mut self, page: StreamPageId) -> bool {
        let Some(entry) = self.end_loading(page) else {
            return false;
        };
        entry.state = PageState::Resident;
        entry.failures = 0;
        let (gpu_bytes, file_bytes) = (entry.gpu_bytes, entry.file_bytes());
        self.statistics.resident_bytes += gpu_bytes;
        self.statistics.loaded_file_bytes += file_bytes;
        self.statistics.loaded += 1;
        true
    }

    /// Reports that a page could not be loaded. It is retried later, with growing delays.
    pub fn set_failed(&mut self, page: StreamPageId) {
        let frame = self.frame;
        let Some(entry) = self.end_loading(page) else {
            return;
        };
        let [first, most] = RETRY_FRAMES;
        // Doubles with each failure. The shift is limited, because more failures would overflow it.
        let wait = first.saturating_mul(1 << entry.failures.min(16)).min(most);
        entry.failures += 1;
        entry.state = PageState::Failed {
            until: frame + wait,
        };
        self.statistics.failed += 1;
    }

    /// Ends the load of a page and returns it, if it was loading.
    fn end_loading(&mut self, page: StreamPageId) -> Option<&mut PageEntry> {
        let mesh = self.meshes.get_mut(&page.mesh)?;
        let entry = mesh.pages.get_mut(page.page as usize)?;
        // A page may be reported twice, or after its mesh was removed. Bytes must not be subtracted again.
        if entry.state != PageState::Loading {
            return None;
        }
        self.statistics.loading_bytes -= entry.loading_bytes;
        self.statistics.loading_gpu_bytes -= entry.gpu_bytes;
        Some(entry)
    }
}
