//! Evaluates the pose of an edge: the pose of a clip, or a blend of two clips with its feet kept
//! planted.

use crate::anim::{
    Chain, JointId, JointTransform, Leg, Moment, Pose, RiggedSkeleton, Skeleton, slerp,
};
use crate::graph::ClipId;
use crate::graph::motion_graph::{Edge, EdgeId, EdgeMotion, LegBlend, MotionGraph};
use crate::graph::play::inertia::MOST_LEGS;
use crate::graph::search::transition::blend_weight;
use crate::math::Rigid2;
use glam::{Quat, Vec3};

/// Both sides of a transition at one moment, in the space of the source's clip.
pub(crate) struct Sides<'a> {
    skeleton: &'a Skeleton,
    source: Moment<'a>,
    target: Moment<'a>,
    align: Rigid2,
    /// Rotation of `align`.
    turn: Quat,
    /// Weight of the target.
    weight: f32,
    /// Frames since the start of the edge.
    frame: f32,
}

impl<'a> Sides<'a> {
    /// Both sides of an edge `frame` frames after its start, or `None` if the edge is not a transition.
    pub(crate) fn new(graph: &'a MotionGraph, edge: &Edge, frame: f32) -> Option<Self> {
        let moment = graph.edge_moment(edge, frame);
        let target = moment.target?;
        let at = |position: ClipPosition| graph.clip(position.clip).at(position.frame);
        Some(Self {
            skeleton: &graph.skeleton,
            source: at(moment.source),
            target: at(target.at),
            align: target.align,
            turn: target.align.rotation(),
            weight: target.weight,
            frame,
        })
    }

    pub(crate) fn source(&self) -> Chain<'a, impl Fn(JointId) -> (Quat, Vec3)> {
        let (skeleton, source) = (self.skeleton, self.source);
        Chain {
            skeleton,
            local: move |id| source.local(skeleton, id),
        }
    }

    pub(crate) fn target(&self) -> Chain<'a, impl Fn(JointId) -> (Quat, Vec3)> {
        let (skeleton, target, align, turn) = (self.skeleton, self.target, self.align, self.turn);
        Chain {
            skeleton,
            local: move |id| match (id, target.local(skeleton, id)) {
                (JointId::ROOT, (rotation, place)) => {
                    ((turn * rotation).normalize(), align.point(place))
                }
                (_, local) => local,
            },
        }
    }

    /// Blend of both sides. The root and joint positions are interpolated linearly, rotations by
    /// slerp along the shorter arc (Kovar 2002, section 3.2).
    pub(crate) fn blend(&self) -> Chain<'a, impl Fn(JointId) -> (Quat, Vec3)> {
        let (source, target, weight) = (self.source(), self.target(), self.weight);
        Chain {
            skeleton: self.skeleton,
            local: move |id| {
                let (from, to) = ((source.local)(id), (target.local)(id));
                (slerp(from.0, to.0, weight), from.1.lerp(to.1, weight))
            },
        }
    }

    /// Height of a joint, interpolated between the two sides by the blend's weight.
    pub(crate) fn height(&self, joint: JointId) -> f32 {
        let source = self.source().global(joint).translation.y;
        let target = self.target().global(joint).translation.y;
        source + (target - source) * self.weight
    }

    /// Distance between a joint's positions on the two sides, in metres.
    pub(crate) fn apart(&self, joint: JointId) -> f32 {
        let source = self.source().global(joint).translation;
        source.distance(self.target().global(joint).translation)
    }

    pub(crate) fn root(&self) -> Vec3 {
        let target = self.align.point(self.target.root());
        self.source.root().lerp(target, self.weight)
    }

    fn pose(&self, out: &mut Pose) {
        out.root = self.root();
        out.rotations.clear();
        out.rotations.resize(self.skeleton.len(), Quat::IDENTITY);
        self.source
            .blend_rotations(&self.target, self.turn, self.weight, &mut out.rotations);
        out.translations.clear();
        // If only one of the clips moves joints, the other side uses the skeleton's offsets.
        if self.source.moves_joints() || self.target.moves_joints() {
            let blend = self.blend();
            let places = self.skeleton.ids().map(|id| (blend.local)(id).1);
            out.translations.extend(places);
        }
    }
}

#[derive(Clone, Copy, Debug)]
pub(crate) struct ClipPosition {
    pub(crate) clip: ClipId,
    pub(crate) frame: f32,
}

/// Positions in clips that an edge plays at one moment.
#[derive(Clone, Copy, Debug)]
pub(crate) struct EdgeMoment {
    /// Position in the clip in which the edge starts.
    pub(crate) source: ClipPosition,
    /// Target side, if the edge is a transition.
    pub(crate) target: Option<TargetMoment>,
}

#[derive(Clone, Copy, Debug)]
pub(crate) struct TargetMoment {
    pub(crate) at: ClipPosition,
    /// Transform from the target clip's space to the source clip's space.
    pub(crate) align: Rigid2,
    pub(crate) weight: f32,
}

impl MotionGraph {
    pub(crate) fn rigged_skeleton(&self) -> RiggedSkeleton<'_> {
        RiggedSkeleton {
            skeleton: self.skeleton(),
            rig: self.rig(),
        }
    }

    /// Positions in clips that an edge plays `frame` frames after its start.
    pub(crate) fn edge_moment(&self, edge: &Edge, frame: f32) -> EdgeMoment {
        let (from, to) = (self.node(edge.from), self.node(edge.to));
        let target = match edge.motion {
            EdgeMotion::Clip => None,
            EdgeMotion::Transition { align, .. } => Some(TargetMoment {
                at: ClipPosition {
                    clip: to.clip,
                    frame: (to.frame - edge.frames) as f32 + frame,
                },
                align,
                weight: 1.0 - blend_weight(frame / edge.frames as f32),
            }),
        };
        EdgeMoment {
            source: ClipPosition {
                clip: from.clip,
                frame: from.frame as f32 + frame,
            },
            target,
        }
    }

    /// Writes the pose of an edge `frame` frames after its start to `out`, in the space of the clip
    /// in which the edge starts. It does not allocate if `out` has held a pose of the skeleton
    /// before.
    pub fn sample_edge(&self, edge: EdgeId, frame: f32, out: &mut Pose) {
        if let Some(sides) = self.sample_sides(edge, frame, out) {
            self.keep_feet(edge, &sides, out);
        }
    }

    /// Like [`MotionGraph::sample_edge`], without foot correction. Feet slide if the blended clips
    /// plant them differently.
    pub fn sample_blend(&self, id: EdgeId, frame: f32, out: &mut Pose) {
        self.sample_sides(id, frame, out);
    }

    /// Samples an edge without foot correction. Returns the blended sides if the edge is a
    /// transition.
    fn sample_sides(&self, id: EdgeId, frame: f32, out: &mut Pose) -> Option<Sides<'_>> {
        let edge = self.edge(id);
        let sides = Sides::new(self, edge, frame);
        match &sides {
            Some(sides) => sides.pose(out),
            None => {
                let from = self.node(edge.from);
                self.clip(from.clip).sample(from.frame as f32 + frame, out);
            }
        }
        sides
    }

    /// Position of the root in the pose of [`MotionGraph::sample_edge`].
    pub fn sample_edge_root(&self, id: EdgeId, frame: f32) -> Vec3 {
        let edge = self.edge(id);
        match Sides::new(self, edge, frame) {
            Some(sides) => sides.root() - Vec3::Y * self.root_drop(id, frame),
            None => {
                let from = self.node(edge.from);
                self.clip(from.clip).sample_root(from.frame as f32 + frame)
            }
        }
    }
}

// Moves the feet of a transition's pose to their planned positions.

/// Position and rotation of a leg's foot according to `blend`, in the source's space.
pub(crate) fn foot(sides: &Sides<'_>, leg: &Leg, blend: LegBlend) -> JointTransform {
    let (weight, height) = blend.at(sides.frame);
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
    pub(crate) fn keep_feet(&self, id: EdgeId, sides: &Sides<'_>, out: &mut Pose) {
        let (edge, frame) = (self.edge(id), sides.frame);
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
            leg.reach_by_knee(&self.skeleton, out, foot, self.knees()[index]);
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
pub(crate) fn root_drop_share(share: f32) -> f32 {
    let s = share.clamp(0.0, 1.0);
    let rest = 2.0 * s - 1.0;
    let flat = 1.0 - rest * rest;
    flat * flat
}

// Whether a foot is planted at a frame of an edge.

impl MotionGraph {
    /// Whether the foot of a leg is planted at a frame of an edge. In a transition the side with the larger weight decides.
    pub(crate) fn foot_stands(&self, edge: EdgeId, frame: f32, leg: usize) -> bool {
        let moment = self.edge_moment(self.edge(edge), frame);
        let position = match moment.target {
            Some(target) if target.weight > 0.5 => target.at,
            _ => moment.source,
        };
        let frame = position.frame.max(0.0) as u32;
        leg < self.feet.legs.len() && self.feet.stands(position.clip, leg, frame)
    }

    /// For each leg, when the foot first does not stand on an edge that begins after `start` seconds; `None` where it always stands.
    pub(crate) fn first_lifts(&self, edge: EdgeId, start: f32) -> [Option<f32>; MOST_LEGS] {
        let frames = 0..=self.edge(edge).frames;
        std::array::from_fn(|leg| {
            let mut each = frames.clone().map(|frame| frame as f32);
            let lifted = each.find(|&frame| !self.foot_stands(edge, frame, leg))?;
            Some(start + lifted / self.frame_rate() as f32)
        })
    }
}
