//! Tests of cuts and layers that a later bake takes over.
//!
//! A test depends on the contents of two clips, on the moment and the target, on the motion after the ends of the clips, and on the limits
//! of plausible motion. The limits are percentiles over all clips, rounded to steps, so that adding a clip changes few of them. A test is
//! taken over unless a limit has changed so much that the result may differ ([`Slack`]).

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
    /// Tests of exits within the widest limits.
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

/// The record of an earlier bake, and the clips that both bakes have in common.
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
    /// Key of the motion that is played after the end of each moment's clip.
    pub(super) continuation: Vec<ContinuationKey>,
    /// Cost of each moment beyond which targets were not considered.
    pub(super) furthest: Vec<f32>,
    /// End of each moment's tests in `tests`.
    ends: Vec<u32>,
    /// Tests of each moment, sorted by target.
    tests: Vec<PairTest>,
}

/// Identifies a target across bakes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub(super) struct TargetKey {
    pub(super) clip: u32,
    pub(super) frame: u32,
    pub(super) continuation: ContinuationKey,
}

/// Checksums of the frames of a motion that continues beyond the end of its clip; none if all frames that tests read belong to the clip.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub(super) struct ContinuationKey(Option<(u64, u32)>);

impl ContinuationKey {
    /// Key of moments that the graph does not play.
    pub(super) const NOT_PLAYED: Self = Self(Some((0, 0)));

    /// Checksums of poses.
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
    /// Packed result. 0 if it is not plausible. Otherwise, from the lowest bit on: 1 + blend + 4 * rate, the leg whose foot stays in place, and the
    /// rank among exits.
    how: u16,
    pub(super) slack: SlackCode,
}

/// Bits of [`PairTest::how`].
const PIN: u32 = 4;
const RANK: u32 = 8;

impl PairTest {
    /// Creates the result of the test of a target. `way` is how it can be entered, or `None` if it is not plausible.
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

    /// The same result for another target index.
    pub(super) fn of_target(self, target: u16) -> Self {
        Self { target, ..self }
    }

    /// The same result without its rank.
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

    /// The entry that the test allows, or `None` if it is not plausible.
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
        self.continuation.push(found.continuation);
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

    /// The tests of a moment with the data that they depend on.
    pub(super) fn moment(&self, moment: usize) -> Option<MomentTests> {
        Some(MomentTests {
            tests: self.of(moment).to_vec(),
            continuation: *self.continuation.get(moment)?,
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
    /// Key of the motion that is played after the end of the clip.
    pub(super) continuation: ContinuationKey,
    /// Cost beyond which targets were not considered.
    pub(super) furthest: f32,
}

impl MomentTests {
    /// The tests of a moment that the graph does not play: none.
    pub(super) fn not_played() -> Self {
        Self {
            continuation: ContinuationKey::NOT_PLAYED,
            ..Self::default()
        }
    }

    /// The entries or layers that the tests allow.
    pub(super) fn entries(&self) -> Vec<KnownEntry> {
        self.tests.iter().filter_map(|test| test.entry()).collect()
    }

    /// The exits that the tests allow, sorted by rank.
    pub(super) fn exits(&self) -> Vec<KnownEntry> {
        let found = self.tests.iter().filter(|test| test.way().is_some());
        let mut found: Vec<&PairTest> = found.collect();
        found.sort_by_key(|test| test.rank());
        found.into_iter().filter_map(|test| test.entry()).collect()
    }
}

/// Inputs that the tests of one kind depend on.
#[derive(Clone, Copy)]
pub(super) struct TestBasis<'a> {
    pub(super) limits: &'a MotionLimits,
    pub(super) targets: &'a [ClipFrame],
    /// Key of the motion that is played after the end of each target's clip. Empty if no motion is played there.
    pub(super) continuation: &'a [ContinuationKey],
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
                continuation: self.continuation.get(index).copied().unwrap_or_default(),
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
