//! How far the points of removed joints are from where they truly are.

use glam::DVec3;
use serde::{Deserialize, Serialize};

use super::Level;
use super::attach::{Riders, Seat};
use super::frames::{Place, place_all};
use super::samples::Samples;
use crate::anim::{Clip, JointId, Skeleton};

/// What a level does to the body, over all frames. A joint's points: the joint itself, the far ends of its bones, and the corners of
/// boxes that hold all within [`super::LevelSettings::skin`] of them; so nothing there is displaced by more than the maximum. Points of kept
/// joints are where they should be.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct LevelError {
    /// How far the points of removed joints are from where they truly are, in the mean, metres.
    pub mean: f32,
    /// At most, metres.
    pub max: f32,
    /// The mean over the points of all joints, metres.
    pub body_mean: f32,
    /// How far a point goes at most when the level before is exchanged for this one in the same frame, metres.
    pub step: f32,
}

/// What one pass over the clips finds.
pub(super) struct Measured {
    pub(super) errors: Vec<LevelError>,
    /// Of the body from its lowest joint to its highest, the median over frames, metres.
    pub(super) height: f32,
    /// From the root to the body's farthest point in any frame, metres.
    pub(super) reach: f32,
}

/// One joint taken out: what moved with it.
struct Change {
    moved: Vec<Moved>,
}

/// A rider, with where it was and where it is now.
type Moved = (JointId, On, On);

/// A joint, and a place in its frame.
type On = (JointId, Place);

/// `seats[i]` is where the joint that `levels[i + 1]` has lost sits.
pub(super) fn measure(
    skeleton: &Skeleton,
    clips: &[Clip],
    (samples, levels, seats): (&Samples, &[Level], &[Seat]),
) -> Measured {
    let changes = changes(skeleton, levels, seats);
    let mut pass = Pass {
        samples,
        points: skeleton.ids().map(|id| samples.points(id).len()).sum(),
        sums: vec![0.0; levels.len()],
        errors: vec![LevelError::default(); levels.len()],
        now: vec![(0.0, 0.0); skeleton.len()],
        reach: 0.0,
    };
    let (mut places, mut heights) = (Vec::new(), Vec::new());
    for clip in clips {
        for frame in 0..clip.frames() {
            place_all(skeleton, clip, frame, &mut places);
            pass.add(&places, &changes);
            let up = places.iter().map(|place| place.translation.y);
            let (low, high) = up.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), y| {
                (low.min(y), high.max(y))
            });
            heights.push(high - low);
        }
    }
    heights.sort_unstable_by(f64::total_cmp);
    pass.finish(&changes, heights.len());
    Measured {
        errors: pass.errors,
        height: heights.get(heights.len() / 2).copied().unwrap_or(0.0) as f32,
        reach: pass.reach as f32,
    }
}

fn changes(skeleton: &Skeleton, levels: &[Level], seats: &[Seat]) -> Vec<Change> {
    let mut riders = Riders::none(skeleton.len());
    let removed = levels.iter().filter_map(|level| level.removed);
    let take_out = |(joint, seat): (JointId, &Seat)| {
        let before: Vec<On> = riders.on(joint).collect();
        riders.remove(joint, (seat.carrier, seat.offset));
        let moved = before
            .into_iter()
            .map(|(rider, offset)| (rider, (joint, offset), riders.seats[rider.index()]));
        Change {
            moved: moved.collect(),
        }
    };
    removed.zip(seats).map(take_out).collect()
}

struct Pass<'a> {
    samples: &'a Samples,
    /// Of the whole body.
    points: usize,
    /// Of each level, over frames and points.
    sums: Vec<f64>,
    errors: Vec<LevelError>,
    /// Of each joint in the level that is looked at: sum and maximum.
    now: Vec<(f64, f64)>,
    reach: f64,
}

impl Pass<'_> {
    fn add(&mut self, places: &[Place], changes: &[Change]) {
        self.now.fill((0.0, 0.0));
        let seated = |(carrier, offset): &On| places[carrier.index()].after(offset);
        let mut sum = 0.0;
        for (level, change) in (1..).zip(changes) {
            for (rider, old, new) in &change.moved {
                let truth = places[rider.index()];
                let (old, new) = (seated(old), seated(new));
                let mut of_rider = (0.0, 0.0f64);
                for &point in self.samples.points(*rider) {
                    let at = new.point(point);
                    let missed = at.distance(truth.point(point));
                    of_rider = (of_rider.0 + missed, of_rider.1.max(missed));
                    let error = &mut self.errors[level];
                    error.step = error.step.max(at.distance(old.point(point)) as f32);
                    self.reach = self.reach.max(at.distance(places[0].translation));
                }
                sum += of_rider.0 - self.now[rider.index()].0;
                self.now[rider.index()] = of_rider;
            }
            self.sums[level] += sum.max(0.0);
            let worst = self.now.iter().fold(0.0f64, |worst, now| worst.max(now.1));
            let error = &mut self.errors[level];
            error.max = error.max.max(worst as f32);
        }
        for (index, place) in places.iter().enumerate() {
            let far = |point: &DVec3| place.point(*point).distance(places[0].translation);
            let points = self.samples.points(JointId(index as u16)).iter();
            self.reach = points.map(far).fold(self.reach, f64::max);
        }
    }

    fn finish(&mut self, changes: &[Change], frames: usize) {
        let mut removed = 0;
        for (level, change) in (1..).zip(changes) {
            let joint = change.moved.iter().find(|(rider, old, _)| *rider == old.0);
            removed += joint.map_or(0, |(rider, ..)| self.samples.points(*rider).len());
            let mean = |points: usize| (self.sums[level] / (points * frames).max(1) as f64) as f32;
            let (of_removed, of_all) = (mean(removed), mean(self.points));
            let error = &mut self.errors[level];
            (error.mean, error.body_mean) = (of_removed, of_all);
        }
    }
}
