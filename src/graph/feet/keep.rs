//! Moves the feet of a transition's pose to their planned positions.

use super::LegBlend;
use crate::anim::{Chain, JointTransform, Leg, Pose, slerp};
use crate::graph::sample::Sides;
use crate::graph::{EdgeId, MotionGraph};

/// Position and rotation of a leg's foot according to `blend`, in the source's space.
pub(super) fn foot(sides: &Sides<'_>, leg: &Leg, blend: LegBlend) -> JointTransform {
    let (weight, height) = blend.at(sides.frame());
    let source = || sides.source().global(leg.foot);
    let target = || sides.target().global(leg.foot);
    // In most frames the foot follows only one side, and the other need not be evaluated.
    if weight <= 0.0 {
        return source();
    }
    if weight >= 1.0 {
        return target();
    }
    let (source, target) = (source(), target());
    let mut translation = source.translation.lerp(target.translation, weight);
    translation.y += height;
    JointTransform {
        rotation: slerp(source.rotation, target.rotation, weight),
        translation,
    }
}

impl MotionGraph {
    /// Moves the feet of a transition's blended pose to their planned positions. At both ends of
    /// the transition, the pose already has them there.
    pub(in crate::graph) fn keep_feet(&self, id: EdgeId, sides: &Sides<'_>, out: &mut Pose) {
        let (edge, frame) = (self.edge(id), sides.frame());
        if self.feet.blends.is_empty() || frame <= 0.0 || frame >= edge.frames as f32 {
            return;
        }
        let root_drop = self.root_drop(id, frame);
        for (index, leg) in self.feet.legs.iter().enumerate() {
            let foot = match self.feet.blend(id, index) {
                Some(blend) => foot(sides, leg, blend),
                // A foot without a plan keeps its position when the root is lowered.
                None if root_drop > 0.0 => Chain::of(&self.skeleton, out).global(leg.foot),
                None => continue,
            };
            // The leg is solved with the lowered root. The original height is restored for the next
            // leg.
            let level = out.root.y;
            out.root.y -= root_drop;
            leg.reach(&self.skeleton, out, foot);
            out.root.y = level;
        }
        out.root.y -= root_drop;
    }

    /// Amount by which the root is lowered at a frame of an edge, in metres.
    pub(crate) fn root_drop(&self, id: EdgeId, frame: f32) -> f32 {
        self.feet.max_root_drop(id) * root_drop_share(frame / self.edge(id).frames as f32)
    }
}

/// Share of its maximum by which the root is lowered at a share of a transition. It is 0 at both
/// ends, with zero slope.
pub(super) fn root_drop_share(share: f32) -> f32 {
    let s = share.clamp(0.0, 1.0);
    let rest = 2.0 * s - 1.0;
    let flat = 1.0 - rest * rest;
    flat * flat
}
