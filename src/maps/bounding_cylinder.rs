//! Bounding cylinders of the body with a vertical axis. They fit a standing body much more tightly
//! than a sphere, and are available at any moment of the graph without evaluating a pose.

use glam::{Vec2, Vec3};

use super::Body;
use crate::anim::{Clip, Pose, Skeleton, forward_kinematics};
use crate::graph::{ClipPosition, EdgeId, MotionGraph};
use crate::math::{Rigid2, in_parallel};

/// A cylinder with a vertical axis, in metres.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct BoundingCylinder {
    /// X and z coordinates of the axis.
    pub(crate) axis: Vec2,
    pub(crate) radius: f32,
    pub(crate) low: f32,
    pub(crate) high: f32,
}

impl BoundingCylinder {
    /// Cylinder around the body in one pose.
    fn around(body: &Body, centres: &[Vec3]) -> Self {
        let (mut low, mut high) = (Vec3::INFINITY, Vec3::NEG_INFINITY);
        for (sphere, &centre) in body.spheres.iter().zip(centres) {
            low = low.min(centre - sphere.radius);
            high = high.max(centre + sphere.radius);
        }
        let middle = 0.5 * (low + high);
        let axis = Vec2::new(middle.x, middle.z);
        let away =
            body.spheres.iter().zip(centres).map(|(sphere, centre)| {
                Vec2::new(centre.x, centre.z).distance(axis) + sphere.radius
            });
        Self {
            axis,
            radius: away.fold(0.0, f32::max),
            low: low.y,
            high: high.y,
        }
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

    /// Returns the cylinder transformed by `placement`.
    pub(crate) fn placed(self, placement: Rigid2) -> Self {
        let axis = placement.point(Vec3::new(self.axis.x, 0.0, self.axis.y));
        Self {
            axis: Vec2::new(axis.x, axis.z),
            ..self
        }
    }
}

/// The cylinders of all frames of all clips.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct ClipCylinders {
    /// Cylinders, `[clip][frame]`.
    clips: Vec<Vec<BoundingCylinder>>,
}

impl ClipCylinders {
    pub(super) fn new(graph: &MotionGraph, body: &Body) -> Self {
        let clips = graph.clips();
        Self {
            clips: in_parallel(0, clips.len(), |clip| {
                of_clip(graph.skeleton(), body, &clips[clip])
            }),
        }
    }

    /// Cylinder around the body at a frame of an edge, in the space of the clip in which the edge
    /// starts. In a transition it is interpolated between the cylinders of the two clips.
    pub(super) fn at(&self, graph: &MotionGraph, edge: EdgeId, frame: f32) -> BoundingCylinder {
        let moment = graph.edge_moment(graph.edge(edge), frame);
        let source = self.of_frame(moment.source);
        let Some(target) = moment.target else {
            return source;
        };
        let other = self.of_frame(target.at).placed(target.align);
        let blended = source.lerp(other, target.weight);
        BoundingCylinder {
            low: blended.low - graph.root_drop(edge, frame),
            ..blended
        }
    }

    fn of_frame(&self, position: ClipPosition) -> BoundingCylinder {
        let frames = &self.clips[position.clip.index()];
        let last = frames.len() - 1;
        let frame = position.frame.clamp(0.0, last as f32);
        let lower = frame as usize;
        frames[lower].lerp(frames[(lower + 1).min(last)], frame - lower as f32)
    }
}

fn of_clip(skeleton: &Skeleton, body: &Body, clip: &Clip) -> Vec<BoundingCylinder> {
    let (mut pose, mut joints, mut centres) = (Pose::default(), Vec::new(), Vec::new());
    let mut of = |frame: usize| {
        clip.pose(frame, &mut pose);
        forward_kinematics(skeleton, &pose, &mut joints);
        body.centres(&joints, &mut centres);
        BoundingCylinder::around(body, &centres)
    };
    (0..clip.frames()).map(&mut of).collect()
}
