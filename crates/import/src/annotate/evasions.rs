//! Evasions: head or trunk leaves its place fast, and the body regains its balance, while the hands do nothing fast.
//!
//! The method is ours. A clip is cut into ranges in which head or root moves and no limb attacks; a rest in a posture away from the first
//! belongs to the range. A range is an evasion if the head leans sideways or back from its place over the root and returns (dodge), if it
//! drops and rises again (duck), or if the body, in guard, travels sideways or back, fast from the first moment on, and comes to rest (step,
//! retreat).

use std::ops::{Range, RangeInclusive};

use glam::Vec3;

use super::attacks::Strike;
use super::body::{Body, between, largest, smoothed, speeds};

/// The trunk moves while head or root is faster than this, in statures per second.
const MIN_SPEED: f32 = 0.15;
/// Least peak speed of head or root, in statures per second.
const MIN_PEAK_SPEED: f32 = 0.45;
/// Shortest and longest evasion, in seconds.
const SECONDS: RangeInclusive<f32> = 0.3..=2.5;
/// Longest rest that does not end an evasion, in seconds; and in a posture away from the first.
const MAX_GAP: f32 = 0.25;
const MAX_HOLD: f32 = 0.8;
/// Distance of the head from its place over the root at the start, from which on it counts as away, in statures.
const AWAY: f32 = 0.07;
/// Least lean of a dodge: displacement of the head against the root along the ground, in statures.
const MIN_LEAN: f32 = 0.09;
/// Largest cosine of the angle between a lean and the direction that the body faces. Bows and reaches lean forward.
const MAX_BOW: f32 = 0.8;
/// Least drop of the head of a duck, in statures.
const MIN_DROP: f32 = 0.1;
/// Least distance of an evasive step, in statures, and least speed over the largest part of it, in statures per second.
const MIN_TRAVEL: f32 = 0.2;
const MIN_STEP_SPEED: f32 = 0.4;
/// Largest cosine of the angle between an evasive step and the direction of the guard.
const MAX_FORWARD: f32 = 0.5;
/// Least mean height of the hands over the root during an evasive step, in statures. It excludes walks.
const MIN_GUARD: f32 = 0.05;
/// Largest speed of a hand relative to the root, in statures per second, and that for each multiple of the least displacement of a dodge or a
/// duck. It excludes attacks and blocks.
const MAX_HAND_SPEED: (f32, f32) = (1.2, 1.0);
/// Half width of the window that smooths the trunk's places, in seconds.
const SMOOTHING: f64 = 0.12;
/// Largest share of the lean, and of the drop, that is left at the end.
const LEAN_LEFT: f32 = 0.6;
const DROP_LEFT: f32 = 0.5;

/// Least distance of the hands from the root along the ground that tells where a guard faces, in statures. A fighter stands half
/// sideways, so that the pelvis alone does not tell it.
const GUARD_REACH: f32 = 0.1;

/// The frames of an evasion, and its displacement as a multiple of the least that counts.
type Evasion = (Range<usize>, f32);

struct Trunk<'a> {
    body: &'a Body,
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

impl<'a> Trunk<'a> {
    fn of(body: &'a Body) -> Self {
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
            body,
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

    /// The ranges of frames in which the trunk moves; the last frame of each moves. A rest in a posture away from the first may
    /// last `hold` frames.
    fn moves(&self, within: Range<usize>, hold: usize) -> Vec<Range<usize>> {
        let gap = self.body.frames(MAX_GAP);
        let mut ranges: Vec<Range<usize>> = Vec::new();
        for frame in within {
            if self.speeds[frame] <= MIN_SPEED {
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
        let is_away = |frame| self.away(frame, rest) >= AWAY;
        frame - range.end <= hold && (range.end..frame).all(is_away)
    }

    /// Whether a range of a score is as long as an evasion, no walk, and the hands are no faster than the body's own movement makes them.
    fn is_quiet(&self, range: &Range<usize>, score: f32) -> bool {
        let hands = largest(self.hand_speeds[range.clone()].iter().copied());
        let limit = MAX_HAND_SPEED.0.max(MAX_HAND_SPEED.1 * score);
        let travels = self.body.travels[range.clone()]
            .iter()
            .filter(|&&travels| travels);
        SECONDS.contains(&self.seconds(range))
            && hands <= limit
            && 2 * travels.count() <= range.len()
    }

    fn seconds(&self, range: &Range<usize>) -> f32 {
        (range.len() - 1) as f32 / self.body.rate as f32
    }

    /// A dodge or a duck.
    fn returns(&self, range: &Range<usize>) -> Option<Evasion> {
        let head = largest(self.head_speeds[range.clone()].iter().copied());
        let is_fast = head > MIN_PEAK_SPEED;
        let score = self.dodge(range.clone()).hypot(self.duck(range.clone()));
        let fits = is_fast && self.is_quiet(range, score);
        (fits && score >= 1.0).then(|| (range.clone(), score))
    }

    /// A step or a retreat.
    fn steps(&self, range: &Range<usize>) -> Option<Evasion> {
        let score = self.step(range.clone());
        (self.is_quiet(range, 1.0) && score >= 1.0).then(|| (range.clone(), score))
    }

    /// Lean away and back, as a multiple of the least that counts; 0 if the range is no dodge.
    fn dodge(&self, range: Range<usize>) -> f32 {
        let start = range.start.saturating_sub(1);
        let last = range.end - 1;
        let lean = |frame: usize| (self.lean[frame] - self.lean[start]).with_y(0.0);
        let furthest = |a: &usize, b: &usize| lean(*a).length().total_cmp(&lean(*b).length());
        let most = lean(range.max_by(furthest).unwrap_or(start));
        let is_bow = most.dot(self.body.facing[start]) > MAX_BOW * most.length();
        match !is_bow && lean(last).length() < LEAN_LEFT * most.length() {
            true => most.length() / MIN_LEAN,
            false => 0.0,
        }
    }

    /// Drop of the head and rise, as a multiple of the least that counts; 0 if the range is no duck.
    fn duck(&self, range: Range<usize>) -> f32 {
        let rest = self.head[range.start.saturating_sub(1)].y;
        let drop = |frame: usize| rest - self.head[frame].y;
        let most = largest(range.clone().map(drop));
        match drop(range.end - 1) < DROP_LEFT * most {
            true => most / MIN_DROP,
            false => 0.0,
        }
    }

    /// Distance sideways or back in guard, as a multiple of the least that counts; 0 if the range is no step.
    fn step(&self, range: Range<usize>) -> f32 {
        let Some(guard) = &self.guard else {
            return 0.0;
        };
        let middle = |frame: usize| 0.5 * (self.head[frame] + self.root[frame]);
        let way = (middle(range.end - 1) - middle(range.start)).with_y(0.0);
        let rest = range.start.saturating_sub(1);
        let hands = guard[rest].with_y(0.0);
        let ahead = match hands.length() >= GUARD_REACH {
            true => hands.normalize(),
            false => self.body.facing[rest],
        };
        let forward = way.normalize_or_zero().dot(ahead);
        let height: f32 = guard[range.clone()].iter().map(|place| place.y).sum();
        let height = height / range.len() as f32;
        let peak = largest(self.speeds[range.clone()].iter().copied());
        // The frames between a tenth of the way and nine tenths.
        let gone = |frame: usize| (middle(frame) - middle(range.start)).with_y(0.0).length();
        let before = |share: f32| {
            range
                .clone()
                .take_while(move |&at| gone(at) < share * way.length())
        };
        let frames = before(0.9).count() - before(0.1).count();
        let speed = 0.8 * way.length() * self.body.rate as f32 / frames.max(1) as f32;
        let is_step = forward < MAX_FORWARD
            && height > MIN_GUARD
            && peak > MIN_PEAK_SPEED
            && speed > MIN_STEP_SPEED;
        match is_step {
            true => way.length() / MIN_TRAVEL,
            false => 0.0,
        }
    }
}

pub(super) fn find(body: &Body, strikes: &[Strike]) -> Vec<Evasion> {
    let trunk = Trunk::of(body);
    let hold = body.frames(MAX_HOLD);
    let strikes_in = |frame: &usize| {
        let mut strikes = strikes.iter();
        strikes.any(|strike| (strike.start..=strike.end).contains(frame))
    };
    let frames: Vec<usize> = (0..body.root.len()).collect();
    let free = frames.chunk_by(|a, b| strikes_in(a) == strikes_in(b));
    let free = free.filter(|part| !strikes_in(&part[0]));
    let free = free.map(|part| part[0]..part[0] + part.len());
    let mut found = Vec::new();
    for range in free.flat_map(|part| trunk.moves(part, hold)) {
        match trunk.returns(&range) {
            Some(evasion) => found.push(evasion),
            None => {
                let moves = trunk.moves(range, 0);
                found.extend(moves.iter().filter_map(|range| trunk.steps(range)));
            }
        }
    }
    found
}
