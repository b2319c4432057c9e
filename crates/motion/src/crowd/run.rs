//! The groups that one call of a kernel poses.

use super::clip_range::ClipRange;
use super::group::{Group, GroupCold};
use super::key_bank::KeyBank;
use super::level_clips::LevelClips;
use super::level_step::LevelStep;
use super::mix::Mix;
use super::output::Output;
use super::scratch::Scratch;
use crate::anim::ClipId;
use crate::math::{F32x16, RowSet};

/// Groups that are posed on one level in one way.
pub(super) struct Run<'a> {
    pub(super) keys: &'a KeyBank,
    pub(super) bank: &'a LevelClips,
    pub(super) level: Level<'a>,
    /// Ranges of the keys of all clips and layers.
    pub(super) ranges: &'a [ClipRange],
    /// For each group, the clip of all its characters if they are near each other in time, else `None`.
    pub(super) near: &'a [Option<ClipId>],
    /// The clips that are mixed into those of the characters.
    pub(super) mix: Mix,
    pub(super) groups: &'a [Group],
    /// Lanes of each group that are inside the frustum.
    pub(super) visible: &'a [u16],
    pub(super) cold: &'a [GroupCold],
    pub(super) turn: Turn,
    /// The groups' clock, in seconds.
    pub(super) now: f32,
    pub(super) output: Output,
    pub(super) scratch: &'a mut Scratch,
}

/// Memory that groups are written to.
pub(super) enum RunMemory<'a> {
    /// One after the other, [`Output::group_len`] `F32x16`s for each group.
    Lines(&'a mut [F32x16]),
    /// One row for each lane, anywhere in the output.
    Rows(RowSet<'a>),
}

impl RunMemory<'_> {
    /// Splits off the memory of the first `groups` groups, which take `lines` `F32x16`s.
    pub(super) fn split_off_front(&mut self, lines: usize, groups: usize) -> Self {
        match self {
            Self::Lines(all) => {
                let (front, rest) = std::mem::take(all).split_at_mut(lines);
                *all = rest;
                Self::Lines(front)
            }
            Self::Rows(rows) => Self::Rows(rows.split_off_front(groups * F32x16::LANES)),
        }
    }
}

/// Which groups are posed in this frame: every `step`th, from `first` on.
#[derive(Clone, Copy)]
pub(super) struct Turn {
    pub(super) first: usize,
    /// Distance from one posed group to the next, in groups; at least 1.
    pub(super) step: usize,
}

/// The level that is posed.
#[derive(Clone, Copy)]
pub(super) struct Level<'a> {
    /// Number of the level, as a float.
    pub(super) number: f32,
    /// Steps from this level to each of the levels after it.
    pub(super) steps: &'a [LevelStep],
}
