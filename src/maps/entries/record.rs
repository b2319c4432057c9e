//! Tests of cuts and layers that a later bake takes over.
//!
//! A test depends on the contents of two clips, on the moment and the target, on what is played after the ends of the clips, and on the
//! limits of plausible motion. The limits are percentiles over all clips, rounded to steps, so that one clip more changes few of them. A
//! test is taken over if no limit has changed by so much that its result may differ ([`Slack`]).

use std::hash::Hasher;

use rustc_hash::FxHasher;
use serde::{Deserialize, Serialize};

use super::limits::MotionLimits;
use super::slack::{Slack, SlackCode};
use super::targets::ClipFrame;
use super::{EntrySettings, EntryWay, KnownEntry};
use crate::anim::Pose;
use crate::graph::ClipMatch;

/// Tests of all cuts and layers of a bake.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct EntryRecord {
    pub(super) settings: Option<EntrySettings>,
    /// First moment of each clip.
    pub(super) first_moment: Vec<u32>,
    pub(super) entries: TestTable,
    pub(super) exits: TestTable,
    /// Exits within the widest limits.
    pub(super) last_exits: TestTable,
    pub(super) layers: TestTable,
}

impl EntryRecord {
    /// Appends the tests of the next moment: of entries, exits and layers.
    pub(super) fn push(&mut self, [entries, exits, layers]: [MomentTests; 3]) {
        self.entries.push(entries);
        self.exits.push(exits);
        self.layers.push(layers);
    }
}

/// The record of an earlier bake, and the clips that both have.
#[derive(Clone, Debug, Default)]
pub(crate) struct EarlierEntries {
    pub(crate) record: EntryRecord,
    pub(crate) clips: ClipMatch,
}

/// The tests of one kind.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(super) struct TestTable {
    pub(super) limits: MotionLimits,
    pub(super) targets: Vec<TargetKey>,
    /// For each moment, what is played after the end of its clip.
    pub(super) beyond: Vec<Beyond>,
    /// For each moment, the cost beyond which targets were not considered.
    pub(super) furthest: Vec<f32>,
    /// For each moment, the end of its tests.
    ends: Vec<u32>,
    /// Tests of each moment, sorted by target.
    tests: Vec<PairTest>,
}

/// A target.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub(super) struct TargetKey {
    pub(super) clip: u32,
    pub(super) frame: u32,
    pub(super) beyond: Beyond,
}

/// Checksums of the frames of a motion that goes on after the end of its clip; none if it ends before.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub(super) struct Beyond(Option<(u64, u32)>);

impl Beyond {
    /// In place of the checksums of what is not played.
    pub(super) const NOT_PLAYED: Self = Self(Some((0, 0)));

    /// The checksums of some poses.
    pub(super) fn of<'p>(poses: impl Iterator<Item = &'p Pose>) -> Self {
        let mut bytes = Vec::new();
        for pose in poses {
            let rotations = pose.rotations.iter().flat_map(|turn| turn.to_array());
            let places = pose.translations.iter().chain([&pose.root]);
            let numbers = rotations.chain(places.flat_map(|place| place.to_array()));
            numbers.for_each(|number| bytes.extend_from_slice(&number.to_le_bytes()));
        }
        let mut hasher = FxHasher::default();
        hasher.write(&bytes);
        Self(Some((hasher.finish(), crc32fast::hash(&bytes))))
    }
}

/// The result of the test of a moment with a target.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub(super) struct PairTest {
    pub(super) target: u16,
    /// 0: not plausible. From the lowest bit on: 1 + blend + 4 * rate, the leg whose foot stays in place, and the rank among exits.
    how: u16,
    pub(super) slack: SlackCode,
}

/// Bits of [`PairTest::how`].
const PIN: u32 = 4;
const RANK: u32 = 8;

impl PairTest {
    /// The test of a target, and how it can be entered if it is plausible.
    pub(super) fn new(target: usize, way: Option<EntryWay>, slack: &Slack) -> Self {
        let how = way.map_or(0, |EntryWay { blend, rate, pin }| {
            1 + blend + 4 * rate + (pin.map_or(0, |leg| leg + 1) << PIN)
        });
        Self {
            target: target as u16,
            how: how as u16,
            slack: slack.code(),
        }
    }

    /// How the target can be entered; `None` if it is not plausible.
    pub(super) fn way(self) -> Option<EntryWay> {
        let how = usize::from((self.how & 15).checked_sub(1)?);
        Some(EntryWay {
            blend: how % 4,
            rate: how / 4,
            pin: usize::from(self.how >> PIN & 15).checked_sub(1),
        })
    }

    /// The same test of a target of another index.
    pub(super) fn of_target(self, target: u16) -> Self {
        Self { target, ..self }
    }

    /// The same test without its rank.
    pub(super) fn unranked(self) -> Self {
        let how = self.how & ((1 << RANK) - 1);
        Self { how, ..self }
    }

    /// Sets the rank among the exits of a moment.
    pub(super) fn set_rank(&mut self, rank: usize) {
        self.how |= (rank << RANK) as u16;
    }

    pub(super) fn rank(self) -> u16 {
        self.how >> RANK
    }

    /// The entry that the test allows.
    pub(super) fn entry(self) -> Option<KnownEntry> {
        Some(KnownEntry::new(self.target, self.way()?))
    }
}

impl TestTable {
    pub(super) fn new(basis: TestBasis<'_>) -> Self {
        Self {
            limits: basis.limits.clone(),
            targets: basis.keys().collect(),
            ..Self::default()
        }
    }

    /// Appends the tests of the next moment.
    pub(super) fn push(&mut self, mut found: MomentTests) {
        found.tests.sort_unstable();
        self.tests.append(&mut found.tests);
        self.ends.push(self.tests.len() as u32);
        self.beyond.push(found.beyond);
        self.furthest.push(found.furthest);
    }

    /// A table of the same targets and limits without tests.
    pub(super) fn without_tests(&self) -> Self {
        Self {
            limits: self.limits.clone(),
            targets: self.targets.clone(),
            ..Self::default()
        }
    }

    /// Whether both tables have the same targets and limits.
    pub(super) fn is_of(&self, other: &Self) -> bool {
        self.limits == other.limits && self.targets == other.targets
    }

    /// What is known of a moment.
    pub(super) fn moment(&self, moment: usize) -> Option<MomentTests> {
        Some(MomentTests {
            tests: self.of(moment).to_vec(),
            beyond: *self.beyond.get(moment)?,
            furthest: *self.furthest.get(moment)?,
        })
    }

    /// The tests of a moment.
    pub(super) fn of(&self, moment: usize) -> &[PairTest] {
        let start = moment
            .checked_sub(1)
            .and_then(|before| self.ends.get(before));
        let start = start.map_or(0, |&start| start as usize);
        let end = self.ends.get(moment).map_or(start, |&end| end as usize);
        self.tests.get(start..end).unwrap_or(&[])
    }
}

/// The tests of a moment.
#[derive(Clone, Debug, Default)]
pub(super) struct MomentTests {
    pub(super) tests: Vec<PairTest>,
    /// What is played after the end of the clip.
    pub(super) beyond: Beyond,
    /// Targets beyond this cost were not considered.
    pub(super) furthest: f32,
}

impl MomentTests {
    /// Those of a moment that the graph does not play.
    pub(super) fn not_played() -> Self {
        Self {
            beyond: Beyond::NOT_PLAYED,
            ..Self::default()
        }
    }

    /// The entries or layers that they allow.
    pub(super) fn entries(&self) -> Vec<KnownEntry> {
        self.tests.iter().filter_map(|test| test.entry()).collect()
    }

    /// The exits that they allow, by rank.
    pub(super) fn exits(&self) -> Vec<KnownEntry> {
        let found = self.tests.iter().filter(|test| test.way().is_some());
        let mut found: Vec<&PairTest> = found.collect();
        found.sort_by_key(|test| test.rank());
        found.into_iter().filter_map(|test| test.entry()).collect()
    }
}

/// What the tests of one kind depend on.
#[derive(Clone, Copy)]
pub(super) struct TestBasis<'a> {
    pub(super) limits: &'a MotionLimits,
    pub(super) targets: &'a [ClipFrame],
    /// What is played after the end of each target's clip; nothing if empty.
    pub(super) beyond: &'a [Beyond],
    /// Number of legs.
    pub(super) legs: usize,
}

impl TestBasis<'_> {
    pub(super) fn keys(&self) -> impl Iterator<Item = TargetKey> + '_ {
        self.targets
            .iter()
            .enumerate()
            .map(|(index, target)| TargetKey {
                clip: target.clip.0,
                frame: target.frame,
                beyond: self.beyond.get(index).copied().unwrap_or_default(),
            })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_test_holds_the_entry_that_it_allows() {
        let slack = Slack::default();
        for (blend, rate, pin, rank) in [(0, 0, None, 0), (3, 0, Some(3), 2), (2, 2, Some(0), 1)] {
            let way = EntryWay { blend, rate, pin };
            let mut test = PairTest::new(7, Some(way), &slack);
            test.set_rank(rank);
            assert_eq!(test.way(), Some(way));
            assert_eq!(usize::from(test.rank()), rank);
            assert_eq!(test.entry(), Some(KnownEntry::new(7, way)));
            assert_eq!(test.unranked().way(), Some(way));
            assert_eq!(test.unranked().rank(), 0);
        }
        let test = PairTest::new(7, None, &slack);
        assert_eq!((test.way(), test.entry(), test.rank()), (None, None, 0));
    }
}
