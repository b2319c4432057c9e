//! The poses of groups of sixteen characters: keys, mixing, the chain of joints, the output.
//!
//! Source: Hasegawa, Nishio & Kobori, 3 (joints of a level evaluated in model space). Differs: one
//! joint of sixteen characters is computed at once, a character in each lane. Joints stand
//! breadth-first, so that a joint seldom waits for the one just before it.

use bytemuck::Zeroable;

use super::bank::{Bank, Span};
use super::form::{Matrices, Posture, Rotations};
use super::group::Group;
use super::output::{Form, Layout, Memory, Output, row_lines, turn_joints, turn_lines};
use super::sample::{Columns, Moment, Playing, Scattered, Source, Window};
use crate::math::{Kernel, Lanes, Line};

/// Groups that play one clip on one level.
pub(super) struct Run<'a> {
    pub(super) bank: &'a Bank,
    pub(super) span: &'a Span,
    pub(super) groups: &'a [Group],
    /// Whether some of them have a second clip.
    pub(super) fading: bool,
    /// The crowd's clock, seconds.
    pub(super) now: f32,
    pub(super) output: Output,
    /// [`Output::lines`] for each group.
    pub(super) out: &'a mut [Line],
    /// For one group's joints, where the output is not read from.
    pub(super) scratch: &'a mut Vec<Line>,
}

/// A line is taken in two parts at most.
const PARTS: usize = 2;

impl Kernel for Run<'_> {
    /// How many groups were not near enough in time to share their loads.
    type Out = usize;

    #[inline(always)]
    fn run<L: Lanes>(self) -> usize {
        const { assert!(L::PARTS <= PARTS) };
        let streamed = self.output.memory == Memory::Streamed;
        let apart = match self.output.form {
            Form::Matrices => self.pose::<L, Matrices>(),
            Form::Rotations => self.pose::<L, Rotations>(),
        };
        if streamed {
            L::fence();
        }
        apart
    }
}

impl Run<'_> {
    #[inline(always)]
    fn pose<L: Lanes, P: Posture>(self) -> usize {
        let joints = self.bank.joints.len();
        let lines = self.output.lines(joints);
        self.scratch.resize(joints * P::NUMBERS, Line::ZERO);
        let length = L::splat(self.span.intervals as f32);
        let fading = self.fading.then_some(self.now);
        let mut apart = 0;
        for (group, out) in self.groups.iter().zip(self.out.chunks_exact_mut(lines)) {
            let mut posing = Posing::<P> {
                bank: self.bank,
                placement: P::Model::zeroed(),
                models: bytemuck::cast_slice_mut(self.scratch),
                out,
                output: self.output,
            };
            for part in 0..L::PARTS {
                P::placed(&group.placement::<L>(part), &mut posing.placement, part);
            }
            // The second is the first again where a line has one part.
            let last = L::PARTS - 1;
            let moments = [
                group.clock.moment(0, self.now, length),
                group.clock.moment(last, self.now, length),
            ];
            let windows = (
                Window::new(self.span, moments[0].interval),
                Window::new(self.span, moments[1].interval),
            );
            if let (Some(first), Some(second)) = windows {
                posing.group(group, fading, moments, [first, second]);
            } else {
                apart += 1;
                let columns = [
                    Scattered::new(self.span, moments[0].interval),
                    Scattered::new(self.span, moments[1].interval),
                ];
                posing.group(group, fading, moments, columns);
            }
        }
        apart
    }
}

/// One group and where it goes.
struct Posing<'a, P: Posture> {
    bank: &'a Bank,
    placement: P::Model,
    models: &'a mut [P::Model],
    out: &'a mut [Line],
    output: Output,
}

impl<P: Posture> Posing<'_, P> {
    #[inline(always)]
    fn group<L: Lanes, C: Columns<L> + Copy>(
        &mut self,
        group: &Group,
        fading: Option<f32>,
        moments: [Moment<L>; PARTS],
        columns: [C; PARTS],
    ) {
        let first = [
            Playing::new(columns[0], moments[0].share),
            Playing::new(columns[1], moments[1].share),
        ];
        if let Some(now) = fading {
            let fade = &group.fade;
            self.joints([
                fade.mixed(first[0], 0, now),
                fade.mixed(first[1], L::PARTS - 1, now),
            ]);
        } else {
            self.joints(first);
        }
    }

    /// All joints, parents first, and out with them.
    #[inline(always)]
    fn joints<L: Lanes, S: Source<L>>(&mut self, sources: [S; PARTS]) {
        match (self.output.layout, self.output.memory) {
            (Layout::Blocks, Memory::Cached) => {
                // The output itself is where children find their parents.
                let models = bytemuck::cast_slice_mut(self.out);
                chain::<L, P, S>(self.bank, &self.placement, sources, models, |_, _| {});
            }
            (Layout::Blocks, Memory::Streamed) => {
                let out = bytemuck::cast_slice_mut(self.out);
                chain::<L, P, S>(
                    self.bank,
                    &self.placement,
                    sources,
                    self.models,
                    #[inline(always)]
                    |models, joint| stream_block::<L, P>(&models[joint], &mut out[joint]),
                );
            }
            (Layout::Rows, memory) => {
                let mut rows = Rows { out: &mut *self.out, memory };
                chain::<L, P, S>(
                    self.bank,
                    &self.placement,
                    sources,
                    self.models,
                    #[inline(always)]
                    |models, joint| rows.write::<L, P>(models, joint),
                );
            }
        }
    }
}

/// The chain of joints: each from its parent. `done` is told of each.
#[inline(always)]
fn chain<L: Lanes, P: Posture, S: Source<L>>(
    bank: &Bank,
    placement: &P::Model,
    mut sources: [S; PARTS],
    models: &mut [P::Model],
    mut done: impl FnMut(&[P::Model], usize),
) {
    let models = &mut models[..bank.joints.len()];
    let Some((root, others)) = bank.joints.split_first() else {
        return;
    };
    // What a joint is without its parent is computed one joint ahead: it is a long way from the keys
    // to there, and the joint before has much to do meanwhile.
    let mut ahead = others.iter();
    let mut ready = [P::ready(sources[0].next(&bank.words, root)); PARTS];
    for part in 1..L::PARTS {
        ready[part] = P::ready(sources[part].next(&bank.words, root));
    }
    for (index, joint) in bank.joints.iter().enumerate() {
        let (above, rest) = models.split_at_mut(index);
        let above = match joint.parent {
            Some(parent) => &above[usize::from(parent)],
            None => placement,
        };
        let now = ready;
        if let Some(next) = ahead.next() {
            for part in 0..L::PARTS {
                ready[part] = P::ready(sources[part].next(&bank.words, next));
            }
        }
        for part in 0..L::PARTS {
            P::compose(above, now[part], &mut rest[0], part);
        }
        done(models, index);
    }
}

#[inline(always)]
fn stream_block<L: Lanes, P: Posture>(from: &P::Model, to: &mut P::Model) {
    for (from, to) in from.as_ref().iter().zip(to.as_mut()) {
        for part in 0..L::PARTS {
            L::load(from, part).stream(to, part);
        }
    }
}

/// The rows of a group's characters.
struct Rows<'a> {
    out: &'a mut [Line],
    memory: Memory,
}

impl Rows<'_> {
    /// Writes the whole lines that end with this joint.
    #[inline(always)]
    fn write<L: Lanes, P: Posture>(&mut self, models: &[P::Model], joint: usize) {
        let (of_turn, lines) = (turn_joints::<P>(), turn_lines::<P>());
        if (joint + 1) % of_turn != 0 && joint + 1 != models.len() {
            return;
        }
        let turn = joint / of_turn;
        let row = row_lines::<P>(models.len());
        for line in 0..lines {
            let mut numbers = [&Line::ZERO; Line::LANES];
            for (index, number) in numbers.iter_mut().enumerate() {
                let place = line * Line::LANES + index;
                if let Some(model) = models.get(turn * of_turn + place / P::ROW)
                    && let Some(found) = model.as_ref().get(place % P::ROW)
                {
                    *number = found;
                }
            }
            let turned = L::transpose(numbers);
            let to = self.out[turn * lines + line..].iter_mut().step_by(row);
            for (from, to) in turned.iter().zip(to) {
                for part in 0..L::PARTS {
                    match self.memory {
                        Memory::Cached => L::load(from, part).store(to, part),
                        Memory::Streamed => L::load(from, part).stream(to, part),
                    }
                }
            }
        }
    }
}
