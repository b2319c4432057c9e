//! The joints of one part of a group: each from its parent, then the blending between levels, then the output.
//!
//! Source: Hasegawa, Nishio & Kobori, 3 (joints of a level evaluated in model space). Differs: one joint of sixteen
//! characters is computed at once, a character in each lane. Joints stand breadth-first, so that a joint seldom waits for
//! the one just before it.

use bytemuck::Zeroable;

use super::fetch::Fetch;
use super::group::Group;
use super::joint_math::JointMath;
use super::level_clips::LevelClips;
use super::quat_lanes::Local;
use super::run::Level;
use super::sampling::Source;
use super::write::Target;
use crate::math::{F32x16, Lanes};

/// A group, and where it goes.
pub(super) struct Posing<'a, P: JointMath, T> {
    pub(super) bank: &'a LevelClips,
    pub(super) level: Level<'a>,
    pub(super) group: &'a Group,
    /// Memory of the thread's own.
    pub(super) models: &'a mut [P::Model],
    pub(super) out: &'a mut T,
    /// Nobody is on the way to another level.
    pub(super) is_posed: bool,
}

impl<P: JointMath, T: Target> Posing<'_, P, T> {
    /// All joints of one part, parents first. `fetch` is told of each joint of the first part.
    #[inline(always)]
    pub(super) fn joints<L: Lanes, S: Source<L>, F: Fetch>(
        &mut self,
        part: usize,
        source: S,
        fetch: Option<&F>,
    ) {
        let (bank, is_posed) = (self.bank, self.is_posed);
        let fetch = fetch.filter(|_| part == 0);
        let chain = Chain {
            bank,
            group: self.group,
            part,
        };
        if let Some(out) = self.out.in_place() {
            let models = bytemuck::cast_slice_mut(out);
            chain.pose::<L, P, S>(
                source,
                models,
                #[inline(always)]
                |joint| {
                    if let Some(fetch) = fetch {
                        fetch.prefetch(bank, joint);
                    }
                },
            );
            if !is_posed {
                step_on::<L, P>(self.level, self.group, InPart { models, part });
            }
            return;
        }
        let joints = bank.joints.len();
        let out = &mut *self.out;
        chain.pose::<L, P, S>(
            source,
            self.models,
            #[inline(always)]
            |joint| {
                if let Some(fetch) = fetch {
                    fetch.prefetch(bank, joint);
                }
                if part == 0 {
                    out.prefetch::<P>(joint, joints);
                }
            },
        );
        if !is_posed {
            let joints = InPart {
                models: &mut *self.models,
                part,
            };
            step_on::<L, P>(self.level, self.group, joints);
        }
    }
}

impl Level<'_> {
    /// Whether nobody of a group is on the way to a level so many steps further, or beyond. Asked of the whole group, so
    /// that the same is computed on registers of every width.
    #[inline(always)]
    pub(super) fn shows<L: Lanes>(&self, detail: &F32x16, steps: usize) -> bool {
        let mut shows = true;
        for part in 0..L::PARTS {
            let ahead = L::load(detail, part) - L::splat(self.number + steps as f32);
            shows &= ahead.all_below(f32::MIN_POSITIVE);
        }
        shows
    }
}

/// The joints of one part of a group.
struct InPart<'a, M> {
    models: &'a mut [M],
    part: usize,
}

/// Puts joints that are blended towards coarser levels where they are carried. The coarsest level comes first: what is
/// carried by such a joint goes with it.
#[inline(always)]
fn step_on<L: Lanes, P: JointMath>(level: Level<'_>, group: &Group, joints: InPart<'_, P::Model>) {
    let InPart { models, part } = joints;
    for (index, step) in level.steps.iter().enumerate().rev() {
        if level.shows::<L>(&group.detail, index) {
            continue;
        }
        let weight = L::load(&group.detail, part) - L::splat(level.number + index as f32);
        let weight = weight.max(L::splat(0.0)).min(L::splat(1.0));
        for removed in &step.removed {
            let ready = P::ready(Local::<L>::splat(removed.turn, removed.place));
            let mut there = P::Model::zeroed();
            P::ride(
                &models[usize::from(removed.carrier)],
                ready,
                &mut there,
                part,
            );
            P::approach(
                &mut models[usize::from(removed.joint)],
                &there,
                weight,
                part,
            );
        }
    }
}

struct Chain<'a> {
    bank: &'a LevelClips,
    group: &'a Group,
    part: usize,
}

impl Chain<'_> {
    /// Each joint from its parent. `done` is told of each.
    #[inline(always)]
    fn pose<L: Lanes, P: JointMath, S: Source<L>>(
        &self,
        mut source: S,
        models: &mut [P::Model],
        mut done: impl FnMut(usize),
    ) {
        let joints = &self.bank.joints[..];
        assert!(joints.len() <= models.len());
        for (index, joint) in joints.iter().enumerate() {
            let ready = P::next(&mut source, joint);
            let (above, rest) = models.split_at_mut(index);
            match joint.parent {
                Some(parent) => {
                    P::compose(&above[usize::from(parent)], ready, &mut rest[0], self.part);
                }
                None => P::stand(
                    self.group.placement(self.part),
                    ready,
                    &mut rest[0],
                    self.part,
                ),
            }
            done(index);
        }
    }
}
