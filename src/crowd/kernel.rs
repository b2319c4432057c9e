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
use super::sample::{Columns, Playing, Scattered, Source, Window};
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

impl Kernel for Run<'_> {
    /// How many parts of groups were not near enough in time to share their loads.
    type Out = usize;

    #[inline(always)]
    fn run<L: Lanes>(self) -> usize {
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
        let mut apart = 0;
        for (group, out) in self.groups.iter().zip(self.out.chunks_exact_mut(lines)) {
            for part in 0..L::PARTS {
                let mut posing = Posing::<P> {
                    bank: self.bank,
                    models: bytemuck::cast_slice_mut(self.scratch),
                    out: &mut *out,
                    output: self.output,
                    part,
                };
                let length = L::splat(self.span.intervals as f32);
                let moment = group.clock.moment(part, self.now, length);
                let fading = self.fading.then_some(self.now);
                if let Some(columns) = Window::<L>::new(self.span, moment.interval) {
                    posing.play(group, Playing::new(columns, moment.share), fading);
                } else {
                    apart += 1;
                    let columns = Scattered::<L>::new(self.span, moment.interval);
                    posing.play(group, Playing::new(columns, moment.share), fading);
                }
            }
        }
        apart
    }
}

/// One part of a group, and where it goes.
struct Posing<'a, P: Posture> {
    bank: &'a Bank,
    models: &'a mut [P::Model],
    out: &'a mut [Line],
    output: Output,
    part: usize,
}

impl<P: Posture> Posing<'_, P> {
    /// `fading`: the crowd's clock, where some have second clips.
    #[inline(always)]
    fn play<L: Lanes, C: Columns<L>>(
        &mut self,
        group: &Group,
        first: Playing<L, C>,
        fading: Option<f32>,
    ) {
        let mut placement = P::Model::zeroed();
        P::placed(&group.placement::<L>(self.part), &mut placement, self.part);
        match fading {
            None => self.joints(&placement, first),
            Some(now) => self.joints(&placement, group.fade.mixed(first, self.part, now)),
        }
    }

    /// All joints, parents first, and out with them when all parts are there.
    #[inline(always)]
    fn joints<L: Lanes, S: Source<L>>(&mut self, placement: &P::Model, source: S) {
        let chain = Chain::<P> {
            bank: self.bank,
            placement,
            part: self.part,
        };
        if (self.output.layout, self.output.memory) == (Layout::Blocks, Memory::Cached) {
            // The output itself is where children find their parents.
            let models = bytemuck::cast_slice_mut(self.out);
            chain.pose(source, models, |_, _| {});
            return;
        }
        let (is_whole, output) = (self.part + 1 == L::PARTS, self.output);
        let out = &mut *self.out;
        chain.pose(
            source,
            self.models,
            #[inline(always)]
            |models, joint| match output.layout {
                _ if !is_whole => {}
                Layout::Blocks => stream_block::<L, P>(&models[joint], block::<P>(out, joint)),
                Layout::Rows => write_rows::<L, P>(models, joint, (&mut *out, output.memory)),
            },
        );
    }
}

/// The joints of one part of a group.
struct Chain<'a, P: Posture> {
    bank: &'a Bank,
    placement: &'a P::Model,
    part: usize,
}

impl<P: Posture> Chain<'_, P> {
    /// Each joint from its parent. `done` is told of each.
    ///
    /// What a joint is without its parent is computed one joint ahead: it is a long way from the
    /// keys to there, and the joint before has much to do meanwhile.
    #[inline(always)]
    fn pose<L: Lanes, S: Source<L>>(
        &self,
        mut source: S,
        models: &mut [P::Model],
        mut done: impl FnMut(&[P::Model], usize),
    ) {
        let Bank { joints, words, .. } = self.bank;
        let models = &mut models[..joints.len()];
        let mut ahead = joints.iter();
        let Some(root) = ahead.next() else {
            return;
        };
        let mut next = P::ready(source.next(words, root));
        for (index, joint) in joints.iter().enumerate() {
            let ready = next;
            if let Some(joint) = ahead.next() {
                next = P::ready(source.next(words, joint));
            }
            let (above, rest) = models.split_at_mut(index);
            let above = match joint.parent {
                Some(parent) => &above[usize::from(parent)],
                None => self.placement,
            };
            P::compose(above, ready, &mut rest[0], self.part);
            done(models, index);
        }
    }
}

/// The lines of one joint in the output of a group.
#[inline(always)]
fn block<P: Posture>(out: &mut [Line], joint: usize) -> &mut [Line] {
    &mut out[joint * P::NUMBERS..][..P::NUMBERS]
}

#[inline(always)]
fn stream_block<L: Lanes, P: Posture>(from: &P::Model, to: &mut [Line]) {
    for (from, to) in from.as_ref().iter().zip(to) {
        for part in 0..L::PARTS {
            L::load(from, part).stream(to, part);
        }
    }
}

/// Writes the whole lines of all rows that end with this joint.
#[inline(always)]
fn write_rows<L: Lanes, P: Posture>(
    models: &[P::Model],
    joint: usize,
    (out, memory): (&mut [Line], Memory),
) {
    let (of_turn, lines) = (turn_joints::<P>(), turn_lines::<P>());
    if !(joint + 1).is_multiple_of(of_turn) && joint + 1 != models.len() {
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
        let to = out[turn * lines + line..].iter_mut().step_by(row);
        for (from, to) in turned.iter().zip(to) {
            for part in 0..L::PARTS {
                match memory {
                    Memory::Cached => L::load(from, part).store(to, part),
                    Memory::Streamed => L::load(from, part).stream(to, part),
                }
            }
        }
    }
}
