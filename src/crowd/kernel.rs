//! The poses of groups of sixteen characters: keys, mixing, the chain of joints, the output.
//!
//! Source: Hasegawa, Nishio & Kobori, 3 (joints of a level evaluated in model space). Differs: one
//! joint of sixteen characters is computed at once, a character in each lane. Joints stand
//! breadth-first, so that a joint seldom waits for the one just before it.

use std::marker::PhantomData;

use bytemuck::Zeroable;

use super::bank::{Bank, Span};
use super::form::{Matrices, Posture, Rotations};
use super::group::{Aside, Group};
use super::output::{Form, Layout, Memory, Output, row_lines, turn_joints, turn_lines};
use super::repertoire::Repertoire;
use super::sample::{Local, Mixed, Moment, Near, Playing, Source, Turned, Window, turn_rows};
use super::step::Step;
use crate::math::{Isa, Kernel, Lanes, Line};

/// Groups that are posed on one level in one way.
pub(super) struct Run<'a> {
    pub(super) bank: &'a Bank,
    pub(super) level: Level<'a>,
    /// The clip of all of them, where they are near each other in time; else each has its own.
    pub(super) near: Option<&'a Span>,
    /// Whether some of them have a second clip; they are then not near.
    pub(super) fading: bool,
    pub(super) groups: &'a [Group],
    pub(super) asides: &'a [Aside],
    /// The first group that is posed, and the step to the next.
    pub(super) turn: (usize, usize),
    /// The crowd's clock, seconds.
    pub(super) now: f32,
    pub(super) output: Output,
    /// [`Output::lines`] for each group.
    pub(super) out: &'a mut [Line],
    pub(super) scratch: &'a mut Scratch,
}

/// The level that is posed.
#[derive(Clone, Copy)]
pub(super) struct Level<'a> {
    /// By its number.
    pub(super) number: f32,
    /// To the levels after it.
    pub(super) steps: &'a [Step],
}

/// What a thread keeps from frame to frame.
#[derive(Debug, Default)]
pub(super) struct Scratch {
    /// A group's joints, where the output is not read from.
    models: Vec<Line>,
    /// Columns of a group's first clips, and of its second ones.
    columns: [Vec<Line>; 2],
}

/// A run in one form: kernels are large, so each form has its own.
struct As<'a, P>(Run<'a>, PhantomData<P>);

impl<P: Posture> Kernel for As<'_, P> {
    /// How many groups were near each other in time no longer.
    type Out = usize;

    #[inline(always)]
    fn run<L: Lanes>(self) -> usize {
        let streamed = self.0.output.memory == Memory::Streamed;
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

/// The moments of a group.
#[derive(Clone, Copy)]
struct Moments<L: Lanes> {
    own: L::Parts<Moment<L>>,
    /// Where each part is that is near; `None` for others.
    near: L::Parts<Option<Near<L>>>,
    all_near: bool,
}

impl Run<'_> {
    #[inline(always)]
    fn pose<L: Lanes, P: Posture>(mut self) -> usize {
        let joints = self.bank.joints.len();
        let lines = self.output.lines(joints);
        let mut scratch = std::mem::take(self.scratch);
        scratch.fit(joints, self.bank.row_lines);
        let all = std::mem::take(&mut self.out);
        let mut apart = 0;
        let (first, step) = self.turn;
        if let Some(group) = self.groups.get(first) {
            // A division and a search of the lanes: begun while the group before has much to do.
            let mut ahead = self.moments::<L>(group, first);
            for index in (first..self.groups.len()).step_by(step) {
                let moments = ahead;
                let next = (index + step).min(self.groups.len() - 1);
                ahead = self.moments(&self.groups[next], next);
                apart += usize::from(self.near.is_some() && !moments.all_near);
                let out = &mut all[index * lines..][..lines];
                self.pose_group::<L, P>(index, &moments, (out, &mut scratch));
            }
        }
        *self.scratch = scratch;
        apart
    }

    #[inline(always)]
    fn moments<L: Lanes>(&self, group: &Group, index: usize) -> Moments<L> {
        let zero = Moment {
            interval: L::splat(0.0),
            share: L::splat(0.0),
        };
        let mut moments = Moments::<L> {
            own: L::parts(zero),
            near: L::parts(None),
            all_near: self.near.is_some(),
        };
        for part in 0..L::PARTS {
            match self.near {
                Some(span) => {
                    let length = L::splat(span.intervals as f32);
                    let moment = group.clock.moment(part, self.now, length);
                    let near = Near::new(span, moment.interval);
                    moments.all_near &= near.is_some();
                    moments.own[part] = moment;
                    moments.near[part] = near;
                }
                None => {
                    let length = L::load(&self.asides[index].length, part);
                    moments.own[part] = group.clock.moment(part, self.now, length);
                }
            }
        }
        moments
    }

    #[inline(always)]
    fn pose_group<L: Lanes, P: Posture>(
        &self,
        index: usize,
        moments: &Moments<L>,
        (out, scratch): (&mut [Line], &mut Scratch),
    ) {
        let (group, aside) = (&self.groups[index], &self.asides[index]);
        let Scratch {
            models,
            columns: [first, second],
        } = scratch;
        let joints = self.bank.joints.len();
        let mut faded = L::parts(moments.own[0]);
        if !moments.all_near {
            self.turn_columns::<L>(&aside.rows, &moments.own, first);
        }
        if self.fading {
            for part in 0..L::PARTS {
                let length = L::load(&aside.fade.length, part);
                faded[part] = aside.fade.clock.moment(part, self.now, length);
            }
            self.turn_columns::<L>(&aside.fade.rows, &faded, second);
        }
        for part in 0..L::PARTS {
            let mut posing = Posing::<P> {
                bank: self.bank,
                level: self.level,
                group,
                models: bytemuck::cast_slice_mut(&mut models[..joints * P::NUMBERS]),
                out: &mut *out,
                output: self.output,
                part,
            };
            let share = moments.own[part].share;
            match (self.near, moments.near[part]) {
                (Some(span), Some(near)) if moments.all_near => {
                    let columns = Window::new(self.bank, span, near);
                    posing.joints::<L, _>(Playing::new(columns, share));
                }
                _ if self.fading => posing.joints::<L, _>(Mixed {
                    first: Playing::new(turned(first, part), share),
                    second: Playing::new(turned(second, part), faded[part].share),
                    weight: L::load(&aside.fade.weight, part),
                }),
                _ => posing.joints::<L, _>(Playing::new(turned(first, part), share)),
            }
        }
    }

    /// The columns of sixteen characters whose clips have so many rows before their own.
    #[inline(always)]
    fn turn_columns<L: Lanes>(
        &self,
        before: &[u32; Line::LANES],
        moments: &L::Parts<Moment<L>>,
        columns: &mut [Line],
    ) {
        let mut intervals = Line::ZERO;
        for part in 0..L::PARTS {
            moments[part].interval.store(&mut intervals, part);
        }
        let mut rows = *before;
        for (row, interval) in rows.iter_mut().zip(intervals.0) {
            *row += interval as u32;
        }
        turn_rows::<L>(self.bank, &rows, columns);
    }
}

#[inline(always)]
fn turned(columns: &[Line], part: usize) -> Turned<'_> {
    Turned {
        lines: columns.iter(),
        part,
    }
}

impl Scratch {
    /// Enough for any level of a repertoire: threads shall not allocate later.
    pub(super) fn of(repertoire: &Repertoire) -> Self {
        let mut scratch = Self::default();
        for bank in &repertoire.banks {
            scratch.fit(bank.joints.len(), bank.row_lines);
        }
        scratch
    }

    /// Never less than there was.
    fn fit(&mut self, joints: usize, row_lines: usize) {
        let grow = |lines: &mut Vec<Line>, length: usize| {
            if lines.len() < length {
                lines.resize(length, Line::ZERO);
            }
        };
        grow(&mut self.models, joints * Matrices::NUMBERS);
        for lines in &mut self.columns {
            grow(lines, row_lines * Line::LANES);
        }
    }
}

/// One part of a group, and where it goes.
struct Posing<'a, P: Posture> {
    bank: &'a Bank,
    level: Level<'a>,
    group: &'a Group,
    models: &'a mut [P::Model],
    out: &'a mut [Line],
    output: Output,
    part: usize,
}

impl<P: Posture> Posing<'_, P> {
    /// All joints, parents first, and out with them when all parts are there.
    #[inline(always)]
    fn joints<L: Lanes, S: Source<L>>(&mut self, source: S) {
        let mut placement = P::Model::zeroed();
        P::placed(
            &self.group.placement::<L>(self.part),
            &mut placement,
            self.part,
        );
        let chain = Chain::<P> {
            bank: self.bank,
            placement: &placement,
            part: self.part,
        };
        let is_posed = self.level.shows::<L>(&self.group.detail, 0);
        if (self.output.layout, self.output.memory) == (Layout::Blocks, Memory::Cached) {
            // The output itself is where children find their parents.
            let models = bytemuck::cast_slice_mut(self.out);
            chain.pose(source, models, |_, _| {});
            if !is_posed {
                step_on::<L, P>(self.level, &self.group.detail, (models, self.part));
            }
            return;
        }
        let (is_whole, output) = (self.part + 1 == L::PARTS, self.output);
        let out = &mut *self.out;
        chain.pose(
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
    fn shows<L: Lanes>(&self, detail: &Line, steps: usize) -> bool {
        let mut shows = true;
        for part in 0..L::PARTS {
            let ahead = L::load(detail, part) - L::splat(self.number + steps as f32);
            shows &= ahead.all_below(f32::MIN_POSITIVE);
        }
        shows
    }
}

/// Joints that go on the way to coarser levels are put where they ride then. The coarsest first:
/// what rides on such a joint goes with it.
#[inline(always)]
fn step_on<L: Lanes, P: Posture>(
    level: Level<'_>,
    detail: &Line,
    (models, part): (&mut [P::Model], usize),
) {
    for (index, step) in level.steps.iter().enumerate().rev() {
        if level.shows::<L>(detail, index) {
            continue;
        }
        let weight = L::load(detail, part) - L::splat(level.number + index as f32);
        let weight = weight.max(L::splat(0.0)).min(L::splat(1.0));
        for ride in &step.rides {
            let ready = P::ready(Local::<L>::splat(ride.turn, ride.place));
            let mut there = P::Model::zeroed();
            P::compose(&models[usize::from(ride.carrier)], ready, &mut there, part);
            P::approach(&mut models[usize::from(ride.joint)], &there, weight, part);
        }
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
        let joints = &self.bank.joints;
        let models = &mut models[..joints.len()];
        let mut ahead = joints.iter();
        let Some(root) = ahead.next() else {
            return;
        };
        let mut next = P::ready(source.next(root));
        for (index, joint) in joints.iter().enumerate() {
            let ready = next;
            if let Some(joint) = ahead.next() {
                next = P::ready(source.next(joint));
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

/// A joint in the order of the output, from memory of the thread's own.
#[inline(always)]
fn write_joint<L: Lanes, P: Posture>(
    models: &[P::Model],
    joint: usize,
    (out, output): (&mut [Line], Output),
) {
    match output.layout {
        Layout::Blocks => stream_block::<L, P>(&models[joint], block::<P>(out, joint)),
        Layout::Rows => write_rows::<L, P>(models, joint, (out, output.memory)),
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
