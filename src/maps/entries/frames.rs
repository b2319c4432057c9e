//! Frames of the motions that are left and entered. Each is sampled once for all tests.

use crate::anim::{Chain, JointId, Pose};
use crate::graph::{ClipPosition, EdgeMotion, Entry, LegPose, Motion, MotionGraph, Playhead};
use crate::maps::entries::limits::{head, turns};
use crate::maps::entries::targets::ClipFrame;
use crate::math::Rigid2;
use glam::Vec3;

/// A frame of a motion, in the space of its clip.
#[derive(Clone, Debug, Default)]
pub(crate) struct Frame {
    pub(crate) pose: Pose,
    pub(crate) head: Vec3,
    /// Legs, in the order of the graph's legs.
    pub(crate) feet: Vec<LegPose>,
}

/// A motion that is left: the frame before the cut, the frame of the cut and the frame after it.
#[derive(Clone, Debug)]
pub(crate) struct LeftMotion {
    pub(crate) frames: [Frame; 3],
    /// Rotation vector of each joint between the first two frames.
    pub(crate) turns: Vec<Vec3>,
}

/// Samples motions frame by frame.
///
/// While the motion stays in the clip, frames are read from the clip by their number after the first frame, so that they do not depend on
/// how the graph's nodes divide the clip.
pub(crate) struct FrameSampler<'a> {
    graph: &'a MotionGraph,
    head: JointId,
    motion: Motion,
}

impl Frame {
    fn new(graph: &MotionGraph, head: JointId, pose: Pose) -> Self {
        let skeleton = graph.skeleton();
        let feet = graph.feet().legs().iter();
        let head = Chain::of(skeleton, &pose).global(head).translation;
        Self {
            head,
            feet: feet
                .map(|leg| LegPose::from_pose(skeleton, &pose, leg))
                .collect(),
            pose,
        }
    }

    pub(crate) fn toes(&self) -> impl Iterator<Item = Vec3> + '_ {
        self.feet.iter().map(|leg| leg.at_toe.translation)
    }
}

impl<'a> FrameSampler<'a> {
    pub(crate) fn new(graph: &'a MotionGraph) -> Self {
        Self {
            graph,
            head: head(graph.skeleton()),
            motion: Motion::default(),
        }
    }

    /// The motion that is left one frame after `before`, a whole frame of a clip.
    pub(crate) fn left(&mut self, before: Playhead) -> LeftMotion {
        self.start(before, 2);
        let frames = [0, 1, 2].map(|frame| {
            let pose = self.pose_after(before, frame);
            self.frame(pose)
        });
        LeftMotion {
            turns: turns(&frames[0].pose, &frames[1].pose),
            frames,
        }
    }

    /// `count` poses of the motion that continues from a whole frame of a clip.
    pub(crate) fn goes_on(&mut self, from: Playhead, count: usize) -> Vec<Pose> {
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

    fn pose_after(&mut self, start: Playhead, frame: usize) -> Pose {
        let place = self.place_after(start, frame);
        self.pose(frame as f32 / self.graph.frame_rate() as f32, place)
    }

    /// The position `frame` frames after the start, if the motion stays in the clip.
    fn place_after(&self, start: Playhead, frame: usize) -> ClipPosition {
        let from = self.graph.node(self.graph.edge(start.edge).from);
        ClipPosition {
            clip: from.clip,
            frame: from.frame as f32 + start.frame + frame as f32,
        }
    }

    /// `count` frames of the motion that is entered at a frame of a clip, at a playback rate.
    pub(crate) fn entered(&mut self, at: &ClipFrame, rate: f32, count: usize) -> Vec<Frame> {
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
        let frame = |frame: usize| {
            let place = ClipPosition {
                clip: at.clip,
                frame: at.frame as f32 + frame as f32 * rate,
            };
            let pose = self.pose(start + frame as f32 / frame_rate, place);
            self.frame(pose)
        };
        (0..count).map(frame).collect()
    }

    fn frame(&self, pose: Pose) -> Frame {
        Frame::new(self.graph, self.head, pose)
    }

    /// The pose of the motion at a time, without offsets that fade out. `place` is the position at that time if the motion is still in its clip.
    fn pose(&mut self, seconds: f32, place: ClipPosition) -> Pose {
        let (graph, mut pose) = (self.graph, Pose::default());
        if self.is_at(seconds, place) {
            graph.clip(place.clip).sample(place.frame, &mut pose);
        } else {
            self.motion.playhead(graph, seconds).pose(graph, &mut pose);
        }
        pose
    }

    /// Whether the motion is at a position of a clip at a time.
    fn is_at(&self, seconds: f32, place: ClipPosition) -> bool {
        /// Maximum rounding error of a position, in frames.
        const ROUNDING: f32 = 0.01;
        let at = self.motion.playhead(self.graph, seconds);
        let edge = self.graph.edge(at.edge);
        let from = self.graph.node(edge.from);
        edge.motion == EdgeMotion::Clip
            && from.clip == place.clip
            && (from.frame as f32 + at.frame - place.frame).abs() < ROUNDING
    }
}
