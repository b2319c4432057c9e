//! Reads whole poses of a compressed clip, eight lanes at a time.

use glam::Quat;

use super::PackedMoment;
use crate::anim::rows::{Block, LANES, Rows};
use crate::math::code_rows::{CODES, RowKernel, RowReader};

/// Writes all rotations but those of end sites.
pub(super) struct WholePose<'a, 'o> {
    pub(super) moment: &'a PackedMoment<'a>,
    pub(super) out: &'o mut [Quat],
}

impl RowKernel for WholePose<'_, '_> {
    type Out = ();

    #[inline(always)]
    fn run<R: RowReader>(self, reader: R) {
        let mut groups = self.moment.groups(reader);
        for lanes in self.moment.lanes().chunks(CODES) {
            scatter(&groups.next_group(), lanes, self.out);
        }
    }
}

/// Hands out all rotations but those of end sites.
pub(super) struct EachRotation<'a, V> {
    pub(super) moment: &'a PackedMoment<'a>,
    pub(super) visit: V,
}

impl<V: FnMut(usize, Quat)> RowKernel for EachRotation<'_, V> {
    type Out = ();

    #[inline(always)]
    fn run<R: RowReader>(mut self, reader: R) {
        let mut groups = self.moment.groups(reader);
        for lanes in self.moment.lanes().chunks(CODES) {
            let [x, y, z, w] = groups.next_group();
            for (lane, &joint) in lanes.iter().take(CODES).enumerate() {
                let rotation = Quat::from_xyzw(x[lane], y[lane], z[lane], w[lane]);
                (self.visit)(usize::from(joint), rotation);
            }
        }
    }
}

/// Groups of eight lanes of a moment, one after another.
pub struct PackedGroups<'a, R> {
    reader: R,
    moment: &'a PackedMoment<'a>,
    group: usize,
    /// Start of the next group's codes in the frames around the moment.
    at: [usize; 2],
}

impl<'a, R: RowReader> PackedGroups<'a, R> {
    #[inline(always)]
    pub(super) fn new(moment: &'a PackedMoment<'a>, reader: R) -> Self {
        Self {
            reader,
            moment,
            group: 0,
            at: [0; 2],
        }
    }

    /// The next eight rotations.
    #[inline(always)]
    pub(crate) fn next_group(&mut self) -> Rows<CODES> {
        let [from, to] = &self.moment.frames;
        let (reader, group) = (self.reader, self.group);
        self.group += 1;
        let first = from.group(reader, group, &mut self.at[0]);
        match self.moment.weight {
            0.0 => reader.unit(&first),
            weight => {
                let second = to.group(reader, group, &mut self.at[1]);
                reader.unit_lerp(&first, &second, weight)
            }
        }
    }

    /// The next 16 rotations; where no more than 8 lanes are left, the second half is 0.
    #[inline(always)]
    pub fn next_block(&mut self, lanes: usize) -> Block {
        let mut block = [[0.0; LANES]; 4];
        for half in 0..lanes.min(LANES).div_ceil(CODES) {
            let group = self.next_group();
            for (row, eight) in block.iter_mut().zip(&group) {
                row[half * CODES..(half + 1) * CODES].copy_from_slice(eight);
            }
        }
        block
    }
}

/// Writes the rotations of lanes to their joints.
#[inline(always)]
pub(in crate::anim) fn scatter<const N: usize>(
    [x, y, z, w]: &Rows<N>,
    lanes: &[u16],
    out: &mut [Quat],
) {
    for (lane, &joint) in lanes.iter().take(N).enumerate() {
        out[usize::from(joint)] = Quat::from_xyzw(x[lane], y[lane], z[lane], w[lane]);
    }
}
