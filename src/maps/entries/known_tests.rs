//! Looks up the tests of an earlier bake by the clips and frames of this bake.

use rustc_hash::{FxHashMap, FxHashSet};

use super::EntrySettings;
use super::limits::MotionLimits;
use super::record::{
    ContinuationKey, EarlierEntries, MomentTests, PairTest, TargetKey, TestBasis, TestTable,
};
use super::slack::NeededCodes;
use crate::graph::Node;

/// The tests of one kind that an earlier bake made.
pub(super) struct KnownTests<'a> {
    table: &'a TestTable,
    /// For each clip of this bake, its first moment in the earlier bake.
    first_moment: Vec<Option<u32>>,
    /// Interval of moments, in frames.
    step: u32,
    /// Number of legs.
    legs: usize,
    /// For each target of this bake, its index in the earlier bake.
    targets: Vec<Option<u16>>,
    /// For each target of the earlier bake, its index in this bake.
    now: Vec<Option<u16>>,
    /// Targets that the earlier bake did not have.
    pub(super) new: Vec<usize>,
    /// Whether this bake has the frames of all targets of the earlier bake.
    has_all: bool,
    /// Minimum codes of tests that are taken over.
    needed: NeededCodes,
}

impl EarlierEntries {
    /// Returns `self` if the record was made with the settings.
    pub(super) fn with(&self, settings: &EntrySettings) -> Option<&Self> {
        (self.record.settings == Some(*settings)).then_some(self)
    }

    /// The tests of one kind, prepared for look-ups.
    pub(super) fn known<'a>(
        &'a self,
        table: &'a TestTable,
        basis: TestBasis<'_>,
    ) -> KnownTests<'a> {
        let clips = &self.clips;
        let places: FxHashMap<TargetKey, u16> = table
            .targets
            .iter()
            .take(usize::from(u16::MAX))
            .zip(0..)
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
            step: self
                .record
                .settings
                .map_or(1, |settings| settings.moment_step.max(1)),
            legs: basis.legs,
            new: (0..targets.len())
                .filter(|&target| targets[target].is_none())
                .collect(),
            targets,
            now,
            needed: basis
                .limits
                .change_since(&table.limits)
                .map_or_else(NeededCodes::unknown, |factors| NeededCodes::new(&factors)),
            table,
        }
    }
}

impl KnownTests<'_> {
    /// Number of the moment at a frame of a clip in the earlier bake.
    fn moment(&self, at: Node) -> Option<usize> {
        let first = self.first_moment.get(at.clip.index()).copied().flatten()?;
        Some(first as usize + (at.frame / self.step) as usize)
    }

    /// Whether a test names a leg that the graph has. It checks tests that come from a file.
    fn is_sound(&self, test: &PairTest) -> bool {
        let pin = test.way().and_then(|way| way.pin);
        pin.is_none_or(|leg| leg < self.legs)
    }

    /// The tests of a moment.
    fn of(&self, moment: usize, continuation: ContinuationKey) -> Option<&[PairTest]> {
        let is_same = self.table.continuation.get(moment) == Some(&continuation);
        is_same.then(|| self.table.of(moment))
    }

    /// The test of a target at a frame of a clip.
    pub(super) fn find(
        &self,
        at: Node,
        continuation: ContinuationKey,
        target: usize,
    ) -> Option<PairTest> {
        let earlier = self.targets[target]?;
        let tests = self.of(self.moment(at)?, continuation)?;
        let found = tests.binary_search_by_key(&earlier, |test| test.target);
        let test = tests[found.ok()?];
        let suffices = self.needed.suffices(test.slack) && self.is_sound(&test);
        suffices.then(|| test.of_target(target as u16).unranked())
    }

    /// Whether this bake has the frames of all targets of the earlier bake.
    pub(super) fn has_all(&self) -> bool {
        self.has_all
    }

    /// Whether both bakes have the same targets.
    pub(super) fn has_same(&self) -> bool {
        self.new.is_empty() && self.targets.len() == self.now.len()
    }

    /// Whether the limits of departure are the same as in the earlier bake.
    pub(super) fn has_departures(&self, limits: &MotionLimits) -> bool {
        let of = |limits: &MotionLimits| [limits.hip_departure, limits.head_departure];
        of(limits) == of(&self.table.limits)
    }

    /// All tests at a frame of a clip from which the motion stays in the clip. `None` if one of them is not known.
    pub(super) fn all(&self, at: Node) -> Option<MomentTests> {
        let moment = self.moment(at)?;
        let tests = self.of(moment, ContinuationKey::default())?.iter();
        let test = |test: &PairTest| {
            let target = self.now.get(usize::from(test.target)).copied().flatten()?;
            let suffices = self.needed.suffices(test.slack) && self.is_sound(test);
            suffices.then(|| test.of_target(target))
        };
        Some(MomentTests {
            tests: tests.map(test).collect::<Option<_>>()?,
            continuation: ContinuationKey::default(),
            furthest: *self.table.furthest.get(moment)?,
        })
    }
}
