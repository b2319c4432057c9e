//! Functions that release characters to the host and resume them, and that save and load games.

use glam::{Quat, Vec3};

use super::game::Game;
use super::sized::{read, sized};
use super::{given, given_slice, given_slice_mut};
use crate::anim::{JointId, Pose};
use crate::character::CharacterId;
use crate::math::Space;

/// `sabaki_local_pose`.
#[derive(Clone, Copy)]
#[repr(C)]
pub(super) struct LocalPose {
    size: u32,
    count: u32,
    root: [f32; 3],
    rotations: *const f32,
    translations: *const f32,
}

sized! {
    LocalPose, "a pose";
}

impl LocalPose {
    /// # Safety
    /// The rotations are valid, and the translations are valid or null.
    unsafe fn copy(&self, space: Space, out: &mut Pose) -> Result<(), String> {
        let count = self.count as usize;
        let moved = if self.translations.is_null() {
            0
        } else {
            3 * count
        };
        // SAFETY: the caller vouches for rotations and translations.
        let (rotations, translations) = unsafe {
            (
                given_slice(self.rotations, 4 * count, "rotations")?,
                given_slice(self.translations, moved, "translations")?,
            )
        };
        out.root = space.point(Vec3::from_array(self.root));
        out.rotations.clear();
        let each = rotations.chunks_exact(4);
        out.rotations
            .extend(each.map(|four| space.rotation(Quat::from_slice(four))));
        out.translations.clear();
        let each = translations.chunks_exact(3);
        out.translations
            .extend(each.map(|three| space.point(Vec3::from_slice(three))));
        Ok(())
    }
}

/// Writes what was saved, and its size.
///
/// # Safety
/// There is room for `capacity` bytes at `bytes`.
unsafe fn write_saved(
    saved: &[u8],
    bytes: *mut u8,
    capacity: usize,
    size: Option<&mut usize>,
) -> Result<(), String> {
    // SAFETY: as the caller of this function promises.
    let out = unsafe { given_slice_mut(bytes, capacity, "bytes") }?;
    *given(size, "size")? = saved.len();
    if let Some(out) = out.get_mut(..saved.len()) {
        out.copy_from_slice(saved);
    } else if !out.is_empty() {
        return Err(format!("what is saved needs {} bytes", saved.len()));
    }
    Ok(())
}

exported! {
    unsafe extern "C" fn sabaki_local_pose_of(
        game: Option<&Game>,
        character: u64,
        root: *mut f32,
        rotations: *mut f32,
        translations: *mut f32,
        count: usize,
    ) {
        let moved = if translations.is_null() { 0 } else { 3 * count };
        // SAFETY: the caller gives place for 3, four times `count` and, unless it is null, three times `count` numbers.
        let (root, rotations, translations) = unsafe {
            (
                given_slice_mut(root, 3, "root")?,
                given_slice_mut(rotations, 4 * count, "rotations")?,
                given_slice_mut(translations, moved, "translations")?,
            )
        };
        let (game, mut pose) = (given(game, "game")?, Pose::default());
        let id = CharacterId::from_bits(character);
        game.characters.local_pose(id, &mut pose)?;
        root.copy_from_slice(&game.space.point(pose.root).to_array());
        for (out, rotation) in rotations.chunks_exact_mut(4).zip(&pose.rotations) {
            game.space.rotation(*rotation).write_to_slice(out);
        }
        pose.fill_translations(game.characters.baked_of(id)?.graph().skeleton());
        for (out, place) in translations.chunks_exact_mut(3).zip(&pose.translations) {
            game.space.point(*place).write_to_slice(out);
        }
    }

    unsafe extern "C" fn sabaki_set_additive(
        game: Option<&mut Game>,
        character: u64,
        joints: *const u32,
        rotations: *const f32,
        count: usize,
    ) {
        // SAFETY: the caller gives that many joints, and four times as many numbers.
        let (joints, rotations) = unsafe {
            (
                given_slice(joints, count, "joints")?,
                given_slice(rotations, 4 * count, "rotations")?,
            )
        };
        let game = given(game, "game")?;
        let space = game.space.inverse();
        let each = joints.iter().zip(rotations.chunks_exact(4));
        let added: Vec<_> = each
            .map(|(&joint, rotation)| {
                let joint = JointId(u16::try_from(joint).unwrap_or(u16::MAX));
                (joint, space.rotation(Quat::from_slice(rotation)))
            })
            .collect();
        let id = CharacterId::from_bits(character);
        game.characters.set_additive(id, &added)?;
    }

    unsafe extern "C" fn sabaki_release(game: Option<&mut Game>, character: u64) {
        let id = CharacterId::from_bits(character);
        given(game, "game")?.characters.release(id)?;
    }

    unsafe extern "C" fn sabaki_resume(
        game: Option<&mut Game>,
        character: u64,
        before: *const LocalPose,
        now: *const LocalPose,
        seconds: f32,
    ) {
        let game = given(game, "game")?;
        // SAFETY: the caller's poses have their rotations.
        unsafe {
            let space = game.space.inverse();
            read(before)?.copy(space, &mut game.poses[0])?;
            read(now)?.copy(space, &mut game.poses[1])?;
        }
        let [before, now] = &game.poses;
        let id = CharacterId::from_bits(character);
        game.characters.resume(id, [before, now], seconds)?;
    }

    unsafe extern "C" fn sabaki_save(
        game: Option<&Game>,
        bytes: *mut u8,
        capacity: usize,
        size: Option<&mut usize>,
    ) {
        let saved = given(game, "game")?.characters.save()?;
        // SAFETY: the caller gives room for that many bytes.
        unsafe { write_saved(&saved, bytes, capacity, size) }?;
    }

    unsafe extern "C" fn sabaki_load(game: Option<&mut Game>, bytes: *const u8, size: usize) {
        // SAFETY: the caller gives that many bytes.
        let bytes = unsafe { given_slice(bytes, size, "bytes") }?;
        given(game, "game")?.characters.load(bytes)?;
    }

    unsafe extern "C" fn sabaki_save_character(
        game: Option<&Game>,
        character: u64,
        bytes: *mut u8,
        capacity: usize,
        size: Option<&mut usize>,
    ) {
        let id = CharacterId::from_bits(character);
        let saved = given(game, "game")?.characters.save_character(id)?;
        // SAFETY: the caller gives room for that many bytes.
        unsafe { write_saved(&saved, bytes, capacity, size) }?;
    }

    unsafe extern "C" fn sabaki_load_character(
        game: Option<&mut Game>,
        character: u64,
        bytes: *const u8,
        size: usize,
    ) {
        // SAFETY: the caller gives that many bytes.
        let bytes = unsafe { given_slice(bytes, size, "bytes") }?;
        let id = CharacterId::from_bits(character);
        given(game, "game")?.characters.load_character(id, bytes)?;
    }
}
