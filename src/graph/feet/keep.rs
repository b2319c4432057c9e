//! Putting the feet of a transition's pose where its plan has them.

use super::LegBlend;
use crate::anim::{Chain, JointTransform, Leg, Pose, reach, slerp};
use crate::graph::sample::Sides;
use crate::graph::{EdgeId, MotionGraph};

/// Where `blend` has a leg's foot, in the source's space.
pub(super) fn foot(sides: &Sides<'_>, leg: &Leg, blend: LegBlend, frame: f32) -> JointTransform {
    let (weight, height) = blend.at(frame);
    let source = || sides.source().global(leg.foot);
    let target = || sides.target().global(leg.foot);
    // Mostly it is all on one side, and the other is not looked at.
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
    /// Moves the feet of a transition's blended pose to where its plan has them. At the transition's
    /// two ends they are there already.
    pub(in crate::graph) fn keep_feet(
        &self,
        (id, frame): (EdgeId, f32),
        sides: &Sides<'_>,
        out: &mut Pose,
    ) {
        let edge = self.edge(id);
        if self.feet.blends.is_empty() || frame <= 0.0 || frame >= edge.frames as f32 {
            return;
        }
        let sunk = self.sunk(id, frame);
        for (index, leg) in self.feet.legs.iter().enumerate() {
            let foot = match self.feet.blend(id, index) {
                Some(blend) => foot(sides, leg, blend, frame),
                // It stays where it is while the root sinks.
                None if sunk > 0.0 => Chain::of(&self.skeleton, out).global(leg.foot),
                None => continue,
            };
            // Each leg looks at the root that has not sunk, and reaches from the one that has.
            let level = out.root.y;
            out.root.y -= sunk;
            reach(&self.skeleton, out, leg, foot);
            out.root.y = level;
        }
        out.root.y -= sunk;
    }

    /// How far the root has sunk at a moment of an edge, metres.
    pub(crate) fn sunk(&self, id: EdgeId, frame: f32) -> f32 {
        self.feet.sink(id) * sinking(frame / self.edge(id).frames as f32)
    }
}

/// How much of its sinking the root has done at a share of a transition: none at its ends, without a
/// jump in value or slope.
pub(super) fn sinking(share: f32) -> f32 {
    let s = share.clamp(0.0, 1.0);
    let rest = 2.0 * s - 1.0;
    let flat = 1.0 - rest * rest;
    flat * flat
}
