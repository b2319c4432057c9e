//! Frames of the motions that are left and entered, each sampled once for all tests.

use glam::Vec3;

use super::limits::head;
use super::targets::ClipFrame;
use crate::anim::{Chain, JointId, JointTransform, Pose, Skeleton};
use crate::graph::{
    ClipId, EdgeMotion, Entry, Motion, MotionGraph, Playhead, foot_at_toe, rotation_vector,
};
use crate::math::Rigid2;

/// A frame of a motion, in the space of its clip.
#[derive(Clone, Debug, Default)]
pub(super) struct Frame {
    pub(super) pose: Pose,
    pub(super) head: Vec3,
    /// The frame of each leg's foot, with its origin at the toe.
    pub(super) feet: Vec<JointTransform>,
}

/// A motion that is left: the frames before the cut, at it, and after it.
#[derive(Clone, Debug)]
pub(super) struct LeftMotion {
    pub(super) frames: [Frame; 3],
    /// Rotation vector of each joint between the first two frames.
    pub(super) turns: Vec<Vec3>,
}

/// A motion that is entered: its frames from the cut on.
#[derive(Clone, Debug)]
pub(super) struct EnteredMotion {
    pub(super) frames: Vec<Frame>,
}

/// Samples motions frame by frame.
///
/// A frame of a clip is read from the clip, at the same number of frames after the motion's first wherever the graph's nodes divide the clip.
pub(super) struct FrameSampler<'a> {
    graph: &'a MotionGraph,
    head: JointId,
    motion: Motion,
}

/// A place on a clip, as a fraction of frames.
#[derive(Clone, Copy)]
struct Place {
    clip: ClipId,
    frame: f32,
}

impl Frame {
    fn of(graph: &MotionGraph, head: JointId, pose: Pose) -> Self {
        let skeleton = graph.skeleton();
        let feet = graph.feet().legs().iter();
        Self {
            head: head_of(skeleton, head, &pose),
            feet: feet.map(|leg| foot_at_toe(skeleton, &pose, leg)).collect(),
            pose,
        }
    }

    /// Positions of the toes.
    pub(super) fn toes(&self) -> impl Iterator<Item = Vec3> + '_ {
        self.feet.iter().map(|foot| foot.translation)
    }
}

fn head_of(skeleton: &Skeleton, head: JointId, pose: &Pose) -> Vec3 {
    let JointTransform { translation, .. } = Chain::of(skeleton, pose).global(head);
    translation
}

impl<'a> FrameSampler<'a> {
    pub(super) fn new(graph: &'a MotionGraph) -> Self {
        Self {
            graph,
            head: head(graph.skeleton()),
            motion: Motion::default(),
        }
    }

    /// The motion that is left one frame after `before`, a whole frame of a clip.
    pub(super) fn left(&mut self, before: Playhead) -> LeftMotion {
        self.start(before, 2);
        let frames = [0, 1, 2].map(|frame| self.frame(self.pose_after(before, frame)));
        LeftMotion {
            turns: turns(&frames[0].pose, &frames[1].pose),
            frames,
        }
    }

    /// So many poses of the motion that goes on at a whole frame of a clip.
    pub(super) fn goes_on(&mut self, from: Playhead, count: usize) -> Vec<Pose> {
        self.start(from, count);
        (0..count)
            .map(|frame| self.pose_after(from, frame))
            .collect()
    }

    fn start(&mut self, from: Playhead, frames: usize) {
        let seconds = frames as f32 / self.graph.frame_rate() as f32;
        self.motion.restart(self.graph, from, []);
        self.motion.extend(self.graph, seconds);
    }

    /// The pose so many frames after the start.
    fn pose_after(&self, start: Playhead, frame: usize) -> Pose {
        let from = self.graph.node(self.graph.edge(start.edge).from);
        let place = Place {
            clip: from.clip,
            frame: from.frame as f32 + start.frame + frame as f32,
        };
        self.pose(frame as f32 / self.graph.frame_rate() as f32, place)
    }

    /// `count` frames of the motion that is entered at a frame of a clip, at a playback rate.
    pub(super) fn entered(&mut self, at: &ClipFrame, rate: f32, count: usize) -> EnteredMotion {
        let frame_rate = self.graph.frame_rate() as f32;
        let start = 1.0 / frame_rate;
        let entry = Entry {
            edge: at.edge,
            frame: at.edge_frame as f32,
            clip_to_world: Rigid2::IDENTITY,
            rate,
            blend: start,
        };
        self.motion.restart(self.graph, entry.playhead(), []);
        self.motion.enter(self.graph, start, &entry);
        self.motion
            .extend(self.graph, start + count as f32 / frame_rate);
        let frames = (0..count).map(|frame| {
            let place = Place {
                clip: at.clip,
                frame: at.frame as f32 + frame as f32 * rate,
            };
            self.frame(self.pose(start + frame as f32 / frame_rate, place))
        });
        EnteredMotion {
            frames: frames.collect(),
        }
    }

    fn frame(&self, pose: Pose) -> Frame {
        Frame::of(self.graph, self.head, pose)
    }

    /// The pose of the motion, without what fades out, at a time at which it is at `place` if it is still in that clip.
    fn pose(&self, seconds: f32, place: Place) -> Pose {
        /// Distance that rounding may put a motion off its frame, in frames.
        const ROUNDING: f32 = 0.01;
        let graph = self.graph;
        let at = self.motion.playhead(graph, seconds);
        let (edge, mut pose) = (graph.edge(at.edge), Pose::default());
        let from = graph.node(edge.from);
        let is_there = edge.motion == EdgeMotion::Clip
            && from.clip == place.clip
            && (from.frame as f32 + at.frame - place.frame).abs() < ROUNDING;
        match is_there {
            true => graph.clip(place.clip).sample(place.frame, &mut pose),
            false => at.pose(graph, &mut pose),
        }
        pose
    }
}

/// Rotation vector of each joint between two poses, in radians.
pub(super) fn turns(from: &Pose, to: &Pose) -> Vec<Vec3> {
    let both = from.rotations.iter().zip(&to.rotations);
    both.map(|(from, to)| rotation_vector(*to * from.conjugate()))
        .collect()
}
