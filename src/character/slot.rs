//! The places of the characters, and the threads that share them.

use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Mutex, PoisonError};
use std::time::{Duration, Instant};

use serde::{Deserialize, Serialize};

use super::event::CharacterId;
use super::kind::{Kind, KindId};
use super::state::CharacterState;
use super::world::Worker;
use crate::graph::BlendReach;
use crate::math::parallel::{WorkerPool, lock};

/// A place for a character.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(super) struct Slot {
    pub(super) generation: u32,
    pub(super) kind: KindId,
    pub(super) state: Option<Box<CharacterState>>,
    /// Time until a new threat may reach the body, during a step.
    #[serde(skip)]
    pub(super) urgency: Option<f32>,
    /// Whether its steering may search in this step.
    #[serde(skip)]
    pub(super) may_search: bool,
    /// Whether the limit of the last step came before its plan was finished. It goes on first in the next step.
    #[serde(skip)]
    pub(super) is_unfinished: bool,
    /// The blend that was posed last, while it lasts.
    #[serde(skip)]
    pub(super) blend: Option<Blend>,
}

/// A blend that was posed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Blend {
    /// Time since its start when it was looked at last, in seconds.
    pub age: f32,
    /// Time of the characters then, in seconds.
    pub now: f64,
    /// How far the farthest joint was, when it was posed, from where it is without the blend, in metres.
    pub moved: f32,
    /// How far its offsets reached then.
    pub reach: BlendReach,
}

impl Slot {
    /// The id of the character at this place of the list.
    pub(super) fn id(&self, index: usize) -> CharacterId {
        CharacterId {
            index: index as u32,
            generation: self.generation,
        }
    }

    /// The blend that lasts, if it was posed before. `age` is the time since the start of the one that lasts.
    pub(super) fn known_blend(&mut self, age: f32, now: f64) -> Option<Blend> {
        /// Slowest rate of a motion. A blend that is younger than one that has gone on at this rate is another one.
        const SLOWEST: f32 = 0.5;
        self.blend = self.blend.and_then(|before| {
            let passed = (now - before.now) as f32;
            let goes_on = age >= before.age + SLOWEST * passed;
            goes_on.then_some(Blend { age, now, ..before })
        });
        self.blend
    }
}

impl Blend {
    /// Estimated displacement of the joint that the blend moves furthest once its offsets have decayed to `reach`, in metres. Displacements
    /// shrink with the offsets, but that of the knee of a nearly straight leg only with their square root. A planted foot is moved further
    /// while the clip's foot goes on, and its knee with it.
    pub(super) fn moved_at(&self, reach: BlendReach) -> f32 {
        /// Factor for the knee of a leg that straightens during the blend.
        const STRAIGHTENED: f32 = 1.4;
        let share = |now: f32, then: f32| now / then.max(1e-3);
        let body = share(reach.body, self.reach.body);
        let share = body.max(share(reach.feet, self.reach.feet));
        reach
            .feet
            .max(STRAIGHTENED * self.moved * share.max(share.sqrt()))
    }
}

/// Calls `work` for each place, on all threads. Each has its own worker.
pub(super) fn each(
    slots: &[Mutex<Slot>],
    workers: &[Mutex<Worker>],
    pool: &mut WorkerPool,
    work: impl Fn(usize, &mut Slot, &mut Worker) + Sync,
) {
    let next = |turn: usize| Some((turn, slots.get(turn)?));
    in_turn(workers, pool, next, |(index, slot), worker| {
        work(index, &mut lock(slot), worker);
    });
}

/// Calls `plan` for characters that have to plan, in their order, on all threads, as long as there is time: `seconds` for all, or 0 for no
/// limit. The first has all of it. `plan` returns whether it finished before the worker's limit.
pub(super) fn each_urgent(
    slots: &[Mutex<Slot>],
    workers: &[Mutex<Worker>],
    pool: &mut WorkerPool,
    urgent: &[Urgent],
    seconds: f32,
    plan: impl Fn(usize, &mut Slot, &mut Worker) -> bool + Sync,
) {
    let Some(first) = urgent.first() else {
        return;
    };
    let limit = (seconds > 0.0).then(|| Duration::from_secs_f32(seconds));
    let deadline = limit.map(|limit| Instant::now() + limit);
    let is_late = || deadline.is_some_and(|deadline| Instant::now() >= deadline);
    let is_first = |urgent: &Urgent| urgent.index == first.index;
    let next = |turn: usize| {
        let urgent = urgent.get(turn)?;
        (is_first(urgent) || !is_late()).then_some(urgent)
    };
    in_turn(workers, pool, next, |urgent, worker| {
        let mut slot = lock(&slots[urgent.index]);
        worker.plan.deadline = deadline;
        worker.plan.is_first = is_first(urgent);
        slot.is_unfinished = !plan(urgent.index, &mut slot, worker);
    });
}

/// Calls `work` for the item of each turn until there is none, on all threads.
fn in_turn<T>(
    workers: &[Mutex<Worker>],
    pool: &mut WorkerPool,
    item: impl Fn(usize) -> Option<T> + Sync,
    work: impl Fn(T, &mut Worker) + Sync,
) {
    let next = AtomicUsize::new(0);
    pool.run(&|thread: usize| {
        let mut worker = lock(&workers[thread]);
        while let Some(item) = item(next.fetch_add(1, Ordering::Relaxed)) {
            work(item, &mut worker);
        }
    });
}

/// A character that has to plan.
#[derive(Clone, Copy, Debug)]
pub(super) struct Urgent {
    /// [`Slot::is_unfinished`].
    is_unfinished: bool,
    /// Time until a threat may reach it, in seconds.
    seconds: f32,
    index: usize,
}

/// Lists the characters that plan in a step, at most `most`: those with unfinished plans, then those that may be reached first before others.
pub(super) fn most_urgent(slots: &[Mutex<Slot>], most: usize, out: &mut Vec<Urgent>) {
    let urgency = |(index, slot): (usize, &Mutex<Slot>)| {
        let slot = lock(slot);
        Some(Urgent {
            is_unfinished: slot.is_unfinished,
            seconds: slot.urgency?,
            index,
        })
    };
    out.clear();
    out.extend(slots.iter().enumerate().filter_map(urgency));
    out.sort_unstable_by(|a, b| {
        let unfinished_first = b.is_unfinished.cmp(&a.is_unfinished);
        unfinished_first
            .then(a.seconds.total_cmp(&b.seconds))
            .then(a.index.cmp(&b.index))
    });
    out.truncate(most);
}

/// A character whose steering has to search.
#[derive(Clone, Copy, Debug)]
pub(super) struct Due {
    /// Time until the search, in seconds; below 0 for one that waits.
    seconds: f32,
    /// Whether it waits for longer than it takes from one search to the next.
    is_overdue: bool,
    cost: usize,
    index: usize,
}

/// Chooses the characters that may search in a step: those that wait longest, until `least` searches are reached or as many as keep up with
/// all characters that search each [`SteerSettings::interval`](super::SteerSettings::interval). Those in blends, who do not search, count only
/// where others have waited for too long.
pub(super) fn share_searches(
    kinds: &[Kind],
    slots: &mut [Mutex<Slot>],
    dt: f32,
    least: usize,
    due: &mut Vec<Due>,
) {
    let (mut of_free, mut of_all) = (0.0, 0.0);
    due.clear();
    for (index, slot) in slots.iter_mut().enumerate() {
        let slot = slot.get_mut().unwrap_or_else(PoisonError::into_inner);
        let state = slot.state.as_deref().filter(|state| !state.is_released);
        let next = state.and_then(|state| Some((state.steer.next_search()?, state)));
        slot.may_search = false;
        let Some((seconds, state)) = next else {
            continue;
        };
        let interval = slot.kind.of(kinds).settings.steer.interval;
        of_all += dt / interval;
        if !state.may_search() {
            continue;
        }
        of_free += dt / interval;
        if seconds <= dt {
            due.push(Due {
                seconds,
                is_overdue: seconds < -interval,
                cost: state.steer.search_cost(),
                index,
            });
        }
    }
    let [most, most_overdue] = [of_free, of_all].map(|count: f32| least.max(count.ceil() as usize));
    due.sort_unstable_by(|a, b| a.seconds.total_cmp(&b.seconds).then(a.index.cmp(&b.index)));
    let mut searches = 0;
    for one in due {
        if searches >= if one.is_overdue { most_overdue } else { most } {
            return;
        }
        let slot = slots[one.index].get_mut();
        slot.unwrap_or_else(PoisonError::into_inner).may_search = true;
        searches += one.cost;
    }
}
