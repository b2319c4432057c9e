//! Search for the entries of all moments.

use glam::Vec3;

use super::limits::{DEPARTURES, Examiner, MotionLimits, head};
use super::{BLENDS, EntrySettings, EntryTable, EntryTarget, KnownEntry, RATES, Stance};
use crate::anim::{Pose, forward_kinematics};
use crate::graph::{ClipId, EdgeId, EdgeMotion, Entry, Motion, MotionGraph, Playhead};
use crate::maps::Evasion;
use crate::math::{Rigid2, in_parallel};

/// Maximum horizontal distance of root and feet, in metres. Most pairs beyond it fail the later tests, which are slower.
const ROOT_APART: f32 = 0.25;
const FOOT_APART: f32 = 0.45;

impl EntryTable {
    /// Finds all entries of a graph. The result does not depend on the number of threads.
    #[must_use]
    pub(crate) fn find(
        graph: &MotionGraph,
        evasions: &[Evasion],
        (settings, threads): (&EntrySettings, usize),
    ) -> Self {
        if settings.moment_step == 0 || evasions.is_empty() {
            return Self::default();
        }
        let places = ClipPlaces::new(graph);
        let mut table = Self {
            limits: MotionLimits::learn(graph, &settings.plausible),
            step: settings.moment_step,
            targets: targets(graph, evasions, settings, &places),
            first_moment: vec![0],
            ..Self::default()
        };
        let finder = Finder {
            graph,
            limits: &table.limits,
            stances: { table.targets.iter() }
                .map(|target| Stance::of_frame(graph, clip_of(graph, target), target.frame))
                .collect(),
            points: { table.targets.iter() }
                .map(|target| {
                    let clip = clip_of(graph, target);
                    let after = f64::from(DEPARTURES[DEPARTURES.len() - 1]) * graph.frame_rate();
                    let last = graph.clip(clip).frames() as u32 - 1;
                    Points::of(graph, clip, (target.frame + after.round() as u32).min(last))
                })
                .collect(),
            targets: &table.targets,
            most: settings.most as usize,
            places: &places,
        };
        let clips = graph.clips().len();
        let moments = |clip: usize| {
            graph.clips()[clip]
                .frames()
                .div_ceil(settings.moment_step as usize)
        };
        let all: Vec<(usize, u32)> = (0..clips)
            .flat_map(|clip| {
                (0..moments(clip)).map(move |moment| (clip, moment as u32 * settings.moment_step))
            })
            .collect();
        let batch = 16;
        let found = in_parallel(threads, all.len().div_ceil(batch), |number| {
            let mut scratch = Scratch::default();
            let own = &all[number * batch..((number + 1) * batch).min(all.len())];
            own.iter()
                .map(|&place| finder.moment(place, &mut scratch))
                .collect::<Vec<_>>()
        });
        for list in found.into_iter().flatten() {
            table.cut += u64::from(list.len() == settings.most as usize);
            table.entries.extend(list);
            table.ends.push(table.entries.len() as u32);
        }
        for clip in 0..clips {
            table
                .first_moment
                .push(table.first_moment[clip] + moments(clip) as u32);
        }
        table
    }
}

fn clip_of(graph: &MotionGraph, target: &EntryTarget) -> ClipId {
    graph.node(graph.edge(target.edge).from).clip
}

/// The edges that play the frames of each clip.
struct ClipPlaces {
    /// First frame and edge, by clip, in order.
    edges: Vec<Vec<(u32, u32, EdgeId)>>,
}

impl ClipPlaces {
    fn new(graph: &MotionGraph) -> Self {
        let mut edges = vec![Vec::new(); graph.clips().len()];
        for id in graph.edge_ids() {
            let edge = graph.edge(id);
            if edge.motion == EdgeMotion::Clip {
                let from = graph.node(edge.from);
                edges[from.clip.index()].push((from.frame, from.frame + edge.frames, id));
            }
        }
        edges.iter_mut().for_each(|list| list.sort_unstable());
        Self { edges }
    }

    /// Edge that plays a frame, and the position on it in frames.
    fn find(&self, clip: ClipId, frame: u32) -> Option<(EdgeId, u32)> {
        let list = &self.edges[clip.index()];
        let after = list.partition_point(|&(first, _, _)| first <= frame);
        let &(first, end, edge) = list.get(after.checked_sub(1)?)?;
        (frame < end).then_some((edge, frame - first))
    }
}

/// Frames that can be entered, sorted by evasion and frame.
fn targets(
    graph: &MotionGraph,
    evasions: &[Evasion],
    settings: &EntrySettings,
    places: &ClipPlaces,
) -> Vec<EntryTarget> {
    let mut settings = *settings;
    settings.target_step = settings.target_step.max(1);
    loop {
        let targets = targets_at_steps(graph, evasions, &settings, places);
        if targets.len() <= (settings.most_targets as usize).max(evasions.len()) {
            return targets;
        }
        settings.target_step += 1;
    }
}

fn targets_at_steps(
    graph: &MotionGraph,
    evasions: &[Evasion],
    settings: &EntrySettings,
    places: &ClipPlaces,
) -> Vec<EntryTarget> {
    let frames = |seconds: f32| (f64::from(seconds) * graph.frame_rate()).round() as u32;
    let mut targets = Vec::new();
    for (index, evasion) in evasions.iter().enumerate() {
        let edge = graph.edge(evasion.edge);
        let start = graph.node(edge.from);
        let last = start.frame + edge.frames.min(frames(settings.late));
        let mut frame = start.frame;
        // Where the lead-in is not in the graph, it cannot be played.
        let earliest = start.frame.saturating_sub(frames(settings.lead_in));
        let step = settings.target_step.max(1);
        while frame >= earliest + step && places.find(start.clip, frame - step).is_some() {
            frame -= step;
        }
        while frame < last && targets.len() < usize::from(u16::MAX) {
            if let Some((edge, edge_frame)) = places.find(start.clip, frame) {
                targets.push(EntryTarget {
                    evasion: index as u16,
                    frame,
                    edge,
                    edge_frame,
                });
            }
            frame += step;
        }
    }
    targets
}

/// A permutation of the numbers below `count` in which each prefix is spread evenly.
fn spread(count: usize) -> impl Iterator<Item = usize> {
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
    fn of(graph: &MotionGraph, clip: ClipId, frame: u32) -> Self {
        let (mut pose, mut joints) = (Pose::default(), Vec::new());
        graph.clip(clip).pose(frame as usize, &mut pose);
        forward_kinematics(graph.skeleton(), &pose, &mut joints);
        Self {
            hip: pose.root,
            head: joints[head(graph.skeleton()).index()].translation,
        }
    }
}

#[derive(Default)]
struct Scratch {
    motion: Motion,
    examiner: Examiner,
}

struct Finder<'a> {
    graph: &'a MotionGraph,
    limits: &'a MotionLimits,
    targets: &'a [EntryTarget],
    /// Maximum number of entries of a moment.
    most: usize,
    stances: Vec<Stance>,
    /// Hips and head of each target after the last of [`DEPARTURES`].
    points: Vec<Points>,
    places: &'a ClipPlaces,
}

impl Finder<'_> {
    /// Finds the entries of a frame of a clip.
    fn moment(&self, (clip, frame): (usize, u32), scratch: &mut Scratch) -> Vec<KnownEntry> {
        let (graph, clip) = (self.graph, ClipId(clip as u32));
        let Some((edge, edge_frame)) = self.places.find(clip, frame) else {
            return Vec::new();
        };
        // Its speed is that from the frame before, or to the next one.
        let before = Playhead {
            edge,
            frame: edge_frame as f32,
            clip_to_world: Rigid2::IDENTITY,
        };
        let legs = graph.feet().legs().len().min(Stance::LEGS);
        let now = frame + 1;
        let last = graph.clip(clip).frames() as u32 - 1;
        let stance = Stance::of_frame(graph, clip, now.min(last));
        let standing: Vec<bool> = (0..legs)
            .map(|leg| graph.feet().stands(clip, leg, now.min(last)))
            .collect();
        let ways = [frame, now.min(last)].map(|frame| Points::of(graph, clip, frame));
        let mut found = Vec::new();
        for target in spread(self.targets.len()) {
            if found.len() == self.most {
                break;
            }
            let at = &self.targets[target];
            // What goes on by itself is no entry.
            let ahead = i64::from(at.frame) - i64::from(now);
            if clip_of(graph, at) == clip && ahead.abs() <= 3 {
                continue;
            }
            let Some(pin) = self.pin((&stance, &standing), target) else {
                continue;
            };
            let align = stance.align(&self.stances[target], pin);
            if !self.goes_on(ways, target, align) {
                continue;
            }
            let mut entry = Entry {
                edge: at.edge,
                frame: at.edge_frame as f32,
                clip_to_world: align,
                rate: 1.0,
                blend: 0.0,
            };
            let mut plausible = |blend: usize, rate: usize| {
                (entry.blend, entry.rate) = (BLENDS[blend], RATES[rate]);
                self.is_plausible(before, &entry, (&standing, scratch))
            };
            let Some(blend) = (0..BLENDS.len()).find(|&blend| plausible(blend, 0)) else {
                continue;
            };
            let fastest = (1..RATES.len())
                .take_while(|&rate| plausible(blend, rate))
                .last();
            let how = (blend, pin, fastest.unwrap_or(0));
            found.push(KnownEntry::new(target as u16, how));
        }
        found.sort_unstable_by_key(|entry| entry.target);
        found
    }

    /// Whether hips and head go on well enough: after the longest blend the body is where the target's clip has it, so that no
    /// pose of the blend is needed to tell.
    fn goes_on(&self, [before, now]: [Points; 2], target: usize, align: Rigid2) -> bool {
        let last = DEPARTURES.len() - 1;
        let frames = (DEPARTURES[last] * self.graph.frame_rate() as f32).round();
        let then = self.points[target];
        let off = |before: Vec3, now: Vec3, then: Vec3| {
            align.point(then) - (now + (now - before) * frames)
        };
        let hip = off(before.hip, now.hip, then.hip).with_y(0.0).length();
        let head = off(before.head, now.head, then.head).length();
        hip <= self.limits.hip_departure[last] && head <= self.limits.head_departure[last]
    }

    /// What stays in place: of the feet that stand the one that leaves root and the other feet least far apart; `None` where all
    /// leave them too far.
    fn pin(&self, (stance, standing): (&Stance, &[bool]), target: usize) -> Option<Option<usize>> {
        let other = &self.stances[target];
        let standing_legs = (0..standing.len()).filter(|&leg| standing[leg]).map(Some);
        let none = (!standing.contains(&true)).then_some(None);
        let pins = standing_legs.chain(none);
        let costs = pins.filter_map(|pin| {
            let (root, feet) = stance.apart(other, stance.align(other, pin));
            let furthest = feet[..standing.len()].iter().copied().fold(0.0, f32::max);
            (root <= ROOT_APART && furthest <= FOOT_APART).then_some((root + 0.3 * furthest, pin))
        });
        let least = costs.min_by(|a, b| a.0.total_cmp(&b.0))?;
        Some(least.1)
    }

    fn is_plausible(
        &self,
        before: Playhead,
        entry: &Entry,
        (standing, scratch): (&[bool], &mut Scratch),
    ) -> bool {
        let graph = self.graph;
        let Scratch { motion, examiner } = scratch;
        let rate = graph.frame_rate() as f32;
        motion.restart(graph, before, []);
        motion.enter(graph, 1.0 / rate, entry);
        motion.extend(graph, 0.6);
        let blend = (entry.blend * rate).ceil() as usize;
        let looked_at = (&*motion, blend, standing);
        examiner.examine(graph, self.limits, looked_at).is_ok()
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
