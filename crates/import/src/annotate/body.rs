//! Places of the parts of a body in each frame of a clip, and what is measured of them.

use glam::Vec3;
use sabaki::anim::{Clip, Facing, JointId, JointKind, Limbs, Pose, Skeleton, forward_kinematics};

use crate::stature;

/// Half width of the window that removes the noise of a limb's places, in seconds. It does nothing at 30 frames per second.
const NOISE: f64 = 0.03;

/// Largest frame rate that events are found at, in frames per second. Faster clips are resampled: the cost grows with the square of the
/// rate, and no strike needs more.
const MOST_RATE: f64 = 240.0;

/// Places of the parts of a body in each frame of a clip, in statures.
pub(super) struct Body {
    /// Frames per second.
    pub(super) rate: f64,
    pub(super) root: Vec<Vec3>,
    /// The head; the root's places where no head is known.
    pub(super) head: Vec<Vec3>,
    /// Direction in which the pelvis faces, along the ground.
    pub(super) facing: Vec<Vec3>,
    pub(super) hands: Vec<Limb>,
    pub(super) feet: Vec<Limb>,
    /// Height of the lowest hand or foot.
    pub(super) lowest: Vec<f32>,
    /// Whether the figure walks or runs.
    pub(super) travels: Vec<bool>,
}

/// Places of a hand or foot.
pub(super) struct Limb {
    pub(super) joint: JointId,
    pub(super) places: Vec<Vec3>,
}

impl Body {
    /// The body of a clip at [`MOST_RATE`] at most, or `None` for fewer than three frames or a figure without height.
    pub(super) fn of(skeleton: &Skeleton, clip: &Clip) -> Option<Self> {
        let slower = (clip.frame_rate() > MOST_RATE).then(|| clip.resampled(MOST_RATE));
        let slower = slower.and_then(Result::ok);
        let clip = slower.as_ref().unwrap_or(clip);
        let mut pose = Pose::default();
        clip.pose(0, &mut pose);
        let height = stature(skeleton, &pose);
        if clip.frames() < 3 || !(height.is_finite() && height > 0.0) {
            return None;
        }
        let limbs = Limbs::of(skeleton);
        // Where names identify nothing, the ends of all chains stand in `feet`: they may be hands.
        let named = !limbs.hands.is_empty();
        let mut joints = Vec::new();
        forward_kinematics(skeleton, &pose, &mut joints);
        let head = head(skeleton, &limbs, |id| joints[id.index()].translation.y);
        let limb = |&joint: &JointId| Limb {
            joint,
            places: Vec::with_capacity(clip.frames()),
        };
        let mut body = Self {
            rate: clip.frame_rate(),
            root: Vec::with_capacity(clip.frames()),
            head: Vec::with_capacity(clip.frames()),
            facing: Vec::with_capacity(clip.frames()),
            lowest: Vec::with_capacity(clip.frames()),
            travels: Vec::new(),
            hands: limbs.hands.iter().map(limb).collect(),
            feet: limbs.feet.iter().filter(|_| named).map(limb).collect(),
        };
        let facing = Facing::of(skeleton);
        let per_metre = (1.0 / height) as f32;
        for frame in 0..clip.frames() {
            clip.pose(frame, &mut pose);
            forward_kinematics(skeleton, &pose, &mut joints);
            let place = |id: JointId| joints[id.index()].translation * per_metre;
            body.root.push(place(JointId::ROOT));
            body.head.push(place(head.unwrap_or(JointId::ROOT)));
            body.facing.push(facing.placement(&joints).vector(Vec3::Z));
            for limb in body.hands.iter_mut().chain(&mut body.feet) {
                limb.places.push(place(limb.joint));
            }
            let heights = body.limbs().map(|limb| limb.places[frame].y);
            let lowest = least(heights);
            body.lowest.push(lowest);
        }
        body.remove_noise();
        body.travels = body.find_travel();
        Some(body)
    }

    fn remove_noise(&mut self) {
        let rate = self.rate;
        let limbs = self.hands.iter_mut().chain(&mut self.feet);
        for places in limbs.map(|limb| &mut limb.places).chain([&mut self.root]) {
            *places = smoothed(places, NOISE, rate);
        }
    }

    /// Whether the root travels on around each frame, longer than a lunge or a leap does.
    fn find_travel(&self) -> Vec<bool> {
        /// Time on both sides of a frame, in seconds, and least speed over the whole, in statures per second.
        const AROUND: f32 = 0.75;
        const SPEED: f32 = 0.5;
        let (last, around) = (self.root.len() - 1, self.frames(AROUND));
        let travels = |frame: usize| {
            let (from, to) = (frame.saturating_sub(around), (frame + around).min(last));
            let way = (self.root[to] - self.root[from]).with_y(0.0).length();
            // Near the ends of a clip the time is shorter.
            to - from >= around && way * self.rate as f32 >= SPEED * (to - from) as f32
        };
        (0..self.root.len()).map(travels).collect()
    }

    /// All hands, then all feet.
    pub(super) fn limbs(&self) -> impl Iterator<Item = &Limb> {
        self.hands.iter().chain(&self.feet)
    }

    /// Speed of the fastest hand relative to the root, in statures per second; 0 without hands.
    pub(super) fn hand_speeds(&self) -> Vec<f32> {
        let mut fastest = vec![0.0f32; self.root.len()];
        for hand in &self.hands {
            let own = speeds(&between(&hand.places, &self.root), self.rate);
            for (fastest, own) in fastest.iter_mut().zip(own) {
                *fastest = fastest.max(own);
            }
        }
        fastest
    }

    /// Number of frames in a time of `seconds`.
    pub(super) fn frames(&self, seconds: f32) -> usize {
        (f64::from(seconds) * self.rate).round() as usize
    }
}

/// The head: the joint closest to the root whose name says so, or else the highest end of a chain that belongs to no limb.
fn head(skeleton: &Skeleton, limbs: &Limbs, height: impl Fn(JointId) -> f32) -> Option<JointId> {
    let depth = |id: JointId| skeleton.ancestry(id).count();
    let is_head = |&id: &JointId| {
        let joint = skeleton.joint(id);
        joint.kind == JointKind::Moving && joint.name.to_ascii_lowercase().contains("head")
    };
    let named = skeleton.ids().filter(is_head).min_by_key(|&id| depth(id));
    let is_limb = |id: JointId| limbs.all().any(|limb| skeleton.carries(limb, id));
    let free = |&id: &JointId| skeleton.children(id).next().is_none() && !is_limb(id);
    named.or_else(|| {
        let ends = skeleton.ids().filter(free);
        ends.max_by(|&a, &b| height(a).total_cmp(&height(b)))
    })
}

/// Smooths places with a triangular window of a half width in seconds. A window narrower than a frame changes nothing.
pub(super) fn smoothed(places: &[Vec3], half_width: f64, rate: f64) -> Vec<Vec3> {
    let frames = half_width * rate;
    let side = frames.ceil() as usize;
    let weights: Vec<f32> = (0..=side)
        .map(|away| (1.0 - away as f64 / frames.max(1e-9)).max(0.0) as f32)
        .collect();
    let last = places.len().saturating_sub(1);
    let at = |frame: usize| {
        let (mut sum, mut total) = (places[frame], 1.0);
        for (away, &weight) in weights.iter().enumerate().skip(1) {
            let pair = places[frame.saturating_sub(away)] + places[(frame + away).min(last)];
            sum += weight * pair;
            total += 2.0 * weight;
        }
        sum / total
    };
    (0..places.len()).map(at).collect()
}

/// Speeds by central differences; at the ends by one-sided ones. `places` has at least two frames.
pub(super) fn speeds(places: &[Vec3], rate: f64) -> Vec<f32> {
    let last = places.len() - 1;
    let at = |frame: usize| {
        let (from, to) = (frame.saturating_sub(1), (frame + 1).min(last));
        places[from].distance(places[to]) * rate as f32 / (to - from) as f32
    };
    (0..places.len()).map(at).collect()
}

/// Differences of two lists of places.
pub(super) fn between(to: &[Vec3], from: &[Vec3]) -> Vec<Vec3> {
    to.iter().zip(from).map(|(&to, &from)| to - from).collect()
}

/// Largest of some values; 0 for none.
pub(super) fn largest(values: impl IntoIterator<Item = f32>) -> f32 {
    values.into_iter().fold(0.0, f32::max)
}

/// Smallest of some values; infinite for none.
pub(super) fn least(values: impl IntoIterator<Item = f32>) -> f32 {
    values.into_iter().fold(f32::INFINITY, f32::min)
}

#[cfg(test)]
mod tests {
    use sabaki_fixtures::clips;

    use super::*;

    #[test]
    fn a_fast_clip_has_no_more_frames_than_are_needed() {
        let joints = [("Hips", None, Vec3::Y), ("LeftHand", Some(0), Vec3::Y)];
        let skeleton = clips::skeleton(&joints);
        for (frame_rate, frames, expected) in [(1e6, 100_001, 25), (240.0, 25, 25), (30.0, 4, 4)] {
            let clip = clips::still_clip(&skeleton, "fast", frame_rate, vec![Vec3::Y; frames]);
            let body = Body::of(&skeleton, &clip).unwrap();
            assert_eq!(body.rate, frame_rate.min(MOST_RATE));
            assert_eq!(body.root.len(), expected);
        }
    }
}
