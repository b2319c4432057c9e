//! The poses of groups of sixteen characters: where they are in their clips, their keys, and their joints (see `chain`).

use std::marker::PhantomData;

use super::bucket::Mix;
use super::chain::Posing;
use super::fetch::Fetch;
use super::group::ClipLines;
use super::group_moments::Moments;
use super::joint_math::JointMath;
use super::matrices::Matrices;
use super::moment::{Cycle, Weights};
use super::output::{Form, Layout, Output, WriteMode};
use super::rotations::Rotations;
use super::run::{Run, RunMemory, Turn};
use super::sampling::{
    AnyColumns, Faded, Layer, Layered, MixedIn, Playing, ReadRows, Window, read_rows,
};
use super::scratch::Scratch;
use super::write::{Copied, InPlace, RunTarget, Scattered, Target};
use crate::math::{F32x16, Isa, Kernel, Lanes};

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
                if !moments.all_near || !self.mix.is_none() {
                    rest += 1;
                    apart += usize::from(self.near.is_some() && !moments.all_near);
                    continue;
                }
                if moments.is_visible {
                    let Scratch { models, spare, .. } = &mut scratch;
                    let out = to.group(moments.group, lines, spare);
                    self.pose_near::<L, P, T::Group<'_>>(moments, out, models);
                }
            }
            if rest == 0 {
                continue;
            }
            let is_read = |moments: &Moments<L>| {
                moments.is_visible && (!moments.all_near || !self.mix.is_none())
            };
            for (index, moments) in ahead.iter().enumerate() {
                if is_read(moments) {
                    let mut next = None;
                    for moments in &ahead[index + 1..] {
                        if next.is_none() && is_read(moments) {
                            next = Some(moments);
                        }
                    }
                    let Scratch {
                        models,
                        columns,
                        spare,
                    } = &mut scratch;
                    let group = ReadGroup {
                        moments,
                        next,
                        columns,
                    };
                    let out = to.group(moments.group, lines, spare);
                    self.pose_read::<L, P, T::Group<'_>>(group, out, models);
                }
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
        out.write::<L, P>(self.models::<P>(models));
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
            next,
            columns: [first, second, third],
        } = group;
        let cold = &self.cold[moments.group];
        let Mix { fades, is_layered } = self.mix;
        if !moments.all_near {
            read_rows::<L>(self.bank, &self.rows(moments), first);
        }
        let mut faded = moments.weights;
        if fades {
            faded = self.read_mixed::<L>(&cold.fade, second);
        }
        let mut layer = moments.weights;
        if is_layered {
            layer = self.read_mixed::<L>(&cold.layer, third);
        }
        let mut fetch = Fetch::none(self.bank);
        if let Some(next) = next {
            self.fetch(next, &mut fetch);
        }
        for part in 0..L::PARTS {
            let mut posing = self.posing::<L, P, T>(moments, &mut out, models);
            let fetch = Some(&fetch);
            if self.mix.is_none() {
                let own = Playing::new(ReadRows::new(first, part), moments.weights[part]);
                posing.joints::<L, _>(part, own, fetch);
                continue;
            }
            let fade = MixedIn {
                clip: Playing::new(ReadRows::new(second, part), faded[part]),
                weight: L::load(&cold.fade.weight, part),
            };
            let shared = self.window::<L>(moments, part);
            let shared = shared.filter(|_| moments.all_near);
            let weights = moments.weights[part];
            if !is_layered {
                // The commonest mixture has a kernel for each kind of columns.
                if let Some(window) = shared {
                    let own = Playing::new(window, weights);
                    posing.joints::<L, _>(part, Faded { own, fade }, fetch);
                } else {
                    let own = Playing::new(ReadRows::new(first, part), weights);
                    posing.joints::<L, _>(part, Faded { own, fade }, fetch);
                }
                continue;
            }
            let own = match shared {
                Some(window) => AnyColumns::Shared(window),
                None => AnyColumns::Read(ReadRows::new(first, part)),
            };
            let own = Playing::new(own, weights);
            let layer = Layer {
                clip: Playing::new(ReadRows::new(third, part), layer[part]),
                places: self.bank.layer_places.iter(),
                weight: L::load(&cold.layer.weight, part),
            };
            if fades {
                let own = Faded { own, fade };
                posing.joints::<L, _>(part, Layered { own, layer }, fetch);
            } else {
                posing.joints::<L, _>(part, Layered { own, layer }, fetch);
            }
        }
        out.write::<L, P>(self.models::<P>(models));
    }

    /// Reads the clips that are mixed into those of a group; returns how far their characters are between two keys.
    #[inline(always)]
    fn read_mixed<L: Lanes>(
        &self,
        clips: &ClipLines,
        columns: &mut [F32x16],
    ) -> L::Parts<Weights<L>> {
        let at = self.mixed_moments::<L>(clips);
        let rows = self.rows_at::<L>(&clips.rows, &at);
        read_rows::<L>(self.bank, &rows, columns);
        let mut weights = L::parts(Weights::new(L::splat(0.0)));
        for part in 0..L::PARTS {
            weights[part] = Weights::new(at[part].share);
        }
        weights
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
        bytemuck::cast_slice_mut(&mut models[..self.bank.joints.len() * P::NUMBERS])
    }
}

/// A group whose characters are read one by one.
struct ReadGroup<'a, L: Lanes> {
    moments: &'a Moments<L>,
    /// The one that is posed after it.
    next: Option<&'a Moments<L>>,
    columns: &'a mut [Vec<F32x16>; 3],
}
