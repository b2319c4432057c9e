//! Chooses the links that let more moments reach an evasion, closest links first.

use super::candidates::{Candidate, Side};
use super::report::GoalReport;
use super::search::LinkSearch;
use super::settings::LinkGoal;
use crate::anim::EventKind;
use crate::graph::waits::{Waits, within};

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
    let mut candidates = search.candidates.find(&evasions, Side::Before, None);
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
        for (index, goal) in goals.iter().enumerate() {
            candidates.retain(|candidate| {
                let enough =
                    progress.share(index) >= goal.share || search.links.len() >= search.most();
                let helps =
                    !enough && progress.gain(search, index, candidate) >= progress.least_gain;
                if helps && !search.darts(&candidate.link) {
                    progress.take(search, candidate);
                    search.take(candidate.link);
                }
                !helps
            });
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
}

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
            counted,
            least_gain: ((search.settings.least_gain * frame_rate).round() as usize).max(1),
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

    fn take(&mut self, search: &LinkSearch<'_>, candidate: &Candidate) {
        let (goals, counted) = (&mut self.goals, &self.counted);
        let jump = search.moments.jump(&candidate.link);
        self.waits.add_jump(jump, |moment, old, new| {
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
