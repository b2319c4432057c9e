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
