//! The joints of one level, where their keys are, and the steps that make the level look like a coarser one.
//!
//! A step moves removed joints to where kept ones carry them. This goes beyond Hasegawa, Nishio & Kobori, who leave the jumps between
//! levels to future work (their 4.2): see [`Blend`](crate::lod::Blend). A group may contain characters of several levels. It is posed
//! on the finest of them. For a character of a coarser level, some steps are applied to that pose, the last one in part.

use super::key_bank::{TrackPlaces, UnitRead};
use super::tracks::{Place, Tracks};
use crate::anim::JointId;
use crate::lod::{Blend, Level};
use crate::math::KeyUnit;

/// The data of a joint that all clips share.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct LevelJoint {
    /// Index of the parent among the level's joints; `None` for the root alone.
    pub(crate) parent: Option<u16>,
    pub(crate) place: Place,
    /// Index of the first column of the joint's track.
    pub(crate) column: usize,
    /// Number of [`LevelClips::reads`](super::level_clips::LevelClips::reads) that are still to be done when the joint is
    /// computed. The reads of its own keys and of the next joint's are done by then, so that they arrive in time.
    pub(crate) reads_left: usize,
}

/// The joints of one level, and where the keys of all clips are.
#[derive(Clone, Debug)]
pub(crate) struct LevelClips {
    /// Joints of the level, parents before children.
    pub(crate) joints: Vec<LevelJoint>,
    /// The units of a row that the level needs.
    pub(crate) reads: Vec<UnitRead>,
    /// Number of `F32x16`s that the level's columns take for sixteen characters.
    pub(crate) column_lines: usize,
    /// Units whose prefetch touches all cache lines that the level needs of a row, wherever in a cache line the row begins.
    pub(crate) fetched: Vec<usize>,
    /// The joints of the skeleton that the level keeps, in the order of `joints`.
    pub(crate) kept: Vec<JointId>,
    /// The index of the joint that draws each joint of the skeleton.
    pub(crate) carriers: Vec<u16>,
    /// Steps from this level to each level after it.
    pub(crate) steps: Vec<Vec<Blend>>,
}

const LINE_UNITS: usize = 64 / size_of::<KeyUnit>();

impl LevelClips {
    /// Builds the level with index `number`.
    pub(crate) fn new(
        levels: &[Level],
        number: usize,
        tracks: &Tracks,
        places: &TrackPlaces,
    ) -> Self {
        let level = &levels[number];
        let attachments = level.attachments.iter();
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
        let reads = UnitRead::for_quads(&quads);
        let units = reads.iter().map(|read| read.unit);
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
        Self {
            joints,
            column_lines: quads.len() * KeyUnit::QUAD,
            reads,
            fetched,
            kept: level.kept.clone(),
            carriers: attachments.map(|attachment| attachment.carrier).collect(),
            steps: steps(levels, number),
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

/// The steps from the level `posed` to each level after it: the joints that are removed, as joints of the posed level.
fn steps(levels: &[Level], posed: usize) -> Vec<Vec<Blend>> {
    let pairs = levels[posed..].windows(2);
    let removed = pairs.map(|pair| {
        let gone = |&&joint: &&JointId| pair[1].index_of(joint).is_none();
        let blend = |&joint: &JointId| Blend::to_carrier(&levels[posed], &pair[1], joint);
        pair[0].kept.iter().filter(gone).filter_map(blend).collect()
    });
    removed.collect()
}
