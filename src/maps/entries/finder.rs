//! The search for cuts from one frame to the targets.

use crate::anim::{Facing, JointId, Pose, forward_kinematics};
use crate::graph::{MotionGraph, Node};
use crate::maps::entries::examine::{Cut, Examiner};
use crate::maps::entries::frames::{Frame, FrameSampler, LeftMotion};
use crate::maps::entries::limits::{DEPARTURES, MotionLimits, departure, departures, head};
use crate::maps::entries::stance::Stance;
use crate::maps::entries::table::{BLENDS, EXIT_BLENDS, EntryWay, KnownEntry, RATES};
use crate::maps::entries::targets::{ClipFrame, ClipPlaces};
use crate::math::{Rigid2, in_parallel};
use glam::Vec3;

pub(crate) struct Scratch<'a> {
    pub(crate) sampler: FrameSampler<'a>,
    pub(crate) examiner: Examiner,
}

impl<'a> Scratch<'a> {
    pub(crate) fn new(graph: &'a MotionGraph) -> Self {
        Self {
            sampler: FrameSampler::new(graph),
            examiner: Examiner::new(graph),
        }
    }
}

/// Blends and playback rates of cuts to targets.
#[derive(Clone, Copy)]
pub(crate) struct Ways {
    /// Durations of the blend in the order of preference, in seconds.
    blends: &'static [f32],
    /// Playback rates of the target's motion.
    rates: &'static [f32],
}

impl Ways {
    pub(crate) const ENTRIES: Self = Self {
        blends: &BLENDS,
        rates: &RATES,
    };
    pub(crate) const EXITS: Self = Self {
        blends: &EXIT_BLENDS,
        rates: &[1.0],
    };
}

/// The search for cuts to a list of target frames.
#[derive(Clone)]
pub(crate) struct Finder<'a> {
    pub(crate) graph: &'a MotionGraph,
    pub(crate) limits: &'a MotionLimits,
    /// Whether the limits are the widest. The toes may then be as fast as before the cut, if that is above the limit.
    pub(crate) is_widest: bool,
    pub(crate) places: &'a ClipPlaces,
    pub(crate) targets: Vec<ClipFrame>,
    pub(crate) head: JointId,
    pub(crate) facing: Facing,
    pub(crate) stances: Vec<Stance>,
    /// Positions of hips and head of each target after the last of [`DEPARTURES`].
    pub(crate) points: Vec<Points>,
    ways: Ways,
    /// Motion that starts at each target, for each playback rate.
    entered: Vec<Vec<Vec<Frame>>>,
}

/// A frame of a clip that cuts start from: data by which targets are aligned, and the motion around it.
pub(crate) struct Departed {
    pub(crate) before: ClipFrame,
    stance: Stance,
    standing: Vec<bool>,
    ways: [Points; 2],
    left: LeftMotion,
}

impl<'a> Finder<'a> {
    pub(crate) fn new(
        graph: &'a MotionGraph,
        limits: &'a MotionLimits,
        places: &'a ClipPlaces,
        targets: Vec<ClipFrame>,
        ways: Ways,
        threads: usize,
    ) -> Self {
        let frame_rate = graph.frame_rate() as f32;
        let longest = ways.blends.iter().copied().fold(0.0, f32::max);
        let frames = Examiner::frames(frame_rate, (longest * frame_rate).ceil() as usize);
        let entered = in_parallel(threads, targets.len(), |target| {
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
            Points::at(graph, head, Node { clip, frame })
        };
        let stances: Vec<Stance> = targets
            .iter()
            .map(|target| Stance::at_frame(graph, facing, target.node()))
            .collect();
        Self {
            graph,
            limits,
            is_widest: false,
            places,
            head,
            facing,
            stances,
            points: targets.iter().map(points).collect(),
            ways,
            entered,
            targets,
        }
    }

    /// Prepares the frame after `before` as the one that is left, and samples the motion as far as the tests need it. The result does not
    /// depend on the targets.
    pub(crate) fn depart(&self, before: ClipFrame, sampler: &mut FrameSampler<'_>) -> Departed {
        let (graph, clip) = (self.graph, before.clip);
        let at = (before.frame + 1).min(graph.clip(clip).frames() as u32 - 1);
        let legs = graph.feet().legs().len().min(Stance::LEGS);
        let standing = (0..legs).map(|leg| graph.feet().stands(clip, leg, at));
        Departed {
            before,
            stance: Stance::at_frame(graph, self.facing, Node { clip, frame: at }),
            standing: standing.collect(),
            ways: [before.frame, at]
                .map(|frame| Points::at(graph, self.head, Node { clip, frame })),
            left: sampler.left(before.playhead()),
        }
    }

    /// The search for cuts to the same frames within the widest limits: those of motion that the clips show at least once.
    pub(crate) fn within_utmost(self, utmost: &'a MotionLimits) -> Self {
        Self {
            limits: utmost,
            is_widest: true,
            ..self
        }
    }

    /// Finds entries of a frame of a clip.
    pub(crate) fn entries(
        &self,
        from: &Departed,
        most: usize,
        scratch: &mut Scratch<'_>,
    ) -> Vec<KnownEntry> {
        let mut found = Vec::new();
        for target in spread(self.targets.len()) {
            if found.len() == most {
                break;
            }
            // Within the widest limits a long blend may let the body go on beyond the target's hips.
            let aligned = self.align(from, target);
            if let Some(aligned) = aligned.filter(|aligned| aligned.goes_on || self.is_widest) {
                found.extend(self.plausible(from, aligned, scratch));
            }
        }
        found.sort_by_key(|found| found.target);
        found
    }

    /// The cut to a target with the first plausible blend and the fastest plausible rate, if there is one.
    pub(crate) fn plausible(
        &self,
        from: &Departed,
        to: Aligned,
        scratch: &mut Scratch<'_>,
    ) -> Option<KnownEntry> {
        let examiner = &mut scratch.examiner;
        let (entered, Ways { blends, rates }) = (&self.entered[to.target], self.ways);
        let cut = |rate: usize| Cut {
            graph: self.graph,
            limits: self.limits,
            left: &from.left,
            entered: &entered[rate],
            align: to.align,
            stands: from.standing.contains(&true),
            toe_slows: self.is_widest,
        };
        let mut test = examiner.cut(cut(0));
        let blend = blends.iter().position(|&blend| test.is_plausible(blend))?;
        let faster = (1..rates.len())
            .take_while(|&rate| examiner.cut(cut(rate)).is_plausible(blends[blend]));
        let way = EntryWay {
            blend,
            rate: faster.last().unwrap_or(0),
            pin: to.pin,
        };
        Some(KnownEntry::new(to.target as u16, way))
    }
}

// A frame that is left, and a target that is aligned with it.

/// Maximum horizontal distance of root and feet, in metres. Most pairs beyond it fail the later tests, which are slower.
pub(crate) const ROOT_APART: f32 = 0.25;
pub(crate) const FOOT_APART: f32 = 0.45;

/// Positions of hips and head in a frame of a clip.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Points {
    pub(crate) hip: Vec3,
    pub(crate) head: Vec3,
}

impl Points {
    /// Positions in a frame. `head` is the head's joint, which the caller looks up once.
    pub(crate) fn at(graph: &MotionGraph, head: JointId, at: Node) -> Self {
        let (mut pose, mut joints) = (Pose::default(), Vec::new());
        graph.clip(at.clip).pose(at.frame as usize, &mut pose);
        forward_kinematics(graph.skeleton(), &pose, &mut joints);
        Self {
            hip: pose.root,
            head: joints[head.index()].translation,
        }
    }
}

#[derive(Clone, Copy)]
pub(crate) struct Aligned {
    pub(crate) target: usize,
    pub(crate) pin: Option<usize>,
    pub(crate) align: Rigid2,
    /// Departure of hips and head and distance of the feet, in metres.
    pub(crate) cost: f32,
    /// Whether the departure of hips and head is within the limits of a short blend.
    pub(crate) goes_on: bool,
}

// Aligns targets with the frame that is left, and excludes targets that are too far away.

/// Number of frames after the target in which a foot must still stand to be preferred as the pin.
const STAYS: u32 = 4;

impl Finder<'_> {
    /// Aligns a target. Returns `None` if it is within three frames of the frame that is left, or too far away.
    pub(crate) fn align(&self, from: &Departed, target: usize) -> Option<Aligned> {
        let at = &self.targets[target];
        let now = from.before.frame + 1;
        if at.clip == from.before.clip && at.frame.abs_diff(now) <= 3 {
            return None;
        }
        let (apart, pin) = self.pin(from, target)?;
        let align = from.stance.align(&self.stances[target], pin);
        let (departed, goes_on) = self.departed(from.ways, target, align);
        Some(Aligned {
            target,
            pin,
            align,
            cost: apart + departed,
            goes_on,
        })
    }

    /// Departure of hips and head from constant velocity, in metres, and whether it is within the limits. After the longest blend of an entry
    /// the body is where the target's clip has it, so no pose of the blend is needed.
    fn departed(&self, [before, now]: [Points; 2], target: usize, align: Rigid2) -> (f32, bool) {
        let last = DEPARTURES.len() - 1;
        let frames = departures(self.graph.frame_rate() as f32)[last];
        let Points { hip, head } = self.points[target];
        let hip = departure([before.hip, now.hip, align.point(hip)], frames);
        let head = departure([before.head, now.head, align.point(head)], frames);
        let (hip, head) = (hip.with_y(0.0).length(), head.length());
        let fits =
            hip <= self.limits.hip_departure[last] && head <= self.limits.head_departure[last];
        (hip + head, fits)
    }

    /// Cost of the best alignment, and the leg whose foot stays in place, or `None` for the root. Candidates are the feet that stand in both
    /// motions; if there are none, all feet that stand; if there are none, the root. The one that leaves root and other feet least far apart is
    /// chosen. Returns `None` if all leave them too far apart.
    fn pin(&self, from: &Departed, target: usize) -> Option<(f32, Option<usize>)> {
        let (stance, standing) = (&from.stance, &from.standing);
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
}

// An order of the targets of which each prefix is spread evenly.

/// A permutation of the numbers below `count` in which each prefix is spread evenly.
pub(crate) fn spread(count: usize) -> impl Iterator<Item = usize> {
    let is_coprime = |step: &usize| {
        let (mut a, mut b) = (*step, count);
        while b > 0 {
            (a, b) = (b, a % b);
        }
        a == 1
    };
    // A step of about the golden section, which spreads prefixes evenly.
    let first = (count * 89 / 144).max(1);
    let step = (first..).find(is_coprime).unwrap_or(1);
    (0..count).map(move |index| index * step % count)
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
