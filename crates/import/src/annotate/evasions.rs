//! Evasions: fast displacements of head and trunk while the hands do nothing fast.
//!
//! The method is ours. A clip is cut into ranges in which head or root moves; a rest in a posture away from the first belongs to
//! the range. A range is an evasion if the head leans away from its place over the root and returns (dodge), if it drops and
//! rises again (duck), or if the body, in guard, travels sideways or back and comes to rest (step, retreat).

use std::ops::Range;

use glam::Vec3;

use super::EvasionSettings;
use super::body::{Body, between, largest, smoothed, speeds};

/// Half width of the window that smooths the trunk's places, in seconds.
const SMOOTHING: f64 = 0.12;
/// Largest share of the lean, and of the drop, that is left at the end.
const LEAN_LEFT: f32 = 0.6;
const DROP_LEFT: f32 = 0.5;

/// Least distance of the hands from the root along the ground that tells where a guard faces, in statures. A fighter stands half
/// sideways, so that the pelvis alone does not tell it.
const GUARD_REACH: f32 = 0.1;

/// An evasion. Times are frames.
#[derive(Clone, Debug)]
pub(super) struct Evasion {
    pub(super) start: usize,
    pub(super) end: usize,
    /// Displacement as a multiple of the least that counts.
    pub(super) score: f32,
}

impl Evasion {
    fn new(range: &Range<usize>, score: f32) -> Self {
        Self {
            start: range.start,
            end: range.end - 1,
            score,
        }
    }
}

/// Curves of the trunk.
struct Trunk {
    root: Vec<Vec3>,
    head: Vec<Vec3>,
    /// Vector from the root to the head, in statures.
    lean: Vec<Vec3>,
    head_speeds: Vec<f32>,
    /// Speed of head or root, whichever is faster.
    speeds: Vec<f32>,
    /// Speed of the fastest hand relative to the root.
    hand_speeds: Vec<f32>,
    /// Vector from the root to the middle of the hands, in statures, if there are hands.
    guard: Option<Vec<Vec3>>,
}

impl Trunk {
    fn of(body: &Body) -> Self {
        let root = smoothed(&body.root, SMOOTHING, body.rate);
        let head = smoothed(&body.head, SMOOTHING, body.rate);
        let head_speeds = speeds(&head, body.rate);
        let root_speeds = speeds(&root, body.rate);
        let hands = body.hands.len() as f32;
        let middle = |frame: usize| {
            let sum: Vec3 = body.hands.iter().map(|hand| hand.places[frame]).sum();
            sum / hands - body.root[frame]
        };
        Self {
            lean: between(&head, &root),
            speeds: head_speeds
                .iter()
                .zip(root_speeds)
                .map(|(a, b)| a.max(b))
                .collect(),
            hand_speeds: body.hand_speeds(),
            guard: (!body.hands.is_empty()).then(|| (0..root.len()).map(middle).collect()),
            root,
            head,
            head_speeds,
        }
    }

    /// Distance of the head from its place over the root in another frame, with its drop.
    fn away(&self, frame: usize, from: usize) -> f32 {
        let drop = self.head[from].y - self.head[frame].y;
        self.lean[frame].distance(self.lean[from]) + drop.max(0.0)
    }
}

/// All evasions of a body, by time.
pub(super) fn find(body: &Body, settings: &EvasionSettings) -> Vec<Evasion> {
    let finder = Finder {
        body,
        settings,
        trunk: Trunk::of(body),
    };
    let all = 0..body.root.len();
    let hold = body.frames(settings.max_hold);
    let mut found = Vec::new();
    for range in finder.moves(all, hold) {
        match finder.returns(&range) {
            Some(evasion) => found.push(evasion),
            None => found.extend(
                finder
                    .moves(range, 0)
                    .iter()
                    .filter_map(|range| finder.steps(range)),
            ),
        }
    }
    found
}

struct Finder<'a> {
    body: &'a Body,
    settings: &'a EvasionSettings,
    trunk: Trunk,
}

impl Finder<'_> {
    /// The ranges of frames in which the trunk moves; the last frame of each moves. A rest in a posture away from the first may
    /// last `hold` frames.
    fn moves(&self, within: Range<usize>, hold: usize) -> Vec<Range<usize>> {
        let gap = self.body.frames(self.settings.max_gap);
        let mut ranges: Vec<Range<usize>> = Vec::new();
        for frame in within {
            if self.trunk.speeds[frame] <= self.settings.min_speed {
                continue;
            }
            match ranges.last_mut() {
                Some(range) if frame - range.end <= gap || self.holds(range, frame, hold) => {
                    range.end = frame + 1;
                }
                _ => ranges.push(frame..frame + 1),
            }
        }
        ranges
    }

    /// Whether the head stays away from its place over the root from a range's end to `frame`, for `hold` frames at most.
    fn holds(&self, range: &Range<usize>, frame: usize, hold: usize) -> bool {
        let rest = range.start.saturating_sub(1);
        let is_away = |frame| self.trunk.away(frame, rest) >= self.settings.away;
        frame - range.end <= hold && (range.end..frame).all(is_away)
    }

    /// Whether a range of a score is as long as an evasion, no walk, and the hands are no faster than the body's own movement makes them.
    fn is_quiet(&self, range: &Range<usize>, score: f32) -> bool {
        let hands = largest(self.trunk.hand_speeds[range.clone()].iter().copied());
        let limit = self.settings.max_hand_speed * score.max(1.0);
        let travels = self.body.travels[range.clone()]
            .iter()
            .filter(|&&travels| travels);
        let (shortest, longest) = (self.settings.min_seconds, self.settings.max_seconds);
        let fits = (shortest..=longest).contains(&self.seconds(range));
        fits && hands <= limit && 2 * travels.count() <= range.len()
    }

    fn seconds(&self, range: &Range<usize>) -> f32 {
        (range.len() - 1) as f32 / self.body.rate as f32
    }

    /// A dodge or a duck.
    fn returns(&self, range: &Range<usize>) -> Option<Evasion> {
        let head = largest(self.trunk.head_speeds[range.clone()].iter().copied());
        let is_fast = head > self.settings.min_peak_speed;
        let score = self.dodge(range.clone()).hypot(self.duck(range.clone()));
        let fits = is_fast && self.is_quiet(range, score);
        (fits && score >= 1.0).then(|| Evasion::new(range, score))
    }

    /// A step or a retreat.
    fn steps(&self, range: &Range<usize>) -> Option<Evasion> {
        let score = self.step(range.clone());
        (self.is_quiet(range, 1.0) && score >= 1.0).then(|| Evasion::new(range, score))
    }

    /// Lean away and back, as a multiple of the least that counts; 0 if the range is no dodge.
    fn dodge(&self, range: Range<usize>) -> f32 {
        let rest = self.trunk.lean[range.start.saturating_sub(1)];
        let lean = |frame: usize| (self.trunk.lean[frame] - rest).with_y(0.0).length();
        let most = largest(range.clone().map(lean));
        if lean(range.end - 1) < LEAN_LEFT * most {
            most / self.settings.min_lean
        } else {
            0.0
        }
    }

    /// Drop of the head and rise, as a multiple of the least that counts; 0 if the range is no duck.
    fn duck(&self, range: Range<usize>) -> f32 {
        let rest = self.trunk.head[range.start.saturating_sub(1)].y;
        let drop = |frame: usize| rest - self.trunk.head[frame].y;
        let most = largest(range.clone().map(drop));
        if drop(range.end - 1) < DROP_LEFT * most {
            most / self.settings.min_drop
        } else {
            0.0
        }
    }

    /// Distance sideways or back in guard, as a multiple of the least that counts; 0 if the range is no step.
    fn step(&self, range: Range<usize>) -> f32 {
        let Some(guard) = &self.trunk.guard else {
            return 0.0;
        };
        let middle = |frame: usize| 0.5 * (self.trunk.head[frame] + self.trunk.root[frame]);
        let way = (middle(range.end - 1) - middle(range.start)).with_y(0.0);
        let rest = range.start.saturating_sub(1);
        let hands = guard[rest].with_y(0.0);
        let ahead = if hands.length() >= GUARD_REACH {
            hands.normalize()
        } else {
            self.body.facing[rest]
        };
        let forward = way.normalize_or_zero().dot(ahead);
        let height: f32 = guard[range.clone()].iter().map(|place| place.y).sum();
        let height = height / range.len() as f32;
        let peak = largest(self.trunk.speeds[range].iter().copied());
        let is_step = forward < self.settings.max_forward
            && height > self.settings.min_guard
            && peak > self.settings.min_peak_speed;
        if is_step {
            way.length() / self.settings.min_travel
        } else {
            0.0
        }
    }
}
