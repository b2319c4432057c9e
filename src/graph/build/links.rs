//! Links: additional transitions from and to events, with looser thresholds and adapted lengths.
//! They are added until enough moments of the graph reach an evasion soon.
//!
//! Source: the idea that interesting motion attracts transitions is from Lee & Lee (2004), who use
//! precomputed probabilities. The method here is our own. First, every event that the graph would
//! drop gets its best link in and its best link out ([`join`]). Then, for one goal after another,
//! the closest link is added that brings evasions within reach of moments that lack them.
//!
//! Architecture invariant: a link is an ordinary [`Transition`]. Code that reads a graph does not
//! know which transitions are links.

use crate::anim::{Clip, EventKind};
use crate::graph::build::candidates::{Candidate, LinkSpace, Side};
use crate::graph::build::input::GraphBuilder;
use crate::graph::build::moments::{Jump, Moments};
use crate::graph::build::nearest::Candidates;
use crate::graph::build::report::{GoalReport, LinkObstacle, LinkReport, UnlinkedEvent};
use crate::graph::build::transition_test::TransitionTest;
use crate::graph::build::waits::{WaitChange, Waits, whole_frames};
use crate::graph::search::transition::Transition;
use crate::graph::settings::{LinkGoal, LinkSettings};
use crate::graph::watch::{BakeStage, Stopped};
use crate::math::in_parallel;

/// Adds links to the transitions of a graph, and returns what was added. It does nothing if the settings disable links. Links that a body
/// cannot do are avoided; without a test, none are.
pub(crate) fn add(
    input: &GraphBuilder<'_>,
    transitions: &mut Vec<Transition>,
    test: &mut Option<TransitionTest>,
) -> Result<LinkReport, Stopped> {
    let Some(settings) = &input.settings.links else {
        return Ok(LinkReport::default());
    };
    let candidates = Candidates::new(LinkSpace::new(input, settings));
    let moments = &candidates.space.moments;
    let mut search = LinkSearch {
        jumps: transitions.iter().map(|t| moments.jump(t)).collect(),
        candidates,
        links: Vec::new(),
        test,
        impossible: 0,
    };
    let unlinked = {
        let _span = tracing::trace_span!("bake: join events").entered();
        join(&mut search)?
    };
    let joins = search.links.len();
    let goals = {
        let _span = tracing::trace_span!("bake: choose links").entered();
        choose(&mut search, settings)?
    };
    let longest = search.links.iter().map(|t| t.frames).max().unwrap_or(0);
    let report = LinkReport {
        joins,
        links: search.links.len(),
        impossible: search.impossible,
        loosest: search.links.iter().map(|t| t.distance).fold(0.0, f32::max),
        longest: longest as f64 / input.settings.frame_rate,
        goals,
        unlinked,
    };
    transitions.append(&mut search.links);
    Ok(report)
}

// Links events that the graph would otherwise drop.

/// The links so far, and the search for more.
struct LinkSearch<'a> {
    candidates: Candidates<'a>,
    /// All transitions and links so far.
    jumps: Vec<Jump>,
    links: Vec<Transition>,
    test: &'a mut Option<TransitionTest>,
    /// Number of links that were not taken because a body cannot do them.
    impossible: usize,
}

impl LinkSearch<'_> {
    fn moments(&self) -> &Moments {
        &self.candidates.space.moments
    }

    fn take(&mut self, link: Transition) {
        let jump = self.moments().jump(&link);
        self.jumps.push(jump);
        self.links.push(link);
    }

    fn test_links(&mut self, links: &[Transition]) -> Vec<bool> {
        match &mut self.test {
            Some(test) => test.impossible(self.candidates.space.input, links),
            None => vec![false; links.len()],
        }
    }
}

/// Links events to the graph's largest component until no further event can be linked. Returns the
/// events that could not be linked.
fn join(search: &mut LinkSearch<'_>) -> Result<Vec<UnlinkedEvent>, Stopped> {
    let events = &search.candidates.space.events;
    let playable = |index: &usize| events[*index].first < events[*index].last;
    let mut open: Vec<usize> = (0..events.len()).filter(playable).collect();
    loop {
        let before = search.links.len();
        match search.moments().component(&search.jumps) {
            None => first_cycle(search, &open)?,
            Some(core) => {
                let space = &search.candidates.space;
                open.retain(|&event| {
                    let [first, last] = space.moments.ends(&space.events[event]);
                    !(core[first as usize] && core[last as usize])
                });
                let links_in = closest(search, &open, Side::Before, &core)?;
                let links_out = closest(search, &open, Side::After, &core)?;
                for ends in links_in.into_iter().zip(links_out) {
                    if let (Some(link_in), Some(link_out)) = ends {
                        search.take(link_in.link);
                        search.take(link_out.link);
                    }
                }
            }
        }
        if search.links.len() == before {
            return Ok(unlinked(search, &open));
        }
    }
}

/// If the graph has no cycle, adds the closest link from after an event back to before it.
fn first_cycle(search: &mut LinkSearch<'_>, open: &[usize]) -> Result<(), Stopped> {
    let mut loops: Vec<Candidate> = Vec::new();
    for &index in open {
        let event = &search.candidates.space.events[index];
        let [first, _] = search.moments().ends(event);
        let start = search.moments().of_clip(event.clip.index()).start;
        let mut allowed = vec![false; search.moments().len()];
        allowed[start..=first as usize].fill(true);
        let candidates = &mut search.candidates;
        let found = candidates.find(&[index], Side::After, Some(&allowed))?;
        loops.extend(found.first());
    }
    let best = loops.iter().min_by(|a, b| a.cost.total_cmp(&b.cost));
    if let Some(best) = best {
        search.take(best.link);
    }
    Ok(())
}

/// The closest link of each event on one side that a body can do, or the closest link if it can do none of them: that
/// is better than losing the event. Only moments that `allowed` contains are linked.
fn closest(
    search: &mut LinkSearch<'_>,
    events: &[usize],
    side: Side,
    allowed: &[bool],
) -> Result<Vec<Option<Candidate>>, Stopped> {
    let mut tested = vec![TestedLinks::default(); events.len()];
    let mut open: Vec<usize> = (0..events.len()).collect();
    let mut most = 16;
    while !open.is_empty() {
        let own: Vec<usize> = open.iter().map(|&index| events[index]).collect();
        let found = search.candidates.nearest(&own, side, allowed, most)?;
        let mut found = found.iter();
        open.retain(|&index| {
            let links = found.next().map_or(&[][..], Vec::as_slice);
            tested[index].test(search, links);
            tested[index].found.is_none() && links.len() == most
        });
        most *= 4;
    }
    let found = tested
        .into_iter()
        .map(|links| links.found.or(links.impossible));
    Ok(found.collect())
}

/// The links of one event that have been tested.
#[derive(Clone, Default)]
struct TestedLinks {
    tested: usize,
    /// The closest link that a body cannot do.
    impossible: Option<Candidate>,
    /// The closest link that it can do.
    found: Option<Candidate>,
}

impl TestedLinks {
    /// Tests links, closest first. Those that were tested before are skipped.
    fn test(&mut self, search: &mut LinkSearch<'_>, links: &[Candidate]) {
        for link in links.iter().skip(self.tested) {
            self.tested += 1;
            let Some(link) = search.candidates.space.refined(*link) else {
                continue;
            };
            if !search.test_links(&[link.link])[0] {
                self.found = Some(link);
                return;
            }
            search.impossible += 1;
            self.impossible.get_or_insert(link);
        }
    }
}

fn unlinked(search: &LinkSearch<'_>, open: &[usize]) -> Vec<UnlinkedEvent> {
    let space = &search.candidates.space;
    let (input, lengths) = (space.input, space.lengths);
    let seconds = |frames: usize| frames as f64 / input.settings.frame_rate;
    let shortest = seconds(lengths.shortest);
    let why = |event: usize| {
        let free = |side| space.free_frames(event, side);
        let (before, after) = (free(Side::Before), free(Side::After));
        if before < lengths.shortest {
            LinkObstacle::NoLeadIn {
                seconds: seconds(before),
                shortest,
            }
        } else if after < lengths.shortest {
            LinkObstacle::NoTail {
                seconds: seconds(after),
                shortest,
            }
        } else {
            LinkObstacle::NothingNear {
                loosest: lengths.loosest,
            }
        }
    };
    let events = space.events.iter().enumerate();
    events
        .filter_map(|(event, found)| {
            let obstacle = if found.first == found.last {
                LinkObstacle::TooShort
            } else {
                open.contains(&event).then(|| why(event))?
            };
            Some(UnlinkedEvent {
                event: found.describe(&input.clips, &input.leads, input.settings.frame_rate),
                obstacle,
            })
        })
        .collect()
}

// Links that bring evasions within reach.

/// Number of passes over the goals. Later passes include moments that earlier links added to the
/// graph.
const ROUNDS: usize = 3;

/// Minimum duration of the moments that a goal's link must help, in seconds.
const LEAST_GAIN: f64 = 1.0 / 30.0;

/// Adds links for one goal after another, until each goal is reached or no link helps.
fn choose(
    search: &mut LinkSearch<'_>,
    settings: &LinkSettings,
) -> Result<Vec<GoalReport>, Stopped> {
    let events = search.candidates.space.events.iter().enumerate();
    let evasions: Vec<usize> = events
        .filter(|(_, event)| event.kind == EventKind::Evasion && event.first < event.last)
        .map(|(index, _)| index)
        .collect();
    let candidates;
    {
        let _span = tracing::trace_span!("bake: find links").entered();
        candidates = search.candidates.find(&evasions, Side::Before, None)?;
        search.candidates.forget_windows();
    }
    let goals = &settings.goals;
    let mut before = Vec::new();
    let mut progress = GoalProgress::new(search, settings, &evasions, &candidates);
    for _ in 0..ROUNDS {
        let Some(progress) = &mut progress else {
            break;
        };
        if before.is_empty() {
            before = (0..goals.len()).map(|goal| progress.share(goal)).collect();
        }
        let links = search.links.len();
        for goal in 0..goals.len() {
            progress.take_for(goal, search)?;
        }
        if search.links.len() == links {
            break;
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
}

struct GoalProgress {
    /// All possible links, closest first.
    offers: Vec<Offer>,
    /// Indices of the offers that were not taken.
    left: Vec<u32>,
    waits: Waits,
    /// Moments of the graph that have a next frame in their clip.
    counted: Vec<bool>,
    all: usize,
    least_gain: usize,
    /// Maximum number of links.
    most: usize,
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
    fn new(
        search: &LinkSearch<'_>,
        settings: &LinkSettings,
        evasions: &[usize],
        candidates: &[Candidate],
    ) -> Option<Self> {
        if evasions.is_empty() {
            return None;
        }
        let (space, moments) = (&search.candidates.space, search.moments());
        let frame_rate = space.input.settings.frame_rate;
        let goal = |&goal: &LinkGoal| GoalState {
            goal,
            limit: whole_frames(goal.seconds, frame_rate),
            evasions: Vec::new(),
            met: 0,
        };
        let goals: Vec<GoalState> = settings.goals.iter().map(goal).collect();
        let horizon = goals.iter().map(|goal| goal.limit).max().unwrap_or(0);
        let offer = |candidate: &Candidate| {
            let link = candidate.link;
            Some(Offer {
                jump: moments.jump(&link),
                evasion: evasions.binary_search(&candidate.event).ok()? as u32,
                clip_start: moments.of_clip(link.source_clip).start as u32,
                link,
            })
        };
        let offers: Vec<Offer> = candidates.iter().filter_map(offer).collect();
        let start = |&event: &usize| vec![moments.ends(&space.events[event])[0]];
        let starts: Vec<Vec<u32>> = evasions.iter().map(start).collect();
        let seconds: f64 = space.input.clips.iter().map(Clip::duration).sum();
        let mut progress = Self {
            left: (0..offers.len() as u32).collect(),
            offers,
            waits: Waits::new(moments, &search.jumps, horizon),
            all: 0,
            least_gain: ((LEAST_GAIN * frame_rate).round() as usize).max(1),
            most: (seconds * settings.most_per_second) as usize,
            counted: counted(search)?,
            goals,
        };
        let threads = space.input.settings.threads;
        progress.waits.set_goals(&starts, threads);
        progress.count(search);
        Some(progress)
    }

    /// Counts anew after links have been added. The waits are known.
    fn count(&mut self, search: &LinkSearch<'_>) {
        if let Some(counted) = counted(search) {
            self.counted = counted;
        }
        let counted = &self.counted;
        self.all = counted.iter().filter(|&&counted| counted).count();
        for goal in &mut self.goals {
            let threads = search.candidates.space.input.settings.threads;
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

    /// Whether enough moments before a link do not meet the goal and would reach the link's evasion in time.
    fn helps(&self, goal: usize, offer: &Offer) -> bool {
        let (goal, evasion, jump) = (&self.goals[goal], offer.evasion as usize, offer.jump);
        let after_link = self
            .waits
            .wait(evasion, jump.to)
            .saturating_add(jump.frames);
        let lacks = |moment: usize| {
            self.counted[moment]
                && usize::from(goal.evasions[moment]) < goal.goal.evasions
                && self.waits.wait(evasion, moment as u32 + 1) >= goal.limit
        };
        // Walk back from the link to the first moment that is too early.
        let gain = (offer.clip_start as usize..jump.from as usize)
            .rev()
            .zip(after_link.saturating_add(1)..=goal.limit)
            .filter(|&(moment, _)| lacks(moment));
        gain.take(self.least_gain).count() >= self.least_gain
    }

    /// Takes the links that help with a goal, one after the other, until it is reached.
    fn take_for(&mut self, goal: usize, search: &mut LinkSearch<'_>) -> Result<(), Stopped> {
        /// Number of links that are tested together, before those ahead of them are taken.
        const BATCH: usize = 4096;
        let input = search.candidates.space.input;
        let threads = input.settings.threads;
        let share = self.goals[goal].goal.share;
        let offered = std::mem::take(&mut self.left);
        self.left.reserve(offered.len());
        let stage = input.watch.stage(BakeStage::Choice, threads);
        for (number, batch) in (0..).zip(offered.chunks(BATCH)) {
            input.watch.check()?;
            stage.progress(number * BATCH as u64, offered.len() as u64);
            let is_reached = |progress: &Self, search: &LinkSearch<'_>| {
                progress.share(goal) >= share || search.links.len() >= progress.most
            };
            if is_reached(self, search) {
                self.left.extend_from_slice(batch);
                continue;
            }
            // Most links that help now will help when it is their turn. Their feet are tested together.
            let helps_now = in_parallel(threads, batch.len(), |index| {
                self.helps(goal, &self.offers[batch[index] as usize])
            });
            let tested = batch.iter().zip(&helps_now).filter(|(_, helps)| **helps);
            let links: Vec<Transition> = tested
                .map(|(&index, _)| self.offers[index as usize].link)
                .collect();
            let mut impossible = search.test_links(&links).into_iter();
            for (&index, helped) in batch.iter().zip(helps_now) {
                let offer = &self.offers[index as usize];
                let known = if helped { impossible.next() } else { None };
                if !self.helps(goal, offer) || is_reached(self, search) {
                    self.left.push(index);
                    continue;
                }
                let (link, jump) = (offer.link, offer.jump);
                let impossible = known.unwrap_or_else(|| search.test_links(&[link])[0]);
                search.impossible += usize::from(impossible);
                if !impossible {
                    let (goals, counted) = (&mut self.goals, &self.counted);
                    let lowered = |change| record(goals, counted, change);
                    self.waits.add_jump(jump, lowered);
                    search.take(link);
                }
            }
        }
        Ok(())
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

/// Updates the goals after a wait at a moment fell. The moment before it in the clip waits one frame longer.
fn record(goals: &mut [GoalState], counted: &[bool], change: WaitChange) {
    let WaitChange { moment, old, new } = change;
    let Some(before) = (moment as usize).checked_sub(1) else {
        return;
    };
    for goal in goals.iter_mut().filter(|_| counted[before]) {
        if new < goal.limit && old >= goal.limit {
            goal.evasions[before] += 1;
            if usize::from(goal.evasions[before]) == goal.goal.evasions {
                goal.met += 1;
            }
        }
    }
}
