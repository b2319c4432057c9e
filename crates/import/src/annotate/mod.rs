//! Proposes events: finds attacks and evasions in clips that nobody has annotated.
//!
//! An attack is a limb that reaches away from the body and returns, faster than walking needs. An evasion is a head or trunk that leaves
//! its place fast, and a body that regains its balance: it comes back, or it stands elsewhere.
//!
//! All lengths are measured in statures (heights of the figure), so that the criteria fit figures of any size and files of any unit.
//! Names of files are not used. A figure that walks or runs neither attacks nor evades.

mod attacks;
mod body;
mod evasions;

use std::ops::AddAssign;

use sabaki::anim::{Clip, EventKind, Skeleton};

use crate::EventEntry;
use body::Body;

/// Proposes the events of a clip, in the order of their starts. Each has a confidence; attacks have the time of contact.
///
/// Attacks need hands or feet that joint names identify (`hand`, `wrist`, `foot`, `ankle`). A clip of fewer than three frames, or
/// of a figure without height, has no events.
#[must_use]
pub fn propose(skeleton: &Skeleton, clip: &Clip) -> Vec<EventEntry> {
    let Some(body) = Body::of(skeleton, clip) else {
        return Vec::new();
    };
    let seconds = |frame: usize| rounded(frame as f64 / body.rate, 1e3);
    let strikes = attacks::find(&body);
    let attacks = strikes.iter().map(|strike| EventEntry {
        kind: EventKind::Attack,
        start: seconds(strike.start),
        end: seconds(strike.end),
        joints: vec![skeleton.joint(strike.joint).name.clone()],
        contact: Some(seconds(strike.contact)),
        confidence: Some(confidence(strike.score / attacks::MIN_SCORE)),
    });
    let evasions = evasions::find(&body, &strikes);
    let evasions = evasions.iter().map(|(frames, score)| EventEntry {
        kind: EventKind::Evasion,
        start: seconds(frames.start),
        end: seconds(frames.end - 1),
        joints: Vec::new(),
        contact: None,
        confidence: Some(confidence(*score)),
    });
    let mut events: Vec<EventEntry> = attacks.chain(evasions).collect();
    events.sort_by(|a, b| a.start.total_cmp(&b.start).then(a.end.total_cmp(&b.end)));
    without_twins(events)
}

/// Makes one event of several of one kind that would have the same frames in a graph, with the joints of all.
fn without_twins(events: Vec<EventEntry>) -> Vec<EventEntry> {
    /// Least difference of two starts or ends in a graph of 30 frames per second, in seconds.
    const FRAME: f64 = 1.0 / 30.0;
    let mut kept: Vec<EventEntry> = Vec::new();
    for event in events {
        let is_same = |other: &&mut EventEntry| {
            let apart = (other.start - event.start)
                .abs()
                .max((other.end - event.end).abs());
            other.kind == event.kind && apart < FRAME
        };
        match kept.iter_mut().find(is_same) {
            None => kept.push(event),
            Some(other) => {
                let new = event.joints.into_iter();
                let new: Vec<String> = new.filter(|name| !other.joints.contains(name)).collect();
                other.joints.extend(new);
                let confidences = [other.confidence, event.confidence].into_iter().flatten();
                other.confidence = confidences.reduce(f64::max);
            }
        }
    }
    kept
}

/// 0.5 for a score of 1, the least that is proposed; near 1 for many times that.
fn confidence(score: f32) -> f64 {
    rounded(1.0 - 0.5 / f64::from(score.max(1.0)), 1e2)
}

fn rounded(value: f64, parts: f64) -> f64 {
    (value * parts).round() / parts
}

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
