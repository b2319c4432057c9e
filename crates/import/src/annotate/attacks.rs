//! Attacks: a hand or foot reaches away from the body and returns, faster than walking needs.
//!
//! The method is ours. Each local maximum of a limb's speed is a candidate. Its time range is where the limb is fast; its score is
//! the peak speed times the gain in reach. The gain is the geometric mean of two gains of the distance from the root: along the
//! ground, which blocks lack, and in space, which swings of the arms lack. A limb that stays where it came to, as in a new stance, does not
//! attack. The body goes along with a strike: a limb that is slower in space than relative to the root swings, as in a dance, and a limb
//! that is faster may be slower than other strikes, as a jab. Of overlapping candidates the best is kept (non-maximum suppression).

use glam::Vec3;
use sabaki::anim::JointId;

use super::body::{Body, Limb, between, largest, least, speeds};

/// Least peak speed of the hand or foot, in statures per second; and that of one which the body carries along.
const MIN_PEAK_SPEED: f32 = 1.75;
const MIN_CARRIED_SPEED: f32 = 1.4;
/// Least ratio of the peak speed to the speed relative to the root: of strikes, and of slower ones, which the body carries along.
const ALONG: f32 = 0.9;
const CARRIED: f32 = 1.1;
/// Speed above which an attack begins, in statures per second, and share of the peak speed below which it ends.
const START_SPEED: f32 = 0.53;
const END_SHARE: f32 = 0.35;
/// Longest time from the start until the limb is nearest to the body, in seconds.
const DRAWN: f32 = 0.1;
/// Longest time from the start to the peak, and from there until the speed has fallen, in seconds.
const MAX_RISE: f32 = 0.4;
const MAX_FALL: f32 = 0.3;
/// Time that is added behind the fall of the speed, for the limb at full reach, in seconds.
const FULL_REACH: f32 = 0.07;
/// Least time from the contact to the end, in seconds: a part of the return. Some annotators count none of it, others all.
const AFTER_CONTACT: f32 = 0.17;
/// Least score: peak speed times gain in reach, in square statures per second.
pub(super) const MIN_SCORE: f32 = 0.15;
/// Least gain in reach along the ground, in statures. Blocks have less.
const MIN_REACH: f32 = 0.08;
/// Least share of that gain that is lost again within a time after the contact, in seconds.
const RETURNS: (f32, f32) = (0.5, 0.7);
/// Least height of the hand or foot at the contact over the lowest hand or foot at that time, in statures. Steps are lower.
const MIN_HEIGHT: f32 = 0.15;
/// Maximum factor between a limb's counted speed and its speed relative to the root. A lunge may add speed, a run may not.
const LUNGE: f32 = 1.15;
/// Time before the peak and behind the contact in which the reach is compared, in seconds.
const NEAR_PEAK: f32 = 0.05;
const NEAR_CONTACT: f32 = 0.1;
/// Time around a strike in which the lowest hand or foot is found, in seconds.
const NEAR_STRIKE: f32 = 0.5;
/// Share of a strike's score that another limb's strike at the same time needs.
const SECOND: f32 = 0.5;

/// An attack. Times are frames.
#[derive(Clone, Debug)]
pub(super) struct Strike {
    pub(super) joint: JointId,
    pub(super) start: usize,
    pub(super) contact: usize,
    pub(super) end: usize,
    /// Peak speed times gain in reach, in square statures per second.
    pub(super) score: f32,
}

impl Strike {
    fn overlaps(&self, other: &Self) -> bool {
        self.start < other.end && other.start < self.end
    }
}

/// All attacks of a body, the best first.
pub(super) fn find(body: &Body) -> Vec<Strike> {
    let mut candidates = Vec::new();
    for limb in body.limbs() {
        let stroke = Stroke::new(body, limb);
        let free = (0..body.root.len()).filter(|&peak| !body.travels[peak]);
        candidates.extend(free.filter_map(|peak| stroke.strike(peak)));
    }
    candidates.sort_by(|a, b| b.score.total_cmp(&a.score).then(a.start.cmp(&b.start)));
    let longest = body.frames(MAX_RISE + MAX_FALL);
    let mut kept: Vec<Strike> = Vec::new();
    for strike in candidates {
        let mut same = kept.iter_mut().filter(|other| other.joint == strike.joint);
        // A stroke with several peaks of speed is one strike, unless it would be longer than a strike can be.
        if let Some(other) = same.find(|other| other.overlaps(&strike)) {
            let (start, end) = (other.start.min(strike.start), other.end.max(strike.end));
            if end - start <= longest {
                (other.start, other.end) = (start, end);
            }
            continue;
        }
        let weak = |other: &Strike| other.overlaps(&strike) && strike.score < SECOND * other.score;
        if !kept.iter().any(weak) {
            kept.push(strike);
        }
    }
    kept
}

/// Curves of one limb.
struct Stroke<'a> {
    body: &'a Body,
    joint: JointId,
    /// Speed in space, and relative to the root.
    speeds: Vec<f32>,
    relative: Vec<f32>,
    /// Distance from the root along the ground, and in space.
    reach: Vec<f32>,
    distance: Vec<f32>,
    height: Vec<f32>,
}

impl<'a> Stroke<'a> {
    fn new(body: &'a Body, limb: &Limb) -> Self {
        let from_root = between(&limb.places, &body.root);
        let flat = |place: &Vec3| place.with_y(0.0).length();
        Self {
            body,
            joint: limb.joint,
            speeds: speeds(&limb.places, body.rate),
            relative: speeds(&from_root, body.rate),
            reach: from_root.iter().map(flat).collect(),
            distance: from_root.iter().map(|place| place.length()).collect(),
            height: limb.places.iter().map(|place| place.y).collect(),
        }
    }

    /// The strike whose speed is largest in frame `peak`.
    fn strike(&self, peak: usize) -> Option<Strike> {
        if self.speeds[peak] < MIN_CARRIED_SPEED || !self.is_peak(peak) {
            return None;
        }
        let last = self.speeds.len() - 1;
        let (start, slow) = (self.start(peak), self.slow(peak));
        let end = (slow + self.body.frames(FULL_REACH)).min(last);
        let contact = self.contact(
            peak.saturating_sub(self.body.frames(NEAR_PEAK)).max(start),
            end,
        );
        let end = end.max((contact + self.body.frames(AFTER_CONTACT)).min(last));
        if self.lift(contact, start, end) < MIN_HEIGHT {
            return None;
        }
        let strike = Strike {
            joint: self.joint,
            start,
            contact,
            end,
            score: 0.0,
        };
        let score = self.score(&strike, peak);
        (score >= MIN_SCORE).then_some(Strike { score, ..strike })
    }

    fn is_peak(&self, frame: usize) -> bool {
        let speed = self.speeds[frame];
        let before = frame
            .checked_sub(1)
            .map_or(0.0, |before| self.speeds[before]);
        let after = self.speeds.get(frame + 1).copied().unwrap_or(0.0);
        before <= speed && after < speed
    }

    /// The first fast frame, or where the limb leaves the body if it is fast before.
    fn start(&self, peak: usize) -> usize {
        let earliest = peak.saturating_sub(self.body.frames(MAX_RISE));
        let slow = |&frame: &usize| self.speeds[frame] <= START_SPEED;
        let fast = (earliest..peak)
            .rev()
            .find(slow)
            .map_or(earliest, |frame| frame + 1);
        let away = |a: &usize, b: &usize| self.distance[*a].total_cmp(&self.distance[*b]);
        let nearest = (fast..=peak).min_by(away).unwrap_or(peak);
        fast.max(nearest.saturating_sub(self.body.frames(DRAWN)))
    }

    /// The last frame from the peak on before the speed has fallen.
    fn slow(&self, peak: usize) -> usize {
        let last = self.speeds.len() - 1;
        let latest = (peak + self.body.frames(MAX_FALL)).min(last);
        let limit = END_SHARE * self.speeds[peak];
        let slow = |&frame: &usize| self.speeds[frame] <= limit;
        (peak + 1..=latest)
            .find(slow)
            .map_or(latest, |frame| frame - 1)
    }

    /// The frame of the largest reach; the first of equals.
    fn contact(&self, from: usize, to: usize) -> usize {
        let further = |a: &usize, b: &usize| self.reach[*a].total_cmp(&self.reach[*b]);
        // `max_by` returns the last maximum.
        (from..=to).rev().max_by(further).unwrap_or(from)
    }

    /// Height of the contact over the lowest hand or foot at about that time.
    fn lift(&self, contact: usize, start: usize, end: usize) -> f32 {
        let near = self.body.frames(NEAR_STRIKE);
        let to = (end + near).min(self.height.len() - 1);
        let around = &self.body.lowest[start.saturating_sub(near)..=to];
        self.height[contact] - least(around.iter().copied())
    }

    /// The score of a strike whose speed is largest in frame `peak`; 0 if it gains no reach, stays, or moves against the body.
    fn score(&self, strike: &Strike, peak: usize) -> f32 {
        let &Strike {
            start,
            contact,
            end,
            ..
        } = strike;
        let after = (contact + self.body.frames(NEAR_CONTACT))
            .min(end)
            .max(peak);
        let far = largest(self.distance[peak..=after].iter().copied());
        let gain = far - least(self.distance[start..=peak].iter().copied());
        let along = self.reach[contact] - least(self.reach[start..=contact].iter().copied());
        let later = (contact + self.body.frames(RETURNS.1)).min(self.reach.len() - 1);
        let back = self.reach[contact] - least(self.reach[contact..=later].iter().copied());
        if along < MIN_REACH || back < RETURNS.0 * along {
            return 0.0;
        }
        let relative = largest(self.relative[start..=end].iter().copied());
        let least = match self.speeds[peak] < MIN_PEAK_SPEED {
            true => CARRIED,
            false => ALONG,
        };
        if self.speeds[peak] < least * relative {
            return 0.0;
        }
        let speed = self.speeds[peak].min(LUNGE * relative);
        speed * (gain.max(0.0) * along).sqrt()
    }
}
