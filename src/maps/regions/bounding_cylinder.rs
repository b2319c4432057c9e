//! Bounding cylinders of the body with a vertical axis. They fit a standing body much more tightly
//! than a sphere, and are available at any moment of the graph without evaluating a pose.

use bytemuck::{Pod, Zeroable};
use glam::{Vec2, Vec3};
use serde::{Deserialize, Serialize};

use super::body::Body;
use crate::anim::{Clip, Pose, Skeleton, forward_kinematics};
use crate::graph::motion_graph::starts;
use crate::graph::{ClipPosition, EdgeId, MotionGraph};
use crate::math::{Rigid2, byte_list, in_parallel};

/// A cylinder with a vertical axis, in metres.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct BoundingCylinder {
    /// X and z coordinates of the axis.
    pub(crate) axis: Vec2,
    pub(crate) radius: f32,
    pub(crate) low: f32,
    pub(crate) high: f32,
}

impl BoundingCylinder {
    /// Whether the numbers are valid for a body within `furthest` metres. It checks cylinders that come from a file.
    fn is_sound(self, furthest: f32) -> bool {
        let near = |value: f32| value.abs() <= furthest;
        near(self.axis.x)
            && near(self.axis.y)
            && near(self.low)
            && self.low <= self.high
            && self.high <= furthest
            && (0.0..=furthest).contains(&self.radius)
    }

    /// Cylinder around spheres, each given by its centre and its radius.
    pub(crate) fn around(spheres: impl Iterator<Item = (Vec3, f32)> + Clone) -> Self {
        let (mut low, mut high) = (Vec3::INFINITY, Vec3::NEG_INFINITY);
        for (centre, radius) in spheres.clone() {
            low = low.min(centre - radius);
            high = high.max(centre + radius);
        }
        let middle = 0.5 * (low + high);
        let axis = Vec2::new(middle.x, middle.z);
        let away =
            spheres.map(|(centre, radius)| Vec2::new(centre.x, centre.z).distance(axis) + radius);
        Self {
            axis,
            radius: away.fold(0.0, f32::max),
            low: low.y,
            high: high.y,
        }
    }

    /// X and z of the axis, radius, lowest y and highest y.
    pub(crate) fn to_array(self) -> [f32; 5] {
        let [x, z] = self.axis.to_array();
        [x, z, self.radius, self.low, self.high]
    }

    /// Interpolates linearly towards another cylinder.
    pub(crate) fn lerp(self, to: Self, share: f32) -> Self {
        let between = |a: f32, b: f32| a + (b - a) * share;
        Self {
            axis: self.axis.lerp(to.axis, share),
            radius: between(self.radius, to.radius),
            low: between(self.low, to.low),
            high: between(self.high, to.high),
        }
    }

    pub(crate) fn placed(self, placement: Rigid2) -> Self {
        let axis = placement.point(Vec3::new(self.axis.x, 0.0, self.axis.y));
        Self {
            axis: Vec2::new(axis.x, axis.z),
            ..self
        }
    }
}

#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(in crate::maps) struct ClipCylinders {
    /// Cylinders of all clips, clip by clip.
    #[serde(with = "byte_list")]
    frames: Vec<BoundingCylinder>,
    /// Index of each clip's first cylinder. The last entry is the number of cylinders.
    first: Vec<u32>,
}

impl ClipCylinders {
    pub(in crate::maps) fn new(graph: &MotionGraph, body: &Body) -> Self {
        let clips = graph.clips();
        let frames = |clip: usize| clip_cylinders(graph.skeleton(), body, &clips[clip]);
        Self {
            frames: in_parallel(0, clips.len(), frames).concat(),
            first: firsts(clips),
        }
    }

    /// Whether each frame of each clip has a valid cylinder of a body that reaches at most `reach` metres from its root.
    pub(in crate::maps) fn fits(&self, clips: &[Clip], reach: f32) -> bool {
        // A root lies within this distance, also where a file was written in another precision.
        let furthest = 4.0 * Skeleton::FURTHEST + 2.0 * reach;
        self.first == firsts(clips)
            && self.first.last().map(|&end| end as usize) == Some(self.frames.len())
            && self
                .frames
                .iter()
                .all(|cylinder| cylinder.is_sound(furthest))
    }

    /// Cylinder around the body at a frame of an edge, in the space of the clip in which the edge
    /// starts. In a transition it is interpolated between the cylinders of the two clips.
    pub(in crate::maps) fn at(
        &self,
        graph: &MotionGraph,
        edge: EdgeId,
        frame: f32,
    ) -> BoundingCylinder {
        let moment = graph.edge_moment(graph.edge(edge), frame);
        let source = self.frame(moment.source);
        let Some(target) = moment.target else {
            return source;
        };
        let other = self.frame(target.at).placed(target.align);
        let blended = source.lerp(other, target.weight);
        BoundingCylinder {
            low: blended.low - graph.root_drop(edge, frame),
            ..blended
        }
    }

    fn frame(&self, position: ClipPosition) -> BoundingCylinder {
        let first = &self.first[position.clip.index()..];
        let frames = &self.frames[first[0] as usize..first[1] as usize];
        let last = frames.len() - 1;
        let frame = position.frame.clamp(0.0, last as f32);
        let lower = frame as usize;
        frames[lower].lerp(frames[(lower + 1).min(last)], frame - lower as f32)
    }
}

/// Index of each clip's first frame among the frames of all clips. The last entry is the number of frames.
fn firsts(clips: &[Clip]) -> Vec<u32> {
    starts(clips.iter().map(|clip| clip.frames() as u32))
}

fn clip_cylinders(skeleton: &Skeleton, body: &Body, clip: &Clip) -> Vec<BoundingCylinder> {
    let (mut pose, mut joints, mut centres) = (Pose::default(), Vec::new(), Vec::new());
    let mut cylinder = |frame: usize| {
        clip.pose(frame, &mut pose);
        forward_kinematics(skeleton, &pose, &mut joints);
        body.centres(&joints, &mut centres);
        let radii = body.spheres.iter().map(|sphere| sphere.radius);
        BoundingCylinder::around(centres.iter().copied().zip(radii))
    };
    (0..clip.frames()).map(&mut cylinder).collect()
}
