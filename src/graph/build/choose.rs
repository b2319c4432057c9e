//! Chooses the links that let more moments reach an evasion, closest links first.

use crate::anim::EventKind;
use crate::graph::build::candidates::{Candidate, Side};
use crate::graph::build::join::LinkSearch;
use crate::graph::build::moments::Jump;
use crate::graph::build::report::GoalReport;
use crate::graph::build::waits::{WaitChange, Waits, within};
use crate::graph::search::transition::Transition;
use crate::graph::settings::LinkGoal;
use crate::graph::watch::{BakeStage, Stopped};
use crate::math::in_parallel;
use std::ops::RangeInclusive;

/// Number of passes over the goals. Later passes include moments that earlier links added to the
/// graph.
const ROUNDS: usize = 3;

/// Adds links for one goal after another, until each goal is reached or no link helps.
pub(crate) fn choose(search: &mut LinkSearch<'_>) -> Result<Vec<GoalReport>, Stopped> {
    let evasions: Vec<usize> = (0..search.source().events.len())
        .filter(|&index| {
            let event = &search.source().events[index];
            event.kind == EventKind::Evasion && event.first < event.last
        })
        .collect();
    let candidates;
    {
        let _span = tracing::trace_span!("bake: find links").entered();
        candidates = search.candidates.find(&evasions, Side::Before, None)?;
        search.candidates.forget_windows();
    }
    let goals = search.settings.goals.clone();
    let mut before = Vec::new();
    let mut progress = GoalProgress::new(search, &evasions, &candidates);
    for round in 0..ROUNDS {
        let Some(progress) = &mut progress else {
            break;
        };
        if before.is_empty() {
            before = (0..goals.len()).map(|goal| progress.share(goal)).collect();
        }
        let links = search.links.len();
        for goal in 0..goals.len() {
            // Most links are taken in the first round.
            if round == 0 {
                progress.forget_waits_beyond(goal);
            }
            progress.take_for(goal, search)?;
        }
        if search.links.len() == links {
            break;
        }
        if round == 0 {
            progress.find_waits(search);
        }
        progress.count(search);
    }
    let reports = goals.iter().enumerate();
    let reports = reports.map(|(index, goal)| GoalReport {
        goal: *goal,
        before: before.get(index).copied().unwrap_or(0.0),
        reached: progress
            .as_ref()
            .map_or(0.0, |progress| progress.share(index)),
    });
    Ok(reports.collect())
}

/// A possible link, in the order of their costs.
struct Offer {
    link: Transition,
    jump: Jump,
    /// Index of the evasion that it leads to.
    evasion: u32,
    /// First moment of the clip that it leaves.
    clip_start: u32,
    /// Whether the link leads to the first frame of a clip.
    is_to_start: bool,
}

impl Offer {
    /// Offers of the candidates that lead to an evasion.
    fn all(search: &LinkSearch<'_>, evasions: &[usize], candidates: &[Candidate]) -> Vec<Self> {
        let offer = |candidate: &Candidate| {
            let link = candidate.link;
            Some(Self {
                jump: search.moments().jump(&link),
                evasion: evasions.binary_search(&candidate.event).ok()? as u32,
                clip_start: search.moments().of_clip(link.source_clip).start as u32,
                is_to_start: link.target_frame == 0,
                link,
            })
        };
        candidates.iter().filter_map(offer).collect()
    }
}

/// Progress of the goals, by moment.
struct GoalProgress {
    /// All possible links, closest first.
    offers: Vec<Offer>,
    /// Indices of those that were not taken.
    left: Vec<u32>,
    waits: Waits,
    /// Moments at which the evasions start.
    starts: Vec<u32>,
    /// Moments of the graph that have a next frame in their clip.
    counted: Vec<bool>,
    all: usize,
    least_gain: usize,
    goals: Vec<GoalState>,
    changed: Changed,
}

/// Number of moments that are marked as changed together.
const BLOCK: usize = 64;

/// Blocks of [`BLOCK`] moments in which something has changed since the last [`Changed::clear`].
#[derive(Default)]
struct Changed {
    blocks: usize,
    /// Waits for each evasion, `[evasion][block]`.
    waits: Vec<bool>,
    /// Number of evasions that a goal counts.
    counts: Vec<bool>,
}

impl Changed {
    fn new(moments: usize, evasions: usize) -> Self {
        let blocks = moments / BLOCK + 1;
        Self {
            blocks,
            waits: vec![false; blocks * evasions],
            counts: vec![false; blocks],
        }
    }

    fn clear(&mut self) {
        self.waits.fill(false);
        self.counts.fill(false);
    }

    /// Marks the wait of a moment for an evasion.
    fn mark(&mut self, evasion: usize, moment: u32) {
        self.waits[evasion * self.blocks + moment as usize / BLOCK] = true;
    }

    fn has(&self, evasion: usize, moments: RangeInclusive<u32>) -> bool {
        let first = evasion * self.blocks;
        let blocks = *moments.start() as usize / BLOCK..=*moments.end() as usize / BLOCK;
        blocks.into_iter().any(|block| self.waits[first + block])
    }

    fn has_counts(&self, moments: RangeInclusive<u32>) -> bool {
        let blocks = *moments.start() as usize / BLOCK..=*moments.end() as usize / BLOCK;
        self.counts[blocks].contains(&true)
    }
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
    fn new(search: &LinkSearch<'_>, evasions: &[usize], candidates: &[Candidate]) -> Option<Self> {
        if evasions.is_empty() {
            return None;
        }
        let counted = counted(search)?;
        let frame_rate = search.source().settings.frame_rate;
        let goals: Vec<GoalState> = search
            .settings
            .goals
            .iter()
            .map(|&goal| GoalState {
                goal,
                limit: within(goal.seconds, frame_rate),
                evasions: Vec::new(),
                met: 0,
            })
            .collect();
        let horizon = goals.iter().map(|goal| goal.limit).max().unwrap_or(0);
        let offers = Offer::all(search, evasions, candidates);
        let start = |&event: &usize| search.ends(&search.source().events[event])[0];
        let mut progress = Self {
            left: (0..offers.len() as u32).collect(),
            offers,
            waits: Waits::new(search.moments(), &search.jumps, horizon),
            starts: evasions.iter().map(start).collect(),
            all: 0,
            least_gain: ((search.settings.least_gain * frame_rate).round() as usize).max(1),
            changed: Changed::new(counted.len(), evasions.len()),
            counted,
            goals,
        };
        progress.find_waits(search);
        progress.count(search);
        Some(progress)
    }

    /// Computes all waits.
    fn find_waits(&mut self, search: &LinkSearch<'_>) {
        let threads = search.source().settings.threads;
        self.waits.set_goals(&self.starts, threads);
    }

    /// Keeps only those waits up to date that matter to a goal or to a later one.
    fn forget_waits_beyond(&mut self, goal: usize) {
        let limits = self.goals[goal..].iter().map(|goal| goal.limit);
        self.waits.forget_beyond(limits.max().unwrap_or(0));
    }

    /// Counts anew after links have been added. The waits are known.
    fn count(&mut self, search: &LinkSearch<'_>) {
        if let Some(counted) = counted(search) {
            self.counted = counted;
        }
        let counted = &self.counted;
        self.all = counted.iter().filter(|&&counted| counted).count();
        for goal in &mut self.goals {
            let threads = search.source().settings.threads;
            let below = self.waits.counts_below(goal.limit, threads);
            let reached = |moment: usize| match counted[moment] {
                true => below[moment + 1],
                false => 0,
            };
            goal.evasions = (0..counted.len()).map(reached).collect();
            let wanted = goal.goal.evasions;
            let met = counted.iter().zip(&goal.evasions);
            let met =
                met.filter(|(counted, reached)| **counted && usize::from(**reached) >= wanted);
            goal.met = met.count();
        }
    }

    /// Share of the counted moments that meet a goal.
    fn share(&self, goal: usize) -> f64 {
        self.goals[goal].met as f64 / self.all.max(1) as f64
    }

    /// Whether a candidate that helped, or did not, may do otherwise now, since [`GoalProgress::changed`] was cleared.
    ///
    /// A gain grows only where the wait behind the link falls: waits before it that fall, and more evasions there, leave less to gain.
    fn may_differ(&self, goal: usize, helped: bool, offer: &Offer) -> bool {
        let (evasion, jump) = (offer.evasion as usize, offer.jump);
        let first = jump.from.saturating_sub(self.goals[goal].limit);
        // The first frame of a clip follows no other, and its changes are not reported.
        offer.is_to_start
            || self.changed.has(evasion, jump.to..=jump.to)
            || helped
                && (self.changed.has(evasion, first..=jump.from)
                    || self.changed.has_counts(first..=jump.from))
    }

    /// Number of moments before a link that do not meet the goal and would reach the link's evasion
    /// in time.
    fn gain(&self, goal: usize, offer: &Offer) -> usize {
        let (goal, evasion, jump) = (&self.goals[goal], offer.evasion as usize, offer.jump);
        let after_link = self.waits.of(evasion, jump.to).saturating_add(jump.frames);
        let lacks = |moment: usize| {
            self.counted[moment]
                && usize::from(goal.evasions[moment]) < goal.goal.evasions
                && self.waits.of(evasion, moment as u32 + 1) >= goal.limit
        };
        // Walk back from the link to the first moment that is too early.
        (offer.clip_start as usize..jump.from as usize)
            .rev()
            .zip(after_link.saturating_add(1)..=goal.limit)
            .filter(|&(moment, _)| lacks(moment))
            .count()
    }

    /// Takes the links that help with a goal, one after the other, until it is reached.
    fn take_for(&mut self, goal: usize, search: &mut LinkSearch<'_>) -> Result<(), Stopped> {
        /// Number of links that are tested together, before those ahead of them are taken.
        const BATCH: usize = 4096;
        let share = self.goals[goal].goal.share;
        let offered = std::mem::take(&mut self.left);
        self.left.reserve(offered.len());
        let (watch, all) = (search.source().watch, offered.len() as u64);
        let stage = watch.stage(BakeStage::Choice, search.source().settings.threads);
        for (number, batch) in (0..).zip(offered.chunks(BATCH)) {
            watch.check()?;
            stage.progress(number * BATCH as u64, all);
            let is_reached = |progress: &Self, search: &LinkSearch<'_>| {
                progress.share(goal) >= share || search.links.len() >= search.most
            };
            if is_reached(self, search) {
                self.left.extend_from_slice(batch);
                continue;
            }
            // Most of those that help now will help when it is their turn.
            let helps_now = in_parallel(search.source().settings.threads, batch.len(), |index| {
                self.gain(goal, &self.offers[batch[index] as usize]) >= self.least_gain
            });
            let tested = batch.iter().zip(&helps_now).filter(|(_, helps)| **helps);
            self.changed.clear();
            let links: Vec<Transition> = tested
                .map(|(&index, _)| self.offers[index as usize].link)
                .collect();
            let mut darts = search.darts(&links).into_iter();
            for (&index, helped) in batch.iter().zip(helps_now) {
                let offer = &self.offers[index as usize];
                let known = if helped { darts.next() } else { None };
                let helps = match self.may_differ(goal, helped, offer) {
                    true => self.gain(goal, offer) >= self.least_gain,
                    false => helped,
                };
                if !helps || is_reached(self, search) {
                    self.left.push(index);
                    continue;
                }
                let (link, jump) = (offer.link, offer.jump);
                let darts = known.unwrap_or_else(|| search.darts(&[link])[0]);
                search.darting += usize::from(darts);
                if !darts {
                    self.take(jump);
                    search.take(link);
                }
            }
        }
        Ok(())
    }

    fn take(&mut self, jump: Jump) {
        let (goals, counted, changed) = (&mut self.goals, &self.counted, &mut self.changed);
        self.waits.add_jump(jump, |change| {
            changed.mark(change.evasion, change.moment);
            if let Some(before) = record(goals, counted, change) {
                changed.counts[before / BLOCK] = true;
            }
        });
    }
}

/// The moments of the graph that have a next frame in their clip.
fn counted(search: &LinkSearch<'_>) -> Option<Vec<bool>> {
    let mut counted = search.moments().component(&search.jumps)?;
    for (moment, goes_on) in search.moments().goes_on().into_iter().enumerate() {
        counted[moment] &= goes_on && counted[moment + 1];
    }
    Some(counted)
}

/// Updates the goals after a wait at a moment fell. The moment before it in the clip waits one frame longer: it is returned if a goal
/// counts one evasion more there.
fn record(goals: &mut [GoalState], counted: &[bool], change: WaitChange) -> Option<usize> {
    let WaitChange { old, new, .. } = change;
    let before = (change.moment as usize)
        .checked_sub(1)
        .filter(|&before| counted[before])?;
    let mut changed = None;
    for goal in goals {
        if new < goal.limit && old >= goal.limit {
            goal.evasions[before] += 1;
            changed = Some(before);
            if usize::from(goal.evasions[before]) == goal.goal.evasions {
                goal.met += 1;
            }
        }
    }
    changed
}
