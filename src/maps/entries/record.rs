//! Tests of cuts and layers that a later bake takes over.
//!
//! A test depends on the contents of two clips, on the moment and the target, and on the limits of plausible motion. The limits are
//! percentiles over all clips, so that one clip more changes them a little. A test is taken over if no limit has changed by so much that
//! its result may differ ([`Slack`]).

use rustc_hash::FxHashMap;
use serde::{Deserialize, Serialize};

use super::EntrySettings;
use super::limits::MotionLimits;
use super::slack::{NeededCodes, Slack, SlackCode};
use super::targets::ClipFrame;
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
    /// Clip and frame of each target.
    targets: Vec<[u32; 2]>,
    /// For each moment, the end of its tests.
    ends: Vec<u32>,
    /// Tests of each moment, sorted by target.
    tests: Vec<PairTest>,
}

/// The result of the test of a moment with a target.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub(super) struct PairTest {
    target: u16,
    /// 0: not plausible.
    how: u8,
    slack: SlackCode,
}

impl PairTest {
    /// The test of a target with the indices of the first plausible blend and of the fastest plausible rate.
    pub(super) fn new(target: usize, how: Option<(usize, usize)>, slack: &Slack) -> Self {
        Self {
            target: target as u16,
            how: how.map_or(0, |(blend, rate)| (1 + blend + 4 * rate) as u8),
            slack: slack.code(),
        }
    }

    pub(super) fn how(self) -> Option<(usize, usize)> {
        let how = usize::from(self.how.checked_sub(1)?);
        Some((how % 4, how / 4))
    }
}

impl TestTable {
    pub(super) fn new(TestBasis { limits, targets }: TestBasis<'_>) -> Self {
        Self {
            limits: limits.clone(),
            targets: targets.iter().map(place).collect(),
            ..Self::default()
        }
    }

    /// Appends the tests of the next moment.
    pub(super) fn push(&mut self, mut tests: Vec<PairTest>) {
        tests.sort_unstable();
        self.tests.extend_from_slice(&tests);
        self.ends.push(self.tests.len() as u32);
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

fn place(target: &ClipFrame) -> [u32; 2] {
    [target.clip.0, target.frame]
}

/// The tests of one kind that an earlier bake made.
pub(super) struct KnownTests<'a> {
    table: &'a TestTable,
    /// For each clip of this bake the first of its moments in the earlier one.
    first_moment: Vec<Option<u32>>,
    /// For each target of this bake its index in the earlier one.
    targets: Vec<Option<u16>>,
    /// Least codes with which a test is taken over.
    needed: NeededCodes,
}

/// What the tests of one kind depend on.
#[derive(Clone, Copy)]
pub(super) struct TestBasis<'a> {
    pub(super) limits: &'a MotionLimits,
    pub(super) targets: &'a [ClipFrame],
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
        TestBasis { limits, targets }: TestBasis<'_>,
    ) -> KnownTests<'a> {
        let clips = &self.clips;
        let places: FxHashMap<[u32; 2], u16> = { table.targets.iter().zip(0..) }
            .filter_map(|(&[clip, frame], index)| Some(([clips.now(clip)?, frame], index)))
            .collect();
        let first_moment = |clip: usize| {
            let earlier = clips.earlier(clip)? as usize;
            self.record.first_moment.get(earlier).copied()
        };
        KnownTests {
            first_moment: (0..clips.len()).map(first_moment).collect(),
            targets: { targets.iter() }
                .map(|target| places.get(&place(target)).copied())
                .collect(),
            needed: limits
                .change_since(&table.limits)
                .map_or_else(NeededCodes::unknown, |factors| NeededCodes::new(&factors)),
            table,
        }
    }
}

impl KnownTests<'_> {
    /// The test of a target at a moment of a clip.
    pub(super) fn find(&self, (clip, moment): (ClipId, u32), target: usize) -> Option<PairTest> {
        let earlier = self.targets[target]?;
        let first = self.first_moment.get(clip.index()).copied().flatten()?;
        let tests = self.table.of((first + moment) as usize);
        let at = tests.binary_search_by_key(&earlier, |test| test.target);
        let test = tests[at.ok()?];
        self.needed.suffices(test.slack).then_some(PairTest {
            target: target as u16,
            ..test
        })
    }
}
