use std::ops::AddAssign;

use sabaki::anim::EventKind;

use crate::events::EventEntry;

/// Least overlap of a proposed and an annotated event that are the same one.
pub const MIN_OVERLAP: f64 = 0.5;

/// Agreement of proposed and annotated events.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Agreement {
    /// Number of proposed events.
    pub proposed: usize,
    /// Number of annotated events.
    pub annotated: usize,
    /// Number of pairs of a proposed and an annotated event that overlap by [`MIN_OVERLAP`] or more; each event is in one pair at most.
    pub found: usize,
    /// Number of those pairs that have a joint in common, or no joints.
    pub same_joints: usize,
}

impl Agreement {
    /// Share of the proposed events that are annotated; `None` without proposals.
    #[must_use]
    pub fn precision(&self) -> Option<f64> {
        (self.proposed > 0).then(|| self.found as f64 / self.proposed as f64)
    }

    /// Share of the annotated events that are proposed; `None` without annotations.
    #[must_use]
    pub fn recall(&self) -> Option<f64> {
        (self.annotated > 0).then(|| self.found as f64 / self.annotated as f64)
    }
}

impl AddAssign for Agreement {
    fn add_assign(&mut self, other: Self) {
        self.proposed += other.proposed;
        self.annotated += other.annotated;
        self.found += other.found;
        self.same_joints += other.same_joints;
    }
}

/// Overlap of two time ranges: their intersection over their union, 0 to 1.
#[must_use]
pub fn overlap(a: &EventEntry, b: &EventEntry) -> f64 {
    let both = (a.end.min(b.end) - a.start.max(b.start)).max(0.0);
    let either = (a.end - a.start) + (b.end - b.start) - both;
    if either > 0.0 { both / either } else { 0.0 }
}

/// Compares the events of one kind and one clip. Pairs are made from the largest overlap on.
#[must_use]
pub fn agreement(kind: EventKind, proposed: &[EventEntry], annotated: &[EventEntry]) -> Agreement {
    let of_kind = |events: &[EventEntry]| -> Vec<EventEntry> {
        let own = events.iter().filter(|event| event.kind == kind);
        own.cloned().collect()
    };
    let (mut proposed, mut annotated) = (of_kind(proposed), of_kind(annotated));
    let mut counts = Agreement {
        proposed: proposed.len(),
        annotated: annotated.len(),
        ..Agreement::default()
    };
    while let Some((own, other)) = best_pair(&proposed, &annotated) {
        let (own, other) = (proposed.swap_remove(own), annotated.swap_remove(other));
        let none = own.joints.is_empty() && other.joints.is_empty();
        let shared = own.joints.iter().any(|joint| other.joints.contains(joint));
        counts.found += 1;
        counts.same_joints += usize::from(none || shared);
    }
    counts
}

/// Indices of the two events that overlap most, if they are the same one.
fn best_pair(proposed: &[EventEntry], annotated: &[EventEntry]) -> Option<(usize, usize)> {
    let pairs = (0..proposed.len()).flat_map(|a| (0..annotated.len()).map(move |b| (a, b)));
    let of = |&(a, b): &(usize, usize)| overlap(&proposed[a], &annotated[b]);
    pairs
        .filter(|pair| of(pair) >= MIN_OVERLAP)
        .max_by(|a, b| of(a).total_cmp(&of(b)))
}
