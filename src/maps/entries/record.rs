//! Tests of cuts and layers that a later bake takes over.
//!
//! A test depends on the contents of two clips, on the moment and the target, on what is played after the ends of the clips, and on the
//! limits of plausible motion. The limits are percentiles over all clips, rounded to steps, so that one clip more changes few of them. A
//! test is taken over if no limit has changed by so much that its result may differ ([`Slack`]).

use std::hash::Hasher;

use rustc_hash::{FxHashMap, FxHashSet, FxHasher};
use serde::{Deserialize, Serialize};

use super::limits::MotionLimits;
use super::slack::{NeededCodes, Slack, SlackCode};
use super::targets::ClipFrame;
use super::{EntrySettings, KnownEntry};
use crate::anim::Pose;
use crate::graph::{ClipId, ClipMatch};

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

/// The record of an earlier bake, and the clips that both have.
#[derive(Clone, Debug, Default)]
pub(crate) struct EarlierEntries {
    pub(crate) record: EntryRecord,
    pub(crate) clips: ClipMatch,
}

/// The tests of one kind.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(super) struct TestTable {
    limits: MotionLimits,
    targets: Vec<TargetKey>,
    /// For each moment, what is played after the end of its clip.
    beyond: Vec<Beyond>,
    /// For each moment, the cost beyond which targets were not considered.
    furthest: Vec<f32>,
    /// For each moment, the end of its tests.
    ends: Vec<u32>,
    /// Tests of each moment, sorted by target.
    tests: Vec<PairTest>,
}

/// A target.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
struct TargetKey {
    clip: u32,
    frame: u32,
    beyond: Beyond,
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
    slack: SlackCode,
}

/// Bits of [`PairTest::how`].
const PIN: u32 = 4;
const RANK: u32 = 8;

impl PairTest {
    /// The test of a target with the indices of the first plausible blend and of the fastest plausible rate.
    pub(super) fn new(
        target: usize,
        (how, pin): (Option<(usize, usize)>, Option<usize>),
        slack: &Slack,
    ) -> Self {
        let pin = pin.map_or(0, |leg| leg + 1);
        let how = how.map_or(0, |(blend, rate)| 1 + blend + 4 * rate + (pin << PIN));
        Self {
            target: target as u16,
            how: how as u16,
            slack: slack.code(),
        }
    }

    pub(super) fn how(self) -> Option<(usize, usize)> {
        let how = usize::from((self.how & 15).checked_sub(1)?);
        Some((how % 4, how / 4))
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
        let (blend, rate) = self.how()?;
        let pin = usize::from(self.how >> PIN & 15).checked_sub(1);
        Some(KnownEntry::new(self.target, (blend, pin, rate)))
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

    fn of(&self, moment: usize) -> &[PairTest] {
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
        let found = self.tests.iter().filter(|test| test.how().is_some());
        let mut found: Vec<&PairTest> = found.collect();
        found.sort_by_key(|test| test.rank());
        found.into_iter().filter_map(|test| test.entry()).collect()
    }
}

/// The tests of one kind that an earlier bake made.
pub(super) struct KnownTests<'a> {
    table: &'a TestTable,
    /// For each clip of this bake the first of its moments in the earlier one.
    first_moment: Vec<Option<u32>>,
    /// For each target of this bake its index in the earlier one.
    targets: Vec<Option<u16>>,
    /// For each target of the earlier bake its index in this one.
    now: Vec<Option<u16>>,
    /// Targets that the earlier bake did not have.
    pub(super) new: Vec<usize>,
    /// Whether this bake has the frames of all targets of the earlier one.
    has_all: bool,
    /// Least codes with which a test is taken over.
    needed: NeededCodes,
}

/// What the tests of one kind depend on.
#[derive(Clone, Copy)]
pub(super) struct TestBasis<'a> {
    pub(super) limits: &'a MotionLimits,
    pub(super) targets: &'a [ClipFrame],
    /// What is played after the end of each target's clip; nothing if empty.
    pub(super) beyond: &'a [Beyond],
}

impl TestBasis<'_> {
    fn keys(&self) -> impl Iterator<Item = TargetKey> + '_ {
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

impl EarlierEntries {
    /// Returns `self` if it was made with some settings.
    pub(super) fn with(&self, settings: &EntrySettings) -> Option<&Self> {
        (self.record.settings == Some(*settings)).then_some(self)
    }

    /// The tests of one kind.
    pub(super) fn known<'a>(
        &'a self,
        table: &'a TestTable,
        basis: TestBasis<'_>,
    ) -> KnownTests<'a> {
        let clips = &self.clips;
        let places: FxHashMap<TargetKey, u16> = { table.targets.iter().zip(0..) }
            .filter_map(|(&key, index)| {
                let clip = clips.now(key.clip)?;
                Some((TargetKey { clip, ..key }, index))
            })
            .collect();
        let first_moment = |clip: usize| {
            let earlier = clips.earlier(clip)? as usize;
            self.record.first_moment.get(earlier).copied()
        };
        let targets: Vec<Option<u16>> = basis.keys().map(|key| places.get(&key).copied()).collect();
        let mut now = vec![None; table.targets.len()];
        for (index, earlier) in targets.iter().enumerate() {
            if let Some(earlier) = earlier {
                now[usize::from(*earlier)] = Some(index as u16);
            }
        }
        let frames: FxHashSet<(u32, u32)> = basis.keys().map(|key| (key.clip, key.frame)).collect();
        let has_frame = |key: &TargetKey| {
            let clip = clips.now(key.clip);
            clip.is_some_and(|clip| frames.contains(&(clip, key.frame)))
        };
        KnownTests {
            has_all: table.targets.iter().all(has_frame),
            first_moment: (0..clips.len()).map(first_moment).collect(),
            new: (0..targets.len())
                .filter(|&target| targets[target].is_none())
                .collect(),
            targets,
            now,
            needed: { basis.limits }
                .change_since(&table.limits)
                .map_or_else(NeededCodes::unknown, |factors| NeededCodes::new(&factors)),
            table,
        }
    }
}

impl KnownTests<'_> {
    /// The tests of a moment of a clip.
    fn of(&self, (clip, moment): (ClipId, u32), beyond: Beyond) -> Option<&[PairTest]> {
        let first = self.first_moment.get(clip.index()).copied().flatten()?;
        let moment = (first + moment) as usize;
        let is_same = self.table.beyond.get(moment) == Some(&beyond);
        is_same.then(|| self.table.of(moment))
    }

    /// The test of a target at a moment of a clip.
    pub(super) fn find(
        &self,
        (place, beyond): ((ClipId, u32), Beyond),
        target: usize,
    ) -> Option<PairTest> {
        let earlier = self.targets[target]?;
        let tests = self.of(place, beyond)?;
        let at = tests.binary_search_by_key(&earlier, |test| test.target);
        let mut test = tests[at.ok()?];
        test.how &= (1 << RANK) - 1;
        self.needed.suffices(test.slack).then_some(PairTest {
            target: target as u16,
            ..test
        })
    }

    /// Whether this bake has the frames of all targets of the earlier one.
    pub(super) fn has_all(&self) -> bool {
        self.has_all
    }

    /// Whether both bakes have the same targets.
    pub(super) fn has_same(&self) -> bool {
        self.new.is_empty() && self.targets.len() == self.now.len()
    }

    /// Whether the earlier bake had the departures of some limits.
    pub(super) fn has_departures(&self, limits: &MotionLimits) -> bool {
        let of = |limits: &MotionLimits| [limits.hip_departure, limits.head_departure];
        of(limits) == of(&self.table.limits)
    }

    /// All tests of a moment that stays in its clip; `None` if one of them is not known.
    pub(super) fn all(&self, (clip, moment): (ClipId, u32)) -> Option<MomentTests> {
        let tests = self.of((clip, moment), Beyond::default())?.iter();
        let test = |test: &PairTest| {
            let target = self.now[usize::from(test.target)]?;
            let suffices = self.needed.suffices(test.slack);
            suffices.then_some(PairTest { target, ..*test })
        };
        let first = self.first_moment[clip.index()]?;
        Some(MomentTests {
            tests: tests.map(test).collect::<Option<_>>()?,
            beyond: Beyond::default(),
            furthest: *self.table.furthest.get((first + moment) as usize)?,
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
            let mut test = PairTest::new(7, (Some((blend, rate)), pin), &slack);
            test.set_rank(rank);
            assert_eq!(test.how(), Some((blend, rate)));
            assert_eq!(usize::from(test.rank()), rank);
            let entry = KnownEntry::new(7, (blend, pin, rate));
            assert_eq!(test.entry(), Some(entry));
        }
        let test = PairTest::new(7, (None, Some(1)), &slack);
        assert_eq!((test.how(), test.entry(), test.rank()), (None, None, 0));
    }
}
