//! The plain way to pose a crowd, and a good one: one character after the other, two keys of four and
//! three floats each, the normalised straight line between them, and a chain of glam's `Affine3A`.

use glam::{Affine3A, Quat, Vec3};
use sabaki::lod::LevelMotion;

pub(crate) struct PlainClip {
    parents: Vec<usize>,
    frames: usize,
    frame_rate: f32,
    /// Frame by frame.
    rotations: Vec<Quat>,
    /// Of the root in each frame.
    roots: Vec<Vec3>,
    /// Of the other joints.
    offsets: Vec<Vec3>,
}

#[derive(Clone, Copy)]
pub(crate) struct PlainCharacter {
    pub(crate) time: f32,
    pub(crate) speed: f32,
}

impl PlainClip {
    pub(crate) fn new(motion: &LevelMotion) -> Self {
        let parents = motion.parents.iter();
        let frames = 0..motion.frames;
        let rotations = frames.clone().flat_map(|frame| {
            motion
                .tracks
                .iter()
                .map(move |track| track.rotations[frame])
        });
        Self {
            parents: parents
                .map(|parent| usize::from(parent.unwrap_or(0)))
                .collect(),
            frames: motion.frames,
            frame_rate: motion.frame_rate,
            rotations: rotations.collect(),
            roots: frames
                .map(|frame| motion.tracks[0].translations.at(frame))
                .collect(),
            offsets: motion
                .tracks
                .iter()
                .map(|track| track.translations.at(0))
                .collect(),
        }
    }

    /// Every character's joints into its part of `out`.
    #[inline(always)]
    pub(crate) fn pose(&self, characters: &[PlainCharacter], now: f32, out: &mut [Affine3A]) {
        let joints = self.parents.len();
        for (character, out) in characters.iter().zip(out.chunks_exact_mut(joints)) {
            let at = (character.time + character.speed * now) * self.frame_rate;
            let at = at.rem_euclid((self.frames - 1) as f32);
            let frame = (at as usize).min(self.frames - 2);
            let weight = at - frame as f32;
            let keys = &self.rotations[frame * joints..][..2 * joints];
            let (before, after) = keys.split_at(joints);
            let turn = |joint: usize| {
                let (a, b) = (before[joint], after[joint]);
                Quat::normalize(a + (b - a) * weight)
            };
            let root = self.roots[frame].lerp(self.roots[frame + 1], weight);
            out[0] = Affine3A::from_rotation_translation(turn(0), root);
            for joint in 1..joints {
                let local = Affine3A::from_rotation_translation(turn(joint), self.offsets[joint]);
                out[joint] = out[self.parents[joint]] * local;
            }
        }
    }
}
