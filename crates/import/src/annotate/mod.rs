//! Proposes events: finds attacks and evasions in clips that nobody has annotated.
//!
//! All lengths are measured in statures (heights of the figure), so that settings fit figures of any size and files of any unit.
//! Names of files are not used.

mod agreement;
mod attacks;
mod body;
mod curves;
mod evasions;
mod settings;

pub use agreement::{Agreement, MIN_OVERLAP, agreement, overlap};
pub use settings::{AnnotateSettings, AttackSettings, EvasionSettings};

use sabaki::anim::{Clip, EventKind, Skeleton};

use super::events::EventEntry;
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
    events
}

/// The curves that events are found by, for pictures. Speeds in statures per second, one for each frame.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct SpeedCurves {
    /// Speed of the fastest hand or foot, relative to the root.
    pub limbs: Vec<f32>,
    /// Speed of the head or of the root, whichever is faster.
    pub trunk: Vec<f32>,
}

impl SpeedCurves {
    /// The curves of a clip; empty for a clip of fewer than three frames or a figure without height.
    #[must_use]
    pub fn of(skeleton: &Skeleton, clip: &Clip) -> Self {
        let Some(body) = Body::of(skeleton, clip) else {
            return Self::default();
        };
        let in_frames = |curve: Vec<f32>| curves::in_frames(&curve, body.rate, clip);
        Self {
            limbs: in_frames(body.limb_speeds(body.limbs())),
            trunk: in_frames(evasions::Trunk::of(&body).speeds),
        }
    }
}

/// 0.5 for a score of 1, the least that is proposed; near 1 for many times that.
fn confidence(score: f32) -> f64 {
    rounded(1.0 - 0.5 / f64::from(score.max(1.0)), 1e2)
}

fn rounded(value: f64, parts: f64) -> f64 {
    (value * parts).round() / parts
}
