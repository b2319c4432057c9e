//! Chooses the links that let more moments reach an evasion, closest links first.

use super::candidates::Candidate;
use super::report::GoalReport;
use super::search::LinkSearch;
use super::settings::LinkGoal;
use crate::anim::EventKind;
use crate::graph::Transition;
use crate::graph::waits::{Waits, within};
use crate::math::in_parallel;

/// Number of passes over the goals. Later passes include moments that earlier links added to the
/// graph.
const ROUNDS: usize = 3;

/// Adds links for one goal after another, until each goal is reached or no link helps.
pub(super) fn choose(search: &mut LinkSearch<'_>) -> Vec<GoalReport> {
    let evasions: Vec<usize> = (0..search.source.events.len())
        .filter(|&index| {
            let event = &search.source.events[index];
            event.kind == EventKind::Evasion && event.first < event.last
        })
        .collect();
    let mut candidates;
    {
        let _span = tracing::trace_span!("bake: find links").entered();
        (candidates, search.record) = search.candidates.find_known(&evasions, search.known);
    }
    let goals = search.settings.goals.clone();
    let mut before = Vec::new();
    for _ in 0..ROUNDS {
        let Some(mut progress) = GoalProgress::new(search, &evasions) else {
            break;
        };
        if before.is_empty() {
            before = (0..goals.len()).map(|goal| progress.share(goal)).collect();
        }
        let links = search.links.len();
        for goal in 0..goals.len() {
            candidates = progress.take_for(goal, search, candidates);
        }
        if search.links.len() == links {
            break;
        }
    }
    let after = GoalProgress::new(search, &evasions);
    goals
        .iter()
        .enumerate()
        .map(|(index, goal)| GoalReport {
            goal: *goal,
            before: before.get(index).copied().unwrap_or(0.0),
            reached: after.as_ref().map_or(0.0, |progress| progress.share(index)),
        })
        .collect()
}

/// Progress of the goals, by moment.
struct GoalProgress {
    waits: Waits,
    /// Indices of the events that are evasions, in the order of `waits`.
    evasions: Vec<usize>,
    /// Moments of the graph that have a next frame in their clip.
    counted: Vec<bool>,
    all: usize,
    least_gain: usize,
    goals: Vec<GoalState>,
    /// For each [`BLOCK`] moments, whether the gain of a link may have changed that reads them.
    changed: Vec<bool>,
}

/// Number of moments that are marked as changed together.
const BLOCK: usize = 64;

struct GoalState {
    goal: LinkGoal,
    /// Time limit of the goal, in frames.
    limit: u32,
    /// For each moment, the number of evasions that can start within the limit.
    evasions: Vec<u16>,
    /// Number of counted moments that reach the wanted number of evasions.
    met: usize,
}

impl GoalProgress {
    /// Returns `None` if there is no graph or no evasion.
    fn new(search: &LinkSearch<'_>, evasions: &[usize]) -> Option<Self> {
        if evasions.is_empty() {
            return None;
        }
        let mut counted = search.moments.component(&search.jumps)?;
        for (moment, goes_on) in search.moments.goes_on().into_iter().enumerate() {
            counted[moment] &= goes_on && counted[moment + 1];
        }
        let frame_rate = search.source.settings.frame_rate;
        let goals: Vec<GoalState> = search
            .settings
            .goals
            .iter()
            .map(|&goal| GoalState {
                goal,
                limit: within(goal.seconds, frame_rate),
                evasions: vec![0; counted.len()],
                met: 0,
            })
            .collect();
        let horizon = goals.iter().map(|goal| goal.limit).max().unwrap_or(0);
        let mut progress = Self {
            waits: Waits::new(&search.moments, &search.jumps, horizon),
            evasions: evasions.to_vec(),
            all: counted.iter().filter(|&&counted| counted).count(),
            least_gain: ((search.settings.least_gain * frame_rate).round() as usize).max(1),
            changed: vec![false; counted.len() / BLOCK + 1],
            counted,
            goals,
        };
        for goal in &mut progress.goals {
            goal.met = if goal.goal.evasions == 0 {
                progress.all
            } else {
                0
            };
        }
        for &event in evasions {
            let [start, _] = search.ends(&search.source.events[event]);
            let (goals, counted) = (&mut progress.goals, &progress.counted);
            progress.waits.add_goal(start, |moment, old, new| {
                record(goals, counted, WaitChange { moment, old, new });
            });
        }
        Some(progress)
    }

    /// Share of the counted moments that meet a goal.
    fn share(&self, goal: usize) -> f64 {
        self.goals[goal].met as f64 / self.all.max(1) as f64
    }

    /// Whether the gain of a candidate may have changed since [`GoalProgress::changed`] was cleared.
    fn may_differ(&self, search: &LinkSearch<'_>, goal: usize, candidate: &Candidate) -> bool {
        let jump = search.moments.jump(&candidate.link);
        let first = jump.from.saturating_sub(self.goals[goal].limit);
        let before = first as usize / BLOCK..=jump.from as usize / BLOCK;
        // The first frame of a clip follows no other, and its changes are not reported.
        candidate.link.target_frame == 0
            || self.changed[jump.to as usize / BLOCK]
            || self.changed[before].contains(&true)
    }

    /// Number of moments before a link that do not meet the goal and would reach the link's evasion
    /// in time.
    fn gain(&self, search: &LinkSearch<'_>, goal: usize, candidate: &Candidate) -> usize {
        let Some(evasion) = self.position(candidate.event) else {
            return 0;
        };
        let goal = &self.goals[goal];
        let jump = search.moments.jump(&candidate.link);
        let after_link = self.waits.of(evasion, jump.to).saturating_add(jump.frames);
        let before = search.moments.of_clip(candidate.link.source_clip).start;
        let lacks = |moment: usize| {
            self.counted[moment]
                && usize::from(goal.evasions[moment]) < goal.goal.evasions
                && self.waits.of(evasion, moment as u32 + 1) >= goal.limit
        };
        // Walk back from the link to the first moment that is too early.
        (before..jump.from as usize)
            .rev()
            .zip(after_link + 1..=goal.limit)
            .filter(|&(moment, _)| lacks(moment))
            .count()
    }

    /// Takes the candidates that help with a goal, one after the other, until it is reached, and returns those that do not.
    fn take_for(
        &mut self,
        goal: usize,
        search: &mut LinkSearch<'_>,
        candidates: Vec<Candidate>,
    ) -> Vec<Candidate> {
        /// Number of candidates that are tested together, before those ahead of them are taken.
        const BATCH: usize = 4096;
        let share = self.goals[goal].goal.share;
        let mut left = Vec::with_capacity(candidates.len());
        for batch in candidates.chunks(BATCH) {
            let is_reached = |progress: &Self, search: &LinkSearch<'_>| {
                progress.share(goal) >= share || search.links.len() >= search.most()
            };
            if is_reached(self, search) {
                left.extend_from_slice(batch);
                continue;
            }
            // Most of those that help now will help when it is their turn.
            let helps_now = in_parallel(search.source.settings.threads, batch.len(), |index| {
                self.gain(search, goal, &batch[index]) >= self.least_gain
            });
            let tested = batch.iter().zip(&helps_now).filter(|(_, helps)| **helps);
            self.changed.fill(false);
            let links: Vec<Transition> = tested.map(|(candidate, _)| candidate.link).collect();
            let mut darts = search.darts(&links).into_iter();
            for (candidate, helped) in batch.iter().zip(helps_now) {
                let known = if helped { darts.next() } else { None };
                let gains = || self.gain(search, goal, candidate) >= self.least_gain;
                let helps = match self.may_differ(search, goal, candidate) {
                    true => gains(),
                    false => helped,
                };
                if !helps || is_reached(self, search) {
                    left.push(*candidate);
                    continue;
                }
                let darts = known.unwrap_or_else(|| search.darts(&[candidate.link])[0]);
                search.darting += usize::from(darts);
                if !darts {
                    self.take(search, candidate);
                    search.take(candidate.link);
                }
            }
        }
        left
    }

    fn take(&mut self, search: &LinkSearch<'_>, candidate: &Candidate) {
        let (goals, counted, changed) = (&mut self.goals, &self.counted, &mut self.changed);
        let jump = search.moments.jump(&candidate.link);
        self.waits.add_jump(jump, |moment, old, new| {
            changed[moment as usize / BLOCK] = true;
            changed[(moment as usize).saturating_sub(1) / BLOCK] = true;
            record(goals, counted, WaitChange { moment, old, new });
        });
    }

    fn position(&self, event: usize) -> Option<usize> {
        self.evasions.binary_search(&event).ok()
    }
}

/// A change of the wait for an evasion at a moment, in frames.
#[derive(Clone, Copy)]
struct WaitChange {
    moment: u32,
    old: u32,
    new: u32,
}

/// Updates the goals after the wait for an evasion at `moment` fell from `old` to `new` frames. The
/// moment before it in the clip waits one frame longer.
fn record(goals: &mut [GoalState], counted: &[bool], change: WaitChange) {
    let WaitChange { moment, old, new } = change;
    let Some(before) = (moment as usize).checked_sub(1).filter(|&b| counted[b]) else {
        return;
    };
    for goal in goals {
        if new < goal.limit && old >= goal.limit {
            goal.evasions[before] += 1;
            if usize::from(goal.evasions[before]) == goal.goal.evasions {
                goal.met += 1;
            }
        }
    }
}
