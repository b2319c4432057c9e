//! The poses of groups of sixteen characters: where they are in their clips, their keys, and their joints (see `chain`).

use std::marker::PhantomData;

use bytemuck::Zeroable;

use super::chain::Posing;
use super::fetch::GroupRows;
use super::group_moments::Moments;
use super::joint_math::JointMath;
use super::matrices::Matrices;
use super::moment::Cycle;
use super::output::{Form, Layout, Output, WriteMode};
use super::rotations::Rotations;
use super::run::{Run, RunMemory, Turn};
use super::sampling::{
    AnyColumns, Faded, Layer, Layered, MixedIn, Playing, ReadRows, RowsPart, Window,
};
use super::scratch::Scratch;
use super::write::{Copied, InPlace, RunTarget, Scattered, Target};
use crate::math::{F32x16, Isa, Kernel, KeyRows, Lanes};

/// A run in one form, to one kind of place: kernels are large, so each has its own.
struct As<'a, P, T> {
    run: Run<'a>,
    to: T,
    math: PhantomData<P>,
}

impl<P: JointMath, T: RunTarget> Kernel for As<'_, P, T> {
    /// Number of groups that are no longer near each other in time.
    type Out = usize;

    #[inline(always)]
    fn run<L: Lanes>(self) -> usize {
        let streamed = self.run.output.write == WriteMode::Streamed;
        let apart = self.run.pose::<L, P, T>(self.to);
        if streamed {
            L::fence();
        }
        apart
    }
}

impl Run<'_> {
    /// Poses all groups; returns the number of those that are no longer near each other in time.
    pub(super) fn on(self, isa: Isa, to: RunMemory<'_>) -> usize {
        let Output { layout, write, .. } = self.output;
        match to {
            RunMemory::Lines(lines) if (layout, write) == (Layout::Blocks, WriteMode::Cached) => {
                self.to(isa, InPlace(lines))
            }
            RunMemory::Lines(lines) => {
                let output = self.output;
                self.to(isa, Copied { lines, output })
            }
            RunMemory::Rows(rows) => {
                let is_streamed = write == WriteMode::Streamed;
                self.to(isa, Scattered { rows, is_streamed })
            }
        }
    }

    fn to<T: RunTarget>(self, isa: Isa, to: T) -> usize {
        match self.output.form {
            Form::Matrices => isa.on_lanes(As::<Matrices, T> {
                run: self,
                to,
                math: PhantomData,
            }),
            Form::Rotations => isa.on_lanes(As::<Rotations, T> {
                run: self,
                to,
                math: PhantomData,
            }),
        }
    }
}

/// Groups whose moments are found before the first of them is posed. Where a group is in its clip is a long chain of steps, each of
/// which waits for the one before: those of several groups are done at once.
const AHEAD: usize = 8;

impl Run<'_> {
    #[inline(always)]
    fn pose<L: Lanes, P: JointMath, T: RunTarget>(self, mut to: T) -> usize {
        let lines = self.output.group_len(self.bank.joints.len());
        let mut scratch = std::mem::take(self.scratch);
        scratch.fit(self.bank);
        // What rows end with is the same on any thread.
        for spare in &mut self.models::<P>(&mut scratch.models)[self.bank.joints.len()..] {
            *spare = P::Model::zeroed();
        }
        let mut apart = 0;
        let cycle = self.near.map(|range| (range, Cycle::<L>::of(range)));
        let Turn { first, step } = self.turn;
        let turns = (first..self.groups.len()).step_by(step).len();
        let mut ahead = [Moments::<L>::blank(); AHEAD];
        let mut rows = [GroupRows::<L>::NONE; AHEAD];
        for begun in (0..turns).step_by(AHEAD) {
            let ahead = &mut ahead[..AHEAD.min(turns - begun)];
            for (turn, moments) in (begun..).zip(ahead.iter_mut()) {
                *moments = self.moments(first + turn * step, cycle);
            }
            // In loops of their own: the first is short then.
            let mut reads = 0;
            for (index, moments) in ahead.iter().enumerate() {
                let is_near = moments.all_near;
                apart += usize::from(self.near.is_some() && !is_near);
                if !moments.is_visible {
                    continue;
                }
                if !is_near || !self.mix.is_none() {
                    // Some groups before they are used: numbers that were stored together are not read one by one at once.
                    rows[reads].index = index;
                    self.group_rows(moments, &mut rows[reads]);
                    reads += 1;
                    continue;
                }
                let Scratch { models, spare, .. } = &mut scratch;
                let out = to.group(moments.group, lines, spare);
                self.pose_near::<L, P, T::Group<'_>>(moments, out, models);
            }
            for read in 0..reads {
                let rows = &rows[read..reads];
                let moments = &ahead[rows[0].index];
                let Scratch {
                    models,
                    columns,
                    spare,
                } = &mut scratch;
                let group = ReadGroup {
                    moments,
                    rows: &rows[0],
                    next: rows.get(1),
                    columns,
                };
                let out = to.group(moments.group, lines, spare);
                self.pose_read::<L, P, T::Group<'_>>(group, out, models);
            }
        }
        *self.scratch = scratch;
        apart
    }

    /// A group whose characters share their loads.
    #[inline(always)]
    fn pose_near<L: Lanes, P: JointMath, T: Target>(
        &self,
        moments: &Moments<L>,
        mut out: T,
        models: &mut [F32x16],
    ) {
        for part in 0..L::PARTS {
            let Some(window) = self.window::<L>(moments, part) else {
                return;
            };
            let playing = Playing::new(window, moments.weights[part]);
            let mut posing = self.posing::<L, P, T>(moments, &mut out, models);
            posing.joints::<L, _>(part, playing, None);
        }
        out.write::<L, P>(self.bank.joints.len(), self.models::<P>(models));
    }

    /// The keys of characters that share their loads.
    #[inline(always)]
    fn window<L: Lanes>(&self, moments: &Moments<L>, part: usize) -> Option<Window<'_, L>> {
        match (self.near, moments.near[part]) {
            (Some(range), Some(near)) => Some(Window::new(self.keys, range, near)),
            _ => None,
        }
    }

    /// A group whose characters are read one by one, in their first clips or in what is mixed into them. The keys of the group
    /// after it are asked for meanwhile.
    #[inline(always)]
    fn pose_read<L: Lanes, P: JointMath, T: Target>(
        &self,
        group: ReadGroup<'_, L>,
        mut out: T,
        models: &mut [F32x16],
    ) {
        let ReadGroup {
            moments,
            rows,
            next: fetch,
            columns: [first, second, third],
        } = group;
        let (bank, cold) = (self.bank, &self.cold[moments.group]);
        let none = KeyRows::none(&self.keys.rows);
        let own_rows = rows.own.as_ref().unwrap_or(&none);
        let (mut faded, mut layered) = (moments.weights, moments.weights);
        let (mut fade_rows, mut layer_rows) = (&none, &none);
        if let Some(clip) = &rows.faded {
            (faded, fade_rows) = (clip.weights, &clip.rows);
        }
        if let Some(clip) = &rows.layer {
            (layered, layer_rows) = (clip.weights, &clip.rows);
        }
        for part in 0..L::PARTS {
            let mut posing = self.posing::<L, P, T>(moments, &mut out, models);
            let weights = moments.weights[part];
            let own_from = RowsPart {
                level: bank,
                rows: own_rows,
                part,
            };
            let fade_from = RowsPart {
                rows: fade_rows,
                ..own_from
            };
            let layer_from = RowsPart {
                rows: layer_rows,
                ..own_from
            };
            if self.mix.is_none() {
                let own = Playing::new(ReadRows::new::<L>(own_from, first), weights);
                posing.joints::<L, _>(part, own, fetch);
                continue;
            }
            let fade = MixedIn {
                clip: Playing::new(ReadRows::new::<L>(fade_from, second), faded[part]),
                weight: L::load(&cold.fade.weight, part),
            };
            let shared = match rows.own {
                Some(_) => None,
                None => self.window::<L>(moments, part),
            };
            if !self.mix.is_layered {
                // The commonest mixture has a kernel for each kind of columns.
                if let Some(window) = shared {
                    let own = Playing::new(window, weights);
                    posing.joints::<L, _>(part, Faded { own, fade }, fetch);
                } else {
                    let own = Playing::new(ReadRows::new::<L>(own_from, first), weights);
                    posing.joints::<L, _>(part, Faded { own, fade }, fetch);
                }
                continue;
            }
            let own = match shared {
                Some(window) => AnyColumns::Shared(window),
                None => AnyColumns::Read(ReadRows::new::<L>(own_from, first)),
            };
            let own = Playing::new(own, weights);
            let layer = Layer {
                clip: Playing::new(ReadRows::new::<L>(layer_from, third), layered[part]),
                places: bank.layer_places.iter(),
                weight: L::load(&cold.layer.weight, part),
            };
            if self.mix.fades {
                let own = Faded { own, fade };
                posing.joints::<L, _>(part, Layered { own, layer }, fetch);
            } else {
                posing.joints::<L, _>(part, Layered { own, layer }, fetch);
            }
        }
        out.write::<L, P>(self.bank.joints.len(), self.models::<P>(models));
    }

    #[inline(always)]
    fn posing<'a, L: Lanes, P: JointMath, T: Target>(
        &'a self,
        moments: &Moments<L>,
        out: &'a mut T,
        models: &'a mut [F32x16],
    ) -> Posing<'a, P, T> {
        Posing {
            bank: self.bank,
            level: self.level,
            group: &self.groups[moments.group],
            models: self.models::<P>(models),
            out,
            is_posed: moments.is_posed,
        }
    }

    /// A group's joints in memory of the thread's own.
    #[inline(always)]
    fn models<'a, P: JointMath>(&self, models: &'a mut [F32x16]) -> &'a mut [P::Model] {
        let joints = self.bank.joints.len() + P::SPARE;
        bytemuck::cast_slice_mut(&mut models[..joints * P::NUMBERS])
    }
}

/// A group whose characters are read one by one.
struct ReadGroup<'a, L: Lanes> {
    moments: &'a Moments<L>,
    rows: &'a GroupRows<'a, L>,
    /// Those of the group that is posed after it.
    next: Option<&'a GroupRows<'a, L>>,
    columns: &'a mut [Vec<F32x16>; 3],
}
