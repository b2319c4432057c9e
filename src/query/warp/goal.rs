//! Constraints of a warp: its time, its bounds, legs and balance.

use glam::Vec3;

use super::balance::{StandingBody, Support};
use super::case::{SAMPLES, WarpCase};
use super::linear::{Linearization, Numbers, Row, Scales};
use super::ticks::Tick;
use crate::anim::{Envelope, Rig};
use crate::graph::Motion;
use crate::maps::BakedGraph;
use crate::query::clearance::SAMPLE_RATE;

/// Constraints of a solution.
pub(super) struct Goal<'a> {
    baked: &'a BakedGraph,
    pub envelope: Envelope,
    pub scales: Scales,
    support: Option<Support>,
    /// Distance of the centre of mass from the support without a warp, in metres; `None` before the first round.
    beside: Option<f32>,
}

impl<'a> Goal<'a> {
    /// Constraints for the samples at which the attack is near. `None` if there is no time for a warp.
    pub(super) fn new(case: WarpCase<'a>, motion: &Motion, ticks: &[Tick]) -> Option<Self> {
        let WarpCase {
            baked, settings, ..
        } = case;
        let (first, last) = (ticks.first()?.seconds(), ticks.last()?.seconds());
        let middle = SAMPLES as f32 / SAMPLE_RATE;
        let envelope = settings.limits.envelope([first + middle, last - middle])?;
        let rig = baked.graph().rig();
        let mut scales = settings
            .bounds
            .within(&settings.limits, &envelope, rig.spine().len());
        let may_lift = may_lift(case, motion, &envelope);
        for (limb, scale) in scales.ends.iter_mut().enumerate() {
            let is_there = rig.limbs()[limb].is_some();
            if !is_there || may_lift.get(limb) == Some(&false) {
                *scale = 0.0;
            }
        }
        // Without known legs, feet would slide.
        if rig.legs().is_none() {
            scales.pelvis = 0.0;
        }
        Some(Self {
            baked,
            envelope,
            scales,
            support: support(case, motion, &envelope),
            beside: None,
        })
    }

    /// Adds the conditions of legs and balance at the samples, linearised at the current parameters `numbers`.
    pub(super) fn add_limit_rows(
        &mut self,
        ticks: &[Tick],
        numbers: &Numbers,
        rows: &mut Vec<Row>,
    ) {
        let baked = self.baked;
        let now = Linearization {
            scales: &self.scales,
            numbers,
        };
        for tick in ticks {
            tick.add_leg_rows(baked.graph().rig(), now, rows);
        }
        let (Some(support), Some(tick)) = (self.support, ticks.get(ticks.len() / 2)) else {
            return;
        };
        let body = StandingBody {
            baked,
            tick,
            support,
        };
        // In the first round the motion has no warp yet.
        let beside = *self
            .beside
            .get_or_insert_with(|| body.beside().unwrap_or(0.0));
        let bend = now.bend();
        let in_air = (0..Rig::LEGS).find(|&limb| bend.ends[limb].length() > LIFTED);
        let support = match in_air {
            Some(limb) if support.feet[limb] => support.without(limb, self.half_seconds()),
            _ => support,
        };
        let body = StandingBody { support, ..body };
        rows.extend(body.row(now, beside));
    }

    /// Time during which the weight of the warp is above one half, in seconds.
    fn half_seconds(&self) -> f32 {
        let Envelope {
            start,
            full,
            release,
            end,
        } = self.envelope;
        0.5 * (release + end - start - full)
    }
}

/// Displacement above which a foot counts as lifted, in metres.
const LIFTED: f32 = 0.01;

/// Support of a body that stands still while the attack passes. `None` if the body moves.
fn support(case: WarpCase<'_>, motion: &Motion, envelope: &Envelope) -> Option<Support> {
    /// Maximum speed of a body that stands still, in metres per second.
    const STILL: f32 = 0.3;
    let graph = case.baked.graph();
    let [from, to] = [envelope.full, envelope.release].map(|t| motion.root(graph, t));
    let way = (to - from) * Vec3::new(1.0, 0.0, 1.0);
    let is_still = way.length() < STILL * (envelope.release - envelope.full);
    let middle = motion.playhead(graph, 0.5 * (envelope.full + envelope.release));
    let feet = [0, 1].map(|limb| graph.foot_stands(middle.edge, middle.frame, limb));
    (is_still && feet == [true; 2]).then_some(Support {
        feet,
        allowed: case.settings.limits.balance,
    })
}

/// Returns for each leg whether its foot may be lifted: if it does not stand, or if the other foot stands, as long as the warp acts.
fn may_lift(case: WarpCase<'_>, motion: &Motion, envelope: &Envelope) -> [bool; Rig::LEGS] {
    /// Number of moments that are examined.
    const LOOKS: usize = 10;
    let graph = case.baked.graph();
    let mut may = [true; Rig::LEGS];
    for look in 0..=LOOKS {
        let share = look as f32 / LOOKS as f32;
        let at = motion.playhead(
            graph,
            envelope.start + (envelope.end - envelope.start) * share,
        );
        let stands = [0, 1].map(|limb| graph.foot_stands(at.edge, at.frame, limb));
        for limb in 0..Rig::LEGS {
            may[limb] &= !stands[limb] || stands[1 - limb];
        }
    }
    may
}
