//! The keys of all clips, as the kernels read them.
//!
//! A clip is a list of tracks, and a track a list of columns: four for a rotation, none to six for a position. A column has
//! one 16-bit key for each frame, and more where a joint turns fast. The same keys stand twice: column by column, for characters that are near each other in
//! time and share their loads, and key by key in rows, for those that are not. In a row four keys are a quad: a rotation is
//! one, a position up to two.

use super::clip_range::ClipRange;
use super::frame_keys::FrameKeys;
use super::quantise::Keys;
use super::tracks::{Place, Tracks};
use crate::math::{KeyUnit, UnitHalves, sorted_indices};

/// The keys of all clips.
#[derive(Clone, Debug, Default)]
pub(super) struct KeyBank {
    /// Columns of all clips.
    pub(super) columns: Vec<i16>,
    /// Rows of all clips.
    pub(super) rows: Vec<KeyUnit>,
    /// Columns of a clip.
    column_count: usize,
    /// Units of a row.
    pub(super) row_units: usize,
    /// When the keys are.
    pub(super) frames: FrameKeys,
}

/// Where a key of a clip stands in each column.
#[derive(Clone, Copy, Debug)]
pub(super) struct KeyPlace {
    /// In the first column.
    pub(super) first: usize,
    /// From column to column.
    pub(super) stride: usize,
}

impl KeyPlace {
    #[inline(always)]
    pub(super) fn of_column(self, column: usize) -> usize {
        self.first + column * self.stride
    }
}

/// Where tracks stand among the columns and in a row.
#[derive(Clone, Debug)]
pub(super) struct TrackPlaces {
    /// The first column of each track.
    pub(super) columns: Vec<usize>,
    /// The first quad of each track.
    pub(super) quads: Vec<usize>,
    column_count: usize,
    row_units: usize,
}

impl TrackPlaces {
    /// Columns stand in the order of the tracks. In a row the tracks of the finest level come first, and those that are
    /// played on coarser levels before others: so a level reads few lines, and few quads that it does not need.
    pub(super) fn new(tracks: &Tracks) -> Self {
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
        let order = sorted_indices(tracks.len(), &|a, b| key(a).cmp(&key(b)));
        let mut quads = vec![0; tracks.len()];
        let (mut quad, mut is_first) = (0, true);
        for track in order {
            if is_first && tracks.levels[track][0] > 0 {
                // From here on most tracks have two quads: a unit each.
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
    /// The keys of all clips and layers; `ranges` are theirs.
    pub(super) fn new(tracks: &Tracks, ranges: &[ClipRange], places: &TrackPlaces) -> Self {
        let clips = tracks.clips;
        let mut bank = Self {
            column_count: places.column_count,
            row_units: places.row_units,
            ..Self::default()
        };
        for (clip, (keys, range)) in tracks.keys.iter().zip(ranges).enumerate() {
            let of_clip = match clip < clips {
                true => &tracks.places,
                false => &tracks.layer_places,
            };
            let row = bank.rows.len();
            let units = range.keys() * places.row_units;
            bank.rows.resize(row + units, KeyUnit::default());
            for (track, keys) in keys.iter().enumerate() {
                let track = TrackKeys {
                    keys,
                    place: of_clip[track],
                    quad: places.quads[track],
                };
                track.add_columns(range, &mut bank.columns);
                track.add_rows(&mut bank.rows[row..], places.row_units);
            }
        }
        bank
    }

    /// The same with the keys of the clips' frames.
    pub(super) fn with_frames(self, frames: FrameKeys) -> Self {
        Self { frames, ..self }
    }

    /// A key of a clip in its first column.
    #[inline(always)]
    pub(super) fn place(&self, range: &ClipRange, key: usize) -> KeyPlace {
        KeyPlace {
            first: range.column * self.column_count + key,
            stride: range.stride(),
        }
    }

    /// Size of all keys, in bytes.
    pub(super) fn bytes(&self) -> usize {
        size_of_val(&*self.columns) + size_of_val(&*self.rows) + self.frames.bytes()
    }
}

/// One track of one clip.
struct TrackKeys<'a> {
    keys: &'a Keys,
    place: Place,
    quad: usize,
}

impl TrackKeys<'_> {
    fn add_columns(&self, range: &ClipRange, columns: &mut Vec<i16>) {
        let last = self.keys.rotations.len() - 1;
        let keys = || (0..range.stride()).map(|index| (index % range.keys()).min(last));
        for component in 0..KeyUnit::QUAD {
            columns.extend(keys().map(|key| self.keys.rotations[key][component]));
        }
        for quad in 0..self.place.quads() {
            for axis in 0..3 {
                let stored = |key| self.place.keys(self.keys.place(key))[quad][axis];
                columns.extend(keys().map(stored));
            }
        }
    }

    fn add_rows(&self, rows: &mut [KeyUnit], row_units: usize) {
        let last = self.keys.rotations.len() - 1;
        for (key, row) in rows.chunks_exact_mut(row_units).enumerate() {
            let key = key.min(last);
            let row: &mut [i16] = bytemuck::cast_slice_mut(row);
            let place = self.place.keys(self.keys.place(key));
            let quads = self.place.quads();
            let own = &mut row[self.quad * KeyUnit::QUAD..][..(1 + quads) * KeyUnit::QUAD];
            let (rotation, places) = own.split_at_mut(KeyUnit::QUAD);
            rotation.copy_from_slice(&self.keys.rotations[key]);
            for (to, from) in places.chunks_exact_mut(KeyUnit::QUAD).zip(place) {
                to[..3].copy_from_slice(&from);
            }
        }
    }
}

/// A unit of the rows, and where its quads go among the columns of a group.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct UnitRead {
    pub(super) halves: UnitHalves,
    /// Lines of the first column of each quad that is wanted.
    pub(super) lines: [usize; 2],
}

impl UnitRead {
    /// The first line that it fills. Each read fills a later one first than the read before it.
    pub(super) fn first_line(&self) -> usize {
        let lines = self.lines.iter().zip(self.halves.wanted);
        let wanted = lines.filter(|&(_, wanted)| wanted);
        wanted.map(|(&line, _)| line).min().unwrap_or_default()
    }

    /// What has to be read for the quads of a level's joints, each of which goes to the next four lines.
    pub(super) fn of(quads: &[usize]) -> Vec<Self> {
        let mut reads: Vec<Self> = Vec::new();
        for (index, &quad) in quads.iter().enumerate() {
            let (unit, half) = (quad / 2, quad % 2);
            let known = reads.iter().position(|read| read.halves.unit == unit);
            let read = known.unwrap_or_else(|| {
                reads.push(Self {
                    halves: UnitHalves {
                        unit,
                        wanted: [false; 2],
                    },
                    lines: [0; 2],
                });
                reads.len() - 1
            });
            reads[read].halves.wanted[half] = true;
            reads[read].lines[half] = index * KeyUnit::QUAD;
        }
        reads
    }
}
