//! Displacement of the body's points by each level, measured over all frames.

use glam::DVec3;

use super::attach::{Attachments, FittedAttachment, Samples};
use super::level::{Level, LevelError};
use crate::anim::{Clip, JointId, Place, Skeleton, place_all};

/// Results of one pass over the clips.
pub(super) struct Measured {
    pub(super) errors: Vec<LevelError>,
    /// Median over frames of the height from the lowest joint to the highest, in metres.
    pub(super) height: f32,
    /// Largest distance of a point from the root in any frame, in metres.
    pub(super) reach: f32,
}

/// A joint that is moved by the removal of a joint, with its attachment before the removal and after it.
type Moved = (JointId, CarrierPlace, CarrierPlace);

/// A carrier, and a transform of an attached joint in its frame.
type CarrierPlace = (JointId, Place);

/// Measures all levels. `attachments[i]` is the attachment of the joint that `levels[i + 1]` has lost.
pub(super) fn measure(
    skeleton: &Skeleton,
    clips: &[Clip],
    samples: &Samples,
    levels: &[Level],
    attachments: &[FittedAttachment],
) -> Measured {
    let changes = changes(skeleton, levels, attachments);
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
            place_all(skeleton, clip.at(frame as f32), &mut places);
            pass.add(&places, &changes);
            let up = places.iter().map(|place| place.translation.y);
            let (low, high) = up.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), y| {
                (low.min(y), high.max(y))
            });
            heights.push(high - low);
        }
    }
    heights.sort_by(f64::total_cmp);
    pass.finish(&changes, heights.len());
    Measured {
        errors: pass.errors,
        height: heights.get(heights.len() / 2).copied().unwrap_or(0.0) as f32,
        reach: pass.reach as f32,
    }
}

fn changes(skeleton: &Skeleton, levels: &[Level], fitted: &[FittedAttachment]) -> Vec<Vec<Moved>> {
    let mut attachments = Attachments::none(skeleton.len());
    let removed = levels.iter().filter_map(|level| level.removed);
    let take_out = |(joint, attachment): (JointId, &FittedAttachment)| {
        let before: Vec<CarrierPlace> = attachments.attached_to(joint).collect();
        attachments.remove(joint, attachment);
        let moved = before
            .into_iter()
            .map(|(moved, offset)| (moved, (joint, offset), attachments.by_joint[moved.index()]));
        moved.collect()
    };
    removed.zip(fitted).map(take_out).collect()
}

struct Pass<'a> {
    samples: &'a Samples,
    /// Number of points of the whole body.
    points: usize,
    /// Sum of each level's displacements over frames and points.
    sums: Vec<f64>,
    errors: Vec<LevelError>,
    /// Sum and maximum of each joint's displacements on the current level.
    now: Vec<(f64, f64)>,
    reach: f64,
}

impl Pass<'_> {
    fn add(&mut self, places: &[Place], changes: &[Vec<Moved>]) {
        self.now.fill((0.0, 0.0));
        let attached = |(carrier, offset): &CarrierPlace| places[carrier.index()].after(offset);
        let mut sum = 0.0;
        for (level, change) in (1..).zip(changes) {
            for (joint, old, new) in change {
                let truth = places[joint.index()];
                let (old, new) = (attached(old), attached(new));
                let mut of_joint = (0.0, 0.0f64);
                for &point in self.samples.points(*joint) {
                    let at = new.point(point);
                    let missed = at.distance(truth.point(point));
                    of_joint = (of_joint.0 + missed, of_joint.1.max(missed));
                    let error = &mut self.errors[level];
                    error.step = error.step.max(at.distance(old.point(point)) as f32);
                    self.reach = self.reach.max(at.distance(places[0].translation));
                }
                sum += of_joint.0 - self.now[joint.index()].0;
                self.now[joint.index()] = of_joint;
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

    fn finish(&mut self, changes: &[Vec<Moved>], frames: usize) {
        let mut removed = 0;
        for (level, change) in (1..).zip(changes) {
            let joint = change.iter().find(|(joint, old, _)| *joint == old.0);
            removed += joint.map_or(0, |(joint, ..)| self.samples.points(*joint).len());
            let mean = |points: usize| (self.sums[level] / (points * frames).max(1) as f64) as f32;
            let (of_removed, of_all) = (mean(removed), mean(self.points));
            let error = &mut self.errors[level];
            (error.mean, error.body_mean) = (of_removed, of_all);
        }
    }
}
