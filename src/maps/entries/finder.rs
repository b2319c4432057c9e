//! The search for cuts from one frame to the targets.

use super::aligned::{Aligned, FOOT_APART, Leaving, Points, ROOT_APART};
use super::examine::{Cut, Examiner};
use super::frames::{EnteredMotion, FrameSampler, LeftMotion};
use super::known_tests::KnownTests;
use super::layer_test::LayerTest;
use super::limits::{DEPARTURES, MotionLimits, head};
use super::near_stances::NearStances;
use super::record::{ContinuationKey, MomentTests, PairTest, TestBasis};
use super::search_basis::SearchBasis;
use super::slack::Slack;
use super::spread::spread;
use super::targets::{ClipFrame, ClipPlaces};
use super::{BLENDS, EXIT_BLENDS, EntryWay, KnownEntry, RATES, Stance};
use crate::anim::{Facing, JointId};
use crate::graph::{MotionGraph, Node};
use crate::math::{in_parallel, sort_rarely};

pub(super) struct Scratch<'a> {
    pub(super) sampler: FrameSampler<'a>,
    pub(super) examiner: Examiner,
    pub(super) layers: LayerTest<'a>,
    /// Tests that a later bake may take over.
    pub(super) tests: Vec<PairTest>,
    /// Cost of the exit that was considered last; infinite if all were considered.
    pub(super) furthest: f32,
    /// For each target, whether it is near.
    pub(super) near: Vec<bool>,
}

impl<'a> Scratch<'a> {
    pub(super) fn new(graph: &'a MotionGraph) -> Self {
        Self {
            tests: Vec::new(),
            furthest: f32::INFINITY,
            near: Vec::new(),
            sampler: FrameSampler::new(graph),
            examiner: Examiner::new(graph),
            layers: LayerTest::new(graph),
        }
    }
}

impl Scratch<'_> {
    /// Takes the tests of the moment that was searched last.
    pub(super) fn take_tests(&mut self, continuation: ContinuationKey) -> MomentTests {
        MomentTests {
            tests: std::mem::take(&mut self.tests),
            continuation,
            furthest: std::mem::replace(&mut self.furthest, f32::INFINITY),
        }
    }
}

/// Blends and playback rates of cuts to targets.
#[derive(Clone, Copy)]
pub(super) struct Ways {
    /// Durations of the blend in the order of preference, in seconds.
    blends: &'static [f32],
    /// Playback rates of the target's motion.
    rates: &'static [f32],
}

impl Ways {
    pub(super) const ENTRIES: Self = Self {
        blends: &BLENDS,
        rates: &RATES,
    };
    pub(super) const EXITS: Self = Self {
        blends: &EXIT_BLENDS,
        rates: &[1.0],
    };
}

/// The search for cuts to a list of target frames.
pub(super) struct Finder<'a> {
    pub(super) graph: &'a MotionGraph,
    pub(super) limits: &'a MotionLimits,
    /// Whether the toes may be as fast as before the cut, if that is above the limit.
    pub(super) toe_slows: bool,
    pub(super) places: &'a ClipPlaces,
    pub(super) targets: Vec<ClipFrame>,
    pub(super) head: JointId,
    pub(super) facing: Facing,
    pub(super) stances: Vec<Stance>,
    pub(super) near: NearStances,
    /// Stances of the targets that an earlier bake did not have.
    pub(super) near_new: NearStances,
    /// Positions of hips and head of each target after the last of [`DEPARTURES`].
    pub(super) points: Vec<Points>,
    ways: Ways,
    /// Motion that starts at each target, for each playback rate.
    entered: Vec<Vec<EnteredMotion>>,
    /// Key of the motion that is played after the end of each target's clip.
    continuation: Vec<ContinuationKey>,
    /// The tests of an earlier bake.
    pub(super) known: Option<KnownTests<'a>>,
}

/// A frame of a clip that cuts start from, with the motion around it.
pub(super) struct Departed {
    pub(super) at: Leaving,
    left: LeftMotion,
    /// Key of the motion that is played after the end of the clip.
    pub(super) continuation: ContinuationKey,
}

impl<'a> Finder<'a> {
    pub(super) fn new(search: SearchBasis<'a>, targets: Vec<ClipFrame>, ways: Ways) -> Self {
        let graph = search.graph;
        let frame_rate = graph.frame_rate() as f32;
        let longest = ways.blends.iter().copied().fold(0.0, f32::max);
        let frames = Examiner::frames(frame_rate, (longest * frame_rate).ceil() as usize);
        let entered = in_parallel(search.threads, targets.len(), |target| {
            let mut sampler = FrameSampler::new(graph);
            let entered = |&rate: &f32| sampler.entered(&targets[target], rate, frames);
            ways.rates.iter().map(entered).collect()
        });
        let continuation = |entered: &Vec<EnteredMotion>| {
            let frames = || entered.iter().flat_map(|motion| &motion.frames);
            match entered.iter().all(|motion| motion.stays_in_clip) {
                true => ContinuationKey::default(),
                false => ContinuationKey::of(frames().map(|frame| &frame.pose)),
            }
        };
        let continuation = entered.iter().map(continuation).collect();
        let after = f64::from(DEPARTURES[DEPARTURES.len() - 1]) * graph.frame_rate();
        let head = head(graph.skeleton());
        let facing = Facing::of(graph.skeleton());
        let points = |target: &ClipFrame| {
            let last = graph.clip(target.clip).frames() as u32 - 1;
            let frame = (target.frame + after.round() as u32).min(last);
            let clip = target.clip;
            Points::of(graph, head, Node { clip, frame })
        };
        let stances: Vec<Stance> = targets
            .iter()
            .map(|target| Stance::of_frame(graph, facing, target.node()))
            .collect();
        let legs = graph.feet().legs().len().min(Stance::LEGS);
        Self {
            graph,
            limits: search.limits,
            toe_slows: false,
            places: search.places,
            head,
            facing,
            near: NearStances::new(&stances, legs, [ROOT_APART, FOOT_APART]),
            near_new: NearStances::default(),
            stances,
            points: targets.iter().map(points).collect(),
            ways,
            entered,
            continuation,
            targets,
            known: None,
        }
    }

    /// Inputs that the tests depend on.
    pub(super) fn basis(&self) -> TestBasis<'_> {
        TestBasis {
            limits: self.limits,
            targets: &self.targets,
            continuation: &self.continuation,
            legs: self.graph.feet().legs().len(),
        }
    }

    /// Samples the motion that is left one frame after a frame of a clip, as far as the tests need it. The result does not depend on the
    /// targets.
    pub(super) fn depart(&self, before: ClipFrame, sampler: &mut FrameSampler<'_>) -> Departed {
        let left = sampler.left(before.playhead());
        Departed {
            at: self.leaving(before),
            continuation: match left.stays_in_clip {
                true => ContinuationKey::default(),
                false => ContinuationKey::of(left.frames.iter().map(|frame| &frame.pose)),
            },
            left,
        }
    }

    /// Takes over the tests of an earlier bake.
    pub(super) fn know(&mut self, known: Option<KnownTests<'a>>) {
        let new = known.iter().flat_map(|known| &known.new);
        let new: Vec<Stance> = new.map(|&target| self.stances[target]).collect();
        let legs = self.graph.feet().legs().len().min(Stance::LEGS);
        self.near_new = NearStances::new(&new, legs, [ROOT_APART, FOOT_APART]);
        self.known = known;
    }

    /// The search for cuts to the same frames within the widest limits: those of motion that the clips show at least once. No tests are taken
    /// over.
    pub(super) fn within_utmost(self, utmost: &'a MotionLimits) -> Self {
        Self {
            limits: utmost,
            toe_slows: true,
            known: None,
            ..self
        }
    }

    /// Whether there are targets that an earlier bake did not have.
    pub(super) fn has_new(&self) -> bool {
        self.known
            .as_ref()
            .is_some_and(|known| !known.new.is_empty())
    }

    /// Finds entries of a frame of a clip.
    pub(super) fn entries(
        &self,
        from: &Departed,
        most: usize,
        scratch: &mut Scratch<'_>,
    ) -> Vec<KnownEntry> {
        let mut found = Vec::new();
        self.find_near(from, &mut scratch.near);
        for target in spread(self.targets.len()) {
            if found.len() == most {
                break;
            }
            if !scratch.near[target] {
                continue;
            }
            let Some(aligned) = self.align(&from.at, target) else {
                continue;
            };
            if !aligned.goes_on {
                continue;
            }
            found.extend(self.plausible(from, aligned, scratch));
        }
        sort_rarely(&mut found, |a, b| a.target.cmp(&b.target));
        found
    }

    /// The cut to a target, if it is plausible.
    pub(super) fn plausible(
        &self,
        from: &Departed,
        to: Aligned,
        scratch: &mut Scratch<'_>,
    ) -> Option<KnownEntry> {
        let known = self.known.as_ref();
        let place = from.at.before.node();
        let known = known.and_then(|known| known.find(place, from.continuation, to.target));
        let test = known.unwrap_or_else(|| {
            scratch.examiner.slack = Slack::default();
            let way = self.tested(from, to, &mut scratch.examiner);
            PairTest::new(to.target, way, &scratch.examiner.slack)
        });
        scratch.tests.push(test);
        test.entry()
    }

    /// The first plausible blend of a cut, and the fastest plausible rate.
    fn tested(&self, from: &Departed, to: Aligned, examiner: &mut Examiner) -> Option<EntryWay> {
        let (entered, Ways { blends, rates }) = (&self.entered[to.target], self.ways);
        let cut = |rate: usize| Cut {
            graph: self.graph,
            limits: self.limits,
            left: &from.left,
            entered: &entered[rate],
            align: to.align,
            stands: from.at.standing.contains(&true),
            toe_slows: self.toe_slows,
        };
        let mut test = examiner.cut(cut(0));
        let blend = blends.iter().position(|&blend| test.is_plausible(blend))?;
        let faster = (1..rates.len())
            .take_while(|&rate| examiner.cut(cut(rate)).is_plausible(blends[blend]));
        Some(EntryWay {
            blend,
            rate: faster.last().unwrap_or(0),
            pin: to.pin,
        })
    }
}
