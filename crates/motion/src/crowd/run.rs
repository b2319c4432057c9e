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
    /// Those of all clips.
    pub(super) ranges: &'a [ClipRange],
    /// Of each group the clip of all its characters, where they are near each other in time; else each has its own.
    pub(super) near: &'a [Option<ClipId>],
    /// What is mixed into the clips of some of them.
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

/// Where groups go.
pub(super) enum RunMemory<'a> {
    /// [`Output::group_len`] for each group.
    Lines(&'a mut [F32x16]),
    /// A row of its own for each lane.
    Rows(RowSet<'a>),
}

impl RunMemory<'_> {
    /// Cuts off what comes first: so much memory for so many groups.
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

/// Which groups are posed in this frame.
#[derive(Clone, Copy)]
pub(super) struct Turn {
    pub(super) first: usize,
    /// From one to the next.
    pub(super) step: usize,
}

/// The level that is posed.
#[derive(Clone, Copy)]
pub(super) struct Level<'a> {
    /// By its number.
    pub(super) number: f32,
    /// To the levels after it.
    pub(super) steps: &'a [LevelStep],
}
