//! Solves a warp.
//!
//! Source: motion warping (Witkin & Popović 1995), by sequential linearisation (Gleicher 1997):
//!
//! ```text
//! numbers = 0
//! for each round:
//!     pose the body with the bend of `numbers` at the samples around the moment at which the attack is nearest
//!     contacts = spheres of the body near the attack, and how each distance changes with the bend
//!     rows     = one condition per contact, and those of legs and balance
//!     end, if the distances are as wanted and legs and balance keep their limits
//!     numbers  = the smallest numbers within their bounds that satisfy all rows
//! ```

use super::check::{Frames, check};
use super::limits::{Goal, SAMPLES, effort, lift_rows};
use super::linear::{Factor, N, Numbers, Row, bend_from, least_numbers, least_violation, worst};
use super::ticks::{Contact, Tick, find_contacts};
use crate::anim::{Rig, Warp};
use crate::graph::Motion;
use crate::maps::BakedGraph;
use crate::query::attack::Attack;
use crate::query::clearance::{Clearance, ExactTest, MotionBody, SAMPLE_RATE};
use crate::query::settings::WarpSettings;

/// Result of a warp that makes a motion clean.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Warped {
    /// Exact clearance of the warped motion.
    pub clearance: Clearance,
    /// Sum of the squared shares of the bounds that the warp uses.
    pub effort: f32,
}

/// Input of a warp.
#[derive(Clone, Copy, Debug)]
pub(super) struct WarpCase<'a> {
    /// Graph of the motion.
    pub baked: &'a BakedGraph,
    /// Attack, in the world and on the clock of the motion.
    pub attack: &'a Attack,
    /// Bounds of the warp.
    pub settings: &'a WarpSettings,
}

/// Wanted change of the smallest distance from the attack.
#[derive(Clone, Copy, Debug, PartialEq)]
enum ClearanceChange {
    /// Increase it to the margin.
    Away,
    /// Decrease it from one value to another, in metres.
    Nearer { from: f32, to: f32 },
}

/// Solver of warps, with its scratch.
#[derive(Clone, Debug, Default)]
pub(in crate::query) struct Warper {
    ticks: Vec<Tick>,
    /// Number of entries of `ticks` in use.
    used: usize,
    contacts: Vec<Contact>,
    rows: Vec<Row>,
    factors: Vec<Factor>,
    plain: Motion,
    frames: Frames,
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

/// Maximum number of rows at a time.
const MOST_ROWS: usize = 192;

/// Violation up to which a row counts as satisfied, in metres.
const KEPT: f32 = 1e-3;

impl Warper {
    /// Warps a motion that is hit, with its clearance, so that it is clean. Returns `None` and leaves the motion unchanged if that is not possible. The motion
    /// must last at least as long as the attack.
    pub(super) fn warp_away(
        &mut self,
        case: WarpCase<'_>,
        motion: &mut Motion,
        clearance: Clearance,
        body: &mut MotionBody,
    ) -> Option<Warped> {
        self.bend(case, ClearanceChange::Away, motion, clearance, body)
    }

    /// Warps a motion that the attack misses by more than `widest` so that it misses by `widest`, or as nearly as the bounds allow.
    /// Returns `None` and leaves the motion unchanged if that is not possible.
    pub(super) fn warp_towards(
        &mut self,
        case: WarpCase<'_>,
        motion: &mut Motion,
        clearance: Clearance,
        body: &mut MotionBody,
    ) -> Option<Warped> {
        let from = clearance.metres;
        let to = case.settings.widest?;
        let change = ClearanceChange::Nearer { from, to };
        let warped = self.bend(case, change, motion, clearance, body)?;
        if warped.clearance.metres < from {
            return Some(warped);
        }
        motion.clone_from(&self.plain);
        None
    }

    fn bend(
        &mut self,
        case: WarpCase<'_>,
        change: ClearanceChange,
        motion: &mut Motion,
        clearance: Clearance,
        body: &mut MotionBody,
    ) -> Option<Warped> {
        if case.attack.spheres().len() > MOST_SPHERES {
            return None;
        }
        let limits = &case.settings.limits;
        // The motion must reach the end of the warp, up to which planted feet are looked up.
        let end = clearance.time + 2.0 * limits.hold + limits.way_out;
        motion.extend(case.baked.graph(), end.min(LONGEST));
        self.plain.clone_from(motion);
        let warped = self.solve(case, change, motion, clearance, body);
        if warped.is_none() {
            motion.clone_from(&self.plain);
        }
        warped
    }

    fn solve(
        &mut self,
        case: WarpCase<'_>,
        change: ClearanceChange,
        motion: &mut Motion,
        mut nearest: Clearance,
        body: &mut MotionBody,
    ) -> Option<Warped> {
        let WarpCase {
            baked,
            attack,
            settings,
        } = case;
        self.used = 0;
        for _ in 0..MOMENTS {
            self.look_at(nearest.time);
            let mut goal = Goal::new(baked, settings, motion, &self.ticks[..self.used])?;
            let numbers = self.solve_ticks(case, change, &mut goal, motion)?;
            let bend = bend_from(&numbers, &goal.scales);
            motion.set_warp(Some(Warp {
                envelope: goal.envelope,
                bend,
            }));
            motion.extend(baked.graph(), goal.envelope.end);
            nearest = ExactTest::new(baked, attack).on_motion(motion, body);
            if nearest.is_clean() {
                self.plain.extend(baked.graph(), goal.envelope.end);
                let (plain, limits) = (&self.plain, &settings.limits);
                let checked = check(baked.graph(), motion, plain, limits, &mut self.frames);
                return checked.is_ok().then(|| Warped {
                    clearance: nearest,
                    effort: effort(&settings.bounds, &bend),
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
        case: WarpCase<'_>,
        change: ClearanceChange,
        goal: &mut Goal,
        motion: &mut Motion,
    ) -> Option<Numbers> {
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
                lift_rows(limb, &goal.scales, &mut self.rows);
            }
        }
        let fixed = self.rows.len();
        let (margin, mut reach) = match change {
            ClearanceChange::Away => (settings.margin, settings.margin),
            ClearanceChange::Nearer { from, to } => (to, from),
        };
        for _ in 0..settings.rounds {
            let bend = bend_from(&numbers, &goal.scales);
            motion.set_warp(Some(Warp {
                envelope: goal.envelope,
                bend,
            }));
            for tick in ticks.iter_mut() {
                tick.pose(baked, motion, &settings.limits);
            }
            find_contacts(baked.body(), attack, reach, ticks, &mut self.contacts);
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
            goal.add_limit_rows(baked, ticks, &numbers, &mut self.rows);
            let are_kept = worst(&self.rows[first..], &numbers) <= KEPT;
            let is_there = match change {
                ClearanceChange::Away => least > 0.5 * margin,
                ClearanceChange::Nearer { .. } => (least - margin).abs() < NEARLY,
            };
            if is_there && are_kept {
                return Some(numbers);
            }
            for contact in &self.contacts {
                let gradient = contact.gradient(baked, ticks);
                let row = contact.row(&gradient, &goal.scales, &numbers, margin);
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
