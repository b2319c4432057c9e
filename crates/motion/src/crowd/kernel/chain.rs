//! Computes the joints of one part of a group: each from its parent, then the blending between levels.
//!
//! Source: Hasegawa, Nishio & Kobori, 3 (joints of a level evaluated in model space). Differs: a joint of sixteen
//! characters is computed at once, one character in each lane. Joints are in breadth-first order, so that a joint seldom
//! waits for the one just before it. These loops are large: they are compiled once, for all kinds of targets.
//!
//! ```text
//! for each joint, parents first:
//!     local = the joint's motion under its parent, from the keys (sampling)
//!     model[joint] = model[parent] * local                         or, for the root, placement * local
//! for each coarser level that some of the characters have, the coarsest first:
//!     for each joint that this level removes:
//!         drawn = model[carrier] * attachment
//!         model[joint] += weight * (drawn - model[joint])          weight: how far the level has come, for each lane
//! ```

use bytemuck::Zeroable;

use super::joint_math::{Local, Model, approach, compose, compose_blended, stand};
use super::moments::shows;
use super::sampling::{Fetch, Source};
use super::write::prefetch_ahead;
use crate::crowd::keys::level_clips::LevelClips;
use crate::crowd::sort::group::Group;
use crate::lod::Blend;
use crate::math::{F32x16, Lanes, RowLines};

/// A group, and where its joints are computed.
pub(crate) struct Posing<'a> {
    pub(crate) bank: &'a LevelClips,
    /// Number of the level that is posed, as a float.
    pub(crate) level: f32,
    pub(crate) group: &'a Group,
    pub(crate) models: &'a mut [Model],
    /// Rows that are written later, to be prefetched.
    pub(crate) ahead: Option<&'a RowLines<'a>>,
    /// Whether all characters look as on the posed level, so that no joint is blended towards a coarser one.
    pub(crate) is_posed: bool,
}

impl Posing<'_> {
    /// [`Posing::joints_here`] in a function of its own.
    #[inline(always)]
    pub(crate) fn joints<L: Lanes, S: Source<L>>(
        self,
        part: usize,
        source: S,
        fetch: Option<&impl Fetch>,
    ) {
        L::apart(
            #[inline(always)]
            || self.joints_here::<L, S>(part, source, fetch),
        );
    }

    /// Computes all joints of one part of the group, parents first. `fetch` is called with each joint of the first part.
    #[inline(always)]
    pub(crate) fn joints_here<L: Lanes, S: Source<L>>(
        self,
        part: usize,
        mut source: S,
        fetch: Option<&impl Fetch>,
    ) {
        let Self {
            bank,
            level,
            group,
            models,
            ahead,
            is_posed,
        } = self;
        let joints = &bank.joints[..];
        assert!(joints.len() <= models.len());
        for (index, joint) in joints.iter().enumerate() {
            let ready = source.next(joint).ready();
            let (above, rest) = models.split_at_mut(index);
            match joint.parent {
                Some(parent) => {
                    compose(&above[usize::from(parent)], ready, &mut rest[0], part);
                }
                None => stand(group.placement(part), ready, &mut rest[0], part),
            }
            if part == 0 {
                if let Some(fetch) = fetch {
                    fetch.prefetch(bank, index);
                }
                if let Some(rows) = ahead {
                    prefetch_ahead(rows, index, joints.len());
                }
            }
        }
        if !is_posed {
            L::apart(
                #[inline(always)]
                || step_on::<L>(&bank.steps, level, &group.detail, models, part),
            );
        }
    }
}

/// Moves the joints of one part that are blended towards coarser levels to where their carriers draw them. Takes the steps of the coarsest
/// level first, so that a joint that is attached to a removed joint moves with it.
#[inline(always)]
fn step_on<L: Lanes>(
    steps: &[Vec<Blend>],
    level: f32,
    detail: &F32x16,
    models: &mut [Model],
    part: usize,
) {
    for (index, step) in steps.iter().enumerate().rev() {
        if shows::<L>(level, detail, index) {
            continue;
        }
        let weight = L::load(detail, part) - L::splat(level + index as f32);
        let weight = weight.max(L::splat(0.0)).min(L::splat(1.0));
        for removed in step {
            let ready = Local::<L>::splat(&removed.offset).ready();
            let mut there = Model::zeroed();
            let carrier = &models[usize::from(removed.carrier)];
            compose_blended(carrier, ready, &mut there, part);
            let joint = &mut models[usize::from(removed.joint)];
            approach(joint, &there, weight, part);
        }
    }
}
