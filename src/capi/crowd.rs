//! Functions that pose all characters of a game at once, on levels of detail, into a buffer of the caller.

use std::sync::Arc;

use glam::Vec3;

use super::game::{Game, kind_id};
use super::sized::{Grows, read, sized, write};
use super::status::Status;
use super::{given, given_slice_mut};
use crate::character::{CharacterId, CrowdPoseSettings};
use crate::crowd::{CrowdSettings, Layout, Output, WriteMode};
use crate::lod::{LevelId, LevelSettings, Levels, Rule, SwitchSettings, Switching};
use crate::math::F32x16;

/// `sabaki_crowd_settings`.
#[derive(Clone, Copy)]
#[repr(C)]
pub(super) struct CrowdSettingsIn {
    size: u32,
    threads: u32,
    is_in_blocks: u32,
    is_streamed: u32,
    near: f32,
    furthest: f32,
    blend_error: f32,
    kind: u32,
}

// SAFETY: numbers alone, the first of which is the size.
unsafe impl Grows for CrowdSettingsIn {
    const NAME: &'static str = "crowd settings";

    fn blank() -> Self {
        let (default, switching) = (CrowdPoseSettings::default(), SwitchSettings::default());
        Self {
            size: 0,
            threads: default.crowd.threads as u32,
            is_in_blocks: 0,
            is_streamed: 0,
            near: default.near,
            furthest: match switching.rule {
                Rule::Energy { furthest } => furthest,
                _ => 0.0,
            },
            blend_error: default.blend_error,
            kind: 0,
        }
    }
}

/// `sabaki_pose_slice`.
#[derive(Clone, Copy)]
#[repr(C)]
pub(super) struct PoseSliceOut {
    size: u32,
    joints: u32,
    start: u64,
    joint_stride: u32,
    number_stride: u32,
    level: u32,
    detail: f32,
}

sized! {
    PoseSliceOut, "pose slice";
}

exported! {
    unsafe extern "C" fn sabaki_crowd_settings_default(settings: *mut CrowdSettingsIn) {
        // SAFETY: the caller gives place for settings.
        unsafe { write(CrowdSettingsIn::blank(), settings) }?;
    }

    unsafe extern "C" fn sabaki_use_crowd(
        game: Option<&mut Game>,
        settings: *const CrowdSettingsIn,
    ) {
        let settings = match settings.is_null() {
            true => CrowdSettingsIn::blank(),
            // SAFETY: the caller gives settings.
            false => unsafe { read(settings) }?,
        };
        let game = given(game, "game")?;
        let kind = kind_id(settings.kind);
        let baked = Arc::clone(game.characters.baked_of_kind(kind)?);
        let (skeleton, clips) = (baked.graph().skeleton(), baked.graph().clips());
        let levels = Levels::build(skeleton, clips, &LevelSettings::default());
        let levels = levels.map_err(|error| error.to_string())?;
        let switching = SwitchSettings {
            rule: Rule::Energy { furthest: settings.furthest },
            ..SwitchSettings::default()
        };
        let switching = Switching::new(&levels, &switching).map_err(|error| error.to_string())?;
        let output = Output {
            layout: if settings.is_in_blocks == 0 { Layout::Instances } else { Layout::Blocks },
            write: if settings.is_streamed == 0 { WriteMode::Cached } else { WriteMode::Streamed },
        };
        game.characters.use_crowd(kind, &levels, CrowdPoseSettings {
            crowd: CrowdSettings {
                output,
                threads: settings.threads as usize,
                ..CrowdSettings::default()
            },
            near: settings.near,
            switching,
            blend_error: settings.blend_error,
        })?;
    }

    unsafe extern "C" fn sabaki_crowd_bytes(game: Option<&Game>, characters: usize) -> usize {
        // SAFETY: nothing is asked of the caller.
        unsafe { sabaki_kind_crowd_bytes(game, 0, characters) }
    }

    unsafe extern "C" fn sabaki_kind_crowd_bytes(
        game: Option<&Game>,
        kind: u32,
        characters: usize,
    ) -> usize {
        let len = |game: &Game| game.characters.max_output_len(kind_id(kind), characters);
        game.map_or(0, |game| len(game) * size_of::<F32x16>())
    }

    unsafe extern "C" fn sabaki_pose_all(
        game: Option<&mut Game>,
        eye: Option<&[f32; 3]>,
        out: *mut F32x16,
        size: usize,
    ) -> Status {
        // SAFETY: the caller gives place for that many bytes.
        unsafe { sabaki_pose_kind(game, 0, eye, out, size) }
    }

    unsafe extern "C" fn sabaki_pose_kind(
        game: Option<&mut Game>,
        kind: u32,
        eye: Option<&[f32; 3]>,
        out: *mut F32x16,
        size: usize,
    ) {
        let (game, eye) = (given(game, "game")?, Vec3::from_array(*given(eye, "eye")?));
        let eye = game.space.inverse().point(eye);
        if !out.is_aligned() {
            return Err("out does not begin at a multiple of 64 bytes".to_owned().into());
        }
        // SAFETY: the caller gives place for that many bytes, and all that they may be are numbers.
        let out = unsafe { given_slice_mut(out, size / size_of::<F32x16>(), "out") }?;
        game.characters.pose_all(kind_id(kind), eye, out)?;
    }

    unsafe extern "C" fn sabaki_pose_slice_of(
        game: Option<&Game>,
        character: u64,
        slice: *mut PoseSliceOut,
    ) {
        let (game, id) = (given(game, "game")?, CharacterId::from_bits(character));
        let found = game.characters.pose_slice(id)?;
        let out = PoseSliceOut {
            size: 0,
            joints: found.joints as u32,
            start: found.start as u64,
            joint_stride: found.joint_stride as u32,
            number_stride: found.number_stride as u32,
            level: found.level.0.into(),
            detail: game.characters.detail(id)?,
        };
        // SAFETY: the caller gives place for a slice.
        unsafe { write(out, slice) }?;
    }

    unsafe extern "C" fn sabaki_level_joint(game: Option<&Game>, level: u32, index: u32) -> u32 {
        // SAFETY: nothing is asked of the caller.
        unsafe { sabaki_kind_level_joint(game, 0, level, index) }
    }

    unsafe extern "C" fn sabaki_kind_level_joint(
        game: Option<&Game>,
        kind: u32,
        level: u32,
        index: u32,
    ) -> u32 {
        let animations = game.and_then(|game| game.characters.animations(kind_id(kind)));
        let joints = animations
            .zip(u16::try_from(level).ok())
            .map(|(animations, level)| animations.joint_ids(LevelId(level)));
        let found = joints.and_then(|joints| joints.get(index as usize));
        found.map_or(u32::MAX, |joint| joint.0.into())
    }
}
