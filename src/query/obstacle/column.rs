//! Vertical columns that contain the body, as a bound of its distance from obstacles.
//!
//! A column is the vertical cylinder around the body at one moment ([`BakedGraph::bounding_cylinder`]), a little wider. Distances
//! are 1-Lipschitz: an obstacle that is further from the column's axis than the column is wide touches no part of the body.

use glam::{Vec2, Vec3};

use super::{Obstacle, Shape};
use crate::graph::MotionMoment;
use crate::maps::BakedGraph;

/// The column around the body at one sample of a motion.
#[derive(Clone, Copy, Debug)]
pub(super) struct Column {
    /// X and z coordinates.
    pub axis: Vec2,
    pub radius: f32,
}

/// Lowest and highest point of the body during a motion, in metres.
#[derive(Clone, Copy, Debug)]
pub(super) struct Heights {
    pub low: f32,
    pub high: f32,
}

impl Heights {
    pub(super) const NONE: Self = Self {
        low: f32::INFINITY,
        high: f32::NEG_INFINITY,
    };
}

impl Column {
    /// How far a body leaves the interpolated cylinder between two frames of a clip, at most, in metres.
    const SLACK: f32 = 0.03;
    /// How far a body leaves the interpolated cylinder in a transition, at most, in metres.
    const TRANSITION_SLACK: f32 = 0.2;

    /// The column at a moment; `heights` grow by it.
    pub(super) fn new(baked: &BakedGraph, moment: MotionMoment<'_>, heights: &mut Heights) -> Self {
        let MotionMoment { motion, seconds } = moment;
        let graph = baked.graph();
        if motion.is_composed(seconds) {
            let (root, reach) = (motion.root(graph, seconds), baked.reach());
            heights.low = heights.low.min(root.y - reach);
            heights.high = heights.high.max(root.y + reach);
            return Self {
                axis: Vec2::new(root.x, root.z),
                radius: reach,
            };
        }
        let playhead = motion.playhead(graph, seconds);
        let cylinder = baked.bounding_cylinder(playhead.edge, playhead.frame);
        let cylinder = cylinder.placed(playhead.clip_to_world);
        let edge = graph.edge(playhead.edge);
        let slack = match graph.edge_moment(edge, playhead.frame).target {
            Some(_) => Self::TRANSITION_SLACK,
            None => Self::SLACK,
        };
        heights.low = heights.low.min(cylinder.low - slack);
        heights.high = heights.high.max(cylinder.high + slack);
        Self {
            axis: cylinder.axis,
            radius: cylinder.radius + slack,
        }
    }
}

impl Column {
    /// The column between two samples, at a share of the time between them.
    pub(super) fn between([before, after]: [Self; 2], share: f32) -> Self {
        let way = before.axis.distance(after.axis);
        Self {
            axis: before.axis.lerp(after.axis, share),
            // The body may leave the interpolated axis by as much.
            radius: before.radius.max(after.radius) + 0.5 * way,
        }
    }
}

impl Obstacle {
    /// Lower bound of the distance from the surface of all points of a vertical line `seconds` from now, in metres.
    pub(super) fn metres_from_line(&self, axis: Vec2, heights: Heights, seconds: f32) -> f32 {
        let at = |y: f32| Vec3::new(axis.x, y, axis.y);
        let Heights { low, high } = heights;
        match &self.shape {
            Shape::HalfSpace { .. } => {
                let [low, high] = [low, high].map(|y| self.metres(at(y), seconds));
                low.min(high)
            }
            Shape::Block { center, .. } => {
                let middle = center.y + self.velocity.y * (self.later + seconds);
                self.metres(at(middle.clamp(low, high)), seconds)
            }
            Shape::Capsule { from, to, radius } => {
                let (from, to) = (Vec2::new(from.x, from.z), Vec2::new(to.x, to.z));
                let velocity = Vec2::new(self.velocity.x, self.velocity.z);
                let point = axis - velocity * (self.later + seconds) - from;
                let along = to - from;
                let square = along.length_squared();
                let share = match square > 0.0 {
                    true => (point.dot(along) / square).clamp(0.0, 1.0),
                    false => 0.0,
                };
                point.distance(along * share) - radius - self.margin
            }
            Shape::Prism { .. } | Shape::Disc { .. } => self.metres(at(low), seconds),
        }
    }
}
