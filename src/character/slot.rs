//! The places of the characters, and the threads that share them.

use std::sync::Mutex;
use std::sync::atomic::{AtomicU32, AtomicU64, AtomicUsize, Ordering};
use std::time::Instant;

use serde::{Deserialize, Serialize};

use super::ids::CharacterId;
use super::scratch::Worker;
use super::state::CharacterState;
use crate::graph::BlendReach;
use sabaki_motion::internal::{WorkerPool, lock};

/// A place for a character.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct Slot {
    pub(super) generation: u32,
    pub(super) state: Option<Box<CharacterState>>,
    /// Time until a new threat may reach the body, during a step.
    #[serde(skip)]
    pub(super) urgency: Option<f32>,
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

/// The places, and the scratch of the threads that share them.
#[derive(Clone, Copy)]
pub(super) struct Shared<'a> {
    pub slots: &'a [Mutex<Slot>],
    pub workers: &'a [Mutex<Worker>],
}

impl Shared<'_> {
    /// Calls `work` for each place, on all threads.
    pub(super) fn each(
        self,
        pool: &mut WorkerPool,
        work: impl Fn(usize, &mut Slot, &mut Worker) + Sync,
    ) {
        let count = self.slots.len();
        self.in_turn(pool, |turn| (turn < count).then_some(turn), work);
    }

    /// Calls `work` for the places of a queue, in its order, on all threads, as long as there is time.
    pub(super) fn each_of(
        self,
        queue: PlanQueue<'_>,
        pool: &mut WorkerPool,
        work: impl Fn(usize, &mut Slot, &mut Worker) + Sync,
    ) {
        if queue.urgent.is_empty() {
            return;
        }
        let time = PlanTime::new(queue.seconds);
        let place = |turn: usize| {
            let urgent = queue.urgent.get(turn)?;
            (turn == 0 || time.is_left()).then_some(urgent.index)
        };
        self.in_turn(pool, place, |index, slot, worker| {
            let begun = Instant::now();
            work(index, slot, worker);
            time.add(begun);
        });
    }

    /// Calls `work` for the place of each turn until there is none, on all threads.
    fn in_turn(
        self,
        pool: &mut WorkerPool,
        place: impl Fn(usize) -> Option<usize> + Sync,
        work: impl Fn(usize, &mut Slot, &mut Worker) + Sync,
    ) {
        let next = AtomicUsize::new(0);
        pool.run(&|thread: usize| {
            let mut worker = lock(&self.workers[thread]);
            while let Some(index) = place(next.fetch_add(1, Ordering::Relaxed)) {
                work(index, &mut lock(&self.slots[index]), &mut worker);
            }
        });
    }
}

/// The characters that plan in a step.
#[derive(Clone, Copy)]
pub(super) struct PlanQueue<'a> {
    pub urgent: &'a [Urgent],
    /// Time for all, in seconds; 0 for no limit. The first always has its turn.
    pub seconds: f32,
}

/// The time that plans of a step have taken.
struct PlanTime {
    begun: Instant,
    /// [`PlanQueue::seconds`].
    seconds: f32,
    plans: AtomicU32,
    /// Sum over all plans, in nanoseconds.
    spent: AtomicU64,
}

impl PlanTime {
    fn new(seconds: f32) -> Self {
        Self {
            begun: Instant::now(),
            seconds,
            plans: AtomicU32::new(0),
            spent: AtomicU64::new(0),
        }
    }

    /// Adds a plan that ends now.
    fn add(&self, begun: Instant) {
        let nanoseconds = u64::try_from(begun.elapsed().as_nanos()).unwrap_or(u64::MAX);
        self.spent.fetch_add(nanoseconds, Ordering::Relaxed);
        self.plans.fetch_add(1, Ordering::Relaxed);
    }

    /// Whether a plan that takes as long as the mean of the others would end in time.
    fn is_left(&self) -> bool {
        let is_limited = self.seconds > 0.0;
        let plans = self.plans.load(Ordering::Relaxed).max(1);
        let mean = 1e-9 * self.spent.load(Ordering::Relaxed) as f32 / plans as f32;
        !is_limited || self.begun.elapsed().as_secs_f32() + mean <= self.seconds
    }
}

/// A character that has to plan.
#[derive(Clone, Copy, Debug)]
pub(super) struct Urgent {
    /// Time until a threat may reach it, in seconds.
    seconds: f32,
    index: usize,
}

/// Lists the characters that plan in a step, at most `most`, those that may be reached first before others.
pub(super) fn most_urgent(slots: &[Mutex<Slot>], most: usize, out: &mut Vec<Urgent>) {
    let urgency = |(index, slot): (usize, &Mutex<Slot>)| {
        let seconds = lock(slot).urgency?;
        Some(Urgent { seconds, index })
    };
    out.clear();
    out.extend(slots.iter().enumerate().filter_map(urgency));
    out.sort_unstable_by(|a, b| a.seconds.total_cmp(&b.seconds).then(a.index.cmp(&b.index)));
    out.truncate(most);
}
