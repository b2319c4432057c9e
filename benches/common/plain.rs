//! The plain way to pose a crowd, and a good one: one character after the other, two keys of four and
//! three floats each, the normalised straight line between them, and a chain of glam's `Affine3A`.
//!
//! All rotations of a character are mixed before its chain is begun: in one loop with the chain they
//! take half as long again, since fewer of them are on their way at once. glam is what the program
//! was built for: `RUSTFLAGS='-C target-cpu=x86-64-v3'` gives it the registers that a game has.

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

/// What is written, and one character's rotations.
#[derive(Default)]
pub(crate) struct PlainMemory {
    pub(crate) turns: Vec<Quat>,
    pub(crate) out: Vec<Affine3A>,
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

    /// Every character's joints into its part of the output.
    pub(crate) fn pose(&self, scene: &[PlainCharacter], now: f32, memory: &mut PlainMemory) {
        let joints = self.parents.len();
        let PlainMemory { turns, out } = memory;
        turns.resize(joints, Quat::IDENTITY);
        for (character, out) in scene.iter().zip(out.chunks_exact_mut(joints)) {
            let at = (character.time + character.speed * now) * self.frame_rate;
            let at = at.rem_euclid((self.frames - 1) as f32);
            let frame = (at as usize).min(self.frames - 2);
            let weight = at - frame as f32;
            let keys = &self.rotations[frame * joints..][..2 * joints];
            let (before, after) = keys.split_at(joints);
            for ((turn, &before), &after) in turns.iter_mut().zip(before).zip(after) {
                *turn = Quat::normalize(before + (after - before) * weight);
            }
            let root = self.roots[frame].lerp(self.roots[frame + 1], weight);
            out[0] = Affine3A::from_rotation_translation(turns[0], root);
            for joint in 1..joints {
                let local = Affine3A::from_rotation_translation(turns[joint], self.offsets[joint]);
                out[joint] = out[self.parents[joint]] * local;
            }
        }
    }
}
