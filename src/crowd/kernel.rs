//! The poses of groups of sixteen characters: where they are in their clips, their keys, and their joints (see `chain`).

use std::marker::PhantomData;

use super::chain::Posing;
use super::group_moments::Moments;
use super::joint_math::JointMath;
use super::matrices::Matrices;
use super::moment::{Cycle, Weights};
use super::output::{Form, WriteMode};
use super::rotations::Rotations;
use super::run::{Run, Turn};
use super::sampling::{Mixed, Playing, ReadRows, Window, read_rows};
use super::scratch::Scratch;
use crate::math::{F32x16, Isa, Kernel, Lanes};

/// A run in one form: kernels are large, so each form has its own.
struct As<'a, P>(Run<'a>, PhantomData<P>);

impl<P: JointMath> Kernel for As<'_, P> {
    /// Number of groups that are no longer near each other in time.
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
    /// Poses all groups; returns the number of those that are no longer near each other in time.
    pub(super) fn on(self, isa: Isa) -> usize {
        match self.output.form {
            Form::Matrices => isa.on_lanes(As::<Matrices>(self, PhantomData)),
            Form::Rotations => isa.on_lanes(As::<Rotations>(self, PhantomData)),
        }
    }
}

/// Groups whose moments are found before the first of them is posed. Where a group is in its clip is a long chain of steps, each of
/// which waits for the one before: those of several groups are done at once.
const AHEAD: usize = 8;

impl Run<'_> {
    #[inline(always)]
    fn pose<L: Lanes, P: JointMath>(mut self) -> usize {
        let lines = self.output.group_len(self.bank.joints.len());
        let mut scratch = std::mem::take(self.scratch);
        scratch.fit(self.bank);
        let all = std::mem::take(&mut self.out);
        let mut apart = 0;
        let cycle = self.near.map(|range| (range, Cycle::<L>::of(range)));
        let Turn { first, step } = self.turn;
        let turns = (first..self.groups.len()).step_by(step).len();
        let mut ahead = [Moments::<L>::blank(); AHEAD];
        for begun in (0..turns).step_by(AHEAD) {
            let ahead = &mut ahead[..AHEAD.min(turns - begun)];
            for (turn, moments) in (begun..).zip(ahead.iter_mut()) {
                *moments = self.moments(first + turn * step, cycle);
            }
            // In loops of their own: the first is short then.
            let mut rest = 0;
            for moments in &*ahead {
                if !moments.all_near || self.fading {
                    rest += 1;
                    apart += usize::from(self.near.is_some() && !moments.all_near);
                    continue;
                }
                if moments.is_visible {
                    let out = &mut all[moments.group * lines..][..lines];
                    self.pose_near::<L, P>(moments, out, &mut scratch.models);
                }
            }
            if rest == 0 {
                continue;
            }
            let is_read =
                |moments: &Moments<L>| moments.is_visible && (!moments.all_near || self.fading);
            for (index, moments) in ahead.iter().enumerate() {
                if is_read(moments) {
                    let mut next = None;
                    for moments in &ahead[index + 1..] {
                        if next.is_none() && is_read(moments) {
                            next = Some(moments);
                        }
                    }
                    let out = &mut all[moments.group * lines..][..lines];
                    self.pose_read::<L, P>([Some(moments), next], out, &mut scratch);
                }
            }
        }
        *self.scratch = scratch;
        apart
    }

    /// A group whose characters share their loads.
    #[inline(always)]
    fn pose_near<L: Lanes, P: JointMath>(
        &self,
        moments: &Moments<L>,
        out: &mut [F32x16],
        models: &mut [F32x16],
    ) {
        let Some(range) = self.near else {
            return;
        };
        for part in 0..L::PARTS {
            let Some(near) = moments.near[part] else {
                return;
            };
            let columns = Window::new(self.keys, range, near);
            let playing = Playing::new(columns, moments.weights[part]);
            let mut posing = self.posing::<L, P>(moments, part, out, models);
            posing.joints::<L, _>(playing, None);
        }
        self.posing::<L, P>(moments, 0, out, models).write::<L>();
    }

    /// A group whose characters are read one by one, in their first clips or in their second ones. The keys of the group
    /// after it are asked for meanwhile.
    #[inline(always)]
    fn pose_read<L: Lanes, P: JointMath>(
        &self,
        [group, next]: [Option<&Moments<L>>; 2],
        out: &mut [F32x16],
        scratch: &mut Scratch,
    ) {
        let Some(moments) = group else {
            return;
        };
        let Scratch {
            models,
            columns: [first, second],
        } = scratch;
        let cold = &self.cold[moments.group];
        if !moments.all_near {
            read_rows::<L>(self.bank, &self.rows(moments), first);
        }
        let mut faded = moments.weights;
        if self.fading {
            let at = self.faded::<L>(moments.group);
            for part in 0..L::PARTS {
                faded[part] = Weights::new(at[part].share);
            }
            let rows = self.rows_at::<L>(&cold.fade.rows, &at);
            read_rows::<L>(self.bank, &rows, second);
        }
        let fetch = self.fetch(next);
        for part in 0..L::PARTS {
            let mut posing = self.posing::<L, P>(moments, part, out, models);
            let own = Playing::new(ReadRows::new(first, part), moments.weights[part]);
            if !self.fading {
                posing.joints::<L, _>(own, Some(&fetch));
                continue;
            }
            let second = Playing::new(ReadRows::new(second, part), faded[part]);
            let weight = L::load(&cold.fade.weight, part);
            match (self.near, moments.near[part]) {
                (Some(range), Some(near)) if moments.all_near => {
                    let columns = Window::new(self.keys, range, near);
                    let mixed = Mixed {
                        first: Playing::new(columns, moments.weights[part]),
                        second,
                        weight,
                    };
                    posing.joints::<L, _>(mixed, Some(&fetch));
                }
                _ => {
                    let mixed = Mixed {
                        first: own,
                        second,
                        weight,
                    };
                    posing.joints::<L, _>(mixed, Some(&fetch));
                }
            }
        }
        self.posing::<L, P>(moments, 0, out, models).write::<L>();
    }

    #[inline(always)]
    fn posing<'a, L: Lanes, P: JointMath>(
        &'a self,
        moments: &Moments<L>,
        part: usize,
        out: &'a mut [F32x16],
        models: &'a mut [F32x16],
    ) -> Posing<'a, P> {
        let lines = self.bank.joints.len() * P::NUMBERS;
        Posing {
            bank: self.bank,
            level: self.level,
            group: &self.groups[moments.group],
            models: bytemuck::cast_slice_mut(&mut models[..lines]),
            out,
            output: self.output,
            part,
            is_posed: moments.is_posed,
        }
    }
}
