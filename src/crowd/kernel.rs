//! The poses of groups of sixteen characters: keys, mixing, the chain of joints, the output.
//!
//! Source: Hasegawa, Nishio & Kobori, 3 (joints of a level evaluated in model space). Differs: one
//! joint of sixteen characters is computed at once, a character in each lane. Joints stand
//! breadth-first, so that a joint seldom waits for the one just before it.

use std::marker::PhantomData;

use bytemuck::Zeroable;

use super::animation_set::AnimationSet;
use super::group::{Group, GroupCold};
use super::joint_math::{JointMath, Matrices, Rotations};
use super::level_clips::{ClipRange, LevelClips};
use super::level_step::LevelStep;
use super::output::{Form, Layout, Output, WriteMode};
use super::sampling::{
    Cycle, Local, Mixed, Moment, Near, Playing, Source, Turned, Weights, Window, gather_rows,
};
use super::write::write_joint;
use crate::math::{F32x16, Isa, Kernel, Lanes};

/// Groups that are posed on one level in one way.
pub(super) struct Run<'a> {
    pub(super) bank: &'a LevelClips,
    pub(super) level: Level<'a>,
    /// The clip of all of them, where they are near each other in time; else each has its own.
    pub(super) near: Option<&'a ClipRange>,
    /// Whether some of them have a second clip; they are then not near.
    pub(super) fading: bool,
    pub(super) groups: &'a [Group],
    /// Lanes of each group that are inside the frustum.
    pub(super) visible: &'a [u16],
    pub(super) cold: &'a [GroupCold],
    /// The first group that is posed, and the step to the next.
    pub(super) turn: (usize, usize),
    /// The crowd's clock, seconds.
    pub(super) now: f32,
    pub(super) output: Output,
    /// [`Output::group_len`] for each group.
    pub(super) out: &'a mut [F32x16],
    pub(super) scratch: &'a mut Scratch,
}

/// The level that is posed.
#[derive(Clone, Copy)]
pub(super) struct Level<'a> {
    /// By its number.
    pub(super) number: f32,
    /// To the levels after it.
    pub(super) steps: &'a [LevelStep],
}

/// What a thread keeps from frame to frame.
#[derive(Debug, Default)]
pub(super) struct Scratch {
    /// A group's joints, where the output is not read from.
    models: Vec<F32x16>,
    /// Columns of a group's first clips, and of its second ones.
    columns: [Vec<F32x16>; 2],
}

/// A run in one form: kernels are large, so each form has its own.
struct As<'a, P>(Run<'a>, PhantomData<P>);

impl<P: JointMath> Kernel for As<'_, P> {
    /// How many groups were near each other in time no longer.
    type Out = usize;

    #[inline(always)]
    fn run<L: Lanes>(self) -> usize {
        let streamed = self.0.output.write == WriteMode::Streamed;
        let apart = self.0.pose::<L, P>();
        if streamed {
            L::fence();
        }
        apart
    }
}

impl Run<'_> {
    /// Poses all groups; says how many were near each other in time no longer.
    pub(super) fn on(self, isa: Isa) -> usize {
        match self.output.form {
            Form::Matrices => isa.on_lanes(As::<Matrices>(self, PhantomData)),
            Form::Rotations => isa.on_lanes(As::<Rotations>(self, PhantomData)),
        }
    }
}

/// Where a group is in its clips, and what of it is shown.
#[derive(Clone, Copy)]
struct Moments<L: Lanes> {
    own: L::Parts<Moment<L>>,
    weights: L::Parts<Weights<L>>,
    /// Where each part is that is near; `None` for others.
    near: L::Parts<Option<Near<L>>>,
    all_near: bool,
    /// Nobody is on the way to another level.
    is_posed: bool,
    /// Some character is inside the frustum.
    is_visible: bool,
}

/// Groups whose moments are found before the first of them is posed. Where a group is in its clip is a long chain of steps, each of
/// which waits for the one before: those of several groups are done at once.
const AHEAD: usize = 8;

impl<L: Lanes> Moments<L> {
    #[inline(always)]
    fn blank() -> Self {
        let zero = L::splat(0.0);
        let moment = Moment {
            interval: zero,
            share: zero,
        };
        Self {
            own: L::parts(moment),
            weights: L::parts(Weights::new(zero)),
            near: L::parts(None),
            all_near: false,
            is_posed: false,
            is_visible: true,
        }
    }
}

impl Run<'_> {
    #[inline(always)]
    fn pose<L: Lanes, P: JointMath>(mut self) -> usize {
        let joints = self.bank.joints.len();
        let lines = self.output.group_len(joints);
        let mut scratch = std::mem::take(self.scratch);
        scratch.fit(joints, self.bank.row_lines);
        let all = std::mem::take(&mut self.out);
        let mut apart = 0;
        let cycle = self.near.map(|range| (range, Cycle::<L>::of(range)));
        let (first, step) = self.turn;
        let turns = (first..self.groups.len()).step_by(step).len();
        let mut ahead = [Moments::<L>::blank(); AHEAD];
        for begun in (0..turns).step_by(AHEAD) {
            let ahead = &mut ahead[..AHEAD.min(turns - begun)];
            for (turn, moments) in (begun..).zip(ahead.iter_mut()) {
                let index = first + turn * step;
                *moments = self.moments(index, cycle);
                moments.is_visible = self.visible[index] != 0;
            }
            // In loops of their own: the first is short then.
            let mut far = 0;
            for (turn, moments) in (begun..).zip(&*ahead) {
                if !moments.all_near {
                    far += 1;
                    continue;
                }
                if !moments.is_visible {
                    continue;
                }
                let index = first + turn * step;
                let out = &mut all[index * lines..][..lines];
                self.pose_near::<L, P>(index, moments, (out, &mut scratch));
            }
            if far == 0 {
                continue;
            }
            for (turn, moments) in (begun..).zip(&*ahead) {
                if moments.all_near || !moments.is_visible {
                    continue;
                }
                let index = first + turn * step;
                let out = &mut all[index * lines..][..lines];
                self.pose_apart::<L, P>(index, moments, (out, &mut scratch));
            }
            apart += far * usize::from(self.near.is_some());
        }
        *self.scratch = scratch;
        apart
    }

    #[inline(always)]
    fn moments<L: Lanes>(&self, index: usize, near: Option<(&ClipRange, Cycle<L>)>) -> Moments<L> {
        let group = &self.groups[index];
        let mut moments = Moments::<L>::blank();
        moments.all_near = near.is_some();
        moments.is_posed = self.level.shows::<L>(&group.detail, 0);
        for part in 0..L::PARTS {
            let moment = match near {
                Some((range, cycle)) => {
                    let moment = group.clock.moment(part, self.now, cycle);
                    let near = Near::new(range, cycle, moment.interval);
                    moments.all_near &= near.is_some();
                    moments.near[part] = near;
                    moment
                }
                None => {
                    let cycle = Cycle::new(L::load(&self.cold[index].length, part));
                    group.clock.moment(part, self.now, cycle)
                }
            };
            moments.own[part] = moment;
            moments.weights[part] = Weights::new(moment.share);
        }
        moments
    }

    /// A group whose characters share their loads.
    #[inline(always)]
    fn pose_near<L: Lanes, P: JointMath>(
        &self,
        index: usize,
        moments: &Moments<L>,
        (out, scratch): (&mut [F32x16], &mut Scratch),
    ) {
        let Some(range) = self.near else {
            return;
        };
        for part in 0..L::PARTS {
            let Some(near) = moments.near[part] else {
                return;
            };
            let columns = Window::new(self.bank, range, near);
            let playing = Playing::new(columns, moments.weights[part]);
            let models = &mut scratch.models;
            let mut posing = self.posing::<P>((index, part), moments.is_posed, (&mut *out, models));
            posing.joints::<L, _>(playing);
        }
    }

    /// A group each of whose characters is read by itself.
    #[inline(always)]
    fn pose_apart<L: Lanes, P: JointMath>(
        &self,
        index: usize,
        moments: &Moments<L>,
        (out, scratch): (&mut [F32x16], &mut Scratch),
    ) {
        let cold = &self.cold[index];
        let Scratch {
            models,
            columns: [first, second],
        } = scratch;
        self.turn_columns::<L>(&cold.rows, &moments.own, first);
        let mut faded = L::parts(moments.own[0]);
        if self.fading {
            for part in 0..L::PARTS {
                let cycle = Cycle::new(L::load(&cold.fade.length, part));
                faded[part] = cold.fade.clock.moment(part, self.now, cycle);
            }
            self.turn_columns::<L>(&cold.fade.rows, &faded, second);
        }
        for part in 0..L::PARTS {
            let mut posing = self.posing::<P>((index, part), moments.is_posed, (&mut *out, models));
            let own = Playing::new(turned(first, part), moments.weights[part]);
            if self.fading {
                let weights = Weights::new(faded[part].share);
                posing.joints::<L, _>(Mixed {
                    first: own,
                    second: Playing::new(turned(second, part), weights),
                    weight: L::load(&cold.fade.weight, part),
                });
            } else {
                posing.joints::<L, _>(own);
            }
        }
    }

    #[inline(always)]
    fn posing<'a, P: JointMath>(
        &'a self,
        (index, part): (usize, usize),
        is_posed: bool,
        (out, models): (&'a mut [F32x16], &'a mut [F32x16]),
    ) -> Posing<'a, P> {
        let lines = self.bank.joints.len() * P::NUMBERS;
        Posing {
            bank: self.bank,
            level: self.level,
            group: &self.groups[index],
            models: bytemuck::cast_slice_mut(&mut models[..lines]),
            out,
            output: self.output,
            part,
            is_posed,
        }
    }

    /// The columns of sixteen characters whose clips have so many rows before their own.
    #[inline(always)]
    fn turn_columns<L: Lanes>(
        &self,
        before: &[u32; F32x16::LANES],
        moments: &L::Parts<Moment<L>>,
        columns: &mut [F32x16],
    ) {
        let mut intervals = F32x16::ZERO;
        for part in 0..L::PARTS {
            moments[part].interval.store(&mut intervals, part);
        }
        let mut rows = *before;
        for (row, interval) in rows.iter_mut().zip(intervals.0) {
            *row += interval as u32;
        }
        gather_rows::<L>(self.bank, &rows, columns);
    }
}

#[inline(always)]
fn turned(columns: &[F32x16], part: usize) -> Turned<'_> {
    Turned {
        lines: columns.iter(),
        part,
    }
}

impl Scratch {
    /// Enough for any level of a animations: threads shall not allocate later.
    pub(super) fn of(animations: &AnimationSet) -> Self {
        let mut scratch = Self::default();
        for bank in &animations.banks {
            scratch.fit(bank.joints.len(), bank.row_lines);
        }
        scratch
    }

    /// Never less than there was.
    fn fit(&mut self, joints: usize, row_lines: usize) {
        let grow = |lines: &mut Vec<F32x16>, length: usize| {
            if lines.len() < length {
                lines.resize(length, F32x16::ZERO);
            }
        };
        grow(&mut self.models, joints * Matrices::NUMBERS);
        for lines in &mut self.columns {
            grow(lines, row_lines * F32x16::LANES);
        }
    }
}

/// One part of a group, and where it goes.
struct Posing<'a, P: JointMath> {
    bank: &'a LevelClips,
    level: Level<'a>,
    group: &'a Group,
    models: &'a mut [P::Model],
    out: &'a mut [F32x16],
    output: Output,
    part: usize,
    is_posed: bool,
}

impl<P: JointMath> Posing<'_, P> {
    /// All joints, parents first, and out with them when all parts are there.
    #[inline(always)]
    fn joints<L: Lanes, S: Source<L>>(&mut self, source: S) {
        let chain = Chain {
            bank: self.bank,
            group: self.group,
            part: self.part,
        };
        let is_posed = self.is_posed;
        if (self.output.layout, self.output.write) == (Layout::Blocks, WriteMode::Cached) {
            // The output itself is where children find their parents.
            let models = bytemuck::cast_slice_mut(self.out);
            chain.pose::<L, P, S>(source, models, |_, _| {});
            if !is_posed {
                step_on::<L, P>(self.level, &self.group.detail, (models, self.part));
            }
            return;
        }
        let (is_whole, output) = (self.part + 1 == L::PARTS, self.output);
        let out = &mut *self.out;
        chain.pose::<L, P, S>(
            source,
            self.models,
            #[inline(always)]
            |models, joint| {
                if is_whole && is_posed {
                    write_joint::<L, P>(models, joint, (&mut *out, output));
                }
            },
        );
        if !is_posed {
            step_on::<L, P>(self.level, &self.group.detail, (self.models, self.part));
            if is_whole {
                for joint in 0..self.bank.joints.len() {
                    write_joint::<L, P>(self.models, joint, (&mut *out, output));
                }
            }
        }
    }
}

impl Level<'_> {
    /// Whether nobody of a group is on the way to a level so many steps further, or beyond. Asked of
    /// the whole group, so that the same is computed on registers of every width.
    #[inline(always)]
    fn shows<L: Lanes>(&self, detail: &F32x16, steps: usize) -> bool {
        let mut shows = true;
        for part in 0..L::PARTS {
            let ahead = L::load(detail, part) - L::splat(self.number + steps as f32);
            shows &= ahead.all_below(f32::MIN_POSITIVE);
        }
        shows
    }
}

/// Joints that go on the way to coarser levels are put where they ride then. The coarsest first:
/// what removed on such a joint goes with it.
#[inline(always)]
fn step_on<L: Lanes, P: JointMath>(
    level: Level<'_>,
    detail: &F32x16,
    (models, part): (&mut [P::Model], usize),
) {
    for (index, step) in level.steps.iter().enumerate().rev() {
        if level.shows::<L>(detail, index) {
            continue;
        }
        let weight = L::load(detail, part) - L::splat(level.number + index as f32);
        let weight = weight.max(L::splat(0.0)).min(L::splat(1.0));
        for ride in &step.removed {
            let ready = P::ready(Local::<L>::splat(ride.turn, ride.place));
            let mut there = P::Model::zeroed();
            P::ride(&models[usize::from(ride.carrier)], ready, &mut there, part);
            P::approach(&mut models[usize::from(ride.joint)], &there, weight, part);
        }
    }
}

/// The joints of one part of a group.
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
        mut done: impl FnMut(&[P::Model], usize),
    ) {
        let joints = &self.bank.joints[..];
        let models = &mut models[..joints.len()];
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
            done(models, index);
        }
    }
}
