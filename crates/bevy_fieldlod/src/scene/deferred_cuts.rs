//! Cuts that wait for their units, where only so many may be spawned in a frame.

use fieldlod_select::InstanceId;

/// The cuts of one view that are not drawn yet: what was drawn before is drawn on until all units of the next
/// one are there.
#[derive(Default)]
pub(crate) struct DeferredCuts(pub(crate) Vec<DeferredCut>);

/// The next cut of one instance.
pub(crate) struct DeferredCut {
    pub(crate) instance: InstanceId,
    /// Its units: a cut that the selector gave once, which may have gone on since; `None` before the first.
    pub(crate) units: Option<Vec<u32>>,
    /// How many of them have a record, which counts this view.
    pub(crate) held: usize,
}

impl DeferredCut {
    /// The units of the cut that is waited for.
    pub(crate) fn units(&self) -> &[u32] {
        self.units.as_deref().unwrap_or_default()
    }
}

impl DeferredCuts {
    /// Whether the cut of an instance is deferred.
    pub(crate) fn contains(&self, instance: InstanceId) -> bool {
        self.0.iter().any(|cut| cut.instance == instance)
    }

    /// Defers the cut of an instance.
    pub(crate) fn push(&mut self, instance: InstanceId) {
        self.0.push(DeferredCut {
            instance,
            units: None,
            held: 0,
        });
    }
}
