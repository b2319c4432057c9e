//! The keys of all clips, as the kernels read them.
//!
//! A clip is a list of tracks, and a track a list of columns: four for a rotation, none to six for a position. A column
//! has one 16-bit key for each frame, and more where a joint turns fast. The keys are stored twice: column by column, for
//! characters that are near each other in time and share their loads, and key by key in rows, for the others. In a row, four
//! keys are a quad. A rotation is one quad, a position up to two.

use super::clip_times::{ClipRange, FrameKeys};
use super::tracks::{Keys, Place, Tracks};
use crate::math::{KeyPlace, KeyUnit};

#[derive(Clone, Debug, Default)]
pub(crate) struct KeyBank {
    /// Columns of all clips, one after the other.
    pub(crate) columns: Vec<i16>,
    /// Rows of all clips, one after the other.
    pub(crate) rows: Vec<KeyUnit>,
    column_count: usize,
    /// Number of [`KeyUnit`]s of a row.
    pub(crate) row_units: usize,
    /// Times of the keys between the frames of their clips.
    pub(crate) frames: FrameKeys,
}

/// Positions of tracks among the columns and in a row.
#[derive(Clone, Debug)]
pub(crate) struct TrackPlaces {
    /// The first column of each track.
    pub(crate) columns: Vec<usize>,
    /// The first quad of each track.
    pub(crate) quads: Vec<usize>,
    column_count: usize,
    row_units: usize,
}

impl TrackPlaces {
    /// Assigns columns and quads to the tracks. Columns follow the order of the tracks. In a row, the tracks of the finest
    /// level come first; within them and within the others, the coarser the coarsest level that plays a track, the earlier
    /// it comes. A level therefore reads few cache lines, and few quads that it does not need.
    pub(crate) fn new(tracks: &Tracks) -> Self {
        let mut columns = Vec::with_capacity(tracks.len());
        let mut column_count = 0;
        for place in &tracks.places {
            columns.push(column_count);
            column_count += KeyUnit::QUAD + place.columns();
        }
        let key = |&track: &usize| {
            let [first, last] = tracks.levels[track];
            (first > 0, std::cmp::Reverse(last))
        };
        let mut order: Vec<usize> = (0..tracks.len()).collect();
        order.sort_by_key(key);
        let mut quads = vec![0; tracks.len()];
        let (mut quad, mut is_first) = (0, true);
        for track in order {
            if is_first && tracks.levels[track][0] > 0 {
                // Most of the remaining tracks have two quads, which fill a unit.
                is_first = false;
                quad = usize::next_multiple_of(quad, 2);
            }
            quads[track] = quad;
            quad += 1 + tracks.places[track].quads();
        }
        Self {
            columns,
            quads,
            column_count,
            row_units: quad.div_ceil(2),
        }
    }
}

impl KeyBank {
    /// The keys of all clips, which have the ranges `ranges`; `frames` has the times of the keys.
    pub(crate) fn new(
        tracks: &Tracks,
        ranges: &[ClipRange],
        places: &TrackPlaces,
        frames: FrameKeys,
    ) -> Self {
        let mut bank = Self {
            column_count: places.column_count,
            row_units: places.row_units,
            frames,
            ..Self::default()
        };
        for (keys, range) in tracks.keys.iter().zip(ranges) {
            let row = bank.rows.len();
            let units = range.keys() * places.row_units;
            bank.rows.resize(row + units, KeyUnit::default());
            for (track, keys) in keys.iter().enumerate() {
                let place = tracks.places[track];
                add_columns(keys, place, range, &mut bank.columns);
                for (key, row) in bank.rows[row..]
                    .chunks_exact_mut(places.row_units)
                    .enumerate()
                {
                    let row = bytemuck::cast_slice_mut(row);
                    fill_row(
                        keys,
                        place,
                        key,
                        &mut row[places.quads[track] * KeyUnit::QUAD..],
                    );
                }
            }
        }
        bank
    }

    /// Position of a key of a clip in the first column, and the stride of columns.
    #[inline(always)]
    pub(crate) fn place(&self, range: &ClipRange, key: usize) -> KeyPlace {
        KeyPlace {
            first: range.column * self.column_count + key,
            stride: range.stride(),
        }
    }

    /// Size of all keys, in bytes.
    pub(crate) fn bytes(&self) -> usize {
        size_of_val(&*self.columns) + size_of_val(&*self.rows) + self.frames.bytes()
    }
}

/// Appends the columns of a track of one clip.
fn add_columns(keys: &Keys, place: Place, range: &ClipRange, columns: &mut Vec<i16>) {
    let last = keys.rotations.len() - 1;
    let indices = || (0..range.stride()).map(|index| (index % range.keys()).min(last));
    for component in 0..KeyUnit::QUAD {
        columns.extend(indices().map(|key| keys.rotations[key][component]));
    }
    for quad in 0..place.quads() {
        for axis in 0..3 {
            let stored = |key| place.keys(keys.place(key))[quad][axis];
            columns.extend(indices().map(stored));
        }
    }
}

/// Writes a key of a track to the quads from the beginning of `row` on.
fn fill_row(keys: &Keys, place: Place, key: usize, row: &mut [i16]) {
    let key = key.min(keys.rotations.len() - 1);
    let (rotation, places) = row.split_at_mut(KeyUnit::QUAD);
    rotation.copy_from_slice(&keys.rotations[key]);
    let stored = place.keys(keys.place(key));
    let quads = places.chunks_exact_mut(KeyUnit::QUAD).take(place.quads());
    for (to, from) in quads.zip(stored) {
        to[..3].copy_from_slice(&from);
    }
}

/// A unit of a row, and the columns of a group that its quads become.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct UnitRead {
    pub(crate) unit: usize,
    /// Which of its two quads are wanted.
    pub(crate) wanted: [bool; 2],
    /// Index of the first column of each wanted quad, in `F32x16`s.
    pub(crate) lines: [usize; 2],
}

impl UnitRead {
    /// Index of the first `F32x16` that the unit fills. It increases from each read to the next.
    pub(crate) fn first_line(&self) -> usize {
        let lines = self.lines.iter().zip(self.wanted);
        let wanted = lines.filter(|&(_, wanted)| wanted);
        wanted.map(|(&line, _)| line).min().unwrap_or_default()
    }

    /// The units to read for the quads of a level's joints. Each quad becomes the next four `F32x16`s.
    pub(crate) fn for_quads(quads: &[usize]) -> Vec<Self> {
        let mut reads: Vec<Self> = Vec::new();
        for (index, &quad) in quads.iter().enumerate() {
            let (unit, half) = (quad / 2, quad % 2);
            let known = reads.iter().position(|read| read.unit == unit);
            let read = known.unwrap_or_else(|| {
                reads.push(Self {
                    unit,
                    wanted: [false; 2],
                    lines: [0; 2],
                });
                reads.len() - 1
            });
            reads[read].wanted[half] = true;
            reads[read].lines[half] = index * KeyUnit::QUAD;
        }
        reads
    }
}
