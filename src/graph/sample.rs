//! The pose of an edge at a moment: a clip's, or two clips' blended, with its feet where they stand.

use glam::{Quat, Vec3};

use super::{ClipId, Edge, EdgeId, EdgeMotion, MotionGraph, blend_weight};
use crate::anim::{Block, Chain, JointId, LANES, Moment, Pose, Skeleton, Slerp, slerp, unpack};
use crate::math::{Isa, Rigid2};

/// Both sides of a transition at one moment, in the space of the clip that it leaves.
pub(super) struct Sides<'a> {
    skeleton: &'a Skeleton,
    source: Moment<'a>,
    target: Moment<'a>,
    align: Rigid2,
    /// Of the align's turn.
    turn: Quat,
    /// Of the target.
    weight: f32,
}

impl<'a> Sides<'a> {
    /// `None` where the edge is no transition.
    pub(super) fn of(graph: &'a MotionGraph, edge: &Edge, frame: f32) -> Option<Self> {
        let moment = graph.edge_moment(edge, frame);
        let target = moment.target?;
        let at = |(clip, frame)| graph.clip(clip).at(frame);
        Some(Self {
            skeleton: &graph.skeleton,
            source: at(moment.source),
            target: at(target.at),
            align: target.align,
            turn: target.align.rotation(),
            weight: target.weight,
        })
    }

    pub(super) fn source(&self) -> Chain<'a, impl Fn(JointId) -> (Quat, Vec3)> {
        let (skeleton, source) = (self.skeleton, self.source);
        Chain {
            skeleton,
            local: move |id| source.local(skeleton, id),
        }
    }

    pub(super) fn target(&self) -> Chain<'a, impl Fn(JointId) -> (Quat, Vec3)> {
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

    /// The blend of both: the root and the joints' places go in a straight line, rotations by slerp
    /// along the shorter arc (Kovar 2002, section 3.2).
    pub(super) fn blend(&self) -> Chain<'a, impl Fn(JointId) -> (Quat, Vec3)> {
        let (source, target, weight) = (self.source(), self.target(), self.weight);
        Chain {
            skeleton: self.skeleton,
            local: move |id| {
                let (from, to) = ((source.local)(id), (target.local)(id));
                (slerp(from.0, to.0, weight), from.1.lerp(to.1, weight))
            },
        }
    }

    /// A joint's height: that of either side by the blend's weights.
    pub(super) fn height(&self, joint: JointId) -> f32 {
        let source = self.source().global(joint).translation.y;
        let target = self.target().global(joint).translation.y;
        source + (target - source) * self.weight
    }

    /// How far the two sides have a joint apart, metres.
    pub(super) fn apart(&self, joint: JointId) -> f32 {
        let source = self.source().global(joint).translation;
        source.distance(self.target().global(joint).translation)
    }

    /// The blend's root, without its rotation.
    pub(super) fn root(&self) -> Vec3 {
        let target = self.align.point(self.target.root());
        self.source.root().lerp(target, self.weight)
    }

    /// The blend's whole pose.
    fn pose(&self, out: &mut Pose) {
        out.root = self.root();
        out.rotations.resize(self.skeleton.len(), Quat::IDENTITY);
        let slerp = Slerp::new(self.weight);
        Isa::best().run(
            #[inline(always)]
            || {
                for (index, part) in out.rotations.chunks_mut(LANES).enumerate() {
                    unpack(&self.block(index, &slerp), part);
                }
            },
        );
        out.translations.clear();
        // Where one of the clips moves joints, the other one's stand where the skeleton has them.
        if self.source.moves_joints() || self.target.moves_joints() {
            let blend = self.blend();
            let places = self.skeleton.ids().map(|id| (blend.local)(id).1);
            out.translations.extend(places);
        }
    }

    /// The blended rotations of sixteen joints.
    #[inline(always)]
    fn block(&self, index: usize, slerp: &Slerp) -> Block {
        let (source, mut target) = (self.source.block(index), self.target.block(index));
        if index == 0 {
            let [x, y, z, w] = target.map(|row| row[0]);
            let turned = (self.turn * Quat::from_xyzw(x, y, z, w)).normalize();
            for (row, value) in target.iter_mut().zip(turned.to_array()) {
                row[0] = value;
            }
        }
        slerp.between(&source, &target)
    }
}

/// What is played at a moment of an edge.
#[derive(Clone, Copy, Debug)]
pub(crate) struct EdgeMoment {
    /// The clip in which it starts, and the frame there.
    pub(crate) source: (ClipId, f32),
    /// In a transition the other side.
    pub(crate) target: Option<TargetMoment>,
}

/// The side to which a transition leads.
#[derive(Clone, Copy, Debug)]
pub(crate) struct TargetMoment {
    pub(crate) at: (ClipId, f32),
    /// Takes its clip to that of the source.
    pub(crate) align: Rigid2,
    pub(crate) weight: f32,
}

impl MotionGraph {
    /// What an edge plays, `frame` frames after its start.
    pub(crate) fn edge_moment(&self, edge: &Edge, frame: f32) -> EdgeMoment {
        let (from, to) = (self.node(edge.from), self.node(edge.to));
        let target = match edge.motion {
            EdgeMotion::Clip => None,
            EdgeMotion::Transition { align, .. } => Some(TargetMoment {
                at: (to.clip, (to.frame - edge.frames) as f32 + frame),
                align,
                weight: 1.0 - blend_weight(frame / edge.frames as f32),
            }),
        };
        EdgeMoment {
            source: (from.clip, from.frame as f32 + frame),
            target,
        }
    }

    /// The pose of an edge, `frame` frames after its start, in the space of the clip in which it
    /// starts. Allocates nothing where `out` has held a pose of the skeleton before.
    pub fn sample_edge(&self, edge: EdgeId, frame: f32, out: &mut Pose) {
        if let Some(sides) = self.sample_sides(edge, frame, out) {
            self.keep_feet((edge, frame), &sides, out);
        }
    }

    /// The same without what is done for feet: they slide where clips that plant them differently are
    /// blended.
    pub fn sample_blend(&self, id: EdgeId, frame: f32, out: &mut Pose) {
        self.sample_sides(id, frame, out);
    }

    /// The same; what is blended where the edge is a transition.
    fn sample_sides(&self, id: EdgeId, frame: f32, out: &mut Pose) -> Option<Sides<'_>> {
        let edge = self.edge(id);
        let sides = Sides::of(self, edge, frame);
        match &sides {
            Some(sides) => sides.pose(out),
            None => {
                let from = self.node(edge.from);
                self.clip(from.clip).sample(from.frame as f32 + frame, out);
            }
        }
        sides
    }

    /// The root's place in the pose that [`MotionGraph::sample_edge`] gives.
    #[must_use]
    pub fn sample_edge_root(&self, id: EdgeId, frame: f32) -> Vec3 {
        let edge = self.edge(id);
        match Sides::of(self, edge, frame) {
            Some(sides) => sides.root() - Vec3::Y * self.sunk(id, frame),
            None => {
                let from = self.node(edge.from);
                self.clip(from.clip).sample_root(from.frame as f32 + frame)
            }
        }
    }
}
