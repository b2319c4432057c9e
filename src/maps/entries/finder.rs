//! The search for cuts from one frame to the targets.

use super::aligned::{Aligned, FOOT_APART, Leaving, Points, ROOT_APART};
use super::examine::{Cut, Examiner};
use super::frames::{EnteredMotion, FrameSampler, LeftMotion};
use super::layer_test::LayerTest;
use super::limits::{DEPARTURES, MotionLimits, head};
use super::near_stances::NearStances;
use super::search_basis::SearchBasis;
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
    /// For each target, whether it is near.
    pub(super) near: Vec<bool>,
}

impl<'a> Scratch<'a> {
    pub(super) fn new(graph: &'a MotionGraph) -> Self {
        Self {
            near: Vec::new(),
            sampler: FrameSampler::new(graph),
            examiner: Examiner::new(graph),
            layers: LayerTest::new(graph),
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
    /// Positions of hips and head of each target after the last of [`DEPARTURES`].
    pub(super) points: Vec<Points>,
    ways: Ways,
    /// Motion that starts at each target, for each playback rate.
    entered: Vec<Vec<EnteredMotion>>,
}

/// A frame of a clip that cuts start from, with the motion around it.
pub(super) struct Departed {
    pub(super) at: Leaving,
    left: LeftMotion,
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
            stances,
            points: targets.iter().map(points).collect(),
            ways,
            entered,
            targets,
        }
    }

    /// Samples the motion that is left one frame after a frame of a clip, as far as the tests need it. The result does not depend on the
    /// targets.
    pub(super) fn depart(&self, before: ClipFrame, sampler: &mut FrameSampler<'_>) -> Departed {
        Departed {
            at: self.leaving(before),
            left: sampler.left(before.playhead()),
        }
    }

    /// The search for cuts to the same frames within the widest limits: those of motion that the clips show at least once.
    pub(super) fn within_utmost(self, utmost: &'a MotionLimits) -> Self {
        Self {
            limits: utmost,
            toe_slows: true,
            ..self
        }
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
        let way = self.tested(from, to, &mut scratch.examiner)?;
        Some(KnownEntry::new(to.target as u16, way))
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
