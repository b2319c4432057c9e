//! A moment of a clip, read joint by joint or as a whole pose.

use glam::{Quat, Vec3};

use super::packed::{PackedGroups, PackedMoment, scatter};
use super::plain::PlainClip;
use super::pose::{nlerp, slerp};
use super::rows::{self, Block, LANES, Rows, Slerp};
use super::{JointId, Pose, Skeleton};
use crate::math::Isa;
use crate::math::code_rows::{RowKernel, RowReader};

/// A moment of a clip. It gives the values of [`Clip::sample`](super::Clip::sample) joint by joint, without computing
/// the whole pose.
#[derive(Clone, Copy, Debug)]
pub struct Moment<'a>(pub(super) Source<'a>);

#[derive(Clone, Copy, Debug)]
pub(super) enum Source<'a> {
    Plain(PlainMoment<'a>),
    Packed(PackedMoment<'a>),
}

/// The root at the first of some frames or, with a weight above 0, between that frame and the next.
#[inline]
pub(super) fn root_between(roots: &[Vec3], weight: f32) -> Vec3 {
    match weight {
        0.0 => roots[0],
        weight => roots[0].lerp(roots[1], weight),
    }
}

impl Moment<'_> {
    pub(super) fn pose(&self, isa: Isa, out: &mut Pose) {
        match &self.0 {
            Source::Plain(plain) => plain.pose(isa, out),
            Source::Packed(packed) => packed.pose(isa, out),
        }
    }

    /// Position of the root, in metres.
    #[inline]
    pub fn root(&self) -> Vec3 {
        match &self.0 {
            Source::Plain(plain) => plain.root(),
            Source::Packed(packed) => packed.root(),
        }
    }

    /// Rotation of a joint in its parent's frame.
    #[inline]
    pub fn rotation(&self, joint: usize) -> Quat {
        match &self.0 {
            Source::Plain(plain) => plain.rotation(joint),
            Source::Packed(packed) => packed.rotation(joint),
        }
    }

    /// Hands out the rotations of all joints; of compressed clips those of end sites, which do not rotate, are left out.
    #[inline]
    pub fn each_rotation(&self, mut visit: impl FnMut(usize, Quat)) {
        match &self.0 {
            Source::Plain(plain) => {
                for joint in 0..plain.clip.joints {
                    visit(joint, plain.rotation(joint));
                }
            }
            Source::Packed(packed) => packed.each_rotation(visit),
        }
    }

    /// Position of a joint in its parent's frame, or `None` if the skeleton's offset applies.
    #[inline]
    pub(crate) fn translation(&self, joint: usize) -> Option<Vec3> {
        match &self.0 {
            Source::Plain(plain) => plain.translation(joint),
            Source::Packed(packed) => packed
                .clip
                .moves_joints()
                .then(|| packed.translation(joint)),
        }
    }

    /// Rotation and position of a joint in its parent's frame. The root's are in the space of the
    /// clip.
    #[inline]
    pub fn local(&self, skeleton: &Skeleton, id: JointId) -> (Quat, Vec3) {
        let index = id.index();
        let place = match id {
            JointId::ROOT => self.root(),
            _ => self
                .translation(index)
                .unwrap_or_else(|| skeleton.joint(id).offset),
        };
        (self.rotation(index), place)
    }

    /// Whether the clip has translations for its joints.
    pub fn moves_joints(&self) -> bool {
        match &self.0 {
            Source::Plain(plain) => plain.moves_joints(),
            Source::Packed(packed) => packed.clip.moves_joints(),
        }
    }

    /// Writes the rotations between this moment and `target`, whose root is first rotated by `turn`: slerp along the shorter
    /// arc, with one weight for all joints. Rotations of end sites may be left as they are.
    pub fn blend_rotations(&self, target: &Self, turn: Quat, weight: f32, out: &mut [Quat]) {
        let blend = Slerp::new(weight);
        match (&self.0, &target.0) {
            (Source::Plain(source), Source::Plain(target)) => Isa::best().run(
                #[inline(always)]
                || {
                    for (index, part) in out.chunks_mut(LANES).enumerate() {
                        let (source, mut target) = (source.block(index), target.block(index));
                        if index == 0 {
                            turn_lane(turn, &mut target, 0);
                        }
                        rows::unpack(&blend.between(&source, &target), part);
                    }
                },
            ),
            (Source::Packed(source), Source::Packed(target))
                if source.clip.lanes() == target.clip.lanes() =>
            {
                Isa::best().read_rows(BlendedGroups {
                    source,
                    target,
                    turn,
                    blend,
                    out,
                });
            }
            // Clips of one skeleton have the same layout, except for those that could not be compressed.
            _ => {
                for (joint, out) in out.iter_mut().enumerate() {
                    let to = match joint {
                        0 => (turn * target.rotation(0)).normalize(),
                        _ => target.rotation(joint),
                    };
                    *out = slerp(self.rotation(joint), to, weight);
                }
            }
        }
    }
}

/// Rotates one rotation of several by `turn`.
#[inline(always)]
fn turn_lane<const N: usize>(turn: Quat, rotations: &mut Rows<N>, lane: usize) {
    let [x, y, z, w] = rotations.map(|row| row[lane]);
    let turned = (turn * Quat::from_xyzw(x, y, z, w)).normalize();
    for (row, value) in rotations.iter_mut().zip(turned.to_array()) {
        row[lane] = value;
    }
}

/// [`Moment::blend_rotations`] for two compressed moments with the same lanes.
struct BlendedGroups<'a> {
    source: &'a PackedMoment<'a>,
    target: &'a PackedMoment<'a>,
    turn: Quat,
    blend: Slerp,
    out: &'a mut [Quat],
}

impl RowKernel for BlendedGroups<'_> {
    type Out = ();

    #[inline(always)]
    fn run<R: RowReader>(self, reader: R) {
        let mut sources = PackedGroups::new(self.source, reader);
        let mut targets = PackedGroups::new(self.target, reader);
        for lanes in self.source.clip.lanes().chunks(LANES) {
            let source = sources.next_block(lanes.len());
            let mut target = targets.next_block(lanes.len());
            if let Some(lane) = lanes.iter().position(|&joint| joint == 0) {
                turn_lane(self.turn, &mut target, lane);
            }
            scatter(&self.blend.between(&source, &target), lanes, self.out);
        }
    }
}

#[derive(Clone, Copy, Debug)]
pub(super) struct PlainMoment<'a> {
    pub(super) clip: &'a PlainClip,
    /// Frame at or before the moment.
    pub(super) lower: usize,
    /// Weight of the next frame, 0 at the last frame.
    pub(super) weight: f32,
}

impl PlainMoment<'_> {
    fn pose(&self, isa: Isa, out: &mut Pose) {
        let (frame, joints) = (self.lower, self.clip.joints);
        let (desc, range) = (&self.clip.desc, frame * joints..(frame + 1) * joints);
        out.root = self.root();
        out.rotations.clear();
        out.rotations
            .extend_from_slice(&desc.rotations[range.clone()]);
        out.translations.clear();
        out.translations
            .extend_from_slice(desc.translations.get(range).unwrap_or(&[]));
        if self.weight > 0.0 {
            isa.run(
                #[inline(always)]
                || {
                    for (index, part) in out.rotations.chunks_mut(LANES).enumerate() {
                        rows::unpack(&self.block(index), part);
                    }
                },
            );
            for (index, translation) in out.translations.iter_mut().enumerate() {
                *translation = self.translation(index).unwrap_or(*translation);
            }
        }
    }

    #[inline]
    fn root(&self) -> Vec3 {
        root_between(&self.clip.desc.roots[self.lower..], self.weight)
    }

    #[inline]
    fn rotation(&self, joint: usize) -> Quat {
        let rotations = &self.clip.desc.rotations[self.lower * self.clip.joints + joint..];
        match self.weight {
            0.0 => rotations[0],
            weight => nlerp(rotations[0], rotations[self.clip.joints], weight),
        }
    }

    /// Rotations of 16 joints, from joint `16 * index` on.
    #[inline(always)]
    fn block(&self, index: usize) -> Block {
        let here = self.clip.block(self.lower, index);
        match self.weight {
            0.0 => here,
            weight => rows::nlerp(&here, &self.clip.block(self.lower + 1, index), weight),
        }
    }

    /// Position of a joint in its parent's frame, or `None` if the skeleton's offset applies.
    #[inline]
    fn translation(&self, joint: usize) -> Option<Vec3> {
        let translations = self
            .clip
            .desc
            .translations
            .get(self.lower * self.clip.joints + joint..)?;
        let here = *translations.first()?;
        Some(match self.weight {
            0.0 => here,
            weight => here.lerp(translations[self.clip.joints], weight),
        })
    }

    fn moves_joints(&self) -> bool {
        !self.clip.desc.translations.is_empty()
    }
}
