//! Search for the entries and exits of all moments.

use glam::Vec3;

use super::examine::{Cut, Examiner};
use super::frames::{EnteredMotion, FrameSampler, LeftMotion};
use super::layer_test::LayerTest;
use super::layers::LayerSource;
use super::limits::{DEPARTURES, MeasuredMotion, MotionLimits, head};
use super::moment_search::MomentSearch;
use super::near_stances::NearStances;
use super::record::{
    Beyond, EarlierEntries, EntryRecord, KnownTests, MomentTests, PairTest, TestBasis, TestTable,
};
use super::slack::Slack;
use super::targets::{ClipFrame, ClipPlaces, natural, targets};
use super::{BLENDS, EXIT_BLENDS, EntrySettings, EntryTable, KnownEntry, RATES, Stance};
use crate::anim::{Facing, JointId, Pose, forward_kinematics};
use crate::graph::{ClipId, MotionGraph, Node, Playhead};
use crate::maps::Evasion;
use crate::math::{Rigid2, in_parallel};

/// Maximum horizontal distance of root and feet, in metres. Most pairs beyond it fail the later tests, which are slower.
const ROOT_APART: f32 = 0.25;
const FOOT_APART: f32 = 0.45;
/// A foot is pinned by preference if it stands so many frames after the target too.
const STAYS: u32 = 4;

impl EntryTable {
    /// Finds all entries of a graph, and records the tests for a later bake. The result does not depend on the number of threads, nor on
    /// the tests that are taken over from an earlier bake.
    #[must_use]
    pub(crate) fn find(
        graph: &MotionGraph,
        evasions: &[Evasion],
        EntrySearch {
            settings,
            threads,
            earlier,
        }: EntrySearch<'_>,
    ) -> (Self, EntryRecord) {
        if settings.moment_step == 0 || evasions.is_empty() {
            return Default::default();
        }
        let earlier = earlier.with(settings);
        let places = ClipPlaces::new(graph);
        let mut measured = MeasuredMotion::of(graph, threads);
        let limits = measured.limits(&settings.plausible);
        let targets = targets(graph, evasions, settings, &places);
        let step = settings.moment_step;
        let mut table = Self {
            step,
            first_moment: first_moments(graph, step),
            ..Self::default()
        };
        let frames = targets
            .iter()
            .map(|target| ClipFrame::of(graph, target.edge, target.edge_frame));
        let how = (Ways::ENTRIES, threads);
        let mut entries = Finder::new((graph, &limits), &places, frames.collect(), how);
        let how = (Ways::EXITS, threads);
        let frames = natural(graph, settings.target_step);
        let mut exits = Finder::new((graph, &limits), &places, frames, how);
        let mut layers = LayerSource::new((graph, evasions), &targets, &limits);
        let mut record = EntryRecord {
            settings: Some(*settings),
            first_moment: table.first_moment.clone(),
            entries: TestTable::new(entries.basis()),
            exits: TestTable::new(exits.basis()),
            layers: TestTable::new(layers.basis(&entries)),
            ..EntryRecord::default()
        };
        if let Some(earlier) = earlier {
            let of_entries = earlier.known(&earlier.record.entries, entries.basis());
            let of_exits = earlier.known(&earlier.record.exits, exits.basis());
            entries.know(Some(of_entries));
            exits.know(Some(of_exits));
            layers.known = Some(earlier.known(&earlier.record.layers, layers.basis(&entries)));
        }
        let search = MomentSearch {
            entries: &entries,
            exits: &exits,
            layers: &layers,
            settings,
        };
        for found in search.all(threads) {
            table.cut += u64::from(found.entries.len() == settings.most as usize);
            table.entries.push(&found.entries);
            table.exits.lists.push(&found.exits);
            table.layers.push(&found.layers);
            let [entries, exits, layers] = found.tests;
            record.entries.push(entries);
            record.exits.push(exits);
            record.layers.push(layers);
        }
        table.exits.targets = exits
            .targets
            .iter()
            .map(|target| (target.edge, target.edge_frame).into())
            .collect();
        let utmost = measured.limits(&settings.plausible.utmost());
        let mut exits = Finder {
            limits: &utmost,
            toe_slows: true,
            known: None,
            ..exits
        };
        exits.known = earlier.map(|it| it.known(&it.record.last_exits, exits.basis()));
        record.last_exits = table.shorten_stretches(&exits, settings.unbranched, threads);
        (table.limits, table.targets) = (limits, targets);
        (table, record)
    }
}

/// The first moment of each clip, and the number of moments.
fn first_moments(graph: &MotionGraph, step: u32) -> Vec<u32> {
    let mut firsts = vec![0];
    for clip in graph.clips() {
        let moments = clip.frames().div_ceil(step as usize) as u32;
        firsts.push(firsts[firsts.len() - 1] + moments);
    }
    firsts
}

/// How entries are searched.
#[derive(Clone, Copy)]
pub(crate) struct EntrySearch<'a> {
    pub(crate) settings: &'a EntrySettings,
    /// Number of threads, 0 for one per CPU core.
    pub(crate) threads: usize,
    /// Tests of an earlier bake.
    pub(crate) earlier: &'a EarlierEntries,
}

/// A permutation of the numbers below `count` in which each prefix is spread evenly.
pub(super) fn spread(count: usize) -> impl Iterator<Item = usize> {
    let is_coprime = |step: &usize| {
        let (mut a, mut b) = (*step, count);
        while b > 0 {
            (a, b) = (b, a % b);
        }
        a == 1
    };
    // About the golden ratio's share.
    let first = (count * 89 / 144).max(1);
    let step = (first..).find(is_coprime).unwrap_or(1);
    (0..count).map(move |index| index * step % count)
}

/// Positions of hips and head in a frame of a clip.
#[derive(Clone, Copy, Debug)]
struct Points {
    hip: Vec3,
    head: Vec3,
}

impl Points {
    /// `head` is the graph's, which is not looked for in each frame.
    fn of((graph, head): (&MotionGraph, JointId), clip: ClipId, frame: u32) -> Self {
        let (mut pose, mut joints) = (Pose::default(), Vec::new());
        graph.clip(clip).pose(frame as usize, &mut pose);
        forward_kinematics(graph.skeleton(), &pose, &mut joints);
        Self {
            hip: pose.root,
            head: joints[head.index()].translation,
        }
    }
}

pub(super) struct Scratch<'a> {
    pub(super) sampler: FrameSampler<'a>,
    pub(super) examiner: Examiner,
    pub(super) layers: LayerTest<'a>,
    /// Interval of moments, in frames.
    pub(super) step: u32,
    /// Tests that a later bake may take over.
    pub(super) tests: Vec<PairTest>,
    /// Cost of the exit that was considered last, or infinite if all were.
    pub(super) furthest: f32,
    /// Whether each target is near.
    pub(super) near: Vec<bool>,
}

impl<'a> Scratch<'a> {
    pub(super) fn new(graph: &'a MotionGraph, step: u32) -> Self {
        Self {
            step,
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
    /// The tests of a moment that was searched.
    pub(super) fn take_tests(&mut self, beyond: Beyond) -> MomentTests {
        MomentTests {
            tests: std::mem::take(&mut self.tests),
            beyond,
            furthest: std::mem::replace(&mut self.furthest, f32::INFINITY),
        }
    }
}

/// How cuts lead to targets.
#[derive(Clone, Copy)]
struct Ways {
    /// Durations of the blend, the one that is wanted most first, in seconds.
    blends: &'static [f32],
    /// Playback rates.
    rates: &'static [f32],
}

impl Ways {
    const ENTRIES: Self = Self {
        blends: &BLENDS,
        rates: &RATES,
    };
    const EXITS: Self = Self {
        blends: &EXIT_BLENDS,
        rates: &[1.0],
    };
}

/// The search among some frames.
pub(super) struct Finder<'a> {
    pub(super) graph: &'a MotionGraph,
    pub(super) limits: &'a MotionLimits,
    /// Whether a toe may be faster than the limit, if it was when a motion is left.
    pub(super) toe_slows: bool,
    pub(super) places: &'a ClipPlaces,
    pub(super) targets: Vec<ClipFrame>,
    head: JointId,
    facing: Facing,
    stances: Vec<Stance>,
    near: NearStances,
    /// Those of the targets that an earlier bake did not have.
    near_new: NearStances,
    /// Hips and head of each target after the last of [`DEPARTURES`].
    points: Vec<Points>,
    ways: Ways,
    /// The motion that starts at each target, by rate.
    entered: Vec<Vec<EnteredMotion>>,
    /// What is played after the end of each target's clip.
    beyond: Vec<Beyond>,
    /// The tests of an earlier bake.
    pub(super) known: Option<KnownTests<'a>>,
}

/// A frame of a clip that is left.
pub(super) struct Departed {
    pub(super) at: Leaving,
    /// The frame before it.
    pub(super) before: Playhead,
    left: LeftMotion,
    /// What is played after the end of the clip.
    pub(super) beyond: Beyond,
}

/// The part of a frame that is left by which targets are aligned.
pub(super) struct Leaving {
    pub(super) clip: ClipId,
    /// The frame at which the cut is made.
    pub(super) now: u32,
    stance: Stance,
    standing: Vec<bool>,
    ways: [Points; 2],
}

/// How a target is aligned.
#[derive(Clone, Copy)]
pub(super) struct Aligned {
    pub(super) pin: Option<usize>,
    align: Rigid2,
    /// Departure of hips and head and distance of the feet, in metres.
    pub(super) cost: f32,
    /// Whether hips and head go on well enough for a short blend.
    goes_on: bool,
}

impl<'a> Finder<'a> {
    fn new(
        (graph, limits): (&'a MotionGraph, &'a MotionLimits),
        places: &'a ClipPlaces,
        targets: Vec<ClipFrame>,
        (ways, threads): (Ways, usize),
    ) -> Self {
        let frame_rate = graph.frame_rate() as f32;
        let longest = ways.blends.iter().copied().fold(0.0, f32::max);
        let frames = Examiner::frames(frame_rate, (longest * frame_rate).ceil() as usize);
        let entered = in_parallel(threads, targets.len(), |target| {
            let mut sampler = FrameSampler::new(graph);
            let entered = |&rate: &f32| sampler.entered(&targets[target], rate, frames);
            ways.rates.iter().map(entered).collect()
        });
        let beyond = |entered: &Vec<EnteredMotion>| {
            let frames = || entered.iter().flat_map(|motion| &motion.frames);
            match entered.iter().all(|motion| motion.stays_in_clip) {
                true => Beyond::default(),
                false => Beyond::of(frames().map(|frame| &frame.pose)),
            }
        };
        let beyond = entered.iter().map(beyond).collect();
        let after = f64::from(DEPARTURES[DEPARTURES.len() - 1]) * graph.frame_rate();
        let head = head(graph.skeleton());
        let facing = Facing::of(graph.skeleton());
        let points = |target: &ClipFrame| {
            let last = graph.clip(target.clip).frames() as u32 - 1;
            let frame = (target.frame + after.round() as u32).min(last);
            Points::of((graph, head), target.clip, frame)
        };
        let stances: Vec<Stance> = { targets.iter() }
            .map(|target| Stance::of_frame(graph, facing, target.node()))
            .collect();
        let legs = graph.feet().legs().len().min(Stance::LEGS);
        Self {
            graph,
            limits,
            toe_slows: false,
            places,
            head,
            facing,
            near: NearStances::new(&stances, legs, [ROOT_APART, FOOT_APART]),
            near_new: NearStances::default(),
            stances,
            points: targets.iter().map(points).collect(),
            ways,
            entered,
            beyond,
            targets,
            known: None,
        }
    }

    /// What the tests depend on.
    pub(super) fn basis(&self) -> TestBasis<'_> {
        TestBasis {
            limits: self.limits,
            targets: &self.targets,
            beyond: &self.beyond,
        }
    }

    /// The playhead at a frame of a clip; `None` if the graph does not play it.
    pub(super) fn playhead(&self, (clip, frame): (usize, u32)) -> Option<Playhead> {
        let (edge, edge_frame) = self.places.find(ClipId(clip as u32), frame)?;
        Some(Playhead {
            edge,
            frame: edge_frame as f32,
            clip_to_world: Rigid2::IDENTITY,
        })
    }

    /// The frame one after a frame of a clip.
    pub(super) fn leaving(&self, (clip, frame): (usize, u32)) -> Leaving {
        let (graph, clip) = (self.graph, ClipId(clip as u32));
        let now = frame + 1;
        let at = now.min(graph.clip(clip).frames() as u32 - 1);
        let legs = graph.feet().legs().len().min(Stance::LEGS);
        let standing = (0..legs).map(|leg| graph.feet().stands(clip, leg, at));
        Leaving {
            clip,
            now,
            stance: Stance::of_frame(graph, self.facing, Node { clip, frame: at }),
            standing: standing.collect(),
            ways: [frame, at].map(|frame| Points::of((graph, self.head), clip, frame)),
        }
    }

    /// Samples what the tests need of the motion that is left one frame after a frame of a clip. It depends on no target.
    pub(super) fn depart(
        &self,
        place: (usize, u32),
        before: Playhead,
        sampler: &mut FrameSampler<'_>,
    ) -> Departed {
        let left = sampler.left(before);
        Departed {
            at: self.leaving(place),
            before,
            beyond: match left.stays_in_clip {
                true => Beyond::default(),
                false => Beyond::of(left.frames.iter().map(|frame| &frame.pose)),
            },
            left,
        }
    }

    /// Takes over the tests of an earlier bake.
    fn know(&mut self, known: Option<KnownTests<'a>>) {
        let new = known.iter().flat_map(|known| &known.new);
        let new: Vec<Stance> = new.map(|&target| self.stances[target]).collect();
        let legs = self.graph.feet().legs().len().min(Stance::LEGS);
        self.near_new = NearStances::new(&new, legs, [ROOT_APART, FOOT_APART]);
        self.known = known;
    }

    /// Whether there are targets that an earlier bake did not have.
    pub(super) fn has_new(&self) -> bool {
        self.known
            .as_ref()
            .is_some_and(|known| !known.new.is_empty())
    }

    /// Whether a target that the earlier bake did not have can be aligned at no more than a cost.
    pub(super) fn has_new_near(&self, from: &Leaving, cost: f32, near: &mut Vec<bool>) -> bool {
        let Some(known) = self.known.as_ref().filter(|_| self.has_new()) else {
            return false;
        };
        near.clear();
        near.resize(known.new.len(), true);
        if !self.near_new.is_empty() {
            self.near_new.find(&from.stance, &from.standing, near);
        }
        let near = known.new.iter().zip(near.iter()).filter(|(_, near)| **near);
        let mut aligned = near.filter_map(|(&target, _)| self.align(from, target));
        aligned.any(|aligned| aligned.cost <= cost)
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
            let Some((blend, fastest)) = self.plausible(from, (target, aligned), scratch) else {
                continue;
            };
            let how = (blend, aligned.pin, fastest);
            found.push(KnownEntry::new(target as u16, how));
        }
        found.sort_unstable_by_key(|entry| entry.target);
        found
    }

    /// Writes for each target whether [`Finder::align`] may align it.
    pub(super) fn find_near(&self, from: &Departed, near: &mut Vec<bool>) {
        match self.near.is_empty() {
            false => self.near.find(&from.at.stance, &from.at.standing, near),
            // A body without feet.
            true => {
                near.clear();
                near.resize(self.targets.len(), true);
            }
        }
    }

    /// Aligns a target, or returns `None` if it is where the motion goes anyway or too far away.
    pub(super) fn align(&self, from: &Leaving, target: usize) -> Option<Aligned> {
        let at = &self.targets[target];
        let ahead = i64::from(at.frame) - i64::from(from.now);
        if at.clip == from.clip && ahead.abs() <= 3 {
            return None;
        }
        let (apart, pin) = self.pin((&from.stance, &from.standing), target)?;
        let align = from.stance.align(&self.stances[target], pin);
        let (departed, goes_on) = self.departed(from.ways, target, align);
        Some(Aligned {
            pin,
            align,
            cost: apart + departed,
            goes_on,
        })
    }

    /// Departure of hips and head from constant velocity, in metres, and whether it is small enough: after the longest blend of an entry the
    /// body is where the target's clip has it, so that no pose of the blend is needed to tell.
    fn departed(&self, [before, now]: [Points; 2], target: usize, align: Rigid2) -> (f32, bool) {
        let last = DEPARTURES.len() - 1;
        let frames = (DEPARTURES[last] * self.graph.frame_rate() as f32).round();
        let then = self.points[target];
        let off = |before: Vec3, now: Vec3, then: Vec3| {
            align.point(then) - (now + (now - before) * frames)
        };
        let hip = off(before.hip, now.hip, then.hip).with_y(0.0).length();
        let head = off(before.head, now.head, then.head).length();
        let fits =
            hip <= self.limits.hip_departure[last] && head <= self.limits.head_departure[last];
        (hip + head, fits)
    }

    /// What stays in place: of the feet that stand in both motions (if there is none, of those that stand) the one that leaves root and the
    /// other feet least far apart; `None` where all leave them too far.
    fn pin(
        &self,
        (stance, standing): (&Stance, &[bool]),
        target: usize,
    ) -> Option<(f32, Option<usize>)> {
        let (other, at) = (&self.stances[target], &self.targets[target]);
        let stays =
            |leg: usize| standing[leg] && self.graph.feet().stands(at.clip, leg, at.frame + STAYS);
        let any_stays = (0..standing.len()).any(stays);
        let standing_legs = (0..standing.len())
            .filter(|&leg| standing[leg] && (stays(leg) || !any_stays))
            .map(Some);
        let none = (!standing.contains(&true)).then_some(None);
        let pins = standing_legs.chain(none);
        let costs = pins.filter_map(|pin| {
            let (root, feet) = stance.apart(other, stance.align(other, pin));
            let furthest = feet[..standing.len()].iter().copied().fold(0.0, f32::max);
            (root <= ROOT_APART && furthest <= FOOT_APART).then_some((root + 0.3 * furthest, pin))
        });
        costs.min_by(|a, b| a.0.total_cmp(&b.0))
    }

    /// The first plausible blend of a cut, and the fastest plausible rate.
    pub(super) fn plausible(
        &self,
        from: &Departed,
        (target, aligned): (usize, Aligned),
        scratch: &mut Scratch<'_>,
    ) -> Option<(usize, usize)> {
        let place = (from.at.clip, (from.at.now - 1) / scratch.step);
        let known = self.known.as_ref();
        let known = known.and_then(|known| known.find((place, from.beyond), target));
        let test = known.unwrap_or_else(|| {
            scratch.examiner.slack = Slack::default();
            let how = self.tested(from, (target, aligned), &mut scratch.examiner);
            PairTest::new(target, (how, aligned.pin), &scratch.examiner.slack)
        });
        scratch.tests.push(test);
        test.how()
    }

    fn tested(
        &self,
        from: &Departed,
        (target, aligned): (usize, Aligned),
        examiner: &mut Examiner,
    ) -> Option<(usize, usize)> {
        let (entered, Ways { blends, rates }) = (&self.entered[target], self.ways);
        let cut = |rate: usize| Cut {
            graph: self.graph,
            limits: self.limits,
            left: &from.left,
            entered: &entered[rate],
            align: aligned.align,
            stands: from.at.standing.contains(&true),
            toe_slows: self.toe_slows,
        };
        let mut test = examiner.cut(cut(0));
        let blend = blends.iter().position(|&blend| test.is_plausible(blend))?;
        let fastest = (1..rates.len())
            .take_while(|&rate| examiner.cut(cut(rate)).is_plausible(blends[blend]))
            .last();
        Some((blend, fastest.unwrap_or(0)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_spread_order_has_each_number_once() {
        for count in [0, 1, 2, 3, 10, 144, 159, 256] {
            let mut order: Vec<usize> = spread(count).collect();
            order.sort_unstable();
            assert_eq!(order, (0..count).collect::<Vec<_>>());
        }
        let first: Vec<usize> = spread(100).take(4).collect();
        let far = |a: usize, b: usize| a.abs_diff(b) > 10;
        assert!(
            first.windows(2).all(|pair| far(pair[0], pair[1])),
            "{first:?}"
        );
    }
}
