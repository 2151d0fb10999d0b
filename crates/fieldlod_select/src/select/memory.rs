//! What a view remembers of instances: how each is drawn, and the limits within which that stays so.

use crate::criterion::limits::{ErrorUnits, Limits};
use crate::hidden::held_shares::LevelShare;
use crate::lanes::bits::{CHUNK, LANES};
use crate::lanes::{Lane, bits_of};
use crate::scene::{MeshId, Scene};
use wide::f32x8;

/// How an instance is drawn.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct InstanceMemory {
    pub(crate) state: InstanceState,
    /// Which of the instances that had the index one after the other.
    pub(crate) generation: u32,
    /// The version of the instance that this was decided for.
    pub(crate) version: u32,
    /// What counts of it where hidden things count less, of a mesh that is drawn as a whole.
    pub(crate) share: LevelShare,
}

#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) enum InstanceState {
    /// Not selected yet, or removed, or on other layers: draws nothing.
    #[default]
    Empty,
    /// Too small to be drawn.
    Culled,
    /// Only what always is refined is refined. The scene may have removed the instance since.
    Coarsest(MeshId),
    /// The mesh as a whole at one level, finer than the coarsest.
    AtLevel(MeshId, u8),
    /// A cut of its own, by its key in the pool.
    Mixed(u32),
}

impl InstanceState {
    /// The units drawn without a cut of one's own, and their triangles.
    pub(crate) fn drawn_whole(self, scene: &Scene) -> (&[u32], u64) {
        match self {
            Self::Coarsest(mesh) => {
                let table = scene.table(mesh);
                (&table.coarsest_units, table.coarsest_triangle_count)
            }
            Self::AtLevel(mesh, level) => scene.table(mesh).drawn_at_level(usize::from(level)),
            _ => (&[], 0),
        }
    }

    /// Whether a view draws it.
    pub(crate) fn is_drawn(self) -> bool {
        matches!(self, Self::Coarsest(_) | Self::AtLevel(..) | Self::Mixed(_))
    }

    /// Within which limits an instance that is not forced to a level stays so. At finer levels it has to be decided
    /// anew in each frame if hidden things count less.
    pub(crate) fn limits(
        self,
        scene: &Scene,
        index: usize,
        units: &ErrorUnits,
        hides: bool,
    ) -> Limits {
        let (mesh, level) = match self {
            Self::Empty => return Limits::EMPTY,
            Self::Culled => return Limits::CULLED,
            Self::Mixed(_) => return Limits::UNKNOWN,
            Self::AtLevel(..) if hides => return Limits::UNKNOWN,
            Self::Coarsest(mesh) => (mesh, None),
            Self::AtLevel(mesh, level) => (mesh, Some(usize::from(level))),
        };
        let errors = scene.table(mesh).errors_at(level);
        let scale = scene.columns.error_scales[index];
        errors.limits(units, 1.0).scaled(scale)
    }
}

/// Limits of all instances in columns, eight to an element, and of 64 at once.
#[derive(Debug, Default)]
pub(crate) struct LimitColumns {
    pub(crate) instances: Vec<EightLimits>,
    /// Of all instances of a chunk.
    pub(crate) chunks: Vec<EightLimits>,
}

/// The limits of eight instances.
#[derive(Clone, Copy, Debug)]
pub(crate) struct EightLimits {
    pub(crate) lowest: [f32; LANES],
    pub(crate) highest: [f32; LANES],
}

impl EightLimits {
    const EMPTY: Self = Self {
        lowest: [Limits::EMPTY.lowest; LANES],
        highest: [Limits::EMPTY.highest; LANES],
    };

    fn set(&mut self, lane: usize, limits: Limits) {
        (self.lowest[lane], self.highest[lane]) = (limits.lowest, limits.highest);
    }
}

impl LimitColumns {
    /// Makes room for so many instances.
    pub(crate) fn resize(&mut self, count: usize) {
        let elements = count.div_ceil(LANES);
        self.instances.resize(elements, EightLimits::EMPTY);
        let chunks = elements.div_ceil(CHUNK / LANES).div_ceil(LANES);
        self.chunks.resize(chunks, EightLimits::EMPTY);
    }

    pub(crate) fn set(&mut self, index: usize, limits: Limits) {
        self.instances[index / LANES].set(index % LANES, limits);
        self.end_chunk(index / CHUNK);
    }

    /// Lets a chunk be looked at instance by instance.
    fn end_chunk(&mut self, chunk: usize) {
        self.chunks[chunk / LANES].set(chunk % LANES, Limits::UNKNOWN);
    }

    /// Finds the limits of a chunk: those of the coarsest levels if all instances are there.
    pub(crate) fn refit(&mut self, chunk: usize) {
        let first = chunk * (CHUNK / LANES);
        let end = self.instances.len().min(first + CHUNK / LANES);
        let mut highest = f32x8::splat(f32::NEG_INFINITY);
        let mut are_coarsest = f32x8::infinity().is_at_most(f32x8::infinity());
        for eight in &self.instances[first..end] {
            // NaN must not get lost.
            let (lowest, other) = (f32x8::new(eight.lowest), f32x8::new(eight.highest));
            highest = f32x8::choose(other.is_at_most(highest), highest, other);
            are_coarsest &= f32x8::infinity().is_at_most(lowest) & other.is_at_most(other);
        }
        let limits = match bits_of(are_coarsest) {
            0xff => Limits {
                lowest: f32::INFINITY,
                highest: highest
                    .to_array()
                    .into_iter()
                    .fold(f32::NEG_INFINITY, f32::max),
            },
            _ => Limits::UNKNOWN,
        };
        self.chunks[chunk / LANES].set(chunk % LANES, limits);
    }

    pub(crate) fn clear(&mut self) {
        self.instances.clear();
        self.chunks.clear();
    }

    #[cfg(test)]
    pub(crate) fn capacity(&self) -> usize {
        self.instances.capacity() + self.chunks.capacity()
    }
}
