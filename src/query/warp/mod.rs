//! Warps: small displacements that make a motion clean if the attack hits it only slightly.
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
use crate::anim::{Rig, Warp};
use crate::graph::Motion;
use case::{ClearanceChange, SAMPLES, Task};
use check::{CheckScratch, MotionCheck};
use contacts::{Contact, ContactSearch};
use goal::Goal;
use linear::{
    Factor, Linearization, N, Numbers, Row, bend_of, least_numbers, least_violation, worst,
};
use ticks::Tick;

/// Solver of warps, with its scratch.
#[derive(Clone, Debug, Default)]
pub(crate) struct Warper {
    ticks: Vec<Tick>,
    /// Number of entries of `ticks` in use.
    used: usize,
    contacts: Vec<Contact>,
    rows: Vec<Row>,
    factors: Vec<Factor>,
    plain: Motion,
    check: CheckScratch,
}

/// Tolerance of a wanted distance, in metres.
const NEARLY: f32 = 0.005;
/// Maximum time from the query to the end of a warp, in seconds.
const LONGEST: f32 = 600.0;
/// Maximum number of moments around which samples are taken.
const MOMENTS: usize = 3;
/// Maximum violation of a row, in metres, up to which a solution is tried, because distances are not linear.
const HOPE: f32 = 0.02;

/// Maximum number of spheres of an attack. Motions are not warped away from larger attacks, because each sphere of the attack is compared with
/// each sphere of the body.
const MOST_SPHERES: usize = 1024;

impl Warper {
    /// Warps a motion that is hit so that it is clean. Returns `None` and leaves the motion unchanged if that is not possible. The motion
    /// must last at least as long as the attack.
    pub(crate) fn warp(
        &mut self,
        case: WarpCase<'_>,
        motion: &mut Motion,
        tested: Tested<'_>,
    ) -> Option<Warped> {
        let change = ClearanceChange::Away;
        self.bend(Task { case, change }, motion, tested)
    }

    /// Warps a motion that the attack misses by more than `widest` so that it misses by `widest`, or as nearly as the bounds allow.
    /// Returns `None` and leaves the motion unchanged if that is not possible.
    pub(crate) fn lessen(
        &mut self,
        case: WarpCase<'_>,
        motion: &mut Motion,
        tested: Tested<'_>,
    ) -> Option<Warped> {
        let from = tested.clearance.metres;
        let to = case.settings.widest?;
        let change = ClearanceChange::Nearer { from, to };
        let lessened = self.bend(Task { case, change }, motion, tested)?;
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
        // The motion must reach the end of the warp, up to which planted feet are looked up.
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
            motion.set_warp(Some(Warp {
                envelope: goal.envelope,
                bend,
            }));
            motion.extend(baked.graph(), goal.envelope.end);
            nearest = ExactTest::new(baked, attack).on_motion(motion, tested.body);
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
            motion.set_warp(None);
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
        let Task { case, change } = task;
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
        let (margin, mut reach) = match change {
            ClearanceChange::Away => (settings.margin, settings.margin),
            ClearanceChange::Nearer { from, to } => (to, from),
        };
        for _ in 0..settings.rounds {
            let bend = bend_of(&numbers, &goal.scales);
            motion.set_warp(Some(Warp {
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
            // Only recent linearisations are kept.
            if self.rows.len() > fixed + MOST_ROWS {
                self.rows.drain(fixed..fixed + MOST_ROWS / 2);
            }
            let first = self.rows.len();
            goal.add_limit_rows(ticks, &numbers, &mut self.rows);
            let are_kept = worst(&self.rows[first..], &numbers) <= KEPT;
            let is_there = match change {
                ClearanceChange::Away => least > 0.5 * margin,
                ClearanceChange::Nearer { .. } => (least - margin).abs() < NEARLY,
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
                if matches!(change, ClearanceChange::Nearer { .. }) && contact.metres == least {
                    self.rows.push(row.reversed());
                }
            }
            if change == ClearanceChange::Away && least_violation(&self.rows[first..]) > HOPE {
                return None;
            }
            numbers = least_numbers(&self.rows, &mut self.factors);
            match change {
                ClearanceChange::Away if worst(&self.rows[first..], &numbers) > HOPE => {
                    return None;
                }
                ClearanceChange::Away => {}
                ClearanceChange::Nearer { .. } => reach = least.min(reach).max(margin),
            }
        }
        // A solution that is not exact is accepted too, if the exact test confirms it.
        matches!(change, ClearanceChange::Nearer { .. }).then_some(numbers)
    }
}

/// Maximum number of rows at a time.
const MOST_ROWS: usize = 192;
/// Violation up to which a row counts as satisfied, in metres.
const KEPT: f32 = 1e-3;
