//! Solves a warp.
//!
//! Source: motion warping (Witkin & Popović 1995), by sequential linearisation (Gleicher 1997):
//!
//! ```text
//! numbers = 0
//! for each round:
//!     pose the body with the bend of `numbers` at the samples around the moment at which the attack is nearest
//!     contacts = spheres of the body near the attack, and how each distance changes with the bend
//!     rows     = one condition per contact, and conditions for legs and balance
//!     end, if the attack is far enough away and legs and balance keep their limits
//!     numbers  = the smallest numbers within their bounds that satisfy all rows
//! ```

use super::limits::{Frames, Goal, SAMPLES, effort, is_sound, lift_rows};
use super::linear::{Factor, N, Numbers, Row, bend_from, least_numbers, least_violation, worst};
use super::ticks::{Contact, Tick, find_contacts};
use crate::anim::{Rig, Warp};
use crate::graph::Motion;
use crate::maps::BakedGraph;
use crate::query::attack::Attack;
use crate::query::clearance::{Clearance, ExactTest, MotionBody, SAMPLE_RATE};
use crate::query::evaluate::{Bound, Evaluator, Round};
use crate::query::score::Evaluated;
use crate::query::settings::WarpSettings;

/// What a warp is for.
#[derive(Clone, Copy)]
struct WarpCase<'a> {
    baked: &'a BakedGraph,
    /// Attack, in the world and from the start of the motion.
    attack: &'a Attack,
    settings: &'a WarpSettings,
    /// How hard the body may push, in metres per second squared.
    push: f32,
    /// Clearance of a motion that is warped towards the attack, in metres; `None` to warp away from it.
    towards: Option<f32>,
}

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
    /// Warps a motion to which the attack is nearest at `time`, so that the attack misses it: a hit by the margin, a clean motion that is warped
    /// towards the attack by [`WarpSettings::widest`] or as nearly as the bounds allow. Returns its exact clearance and the sum of the squared
    /// shares of the bounds that the warp uses. Returns `None` and leaves the motion unchanged if that is not possible. The motion must last
    /// at least as long as the attack.
    fn warp(
        &mut self,
        case: WarpCase<'_>,
        motion: &mut Motion,
        time: f32,
        body: &mut MotionBody,
    ) -> Option<(Clearance, f32)> {
        let graph = case.baked.graph();
        if case.attack.spheres().len() > MOST_SPHERES {
            return None;
        }
        // The motion must reach the end of the warp, up to which planted feet are looked up.
        let limits = &case.settings.limits;
        let end = time + 2.0 * limits.hold + limits.way_out;
        motion.extend(graph, end.min(LONGEST));
        self.plain.clone_from(motion);
        let gains = |found: f32| case.towards.is_none_or(|from| found < from);
        let warped = self.solve(case, motion, time, body);
        let warped = warped.filter(|(clearance, _)| gains(clearance.metres));
        if warped.is_none() {
            motion.clone_from(&self.plain);
        }
        warped
    }

    /// Like [`Warper::warp`], but may leave a warp that does not make the motion clean. If the warped motion is hit at another moment, the samples around that moment are added.
    fn solve(
        &mut self,
        case: WarpCase<'_>,
        motion: &mut Motion,
        mut time: f32,
        body: &mut MotionBody,
    ) -> Option<(Clearance, f32)> {
        let (baked, settings) = (case.baked, case.settings);
        self.used = 0;
        for _ in 0..MOMENTS {
            if body.is_late() {
                break;
            }
            self.add_ticks(time);
            let mut goal = Goal::new(baked, settings, motion, &self.ticks[..self.used])?;
            let numbers = self.solve_ticks(case, &mut goal, motion)?;
            let (envelope, bend) = (goal.envelope, bend_from(&numbers, &goal.scales));
            motion.set_warp(Some(Warp { envelope, bend }));
            motion.extend(baked.graph(), envelope.end);
            let clearance = ExactTest::new(baked, case.attack).on_motion(motion, body);
            if clearance.is_clean() {
                self.plain.extend(baked.graph(), envelope.end);
                let (plain, limits) = (&self.plain, &settings.limits);
                let is_sound = is_sound(baked.graph(), motion, plain, limits, &mut self.frames)
                    && body.push(baked, None, motion, envelope.end, case.push) <= case.push;
                return is_sound.then(|| (clearance, effort(&settings.bounds, &bend)));
            }
            motion.set_warp(None);
            time = clearance.time;
        }
        None
    }

    /// Adds the samples around a moment, in order and without duplicates.
    fn add_ticks(&mut self, seconds: f32) {
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

    /// Parameters of a bend with which the attack is as near as wanted at all samples, or `None` if there are none.
    fn solve_ticks(
        &mut self,
        case: WarpCase<'_>,
        goal: &mut Goal,
        motion: &mut Motion,
    ) -> Option<Numbers> {
        let (baked, settings, towards) = (case.baked, case.settings, case.towards);
        let ticks = &mut self.ticks[..self.used];
        let mut numbers: Numbers = [0.0; N];
        self.rows.clear();
        for limb in 0..Rig::LEGS {
            if goal.scales.ends[limb] > 0.0 {
                lift_rows(limb, &goal.scales, &mut self.rows);
            }
        }
        let fixed = self.rows.len();
        let (wanted, mut reach) = match towards {
            None => (settings.margin, settings.margin),
            Some(from) => (settings.widest?, from),
        };
        for _ in 0..settings.rounds {
            motion.set_warp(Some(Warp {
                envelope: goal.envelope,
                bend: bend_from(&numbers, &goal.scales),
            }));
            for tick in ticks.iter_mut() {
                tick.pose(baked, motion, &settings.limits);
            }
            find_contacts(baked.body(), case.attack, reach, ticks, &mut self.contacts);
            let metres = self.contacts.iter().map(|contact| contact.metres);
            let least = metres.fold(f32::INFINITY, f32::min);
            // Only recent linearisations are kept.
            if self.rows.len() > fixed + MOST_ROWS {
                self.rows.drain(fixed..fixed + MOST_ROWS / 2);
            }
            let first = self.rows.len();
            goal.add_limit_rows(baked, ticks, &numbers, &mut self.rows);
            let is_there = match towards {
                None => least > 0.5 * wanted,
                Some(_) => (least - wanted).abs() < NEARLY,
            };
            if is_there && worst(&self.rows[first..], &numbers) <= KEPT {
                return Some(numbers);
            }
            for contact in &self.contacts {
                let gradient = contact.gradient(baked, ticks);
                let row = contact.row(&gradient, &goal.scales, &numbers, wanted);
                self.rows.push(row);
                if towards.is_some() && contact.metres == least {
                    self.rows.push(row.reversed());
                }
            }
            if towards.is_none() && least_violation(&self.rows[first..]) > HOPE {
                return None;
            }
            numbers = least_numbers(&self.rows, &mut self.factors);
            if towards.is_some() {
                reach = least.min(reach).max(wanted);
            } else if worst(&self.rows[first..], &numbers) > HOPE {
                return None;
            }
        }
        // Towards the attack, a solution that is not exact is accepted too, if the exact test confirms it.
        towards.map(|_| numbers)
    }
}

/// Warps one of the shallowest hits so that it is clean, the shallowest first, and writes its motion to `motion`. Returns its index, or
/// `None` if no hit can be made clean.
pub(in crate::query) fn warp_hits(
    round: Round<'_>,
    evaluator: &mut Evaluator,
    warper: &mut Warper,
    motion: &mut Motion,
) -> Option<usize> {
    let _span = tracing::trace_span!("query: warp").entered();
    let (settings, request) = (round.query.settings, &round.state.request);
    evaluator.order_by_depth();
    // If there are obstacles, only hits that enter none were measured.
    evaluator.order.retain(|bound| {
        let one = evaluator.evaluated[bound.index];
        !request.is_among_obstacles() || one.is_some_and(|one| one.is_final)
    });
    let plain = (request.margin > 0.0).then_some((&request.plain, request.margin));
    for (attack, margin) in [(&request.attack, 0.0)].into_iter().chain(plain) {
        let mut tried = 0;
        for at in 0..evaluator.order.len() {
            let Bound { value, index } = evaluator.order[at];
            let time = evaluator.evaluated[index].map(|one| one.clearance.time)?;
            let is_enough = tried == settings.warp.candidates || evaluator.body().is_late();
            if -value - margin > settings.warp.deepest || is_enough {
                break;
            }
            round.motion(index, motion);
            if evaluator.refuse(round, index, motion) {
                continue;
            }
            tried += 1;
            if value + margin >= 0.0 {
                // The attack without the margin misses the motion without a warp.
                return Some(index);
            }
            let case = WarpCase {
                baked: round.query.baked,
                attack,
                settings: &settings.warp,
                push: evaluator.push_limit(round),
                towards: None,
            };
            let body = evaluator.body();
            let warped = warper.warp(case, motion, time, body);
            let Some((mut clearance, effort)) = warped else {
                continue;
            };
            if round.entered(motion, 0.0, body).is_some() {
                continue;
            }
            // The clearance of the request's attack, which is larger by the margin.
            clearance.metres -= margin;
            let score = round.score(index, clearance.metres);
            let score = score.warped(effort, &settings.weights);
            evaluator.evaluated[index] = Some(Evaluated::warped(clearance, score, motion));
            return Some(index);
        }
    }
    None
}

/// Warps the chosen candidate, which is clean and whose motion is `motion`, if the settings ask for a larger or a smaller clearance.
pub(in crate::query) fn adjust(
    round: Round<'_>,
    evaluator: &mut Evaluator,
    warper: &mut Warper,
    chosen: usize,
    motion: &mut Motion,
) {
    let Some(before) = evaluator.evaluated[chosen].filter(|one| one.score.is_some()) else {
        return;
    };
    let (mut settings, metres) = (round.query.settings.warp, before.clearance.metres);
    let is_near = metres < settings.nearest;
    if !is_near && settings.widest.is_none_or(|widest| metres <= widest) {
        return;
    }
    settings.margin = settings.margin.max(settings.nearest);
    let case = WarpCase {
        baked: round.query.baked,
        attack: &round.state.request.attack,
        settings: &settings,
        push: evaluator.push_limit(round),
        towards: (!is_near).then_some(metres),
    };
    let body = evaluator.body();
    let warped = warper.warp(case, motion, before.clearance.time, body);
    let Some((clearance, effort)) = warped else {
        return;
    };
    let weights = &round.query.settings.weights;
    let score = round.score(chosen, clearance.metres);
    let score = score.warped(effort, weights);
    let gains = match is_near {
        true => clearance.metres > metres,
        false => before.score.is_some_and(|own| score.total < own.total),
    };
    if !gains || round.entered(motion, 0.0, body).is_some() {
        motion.set_warp(None);
        return;
    }
    evaluator.evaluated[chosen] = Some(Evaluated::warped(clearance, score, motion));
}
