//! Samples a clip at the moments of a register's characters.

use super::joint_math::{Local, QuatLanes};
use crate::crowd::keys::key_bank::UnitRead;
use crate::crowd::keys::level_clips::{LevelClips, LevelJoint};
use crate::crowd::keys::tracks::{Place, PlaceRange};
use crate::math::{F32x16, KeyColumns, KeyRows, KeyUnit, Lanes};

/// The motion of a level's joints, one joint after the other.
pub(crate) trait Source<L: Lanes> {
    /// The motion of the next joint, with a rotation of any length.
    fn next(&mut self, joint: &LevelJoint) -> Local<L>;
}

/// The keys of a level's joints, one joint after the other. Each word has two neighbouring keys.
pub(crate) trait Columns<L: Lanes> {
    fn rotation(&mut self, joint: &LevelJoint) -> [L::Words; 4];

    /// A quad of the next joint's position; quads are read in order.
    fn place(&mut self, joint: &LevelJoint, quad: usize) -> [L::Words; 3];
}

/// Columns of lanes that are near each other in time. One load, or two for wide windows, fetches the keys of all lanes.
pub(crate) struct Window<'a, L: Lanes, const WIDE: bool> {
    pub(crate) columns: KeyColumns<'a>,
    /// Number of keys that each lane is ahead: see [`Lanes::window_places`].
    pub(crate) places: L::Words,
}

impl<L: Lanes, const WIDE: bool> Window<'_, L, WIDE> {
    #[inline(always)]
    fn read<const N: usize>(&self, column: usize) -> [L::Words; N] {
        let columns = KeyColumns {
            at: self.columns.at.column(column),
            next: self.columns.next.column(column),
            ..self.columns
        };
        L::windows::<WIDE, N>(columns, self.places)
    }
}

impl<L: Lanes, const WIDE: bool> Columns<L> for Window<'_, L, WIDE> {
    #[inline(always)]
    fn rotation(&mut self, joint: &LevelJoint) -> [L::Words; 4] {
        self.read(joint.column)
    }

    #[inline(always)]
    fn place(&mut self, joint: &LevelJoint, quad: usize) -> [L::Words; 3] {
        self.read(joint.column + KeyUnit::QUAD + 3 * quad)
    }
}

/// Columns that are made from sixteen rows, for characters anywhere in any clip: four `F32x16`s for each quad. They are made
/// one joint ahead, between the computations of joints: reading waits for memory and exchanges lanes, while joints are
/// products.
pub(crate) struct ReadRows<'a> {
    rows: &'a KeyRows<'a>,
    /// Units that are still to be read.
    reads: std::slice::Iter<'a, UnitRead>,
    columns: &'a mut [F32x16],
    /// Index of the next `F32x16` to use in `columns`.
    line: usize,
    part: usize,
}

impl<'a> ReadRows<'a> {
    /// Reads the rows. The first part reads the keys for all parts into `columns`.
    #[inline(always)]
    pub(crate) fn new<L: Lanes>(
        level: &'a LevelClips,
        rows: &'a KeyRows<'a>,
        part: usize,
        columns: &'a mut [F32x16],
    ) -> Self {
        let reads = match part {
            0 => &level.reads[..],
            _ => &[],
        };
        let mut own = Self {
            rows,
            reads: reads.iter(),
            columns: &mut columns[..level.column_lines],
            line: 0,
            part,
        };
        if !Self::reads_between::<L>() && !rows.is_none() {
            own.read::<L>(0);
        }
        own
    }

    /// Whether columns are made between the computations of joints. Kernels without wide registers are faster if they make
    /// all of them first.
    const fn reads_between<L: Lanes>() -> bool {
        L::PARTS <= 2
    }

    /// Reads units until `left` of them are left.
    #[inline(always)]
    fn read<L: Lanes>(&mut self, left: usize) {
        while self.reads.len() > left {
            let Some(read) = self.reads.next() else {
                return;
            };
            let columns = &mut *self.columns;
            L::unit_with(
                self.rows,
                read.unit,
                read.wanted,
                #[inline(always)]
                |key, part, words| {
                    let line = read.lines[key / KeyUnit::QUAD] + key % KeyUnit::QUAD;
                    L::from_bits(words).store(&mut columns[line], part);
                },
            );
        }
    }

    #[inline(always)]
    fn quad<L: Lanes, const N: usize>(&mut self) -> [L::Words; N] {
        let mut words = [L::splat_words(0); N];
        let lines = &self.columns[self.line..][..KeyUnit::QUAD];
        self.line += KeyUnit::QUAD;
        for index in 0..N {
            words[index] = L::load_words(&lines[index], self.part);
        }
        words
    }
}

impl<L: Lanes> Columns<L> for ReadRows<'_> {
    #[inline(always)]
    fn rotation(&mut self, joint: &LevelJoint) -> [L::Words; 4] {
        if Self::reads_between::<L>() {
            self.read::<L>(joint.reads_left);
        }
        self.quad::<L, 4>()
    }

    #[inline(always)]
    fn place(&mut self, _: &LevelJoint, _: usize) -> [L::Words; 3] {
        self.quad::<L, 3>()
    }
}

/// A clip that is played: its keys, and the [weights](super::moments::weights) of the two keys around each moment.
pub(crate) struct Playing<L: Lanes, C> {
    pub(crate) columns: C,
    pub(crate) weights: L::Words,
}

impl<L: Lanes, C: Columns<L>> Playing<L, C> {
    /// The weighted sums of two keys, times [`ONE`](crate::crowd::keys::tracks::ONE).
    #[inline(always)]
    fn mixed<const N: usize>(&self, words: [L::Words; N]) -> [L; N] {
        let mut mixed = [L::splat(0.0); N];
        for index in 0..N {
            mixed[index] = L::dot_pairs(words[index], self.weights);
        }
        mixed
    }

    #[inline(always)]
    fn narrow(&mut self, joint: &LevelJoint, range: &PlaceRange) -> [L; 3] {
        let words = self.columns.place(joint, 0);
        let mixed = self.mixed(words);
        let mut place = [L::splat(0.0); 3];
        for axis in 0..3 {
            place[axis] =
                L::splat(range.unit[axis]).mul_add(mixed[axis], L::splat(range.middle[axis]));
        }
        place
    }

    #[inline(always)]
    fn wide(&mut self, joint: &LevelJoint, range: &PlaceRange) -> [L; 3] {
        let (coarse, rest) = (self.columns.place(joint, 0), self.columns.place(joint, 1));
        let (coarse, rest) = (self.mixed(coarse), self.mixed(rest));
        let mut place = [L::splat(0.0); 3];
        for axis in 0..3 {
            let unit = range.unit[axis];
            let step = L::splat(unit * Place::COARSE);
            let start = step.mul_add(coarse[axis], L::splat(range.middle[axis]));
            place[axis] = L::splat(unit).mul_add(rest[axis], start);
        }
        place
    }
}

impl<L: Lanes, C: Columns<L>> Source<L> for Playing<L, C> {
    #[inline(always)]
    fn next(&mut self, joint: &LevelJoint) -> Local<L> {
        let words = self.columns.rotation(joint);
        let [x, y, z, w] = self.mixed(words);
        let turn = QuatLanes { x, y, z, w };
        let place = match &joint.place {
            Place::Fixed(place) => [L::splat(place.x), L::splat(place.y), L::splat(place.z)],
            Place::Narrow(range) => self.narrow(joint, range),
            Place::Wide(range) => self.wide(joint, range),
        };
        Local { turn, place }
    }
}

/// A clip, and a second clip that it is cross-faded to.
pub(crate) struct Faded<L: Lanes, C, D> {
    pub(crate) own: Playing<L, C>,
    pub(crate) fade: Playing<L, D>,
    /// Weight of the second clip in each lane.
    pub(crate) weight: L,
}

impl<L: Lanes, C: Columns<L>, D: Columns<L>> Source<L> for Faded<L, C, D> {
    #[inline(always)]
    fn next(&mut self, joint: &LevelJoint) -> Local<L> {
        let mut local = self.own.next(joint);
        let other = self.fade.next(joint);
        local.turn = local.turn.towards_between_keys(other.turn, self.weight);
        if joint.place.quads() > 0 {
            for axis in 0..3 {
                let (from, to) = (local.place[axis], other.place[axis]);
                local.place[axis] = (to - from).mul_add(self.weight, from);
            }
        }
        local
    }
}

/// The rows of keys that a group will read.
pub(crate) trait Fetch {
    /// Prefetches the keys that one lane needs of a level.
    fn prefetch_lane(&self, level: &LevelClips, lane: usize);

    /// Prefetches all keys. This is for the first group, which has no group before it.
    #[inline(always)]
    fn prefetch_all(&self, level: &LevelClips) {
        for lane in 0..F32x16::LANES {
            self.prefetch_lane(level, lane);
        }
    }

    /// Prefetches a share of the keys, while a joint of the group before is computed.
    #[inline(always)]
    fn prefetch(&self, level: &LevelClips, joint: usize) {
        let joints = level.joints.len();
        let lane = |joint: usize| joint * F32x16::LANES / joints;
        for lane in lane(joint)..lane(joint + 1) {
            self.prefetch_lane(level, lane);
        }
    }
}

impl Fetch for KeyRows<'_> {
    #[inline(always)]
    fn prefetch_lane(&self, level: &LevelClips, lane: usize) {
        for &unit in &level.fetched {
            self.prefetch(lane, unit);
        }
    }
}
