//! Attacks: fast strokes of a hand or foot away from the body.
//!
//! The method is ours. Each local maximum of a limb's speed is a candidate. Its time range is where the limb is fast; its score is
//! the peak speed times the gain in reach. The gain is the geometric mean of two gains of the distance from the root: along the
//! ground, which blocks lack, and in space, which swings of the arms lack. Of overlapping candidates the best is kept (non-maximum
//! suppression).

use glam::Vec3;
use sabaki::anim::JointId;

use super::AttackSettings;
use super::body::{Body, Limb, between, largest, least, speeds};

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
pub(super) fn find(body: &Body, settings: &AttackSettings) -> Vec<Strike> {
    let mut candidates = Vec::new();
    for limb in body.limbs() {
        let stroke = Stroke::new(body, limb, settings);
        let free = (0..body.root.len()).filter(|&peak| !body.travels[peak]);
        candidates.extend(free.filter_map(|peak| stroke.strike(peak)));
    }
    candidates.sort_by(|a, b| b.score.total_cmp(&a.score).then(a.start.cmp(&b.start)));
    let longest = body.frames(settings.max_rise + settings.max_fall);
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
    settings: &'a AttackSettings,
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
    fn new(body: &'a Body, limb: &Limb, settings: &'a AttackSettings) -> Self {
        let from_root = between(&limb.places, &body.root);
        let flat = |place: &Vec3| place.with_y(0.0).length();
        Self {
            body,
            settings,
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
        if self.speeds[peak] < self.settings.min_peak_speed || !self.is_peak(peak) {
            return None;
        }
        let last = self.speeds.len() - 1;
        let (start, slow) = (self.start(peak), self.slow(peak));
        let end = (slow + self.body.frames(self.settings.full_reach)).min(last);
        let contact = self.contact(
            peak.saturating_sub(self.body.frames(NEAR_PEAK)).max(start),
            end,
        );
        let end = end.max((contact + self.body.frames(self.settings.after_contact)).min(last));
        if self.lift(contact, start, end) < self.settings.min_height {
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
        (score >= self.settings.min_score).then_some(Strike { score, ..strike })
    }

    fn is_peak(&self, frame: usize) -> bool {
        let speed = self.speeds[frame];
        let before = frame
            .checked_sub(1)
            .map_or(0.0, |before| self.speeds[before]);
        let after = self.speeds.get(frame + 1).copied().unwrap_or(0.0);
        before <= speed && after < speed
    }

    fn start(&self, peak: usize) -> usize {
        let earliest = peak.saturating_sub(self.body.frames(self.settings.max_rise));
        let slow = |&frame: &usize| self.speeds[frame] <= self.settings.start_speed;
        (earliest..peak)
            .rev()
            .find(slow)
            .map_or(earliest, |frame| frame + 1)
    }

    /// The last frame from the peak on before the speed has fallen.
    fn slow(&self, peak: usize) -> usize {
        let last = self.speeds.len() - 1;
        let latest = (peak + self.body.frames(self.settings.max_fall)).min(last);
        let limit = self.settings.end_share * self.speeds[peak];
        let slow = |&frame: &usize| self.speeds[frame] <= limit;
        (peak + 1..=latest)
            .find(slow)
            .map_or(latest, |frame| frame - 1)
    }

    /// The frame of the largest reach; the first of equals.
    fn contact(&self, from: usize, to: usize) -> usize {
        (from..=to).fold(from, |best, frame| {
            if self.reach[frame] > self.reach[best] {
                frame
            } else {
                best
            }
        })
    }

    /// Height of the contact over the lowest hand or foot at about that time.
    fn lift(&self, contact: usize, start: usize, end: usize) -> f32 {
        let near = self.body.frames(NEAR_STRIKE);
        let to = (end + near).min(self.height.len() - 1);
        let around = &self.body.lowest[start.saturating_sub(near)..=to];
        self.height[contact] - least(around.iter().copied())
    }

    /// The score of a strike whose speed is largest in frame `peak`.
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
        let relative = largest(self.relative[start..=end].iter().copied());
        let speed = self.speeds[peak].min(LUNGE * relative);
        speed * (gain.max(0.0) * along.max(0.0)).sqrt()
    }
}
