//! Warps: small displacements that make a motion clean that is hit by little.
//!
//! Source: motion warping (Witkin & Popović 1995), which Masaoka & Oshita propose as future work (section 7). The warp is solved by
//! sequential linearisation (Gleicher 1997): the distances of the attack from near body spheres are linearised in the warp's
//! parameters, the smallest warp that satisfies all conditions is computed, the body is posed with it, and the step is repeated. The
//! warped motion is accepted only if the exact test finds it clean.

mod balance;
mod case;
mod check;
mod contacts;
#[cfg(test)]
pub(in crate::query) mod fixture;
mod goal;
mod legs;
mod linear;
mod settings;
mod ticks;

pub use settings::{WarpBounds, WarpLimits, WarpSettings};

pub(crate) use case::{Tested, WarpCase, Warped};

use super::clearance::{ExactTest, SAMPLE_RATE};
use crate::graph::Motion;
use case::{SAMPLES, Task, Wish};
use check::{CheckScratch, MotionCheck};
use contacts::{Contact, ContactSearch};
use goal::Goal;
use linear::{
    Factor, Linearization, N, Numbers, Row, bend_of, least_numbers, least_violation, worst,
};
use sabaki_motion::internal::{Rig, Warp};
use ticks::Tick;

/// Solver of warps, with its scratch.
#[derive(Clone, Debug, Default)]
pub(crate) struct Warper {
    ticks: Vec<Tick>,
    /// Number of ticks in use.
    used: usize,
    contacts: Vec<Contact>,
    rows: Vec<Row>,
    factors: Vec<Factor>,
    plain: Motion,
    check: CheckScratch,
}

/// Tolerance of a wanted distance, in metres.
const NEARLY: f32 = 0.005;
/// Latest end of a warp, in seconds after the query.
const LONGEST: f32 = 600.0;
/// Maximum number of moments around which samples are taken.
const MOMENTS: usize = 3;
/// Maximum violation of a row at which a solution is tried, in metres. Distances are not linear.
const HOPE: f32 = 0.02;

/// Attacks of more spheres are not bent away from: each sphere of the attack is compared with each of the body.
const MOST_SPHERES: usize = 1024;

impl Warper {
    /// Bends a motion that is hit so that it is clean. Returns `None` and leaves the motion unchanged if that is not possible. The motion
    /// must last at least as long as the attack.
    pub(crate) fn warp(
        &mut self,
        case: WarpCase<'_>,
        motion: &mut Motion,
        tested: Tested<'_>,
    ) -> Option<Warped> {
        let wish = Wish::Away;
        self.bend(Task { case, wish }, motion, tested)
    }

    /// Bends a motion that the attack misses by more than `widest` so that it misses by `widest`, or as near to it as the bounds allow.
    /// Returns `None` and leaves the motion unchanged if that is not possible.
    pub(crate) fn lessen(
        &mut self,
        case: WarpCase<'_>,
        motion: &mut Motion,
        tested: Tested<'_>,
    ) -> Option<Warped> {
        let from = tested.clearance.metres;
        let to = case.settings.widest?;
        let wish = Wish::Nearer { from, to };
        let lessened = self.bend(Task { case, wish }, motion, tested)?;
        if lessened.clearance.metres < from {
            return Some(lessened);
        }
        motion.clone_from(&self.plain);
        None
    }

    fn bend(&mut self, task: Task<'_>, motion: &mut Motion, tested: Tested<'_>) -> Option<Warped> {
        let case = task.case;
        if case.attack.spheres().len() > MOST_SPHERES {
            return None;
        }
        let limits = &case.settings.limits;
        // What stands and what does not is asked until the warp has gone.
        let end = tested.clearance.time + 2.0 * limits.hold + limits.way_out;
        motion.extend(case.baked.graph(), end.min(LONGEST));
        self.plain.clone_from(motion);
        let warped = self.solve(task, motion, tested);
        if warped.is_none() {
            motion.clone_from(&self.plain);
        }
        warped
    }

    fn solve(&mut self, task: Task<'_>, motion: &mut Motion, tested: Tested<'_>) -> Option<Warped> {
        let WarpCase {
            baked,
            attack,
            settings,
        } = task.case;
        let mut nearest = tested.clearance;
        self.used = 0;
        for _ in 0..MOMENTS {
            self.look_at(nearest.time);
            let mut goal = Goal::new(task.case, motion, &self.ticks[..self.used])?;
            let numbers = self.solve_ticks(task, &mut goal, motion)?;
            let bend = bend_of(&numbers, &goal.scales);
            motion.bend(Some(Warp {
                envelope: goal.envelope,
                bend,
            }));
            motion.extend(baked.graph(), goal.envelope.end);
            nearest = ExactTest::new(baked, attack).on_shared_motion(motion, tested.body);
            if nearest.is_clean() {
                self.plain.extend(baked.graph(), goal.envelope.end);
                let check = MotionCheck {
                    graph: baked.graph(),
                    motion,
                    plain: &self.plain,
                    limits: &settings.limits,
                };
                let checked = check.run(&mut self.check);
                return checked.is_ok().then(|| Warped {
                    clearance: nearest,
                    effort: settings.bounds.effort(&bend),
                });
            }
            motion.bend(None);
        }
        None
    }

    /// Adds the samples around a moment, in order and without duplicates.
    fn look_at(&mut self, seconds: f32) {
        let middle = (seconds * SAMPLE_RATE) as usize;
        for number in middle.saturating_sub(SAMPLES)..=middle + SAMPLES + 1 {
            let used = &self.ticks[..self.used];
            let at = used.partition_point(|tick| tick.number < number);
            if used.get(at).is_some_and(|tick| tick.number == number) {
                continue;
            }
            if self.ticks.len() == self.used {
                self.ticks.push(Tick::default());
            }
            self.ticks[self.used].restart(number);
            self.ticks[at..=self.used].rotate_right(1);
            self.used += 1;
        }
    }

    /// Parameters of a bend that keeps the attack away at all samples, or `None` if there are none.
    fn solve_ticks(
        &mut self,
        task: Task<'_>,
        goal: &mut Goal<'_>,
        motion: &mut Motion,
    ) -> Option<Numbers> {
        let Task { case, wish } = task;
        let WarpCase {
            baked,
            attack,
            settings,
        } = case;
        let ticks = &mut self.ticks[..self.used];
        let mut numbers: Numbers = [0.0; N];
        self.rows.clear();
        for limb in 0..Rig::LEGS {
            if goal.scales.ends[limb] > 0.0 {
                legs::lift_rows(limb, &goal.scales, &mut self.rows);
            }
        }
        let fixed = self.rows.len();
        let (margin, mut reach) = match wish {
            Wish::Away => (settings.margin, settings.margin),
            Wish::Nearer { from, to } => (to, from),
        };
        for _ in 0..settings.rounds {
            let bend = bend_of(&numbers, &goal.scales);
            motion.bend(Some(Warp {
                envelope: goal.envelope,
                bend,
            }));
            for tick in ticks.iter_mut() {
                tick.pose(baked, motion, &settings.limits);
            }
            let search = ContactSearch {
                body: baked.body(),
                attack,
                margin: reach,
            };
            search.run(ticks, &mut self.contacts);
            let least = self
                .contacts
                .iter()
                .map(|contact| contact.metres)
                .fold(f32::INFINITY, f32::min);
            // What was linear once is only kept as long as it is new.
            if self.rows.len() > fixed + MOST_ROWS {
                self.rows.drain(fixed..fixed + MOST_ROWS / 2);
            }
            let first = self.rows.len();
            goal.add_limit_rows(ticks, &numbers, &mut self.rows);
            let are_kept = worst(&self.rows[first..], &numbers) <= KEPT;
            let is_there = match wish {
                Wish::Away => least > 0.5 * margin,
                Wish::Nearer { .. } => (least - margin).abs() < NEARLY,
            };
            if is_there && are_kept {
                return Some(numbers);
            }
            let now = Linearization {
                scales: &goal.scales,
                numbers: &numbers,
            };
            for contact in &self.contacts {
                let gradient = contact.gradient(baked, ticks);
                let row = contact.row(&gradient, now, margin);
                self.rows.push(row);
                if matches!(wish, Wish::Nearer { .. }) && contact.metres == least {
                    self.rows.push(row.reversed());
                }
            }
            if wish == Wish::Away && least_violation(&self.rows[first..]) > HOPE {
                return None;
            }
            numbers = least_numbers(&self.rows, &mut self.factors);
            match wish {
                Wish::Away if worst(&self.rows[first..], &numbers) > HOPE => return None,
                Wish::Away => {}
                Wish::Nearer { .. } => reach = least.min(reach).max(margin),
            }
        }
        // Nearer is better than not, if the exact test says so.
        matches!(wish, Wish::Nearer { .. }).then_some(numbers)
    }
}

/// Maximum number of rows at a time.
const MOST_ROWS: usize = 192;
/// Violation up to which a row counts as satisfied, in metres.
const KEPT: f32 = 1e-3;
