//! Proposes events: finds attacks and evasions in clips that nobody has annotated.
//!
//! All lengths are measured in statures (heights of the figure), so that settings fit figures of any size and files of any unit.
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
pub fn propose(skeleton: &Skeleton, clip: &Clip, settings: &AnnotateSettings) -> Vec<EventEntry> {
    let Some(body) = Body::of(skeleton, clip) else {
        return Vec::new();
    };
    let seconds = |frame: usize| rounded(frame as f64 / body.rate, 1e3);
    let attacks = attacks::find(&body, &settings.attacks);
    let attacks = attacks.iter().map(|strike| EventEntry {
        kind: EventKind::Attack,
        start: seconds(strike.start),
        end: seconds(strike.end),
        joints: vec![skeleton.joint(strike.joint).name.clone()],
        contact: Some(seconds(strike.contact)),
        confidence: Some(confidence(strike.score / settings.attacks.min_score)),
    });
    let evasions = evasions::find(&body, &settings.evasions);
    let evasions = evasions.iter().map(|evasion| EventEntry {
        kind: EventKind::Evasion,
        start: seconds(evasion.start),
        end: seconds(evasion.end),
        joints: Vec::new(),
        contact: None,
        confidence: Some(confidence(evasion.score)),
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

/// Criteria of events. A stature is the height of the figure.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct AnnotateSettings {
    /// Attacks.
    pub attacks: AttackSettings,
    /// Evasions.
    pub evasions: EvasionSettings,
}

/// Criteria of attacks.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AttackSettings {
    /// Least peak speed of the hand or foot, in statures per second. Default: 1.95.
    pub min_peak_speed: f32,
    /// An attack begins when the speed rises above this value, in statures per second. Default: 0.53.
    pub start_speed: f32,
    /// An attack ends when the speed falls below this share of the peak. Default: 0.35.
    pub end_share: f32,
    /// Longest time from the start to the peak, in seconds. Default: 0.4.
    pub max_rise: f32,
    /// Longest time from the peak until the speed has fallen, in seconds. Default: 0.3.
    pub max_fall: f32,
    /// Time that is added behind the fall of the speed, for the limb at full reach, in seconds. Default: 0.07.
    pub full_reach: f32,
    /// Least time from the contact to the end, in seconds. Default: 0.13, a part of the return: some annotators count none of it,
    /// others all.
    pub after_contact: f32,
    /// Least score: peak speed times gain in reach, in square statures per second. Default: 0.35.
    pub min_score: f32,
    /// Least height of the hand or foot at the contact over the lowest hand or foot at that time, in statures. It excludes steps.
    /// Default: 0.22.
    pub min_height: f32,
}

impl Default for AttackSettings {
    fn default() -> Self {
        Self {
            min_peak_speed: 1.95,
            start_speed: 0.53,
            end_share: 0.35,
            max_rise: 0.4,
            max_fall: 0.3,
            full_reach: 0.07,
            after_contact: 0.13,
            min_score: 0.35,
            min_height: 0.22,
        }
    }
}

/// Criteria of evasions.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EvasionSettings {
    /// The trunk moves while head or root is faster than this value, in statures per second. Default: 0.15.
    pub min_speed: f32,
    /// Least peak speed of head or root, in statures per second. Default: 0.31.
    pub min_peak_speed: f32,
    /// Shortest evasion, in seconds. Default: 0.3.
    pub min_seconds: f32,
    /// Longest rest that does not end an evasion, in seconds. Default: 0.25.
    pub max_gap: f32,
    /// Longest rest in a posture away from the first, in seconds. Default: 0.8.
    pub max_hold: f32,
    /// Distance of the head from its place over the root at the start, from which on it counts as away, in statures. Default: 0.07.
    pub away: f32,
    /// Least lean of a dodge: displacement of the head against the root along the ground, in statures. Default: 0.115.
    pub min_lean: f32,
    /// Least drop of the head of a duck, in statures. Default: 0.105.
    pub min_drop: f32,
    /// Longest evasion, in seconds. Default: 2.5.
    pub max_seconds: f32,
    /// Least distance of an evasive step, in statures. Default: 0.265.
    pub min_travel: f32,
    /// Largest cosine of the angle between an evasive step and the direction of the guard. Default: 0.5.
    pub max_forward: f32,
    /// Least mean height of the hands over the root during an evasive step, in statures. It excludes walks. Default: 0.05.
    pub min_guard: f32,
    /// Largest speed of a hand relative to the root, in statures per second. It excludes attacks and blocks. Dodges and
    /// ducks of twice the least displacement may have twice this speed. Default: 1.2.
    pub max_hand_speed: f32,
}

impl Default for EvasionSettings {
    fn default() -> Self {
        Self {
            min_speed: 0.15,
            min_peak_speed: 0.31,
            min_seconds: 0.3,
            max_gap: 0.25,
            max_hold: 0.8,
            away: 0.07,
            min_lean: 0.115,
            min_drop: 0.105,
            max_seconds: 2.5,
            min_travel: 0.265,
            max_forward: 0.5,
            min_guard: 0.05,
            max_hand_speed: 1.2,
        }
    }
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
