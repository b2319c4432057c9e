//! Which links bring evasions near to the moments that lack them, the closest links first.

use super::candidates::{Candidate, Side};
use super::{GoalReport, LinkGoal, Work};
use crate::anim::EventKind;
use crate::graph::waits::{Waits, within};

/// How often goals are gone through again with the moments that links have won for the graph.
const ROUNDS: usize = 3;

/// Takes links, goal after goal, until each is reached or nothing helps it.
pub(super) fn choose(work: &mut Work<'_>) -> Vec<GoalReport> {
    let evasions: Vec<usize> = (0..work.source.events.len())
        .filter(|&index| {
            let event = &work.source.events[index];
            event.kind == EventKind::Evasion && event.first < event.last
        })
        .collect();
    let mut candidates = work.candidates.find(&evasions, Side::Before, None);
    let goals = work.settings.goals.clone();
    let mut before = Vec::new();
    for _ in 0..ROUNDS {
        let Some(mut need) = Need::new(work, &evasions) else {
            break;
        };
        if before.is_empty() {
            before = (0..goals.len()).map(|goal| need.share(goal)).collect();
        }
        let links = work.links.len();
        for (index, goal) in goals.iter().enumerate() {
            candidates.retain(|candidate| {
                let enough = need.share(index) >= goal.share || work.links.len() >= work.most();
                let taken = !enough && need.gain(work, index, candidate) >= need.least_gain;
                if taken {
                    need.take(work, candidate);
                    work.take(candidate.link);
                }
                !taken
            });
        }
        if work.links.len() == links {
            break;
        }
    }
    let after = Need::new(work, &evasions);
    goals
        .iter()
        .enumerate()
        .map(|(index, goal)| GoalReport {
            goal: *goal,
            before: before.get(index).copied().unwrap_or(0.0),
            reached: after.as_ref().map_or(0.0, |need| need.share(index)),
        })
        .collect()
}

/// Which moments lack what.
struct Need {
    waits: Waits,
    /// The events that are evasions, in the order of `waits`.
    evasions: Vec<usize>,
    /// Moments of the graph from which their clip goes on.
    counted: Vec<bool>,
    all: usize,
    least_gain: usize,
    goals: Vec<GoalState>,
}

struct GoalState {
    goal: LinkGoal,
    /// The goal's time in frames.
    limit: u32,
    /// For each moment the evasions that can start within that time.
    evasions: Vec<u16>,
    /// How many counted moments reach as many as are wanted.
    met: usize,
}

impl Need {
    /// `None` where there is no graph or no evasion.
    fn new(work: &Work<'_>, evasions: &[usize]) -> Option<Self> {
        if evasions.is_empty() {
            return None;
        }
        let mut counted = work.moments.component(&work.jumps)?;
        for (moment, goes_on) in work.moments.goes_on().into_iter().enumerate() {
            counted[moment] &= goes_on && counted[moment + 1];
        }
        let frame_rate = work.source.settings.frame_rate;
        let goals: Vec<GoalState> = work
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
        let mut need = Self {
            waits: Waits::new(&work.moments, &work.jumps, horizon),
            evasions: evasions.to_vec(),
            all: counted.iter().filter(|&&counted| counted).count(),
            counted,
            least_gain: ((work.settings.least_gain * frame_rate).round() as usize).max(1),
            goals,
        };
        for goal in &mut need.goals {
            goal.met = if goal.goal.evasions == 0 { need.all } else { 0 };
        }
        for &event in evasions {
            let [start, _] = work.ends(&work.source.events[event]);
            let (goals, counted) = (&mut need.goals, &need.counted);
            need.waits.add_goal(start, |moment, old, new| {
                note(goals, counted, (moment, old, new));
            });
        }
        Some(need)
    }

    /// Share of the counted moments for which a goal is met.
    fn share(&self, goal: usize) -> f64 {
        self.goals[goal].met as f64 / self.all.max(1) as f64
    }

    /// How many moments that lack it on the way to a link would come to reach its evasion in time.
    fn gain(&self, work: &Work<'_>, goal: usize, candidate: &Candidate) -> usize {
        let Some(evasion) = self.position(candidate.event) else {
            return 0;
        };
        let goal = &self.goals[goal];
        let jump = work.moments.jump(&candidate.link);
        let after_link = self.waits.of(evasion, jump.to).saturating_add(jump.frames);
        let before = work.moments.of_clip(candidate.link.source_clip).start;
        let lacks = |moment: usize| {
            self.counted[moment]
                && usize::from(goal.evasions[moment]) < goal.goal.evasions
                && self.waits.of(evasion, moment as u32 + 1) >= goal.limit
        };
        // From the link back to the first moment from which it is too far.
        (before..jump.from as usize)
            .rev()
            .zip(after_link + 1..=goal.limit)
            .filter(|&(moment, _)| lacks(moment))
            .count()
    }

    fn take(&mut self, work: &Work<'_>, candidate: &Candidate) {
        let (goals, counted) = (&mut self.goals, &self.counted);
        let jump = work.moments.jump(&candidate.link);
        self.waits.add_jump(jump, |moment, old, new| {
            note(goals, counted, (moment, old, new));
        });
    }

    fn position(&self, event: usize) -> Option<usize> {
        self.evasions.binary_search(&event).ok()
    }
}

/// Keeps the goals' counts: at `moment` the wait for some evasion fell from `old` to `new` frames.
/// The moment before it, whose next step leads there, waits one frame longer.
fn note(goals: &mut [GoalState], counted: &[bool], (moment, old, new): (u32, u32, u32)) {
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
