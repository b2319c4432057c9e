//! The joints of one level, and where their keys are.

use super::key_bank::{TrackPlaces, UnitRead};
use super::level_joint::LevelJoint;
use super::tracks::{Place, Tracks};
use crate::lod::Level;
use crate::math::KeyUnit;

/// The joints of one level, and where the keys of all clips are.
#[derive(Clone, Debug)]
pub(super) struct LevelClips {
    /// Joints of the level, parents before children.
    pub(super) joints: Vec<LevelJoint>,
    /// The place of each joint's track in additive layers, as [`LevelJoint::place`] is for clips.
    pub(super) layer_places: Vec<Place>,
    /// The units of a row that the level needs.
    pub(super) reads: Vec<UnitRead>,
    /// Number of `F32x16`s that the level's columns take for sixteen characters.
    pub(super) column_lines: usize,
    /// Units whose prefetch touches all cache lines that the level needs of a row, wherever in a cache line the row begins.
    pub(super) fetched: Vec<usize>,
}

/// Number of units in a cache line.
const LINE_UNITS: usize = 64 / size_of::<KeyUnit>();

impl LevelClips {
    /// Builds the level with index `number`.
    pub(super) fn new(level: &Level, number: usize, stored: Stored<'_>) -> Self {
        let Stored { tracks, places } = stored;
        let of_level = &tracks.of_levels[number];
        let joints = of_level.iter().zip(&level.parents);
        let joints = joints.map(|(&track, &parent)| LevelJoint {
            parent,
            place: tracks.places[track],
            column: places.columns[track],
            reads_left: 0,
        });
        let quads = of_level.iter().flat_map(|&track| {
            let first = places.quads[track];
            first..first + 1 + tracks.places[track].quads()
        });
        let quads: Vec<usize> = quads.collect();
        let reads = UnitRead::of(&quads);
        let units = reads.iter().map(|read| read.halves.unit);
        let fetched = touching_all_lines(units.collect());
        let mut joints: Vec<LevelJoint> = joints.collect();
        let mut lines = 0;
        let ends = joints.iter().map(|joint| {
            lines += (1 + joint.place.quads()) * KeyUnit::QUAD;
            lines
        });
        let ends: Vec<usize> = ends.collect();
        for (index, joint) in joints.iter_mut().enumerate() {
            let end = ends[(index + 1).min(ends.len() - 1)];
            joint.reads_left = reads.len() - reads.partition_point(|read| read.first_line() < end);
        }
        let layer_places = of_level.iter().map(|&track| tracks.layer_places[track]);
        Self {
            layer_places: layer_places.collect(),
            joints,
            column_lines: quads.len() * KeyUnit::QUAD,
            reads,
            fetched,
        }
    }
}

/// A subset of the units whose cache lines contain all of them, wherever in a cache line the row begins: a unit that lies
/// between two units at most a cache line apart is in the cache line of one of them.
fn touching_all_lines(mut units: Vec<usize>) -> Vec<usize> {
    units.sort_unstable();
    let mut touching: Vec<usize> = Vec::new();
    for (index, &unit) in units.iter().enumerate() {
        let is_reached = |&next: &usize| {
            touching
                .last()
                .is_some_and(|&last| next <= last + LINE_UNITS)
        };
        // The cache line of this unit also contains the next one.
        if !units.get(index + 1).is_some_and(is_reached) {
            touching.push(unit);
        }
    }
    touching
}

/// The tracks of all levels, and where they are stored.
#[derive(Clone, Copy)]
pub(super) struct Stored<'a> {
    pub(super) tracks: &'a Tracks,
    pub(super) places: &'a TrackPlaces,
}
